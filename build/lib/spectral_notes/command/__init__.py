"""The command line `spectral-notes`, its jobs and reports, and the doctor that examines a set-up."""

from spectral_notes.command.cli import main, run
from spectral_notes.command.doctor import Finding, check_memory, examine

__all__ = [
    "main",
    "run",
    "Finding",
    "examine",
    "check_memory",
]
