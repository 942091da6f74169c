"""Checks under the questions of an assignment: what a student's function returns is judged by a check."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from spectral_notes._checks import as_number
from spectral_notes.checking.answers import call
from spectral_notes.checking.verdicts import Verdict, judged, wrong


@judged
def check_result(
    answer: object, inputs: Sequence[Any], check: Callable[..., Verdict], *args: Any, **options: Any
) -> Verdict:
    """Judge what a function returns for the given inputs by a check of `spectral_notes.checking`.

    A function that raises or returns None is wrong, and a body that is still empty was not attempted.

    Parameters
    ----------
    answer : the student's function; it is called with copies of the inputs, and may raise
    inputs : the arguments of the call
    check : the check that judges what came back
    *args, **options : what the check is told besides

    Examples
    --------
    >>> from spectral_notes.checking import check_number
    >>> print(check_result(lambda x: x[0], (1.0,), check_number, 2.0))
    Not right. It raises TypeError: 'float' object is not subscriptable
    The law: the function accepts the inputs that the exercise names.
    """
    if not callable(answer):
        return wrong(f"A {type(answer).__name__} came. Pass the function itself, uncalled.", "the answer is a function")
    verdict = check(call(answer, *copy.deepcopy(tuple(inputs))), *args, **options)
    if verdict.status == "wrong" and all(isinstance(one, int | float) for one in inputs):
        return wrong(f"For {', '.join(map(str, inputs))}: {verdict.message}", verdict.law)
    return verdict


@dataclass(frozen=True, repr=False)
class Marks:
    """The verdicts under an answer, and what the question is worth; these verdicts themselves earn nothing.

    Parameters
    ----------
    verdicts : one or more
    points : what the question is worth, above zero

    Examples
    --------
    >>> from spectral_notes.checking import check_number
    >>> Marks([check_number(2.0, 2.0), check_number(1.0, 2.0), check_number(..., 2.0)], points=6)
    1 of 3 checks pass
    """

    verdicts: Sequence[Verdict]
    points: float

    def __post_init__(self) -> None:
        as_number("points", self.points, above=0.0)
        if not self.verdicts:
            raise ValueError("verdicts must hold at least one verdict; got none")

    def __repr__(self) -> str:
        return f"{sum(map(bool, self.verdicts))} of {len(self.verdicts)} checks pass"

    def _repr_markdown_(self) -> str:
        """Return the verdicts, one a paragraph and each only once, and what counts for the points."""
        told = "\n\n".join(dict.fromkeys(verdict._repr_markdown_() for verdict in self.verdicts))
        return f"{told}\n\n*{self}. Others, on inputs that you have not seen, decide on the {self.points:g} points.*"
