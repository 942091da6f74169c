"""Reading whatever a student may pass, saying where an answer is wrong, and guessing the slip behind it.

Nothing here raises on a strange answer but `Stop`, which carries the verdict.
"""

from __future__ import annotations

import dis
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp

from spectral_notes.checking.verdicts import Stop, Verdict, demand, refuse_placeholder, wrong

LARGEST = 1e100  # beyond it squares overflow, and nothing in the course is so large

# --- reading what came ----------------------------------------------------------------------------------------------


def call(answer: Callable[..., Any], *inputs: Any) -> object:
    """Return what a student's function returns; what it raises becomes a verdict."""
    try:
        returned = answer(*inputs)
    except (Exception, SystemExit) as error:
        if isinstance(error, NotImplementedError) and _is_own(error):
            raise Stop(Verdict("unattempted", "Write the body of the function.")) from None
        said = f"It raises {type(error).__name__}: {_short(error)}"
        raise Stop(wrong(said, "the function accepts the inputs that the exercise names")) from None
    try:
        refuse_placeholder(returned, "The function returns nothing yet.")
    except Stop:
        if is_stub(answer):
            raise
        said = "It returns None or dots, whole or in part. Is a return missing?"
        raise Stop(wrong(said, "the function returns what the exercise asks for")) from None
    return returned


def is_stub(answer: Any) -> bool:
    """Say whether the body of a function is still empty: it does nothing but return a constant."""
    try:
        steps = {step.opname for step in dis.get_instructions(answer)}
    except TypeError:
        return bool(getattr(answer, "is_stub", False))
    return steps <= {"RESUME", "LOAD_CONST", "RETURN_VALUE", "RETURN_CONST", "NOP"}


def _is_own(error: BaseException) -> bool:
    """Say whether a function raised an error itself and without a word, as `raise NotImplementedError` does."""
    within = error.__traceback__.tb_next if error.__traceback__ else None
    return not str(error) and within is not None and within.tb_next is None


def read_array(answer: object, what: str, shape: Sequence[int | str], *, real: bool = True) -> Any:
    """Return an answer as a finite float64 (or complex128) array of the given shape; a string names a free axis."""
    array = _array(answer, what)
    if 1 in array.shape and array.ndim != len(shape) and np.squeeze(array).ndim == len(shape):
        array = np.squeeze(array)  # a column or a row for a vector is no mistake
    demand(_fits(array.shape, shape), *_about_shape(what, array.shape, shape))
    array = array.astype(np.complex128)
    demand(
        np.isfinite(array).all() and (abs(array) <= LARGEST).all(),
        f"{what} holds NaN or infinite entries, the first at {_first(~(abs(array) <= LARGEST))}. Is there a division "
        "by zero?",
        f"{what} holds finite numbers",
    )
    if not real:
        return array
    size = abs(array).max(initial=0.0)
    demand(
        abs(array.imag).max(initial=0.0) <= 1e-6 * size,
        f"{what} has an imaginary part, the largest at {place_of(array.imag)}.",
        f"{what} is real",
    )
    return np.array(array.real)


def read_matrix(answer: Any, what: str, shape: tuple[int, int]) -> sp.csr_array:
    """Return an answer, dense or sparse, as a finite real sparse matrix of the given shape."""
    if not sp.issparse(answer):
        return sp.csr_array(read_array(answer, what, shape))
    demand(_fits(answer.shape, shape), *_about_shape(what, answer.shape, shape))
    try:
        entries = sp.coo_array(answer)
        values = read_array(entries.data, what, ("nnz",))
        matrix = sp.csr_array((values, (entries.row, entries.col)), shape=shape)
    except (TypeError, ValueError, IndexError) as error:
        raise Stop(wrong(f"It cannot be read: {_short(error)}", f"{what} is a matrix of numbers")) from None
    return matrix


def _array(answer: Any, what: str) -> Any:
    """An answer as an array of numbers, or the end of the check."""
    law = f"{what} is made of numbers"
    try:
        array = np.asarray(answer.toarray() if sp.issparse(answer) else answer)
        if array.dtype.kind == "O":
            refuse_placeholder(array.ravel()[:100].tolist())
            array = array.astype(np.complex128 if any(isinstance(x, complex) for x in array.ravel()) else np.float64)
    except Stop:
        raise
    except Exception as error:
        raise Stop(wrong(f"A {type(answer).__name__} cannot be read as numbers: {_short(error)}", law)) from None
    kind = "text" if array.dtype.kind in "US" else f"entries of type {array.dtype}"
    demand(array.dtype.kind in "biufc", f"Numbers are expected; {kind} came.", law)
    return array


