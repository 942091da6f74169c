"""Verdicts on answers: right, wrong with the law that is broken, or not attempted."""

from __future__ import annotations

import base64
import functools
import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Concatenate, Literal, ParamSpec

import numpy as np

from spectral_notes.checking.languages import translated

P = ParamSpec("P")
Check = Callable[Concatenate[object, P], "Verdict"]
OPENINGS = {"right": "Right.", "wrong": "Not right.", "unattempted": "Not attempted yet."}
PLACEHOLDER = "Replace the dots, run that cell, then this one."


@dataclass(frozen=True, repr=False)
class Verdict:
    """Say whether an answer is right and, if not, which law it breaks, by how much and where; never the solution.

    Parameters
    ----------
    status : {"right", "wrong", "unattempted"}, `bool(verdict)` is True for "right" only
    message : what was found
    law : the law that a wrong answer breaks, or that a right one keeps

    Examples
    --------
    >>> print(Verdict("wrong", "Rows do not sum to zero (largest 0.31, row 12).", "the rows of L sum to zero"))
    Not right. Rows do not sum to zero (largest 0.31, row 12).
    The law: the rows of L sum to zero.
    """

    status: Literal["right", "wrong", "unattempted"]
    message: str
    law: str = ""

    def __bool__(self) -> bool:
        return self.status == "right"

    def __str__(self) -> str:
        law = translated(f"The law: {self.law}.") if self.status == "wrong" and self.law else ""
        return f"{translated(OPENINGS[self.status])} {translated(self.message)}" + (f"\n{law}" if law else "")

    __repr__ = __str__

    def _repr_markdown_(self) -> str:
        """Return the verdict for a notebook, its first words in bold."""
        opening = translated(OPENINGS[self.status])
        return f"**{opening}**" + str(self)[len(opening) :].replace("\n", "\n\n").replace("*", "\\*")


class Stop(Exception):  # noqa: N818
    """End a check early with its verdict."""

    def __init__(self, verdict: Verdict) -> None:
        super().__init__(str(verdict))
        self.verdict = verdict


def right(message: str, law: str = "") -> Verdict:
    """The verdict on a right answer."""
    return Verdict("right", message, law)


def wrong(message: str, law: str) -> Verdict:
    """The verdict on an answer that breaks a law."""
    return Verdict("wrong", message, law)


def demand(holds: object, message: str, law: str) -> None:
    """End the check with a wrong verdict unless the law holds; NaN in a comparison counts as broken."""
    if not holds:
        raise Stop(wrong(message, law))


def judged(check: Check[P]) -> Check[P]:
    """Make a check kind to placeholders and quiet about warnings, and turn `Stop` into its verdict."""

    @functools.wraps(check)
    def guarded(answer: object, *args: P.args, **kwargs: P.kwargs) -> Verdict:
        try:
            refuse_placeholder(answer)
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                return check(answer, *args, **kwargs)
        except Stop as stop:
            return stop.verdict

    return guarded  # type: ignore[return-value]


def refuse_placeholder(answer: object, message: str = PLACEHOLDER) -> None:
    """End the check kindly when the answer, or a part of it, is still None or dots."""
    parts = answer if isinstance(answer, tuple | list) and len(answer) <= 100 else (answer,)
    if any(part is None or part is Ellipsis or part is NotImplemented for part in parts):
        raise Stop(Verdict("unattempted", message))
    if isinstance(answer, str) and answer.strip(" .…") == "":
        raise Stop(Verdict("unattempted", message))


# --- sealed answers -------------------------------------------------------------------------------------------------


def seal(value: object) -> str:
    """Return a value in a spelling that is not read at a glance: no secret, but no spoiler beside the question.

    `check_number`, `check_values`, `check_function` and `check_choice` accept it in place of the answer: a number, a
    word, a truth value or a list of them.

    Examples
    --------
    >>> seal(2), unseal(seal([1, 2.5]))
    ('sealed:Mg==', [1, 2.5])
    """
    return "sealed:" + base64.b64encode(json.dumps(value).encode()).decode()


def unseal(value: object) -> Any:
    """Return a sealed value; leave any other as it is."""
    if isinstance(value, str) and value.startswith("sealed:"):
        return json.loads(base64.b64decode(value.removeprefix("sealed:")))
    return value
