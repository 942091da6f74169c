"""Checks of numbers, arrays, functions, labels and choices."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.metrics import adjusted_rand_score

from spectral_notes.checking.answers import call, place_of, read_array, slip
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, unseal, wrong

TRUTH = {"1": "true", "1.0": "true", "yes": "true", "0": "false", "0.0": "false", "no": "false"}


@judged
def check_number(
    answer: object, expected: float | str, *, within: float | None = None, modulo: float | None = None, law: str = "",
    slips: dict[float, str] | None = None,
) -> Verdict:
    """Judge one number.

    Parameters
    ----------
    answer : a scalar, or an array with one entry
    expected : the right number, or `seal` of it
    within : how far off it may be, in its own unit; a thousandth of its size if not given
    modulo : numbers that differ by a multiple of it are the same, as phases by a full turn
    law : the law that gives the number, named when it is wrong
    slips : wrong numbers that have a known cause, with the sentence that names it

    Examples
    --------
    >>> print(check_number(-2.0, 2.0, law="the error falls as h^2"))
    Not right. Your number is -2. Is its sign turned?
    The law: the error falls as h^2.
    """
    value = float(unseal(expected))
    tolerance = within if within is not None else (1e-3 * abs(value) or 1e-9)
    given = float(read_array(answer, "the answer", ()))
    law = law or "the number follows from the definition"

    def apart(number: float) -> float:
        gap = abs(given - number)
        return gap if modulo is None else abs(gap - modulo * round(gap / modulo))

    if apart(value) <= tolerance:
        return right("The number is right.", law)
    for number, words in (slips or {}).items():
        demand(not apart(number) <= tolerance, f"Your number is {given:.4g}. {words}", law)
    return wrong(f"Your number is {given:.4g}.{slip(given, value)}", law)


@judged
def check_values(
    answer: object, expected: ArrayLike | str, *, within: float = 1e-5, law: str = "", either_sign: bool = False,
    free_scale: bool = False, through: ArrayLike | None = None,
) -> Verdict:
    """Judge an array of numbers, entry by entry.

    Parameters
    ----------
    answer : what the student passes
    expected : the right values, or `seal` of their list
    within : how far off an entry may be, as a fraction of the largest one
    law : the law that gives the values
    either_sign, free_scale : accept the negative as well; accept any multiple but zero
    through : (m, n), only what this matrix makes of the answer counts
        `expected` is a right answer (n,) or what the matrix makes of one (m,); if that is zero, zero itself is refused.

    Examples
    --------
    >>> print(check_values([0, 1, 2, 4], [0, 1, 2, 3]))
    Not right. It differs by 1 at index 3.
    The law: every value follows from the definition.
    """
    value = np.asarray(unseal(expected)) * 1  # truth values count as 0 and 1
    matrix = None if through is None else np.asarray(through)
    shape, is_image = value.shape, False
    if matrix is not None and value.shape == matrix.shape[:1] != matrix.shape[1:]:
        shape, is_image = matrix.shape[1:], True
    given = read_array(answer, "the answer", shape, real=not np.iscomplexobj(value))
    law = law or "every value follows from the definition"
    unit = abs(value).max(initial=0.0) or 1.0
    if matrix is not None:
        value = value if is_image else matrix @ value
        demand(given.any() or value.any(), "It is zero, which every matrix maps to zero.", law)
        unit = (abs(matrix) @ abs(given)).max()
        given = matrix @ given
    compared = given
    if free_scale and abs(given).max(initial=0.0) > 0:
        compared = given * (np.vdot(given, value) / np.vdot(given, given))
    elif either_sign and abs(given + value).max(initial=0.0) < abs(given - value).max(initial=0.0):
        compared = -given
    difference = compared - value
    size = abs(difference).max(initial=0.0)
    if size <= within * unit:
        return right("Every value is right.", law)
    if matrix is not None:
        return wrong(f"What the matrix makes of it differs by {size:.3g} at {place_of(difference)}.", law)
    return wrong(f"It differs by {size:.3g} at {place_of(difference)}.{slip(given, value)}", law)


@judged
def check_function(
    answer: object, reference: Callable[..., Any] | str, inputs: Iterable[Sequence[Any]], *, within: float = 1e-5,
    law: str = "",
) -> Verdict:
    """Judge a function by what it returns for test inputs.

    Parameters
    ----------
    answer : the student's function; it is called with copies of the inputs
    reference : a function that is right, or `seal` of the list of what one returns for the inputs
    inputs : the arguments of each call
    within : how far off a value may be, as a fraction of the largest one
    law : the law that the function obeys

    Examples
    --------
    >>> sides = np.array([1.0, 2.0, 5.0])
    >>> print(check_function(lambda x: x, np.square, [(sides,)], law="the area of a square is its side squared"))
    Not right. For test input 1 of 1, it differs by 20 at index 2. Is a square missing?
    The law: the area of a square is its side squared.
    """
    if not callable(answer):
        return wrong(f"A {type(answer).__name__} came. Pass the function itself, uncalled.", "the answer is a function")
    tests = list(inputs)
    wanted = unseal(reference) if isinstance(reference, str) else [reference(*arguments) for arguments in tests]
    for number, (arguments, value) in enumerate(zip(tests, wanted, strict=True), start=1):
        returned = call(answer, *copy.deepcopy(tuple(arguments)))
        verdict = check_values(returned, value, within=within, law=law)
        if not verdict:
            message = verdict.message[0].lower() + verdict.message[1:]
            raise Stop(Verdict(verdict.status, f"For test input {number} of {len(tests)}, {message}", verdict.law))
    return right("The function returns the right values.", law)


@judged
def check_labels(answer: object, expected: ArrayLike, *, agreement: float = 1.0, law: str = "") -> Verdict:
    """Judge labels up to their names: only which samples share a label counts.

    Parameters
    ----------
    answer : one label a sample; numbers or words
    expected : (n,), labels that are right
    agreement : the adjusted Rand index that is asked for: 1 for the same parts, 0 for chance
    law : the law that the parts obey

    Examples
    --------
    >>> bool(check_labels(["b", "b", "a"], [0, 0, 1]))
    True
    """
    value = np.asarray(expected)
    try:
        given = np.asarray(answer).ravel()
        parts, given = np.unique(given, return_inverse=True)
    except Exception:
        return wrong(f"A {type(answer).__name__} cannot be read as labels.", "there is one label a sample")
    one_each = "there is one label a sample"
    demand(len(given) == len(value), f"{len(given)} labels came for {len(value)} samples.", one_each)
    law = law or "the parts are those that the method finds"
    index = float(adjusted_rand_score(value, given))
    if index >= agreement - 1e-9:
        return right("The parts are right.", law)
    wanted = len(np.unique(value))
    count = f" There are {len(parts)} parts where {wanted} are asked for." if len(parts) != wanted else ""
    message = f"The adjusted Rand index with the right parts is {index:.2f}; {agreement:.2f} is asked for."
    return wrong(message + count, law)


@judged
def check_choice(answer: object, expected: object, *, law: str = "", slips: dict[str, str] | None = None) -> Verdict:
    """Judge a word, a truth value or a set of words: case, blanks and order do not count.

    Parameters
    ----------
    answer : what the student chose
    expected : the right choice, or `seal` of it
    law : the law that decides
    slips : wrong choices that have a known cause, with the sentence that names it

    Examples
    --------
    >>> bool(check_choice({"Sphere", "egg "}, ["egg", "sphere"]))
    True
    """
    wanted = unseal(expected)
    value, given = _words(wanted), _words(answer)
    if isinstance(wanted, bool | np.bool_):
        given = frozenset(TRUTH.get(word, word) for word in given)
    law = law or "the choice follows from the numbers"
    if given == value:
        return right("That is the right choice.", law)
    known = next((f" {words}" for choice, words in (slips or {}).items() if given == _words(choice)), "")
    if isinstance(answer, str | bool | int | np.bool_):
        return wrong(f"{str(answer)[:60]!r} is not what the numbers say.{known}", law)
    return wrong(f"This choice is not what the numbers say.{known}", law)


def _words(choice: object) -> frozenset[str]:
    """A choice as a set of words in lower case, without blanks."""
    several = choice if isinstance(choice, list | tuple | set | frozenset | np.ndarray) else [choice]
    try:
        return frozenset("".join(str(word).lower().split()) for word in several)
    except Exception:
        return frozenset()