def _fits(have: tuple[int, ...], want: Sequence[int | str]) -> bool:
    """Say whether a shape is the wanted one."""
    return len(have) == len(want) and all(isinstance(w, str) or w == h for w, h in zip(want, have, strict=True))


def _about_shape(what: str, have: tuple[int, ...], want: Sequence[int | str]) -> tuple[str, str]:
    """What is wrong with the shape that came, and the law about it."""
    wanted = "(" + ", ".join(map(str, want)) + ("," if len(want) == 1 else "") + ")"
    message = f"The shape {have} came."
    if len(have) == 2 and len(want) == 2 and _fits(have[::-1], want):
        message += " Is it transposed?"
    return message, f"{what} has shape {wanted}"


def _short(error: BaseException) -> str:
    """The first words of an error."""
    try:
        return " ".join(str(error).split())[:120] or "no message"
    except Exception:
        return "no message"


# --- sizes and places -----------------------------------------------------------------------------------------------


def place_of(array: Any) -> str:
    """Name the place of the largest entry: 'index 3' or 'row 3, column 5'."""
    return _first(abs(array) == abs(array).max()) if array.size else "no place"


def _first(mask: Any) -> str:
    """Name the first place where a mask holds."""
    places = np.argwhere(mask)
    where = [int(i) for i in places[0]] if len(places) else []
    if len(where) == 2:
        return f"row {where[0]}, column {where[1]}"
    return f"index {', '.join(map(str, where))}" if where else "its only place"


def largest(matrix: sp.csr_array) -> float:
    """The largest magnitude of a sparse matrix."""
    return float(abs(matrix.data).max(initial=0.0))


def place_in(matrix: sp.csr_array) -> str:
    """Name the place of the largest entry of a sparse matrix."""
    entries = sp.coo_array(matrix)
    if not entries.nnz:
        return "no place"
    at = int(np.argmax(abs(entries.data)))
    return f"row {int(entries.row[at])}, column {int(entries.col[at])}"


# --- likely slips ---------------------------------------------------------------------------------------------------

FACTORS = {
    2.0: "a factor of 2",
    3.0: "a factor of 3",
    4.0: "a factor of 4",
    6.0: "a factor of 6",
    np.pi: "a factor of pi",
    2 * np.pi: "a factor of 2 pi",
    4 * np.pi: "a factor of 4 pi",
    4 * np.pi**2: "a factor of 4 pi^2",
    180 / np.pi: "degrees taken for radians",
    100.0: "percent taken for a fraction",
    1000.0: "a factor of 1000",
}


def slip(answer: Any, expected: Any) -> str:
    """Name the likely slip between an answer and the right one, as a sentence with a blank before it, or ''."""
    answer, expected = np.asarray(answer), np.asarray(expected)
    if answer.shape != expected.shape or not expected.any() or _near(answer, expected):
        return ""
    if _near(-answer, expected):
        return " Is its sign turned?"
    return _slip_of_scale(answer, expected) or _slip_of_order(answer, expected) or _slip_of_power(answer, expected)


def _slip_of_scale(answer: Any, expected: Any) -> str:
    """Name the factor between two arrays, if it is one."""
    top = np.unravel_index(int(np.argmax(abs(expected))), expected.shape)
    ratio = abs(answer[top] / expected[top])
    if not ratio > 0 or not _near(answer * (expected[top] / answer[top]), expected):
        return ""
    known = [words for factor, words in FACTORS.items() if min(abs(ratio / factor - 1), abs(ratio * factor - 1)) < 2e-3]
    if expected.size == 1:
        return f" Is it {known[0]}?" if known else ""
    return f" Everywhere the same slip: {known[0] if known else f'a factor of {ratio:.3g}'}."


def _slip_of_order(answer: Any, expected: Any) -> str:
    """Say whether the right values stand in a wrong order."""
    if expected.ndim != 1:
        return ""
    if _near(answer[::-1], expected):
        return " Is it in reverse order?"
    if _near(np.roll(answer, 1), expected) or _near(np.roll(answer, -1), expected):
        return " Is it shifted by one?"
    return " Is it in another order?" if _near(np.sort(answer), np.sort(expected)) else ""


def _slip_of_power(answer: Any, expected: Any) -> str:
    """Say whether a square, a root or a reciprocal was forgotten."""
    if _near(np.sqrt(abs(answer)), expected):
        return " Is a square root missing?"
    if _near(answer**2, expected):
        return " Is a square missing?"
    return " Is it the reciprocal?" if _near(1 / np.where(answer == 0, np.inf, answer), expected) else ""


def _near(moved: Any, expected: Any) -> bool:
    """Say whether two arrays agree to three digits."""
    return bool(abs(moved - expected).max() <= 2e-3 * abs(expected).max())
