"""Checks of eigenbases, coefficients and embeddings."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_choice, as_count, as_symmetric
from spectral_notes.checking.answers import call, place_of, read_array, slip
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, wrong
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis

WITHIN = 1e-4  # single precision passes
SAME = 1e-3  # eigenvalues nearer than this, relatively, count as one
EQUATION = "L phi = lambda M phi"


@judged
def check_eigenbasis(answer: object, L: Any, M: Any, k: int) -> Verdict:
    """Judge the k smallest eigenpairs of L phi = lambda M phi; signs and repeated eigenspaces are free.

    Right if the modes are orthonormal in M, solve the equation, and none is missing.

    Parameters
    ----------
    answer : an `Eigenbasis`, or the pair (evals, evecs) with one mode a column
    L, M : (n, n), the weak Laplacian, positive semidefinite, and the mass
    k : how many modes are asked for

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> L, M = interval_laplacian(51)
    >>> basis = compute_eigenbasis(L, M, 4)
    >>> bool(check_eigenbasis((basis.evals, -basis.evecs), L, M, 4))
    True
    >>> print(check_eigenbasis((basis.evals, basis.evecs / 5), L, M, 4))
    Not right. A mode has M-length 0.2 (mode 0): is each column divided by the square root of phi^T M phi?
    The law: evecs.T @ M @ evecs is the identity.
    """
    L, M = as_symmetric("L", L), as_symmetric("M", M)
    n = int(L.shape[0])
    k = as_count("k", k, 1, n)
    reference = compute_eigenbasis(L, M, min(n, k + 8))
    given_evals, given_evecs = _pair_of(answer)
    evals = read_array(given_evals, "evals", ("k",))
    evecs = read_array(given_evecs, "evecs", ("n", "k"))
    demand(
        evecs.shape != (k, n) or n == k,
        f"The shape is {evecs.shape}: is it transposed?",
        "evecs holds one mode a column",
    )
    demand(len(evecs) == n, f"{len(evecs)} values came for {n} samples.", "a mode has one value a sample")
    demand(
        len(evals) == evecs.shape[1] == k,
        f"{len(evals)} eigenvalues and {evecs.shape[1]} modes came.",
        f"{k} modes are asked for",
    )
    _demand_spectrum(evals, reference, k)
    _demand_orthonormal(evecs, M)
    _demand_modes(evals, evecs, reference)
    return right("All modes solve the equation, orthonormal in M, and none is missing.", EQUATION)


def _pair_of(answer: object) -> tuple[object, object]:
    """The eigenvalues and the modes of an answer."""
    if isinstance(answer, Eigenbasis):
        return answer.evals, answer.evecs
    if isinstance(answer, tuple | list) and len(answer) == 2:
        return answer[0], answer[1]
    raise Stop(wrong(f"A {type(answer).__name__} came.", "a basis is a pair (evals, evecs), or an Eigenbasis"))


def _demand_spectrum(evals: FloatArray, reference: Eigenbasis, k: int) -> None:
    """Refuse eigenvalues that are not the k smallest."""
    true, scale = reference.evals[:k], float(reference.evals[-1]) or 1.0
    falls = np.flatnonzero(np.diff(evals) < -WITHIN * scale)
    if len(falls):
        raise Stop(wrong(f"Eigenvalue {falls[0] + 1} is smaller than the one before.", "eigenvalues ascend"))
    demand(
        evals.min() > -WITHIN * scale,
        f"Eigenvalue {int(np.argmin(evals))} is {evals.min():.3g}: has L the other sign?",
        "L is positive semidefinite, so no eigenvalue is negative",
    )
    apart = abs(evals - true) > _room(true, scale)
    if not apart.any():
        return
    law = f"the eigenvalues are the {k} smallest of {EQUATION}"
    at = int(np.argmax(apart))
    message = f"Eigenvalue {at} is {evals[at]:.4g}, and it should not be."
    later = reference.evals[1 : k + 1]
    if len(later) == k and abs(evals - later).max() <= SAME * scale and true[0] < SAME * scale:
        message = "The zero mode is missing: the constant is a mode as well."
    elif abs(evals**2 - true).max() <= SAME * scale:
        message = "These are frequencies, the square roots of the eigenvalues."
    elif evals.min() > reference.evals[-1]:
        message = f"The smallest is {evals.min():.4g}: are these the largest ones?"
    else:
        message += slip(evals, true)
    raise Stop(wrong(message, law))


def _room(evals: FloatArray, scale: float) -> FloatArray:
    """How far from an eigenvalue counts as the same: a part of it, and of the largest, for single precision."""
    return SAME * (abs(evals) + 0.05 * scale)


def _demand_orthonormal(evecs: FloatArray, M: sp.csr_array) -> None:
    """Refuse modes that are not orthonormal in M."""
    law = "evecs.T @ M @ evecs is the identity"
    gram = evecs.T @ (M @ evecs)
    error = abs(gram - np.eye(len(gram)))
    if error.max() <= WITHIN:
        return
    if abs(evecs.T @ evecs - np.eye(len(gram))).max() <= WITHIN:
        raise Stop(wrong(f"Orthonormal without M (error {error.max():.2g} with it): use evecs.T @ M @ evecs.", law))
    lengths = np.sqrt(abs(gram.diagonal()))
    worst = int(np.argmax(abs(lengths - 1)))
    demand(
        abs(lengths[worst] - 1) <= WITHIN,
        f"A mode has M-length {lengths[worst]:.3g} (mode {worst}): is each column divided by the square root of "
        "phi^T M phi?",
        law,
    )
    raise Stop(wrong(f"Two modes are not orthogonal: {error.max():.2g} at {place_of(error)}.", law))


def _demand_modes(evals: FloatArray, evecs: FloatArray, reference: Eigenbasis) -> None:
    """Refuse columns that leave the eigenspace of their eigenvalue."""
    c = reference.analyze(evecs)  # (k + 8, k)
    room = 2 * _room(evals, float(reference.evals[-1]) or 1.0)
    inside = abs(reference.evals[:, None] - evals[None, :]) <= room
    outside = np.sqrt(np.maximum(0.0, np.einsum("ij,ij->j", evecs, reference.M @ evecs) - (c**2 * inside).sum(axis=0)))
    if reference.k < reference.n:
        outside[evals >= reference.evals[-1] - room] = 0.0  # their eigenspace may go on beyond the reference
    worst = int(np.argmax(outside))
    demand(
        outside[worst] <= 0.02,
        f"Mode {worst} leaves the eigenspace of its eigenvalue by {outside[worst]:.2g} of its length: are evals and "
        "evecs in the same order, and M on the right side?",
        f"each mode solves {EQUATION} with its own eigenvalue",
    )


@judged
def check_coefficients(answer: object, basis: Eigenbasis, f: ArrayLike) -> Verdict:
    """Judge the coefficients of a signal in a basis, c = evecs.T @ M @ f.

    Parameters
    ----------
    answer : the coefficients, (k,) or (k, d); or a function of f that returns them
    basis : the modes
    f : (n,) or (n, d), the signal

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(51), 4)
    >>> f = np.linspace(0, 1, 51)
    >>> print(check_coefficients(basis.evecs.T @ f, basis, f))
    Not right. These are inner products without M: they depend on how densely the domain is sampled.
    The law: c = evecs.T @ M @ f.
    """
    law = "c = evecs.T @ M @ f"
    signal = np.asarray(f, dtype=np.float64)
    if callable(answer):
        answer = call(answer, signal.copy())
    true, flat = basis.analyze(signal), basis.evecs.T @ signal
    given = read_array(answer, "c", true.shape)
    size = abs(true).max(initial=0.0) or 1.0
    if abs(given - true).max() <= WITHIN * size:
        return right("These are the coefficients.", law)
    demand(
        abs(given - flat).max() > 1e-3 * abs(flat).max(),
        "These are inner products without M: they depend on how densely the domain is sampled.",
        law,
    )
    difference = given - true
    first = place_of((abs(difference) > WITHIN * size) * 1.0)
    demand(
        abs(abs(given) - abs(true)).max() > 1e-3 * size,
        f"Some signs are turned (first at {first}): is it the given basis?",
        law,
    )
    raise Stop(wrong(f"It differs by {abs(difference).max():.3g} at {place_of(difference)}.{slip(given, true)}", law))


@judged
def check_embedding(answer: object, basis: Eigenbasis, n_dims: int, *, weights: str = "gps") -> Verdict:
    """Judge a spectral embedding: one row a sample, without the zero mode; signs and repeated eigenspaces are free.

    Parameters
    ----------
    answer : (n, n_dims)
    basis : at least n_dims + 1 modes of a connected domain; a few more, so that repeated eigenspaces are whole
    n_dims : the dimension
    weights : {"gps", "none"}, each mode divided by the square root of its eigenvalue, or left alone

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(51), 6)
    >>> print(check_embedding(basis.evecs[:, :3], basis, 3, weights="none"))
    Not right. Coordinate 0 is the same for all samples: leave the zero mode out.
    The law: the constant mode says nothing about place.
    """
    as_choice("weights", weights, ("gps", "none"))
    n_dims = as_count("n_dims", n_dims, 1, basis.k - 1)
    X = read_array(answer, "the embedding", (basis.n, n_dims))
    spread = np.ptp(X, axis=0) / (abs(X).max() or 1.0)
    flat = int(np.argmin(spread))
    demand(
        spread[flat] > 1e-6,
        f"Coordinate {flat} is the same for all samples: leave the zero mode out.",
        "the constant mode says nothing about place",
    )
    evals = basis.evals[1 : n_dims + 1]
    c = basis.analyze(X)  # (k, n_dims)
    near = abs(basis.evals[:, None] - evals[None, :]) <= SAME * evals[-1]
    lengths = np.sqrt(np.einsum("ij,ij->j", X, basis.M @ X))
    strayed = np.sqrt(np.maximum(0.0, lengths**2 - (c**2 * near).sum(axis=0))) / lengths
    worst = int(np.argmax(strayed))
    demand(
        strayed[worst] <= 0.02,
        f"Coordinate {worst} strays from its mode by {strayed[worst]:.2g} of its length: are the modes in order?",
        "coordinate i is mode i + 1",
    )
    wanted = evals**-0.5 if weights == "gps" else np.ones(n_dims)
    _demand_weights(lengths, wanted, evals, weights)
    cosines = (c.T @ c) / np.outer(lengths, lengths) - np.eye(n_dims)
    demand(abs(cosines).max() <= 0.02, f"Two are not: {place_of(cosines)}.", "coordinates are orthogonal in M")
    return right("Every coordinate is a mode with its weight.")


def _demand_weights(lengths: FloatArray, wanted: FloatArray, evals: FloatArray, weights: str) -> None:
    """Refuse coordinates of wrong length."""
    if abs(lengths / wanted - 1).max() <= 1e-3:
        return
    law = "coordinate i has weight 1 / sqrt(lambda)" if weights == "gps" else "every coordinate has M-length 1"
    known = {
        "not weighted": evals**0,
        "weighted by 1 / sqrt(lambda)": evals**-0.5,
        "weighted by lambda": evals,
        "weighted by sqrt(lambda)": evals**0.5,
        "weighted by 1 / lambda": evals**-1.0,
    }
    for words, length in known.items():
        demand(abs(lengths / length - 1).max() > 1e-3, f"The coordinates are {words}.", law)
    worst = int(np.argmax(abs(lengths / wanted - 1)))
    raise Stop(wrong(f"Coordinate {worst} is {lengths[worst] / wanted[worst]:.3g} times as long as it should be.", law))
