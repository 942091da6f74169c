"""Labs: pages in which a reader turns a shape, drags a number and sees the modes answer, without a kernel."""

from spectral_notes.labs.notebook import lab

__all__ = [
    "lab",
]
