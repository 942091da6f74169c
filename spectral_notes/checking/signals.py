"""Checks of discrete Fourier transforms and difference matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats
from spectral_notes.checking.answers import call, place_of, read_array, read_matrix
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, wrong

SCALINGS = ("numpy", "mean", "unitary", "any")
TRANSFORM = "F[k] is the sum of f[j] exp(-2 pi i j k / N) over j"


@judged
def check_dft(answer: object, f: ArrayLike, *, scaling: str = "any", within: float = 1e-5) -> Verdict:
    """Judge the discrete Fourier transform of a signal.

    Parameters
    ----------
    answer : the N complex coefficients, those of `rfft`, or the pair (a, b) of cosine and sine coefficients
        Or an (N, N) matrix that makes the coefficients of f, or a function that does.
    f : (N,), the signal
    scaling : {"any", "numpy", "mean", "unitary"}, which factor is asked for: 1, 1 / N or 1 / sqrt(N)
        A pair (a, b) is always averaged over N.
    within : how far off a coefficient may be, as a fraction of the largest one

    Examples
    --------
    >>> f = np.sin(2 * np.pi * np.arange(8) / 8) + 0.5
    >>> bool(check_dft(np.fft.fft(f) / 8, f))
    True
    >>> print(check_dft(np.fft.fft(f).conj(), f))
    Not right. Coefficients of the sines have the wrong sign (largest at index 1): exp(+i) where exp(-i) belongs?
    The law: F[k] is the sum of f[j] exp(-2 pi i j k / N) over j.
    """
    as_choice("scaling", scaling, SCALINGS)
    signal = np.asarray(f)
    n, true = len(signal), np.fft.fft(signal)
    F = _coefficients(answer, signal)
    if len(F) == n // 2 + 1 and n > 2 and not np.iscomplexobj(signal):
        true = true[: n // 2 + 1]  # what rfft returns: the rest mirrors it
    demand(len(F) == len(true), f"{len(F)} came.", f"there are {n} coefficients")
    size = abs(true).max() or 1.0
    for name, factor in _scales(n).items():
        if scaling in (name, "any") and abs(F / factor - true).max() <= within * size:
            return right("These are the coefficients of the signal.", TRANSFORM)
    law = f"N (a[k] - i b[k]) is F[k], and {TRANSFORM}" if _is_pair(answer, n) else TRANSFORM
    return wrong(_slip_of_transform(F, true, n, scaling), law)


def _coefficients(answer: Any, signal: Any) -> Any:
    """The coefficients that an answer stands for, as F."""
    n = len(signal)
    if callable(answer):
        answer = call(answer, signal.copy())
    if _is_pair(answer, n):
        a, b = (read_array(part, name, (n,)) for part, name in zip(answer, "ab", strict=True))
        return n * (a - 1j * b)
    matrix = read_array(answer, "the transform", ("N", "N"), real=False) if _has_shape(answer, (n, n)) else None
    return read_array(answer, "the transform", ("N",), real=False) if matrix is None else matrix @ signal


def _is_pair(answer: Any, n: int) -> bool:
    """Say whether an answer is (a, b), as a tuple or as two rows."""
    if isinstance(answer, tuple):
        return len(answer) == 2
    return n != 2 and _has_shape(answer, (2, n))


def _has_shape(answer: Any, shape: tuple[int, int]) -> bool:
    """Say whether an answer is a matrix of a shape."""
    try:
        return tuple(answer.shape if sp.issparse(answer) else np.shape(answer)) == shape
    except Exception:
        return False


def _scales(n: int) -> dict[str, float]:
    """The factors that are in use before the sum."""
    return {"numpy": 1.0, "mean": 1.0 / n, "unitary": n**-0.5}


def _slip_of_transform(F: Any, true: Any, n: int, scaling: str) -> str:
    """Say what is wrong with coefficients."""
    size = abs(true).max() or 1.0

    def scale_of(other: Any, goal: Any = true) -> str:
        fits = (name for name, s in _scales(n).items() if abs(other / s - goal).max() <= 2e-3 * size)
        return next(fits, "")

    if name := scale_of(F):
        return f"The scale is that of {name!r}, and {scaling!r} is asked for."
    if scale_of(F.conj()):
        where = int(np.argmax(abs(true.imag)))
        sign = "exp(+i) where exp(-i) belongs?"
        return f"Coefficients of the sines have the wrong sign (largest at index {where}): {sign}"
    if scale_of(np.roll(F, 1)) or scale_of(np.roll(F, -1)):
        return "The frequencies are off by one: k counts from 0, and F[0] is the sum of the signal."
    if scale_of(np.fft.ifftshift(F)):
        return "The frequencies are in another order: 0 first, as numpy.fft.fft has them. Is it shifted by fftshift?"
    if not F.imag.any() and scale_of(F, true.real):
        return "Only the cosines are there: the imaginary part is zero where the signal has sines."
    if scale_of(F / n):
        return "Everywhere the same slip: a factor of N. Is the 1/N missing?"
    if scale_of(F / 2) or scale_of(F * 2):
        return "Everywhere the same slip: a factor of 2. Does each frequency count once or twice?"
    difference = min((F / s - true for s in _scales(n).values()), key=lambda gap: abs(gap).max())
    far = f"{abs(difference).max() / size:.2g} of the largest coefficient"
    return f"It differs by {far}, most at {place_of(difference)}."


@judged
def check_difference_matrix(
    answer: object, x: ArrayLike, *, derivative: int = 1, accuracy: int = 2, length: float | None = None
) -> Verdict:
    """Judge a matrix that differentiates samples: its rows must be exact for polynomials.

    A row with accuracy p is exact for 1, x, ..., x^(d + p - 1), where d is the order of the derivative; its error then
    falls like h^p. Every stencil that does this is right.

    Parameters
    ----------
    answer : (n, n), dense or sparse
    x : (n,), the sample points, ascending
    derivative : {1, 2}, which derivative; the second is +d^2/dx^2
    accuracy : the order of accuracy that is asked for
    length : the circumference, for samples round a circle; an interval if not given

    Examples
    --------
    >>> D = (np.diag(np.ones(4), 1) - np.diag(np.ones(4), -1)) / 2
    >>> print(check_difference_matrix(D, np.arange(5.0)))
    Not right. Row 0 and row 4 do not sum to zero (row 0: 0.5): the end rows lack their one-sided stencils?
    The law: the derivative of a constant is zero.
    """
    points = as_floats("x", x, ("n",))
    d = as_count("derivative", derivative, 1, 2)
    n, h = len(points), float(np.diff(points).min())
    D = read_matrix(answer, "the matrix", (n, n))
    offsets = _offsets(D, points, length)
    for degree in range(d + accuracy):
        target = float(degree == d) * float(np.prod(np.arange(1, d + 1)))
        powers = sp.csr_array((D.data * (offsets / h) ** degree, D.indices, D.indptr), shape=D.shape)
        error = powers.sum(axis=1) * h**d - target  # what each row makes of ((x - x_i) / h)^degree, times h^d
        if not abs(error).max() <= 1e-4:
            if length is not None and _spectral(D, points, d, length):
                break
            raise Stop(wrong(_slip_of_rows(D, error, degree, d, h), _law_of(degree, d)))
    return right("Every row is exact to the order that is asked for.", _law_of(d, d))


def _offsets(D: sp.csr_array, points: FloatArray, length: float | None) -> FloatArray:
    """How far the sample of each stored entry lies from that of its row, the short way round a circle."""
    rows = np.repeat(np.arange(len(points)), np.diff(D.indptr))
    offsets = points[D.indices] - points[rows]
    return offsets if length is None else (offsets + length / 2) % length - length / 2


def _spectral(D: sp.csr_array, points: FloatArray, d: int, length: float) -> bool:
    """Say whether a full matrix on a circle is exact for waves instead."""
    for k in range(1, max(2, len(points) // 4)):
        wave = np.exp(2j * np.pi * k * points / length)
        factor = (2j * np.pi * k / length) ** d
        if abs(D @ wave - factor * wave).max() > 1e-5 * abs(factor):
            return False
    return bool(abs(D @ np.ones(len(points))).max() < 1e-5 * len(points) ** d)


def _law_of(degree: int, d: int) -> str:
    """The law that a polynomial tests."""
    if degree == 0:
        return "the derivative of a constant is zero"
    if degree < d:
        return "the second derivative of a straight line is zero"
    if degree == d:
        return "the derivative of x is 1" if d == 1 else "the second derivative of x^2 is 2"
    return f"the rows are exact for x^{degree}, as their order of accuracy asks"


def _slip_of_rows(D: sp.csr_array, error: FloatArray, degree: int, d: int, h: float) -> str:
    """Say which rows are wrong and why that may be."""
    bad = np.flatnonzero(~(abs(error) <= 1e-4))
    n = len(error)
    more = "" if len(bad) < 3 else f" and {len(bad) - 2} more"
    named = " and ".join(f"row {i}" for i in bad[:2]).capitalize() + more
    does = "do" if len(bad) > 1 else "does"
    size = f"(row {bad[0]}: {error[bad[0]] / h**d:.3g})"
    empty = [int(i) for i in bad if not D.data[D.indptr[i] : D.indptr[i + 1]].any()]
    if set(bad) <= {0, 1, n - 2, n - 1} and n > 4:
        hint = "the end rows are empty?" if empty else "the end rows lack their one-sided stencils?"
        corners = degree == 0 and d == 2 and not empty
        hint = "are the entries that join the two ends in their corners?" if corners else hint
    elif degree == d:
        ratio = 1 + error[n // 2] / float(np.prod(np.arange(1, d + 1)))
        known = {
            -1.0: "is its sign turned?",
            2.0: "divided by h where 2h belongs?",
            0.5: "divided by 2h where h belongs?",
            h**d: f"not divided by {'h' if d == 1 else 'h^2'}?",
            2 * h: "not divided by 2h?",
        }
        known |= {h: "divided by h once, not twice?"} if d == 2 else {}
        hint = next((words for r, words in known.items() if abs(ratio / r - 1) < 1e-3), "is the spacing in it?")
    else:
        hint = "each row's entries must balance"
    if degree == 0:
        return f"{named} {does} not sum to zero {size}: {hint}"
    return f"{named} {'are' if len(bad) > 1 else 'is'} not exact for x^{degree} {size}: {hint}"
