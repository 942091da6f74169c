"""Checks that know the mathematics: each takes an answer and returns a `Verdict`.

A check accepts every right answer (either sign of a mode, any basis of a repeated eigenspace, sparse or dense, single
precision) and says of a wrong one which law it breaks, by how much, where, and what slip is likely: never the solution.
It does not raise, whatever the answer may be; a placeholder (`...` or None) is told kindly. Exercises print a verdict,
and `if verdict:` asks whether the answer is right.

>>> print(check_number(..., 2.0))
Not attempted yet. Replace the dots, run that cell, then this one.
>>> print(check_number(2.0, 2.0))
Right. The number is right.
"""

from spectral_notes.checking.geometry import check_curvature
from spectral_notes.checking.maps import check_functional_map, check_point_map
from spectral_notes.checking.marking import Marks, check_result
from spectral_notes.checking.modes import check_coefficients, check_eigenbasis, check_embedding
from spectral_notes.checking.operators import check_laplacian, check_mass_matrix
from spectral_notes.checking.signals import check_dft, check_difference_matrix
from spectral_notes.checking.values import check_choice, check_function, check_labels, check_number, check_values
from spectral_notes.checking.verdicts import Verdict, seal

__all__ = [
    "Verdict",
    "seal",
    "check_number",
    "check_values",
    "check_function",
    "check_labels",
    "check_choice",
    "check_dft",
    "check_difference_matrix",
    "check_laplacian",
    "check_mass_matrix",
    "check_curvature",
    "check_eigenbasis",
    "check_coefficients",
    "check_embedding",
    "check_functional_map",
    "check_point_map",
    "Marks",
    "check_result",
]
