"""The command line, as `python -m spectral_notes`."""

from spectral_notes.command import run

run()
