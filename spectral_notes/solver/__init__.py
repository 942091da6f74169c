"""The engine of `compute_eigenbasis`: block Lanczos on one factor, certificates, bands, and SLEPc past one machine."""

from spectral_notes.solver.eigensolver import memory_needed
from spectral_notes.solver.factorization import count_below, factor_in_use

__all__ = [
    "memory_needed",
    "count_below",
    "factor_in_use",
]
