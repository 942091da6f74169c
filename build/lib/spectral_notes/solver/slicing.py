"""Spectrum slicing: many modes in little memory, a band of eigenvalues at a time.

Block Lanczos on (L - sigma M)^-1 finds the eigenvalues nearest to the shift sigma. The factorization that this needs
also counts, by Sylvester's law of inertia, how many eigenvalues lie below sigma; so a band is complete or it is known
not to be. Only the modes themselves and the basis of one band are in memory at a time.

Sources: Grimes, Lewis and Simon (1994), the shift strategy; Vallet and Lévy, "Spectral geometry processing with
manifold harmonics" (2008), bands for meshes.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from spectral_notes._checks import FloatArray
from spectral_notes.solver.factorization import Solve, symmetric_lu, trustworthy
from spectral_notes.solver.lanczos import Watch, block_lanczos

BAND = 64  # modes a slice: about as many as one factorization is worth
BLOCK = 8
ROWS = 8192


def slice_spectrum(
    A: sp.csr_array, B: sp.csr_array, zero: FloatArray, k: int, spacing: float, *, tol: float, seed: int,
    band: int = BAND, watch: Watch | None = None,
) -> FloatArray:
    """Compute the vectors of the k smallest eigenvalues of A x = lambda B x, each band counted before it is accepted.

    Parameters
    ----------
    A : (n, n) sparse array
        Symmetric positive semidefinite.
    B : (n, n) sparse array
        Symmetric positive definite.
    zero : (n, c) array
        An orthonormal basis of the null space of A, c < k.
    k : int
        How many vectors.
    spacing : float
        A guess of the mean distance between eigenvalues; it is corrected on the way.
    tol : float
        Residual of each pair at which it has converged, relative to the distance from the shift.
    seed : int
        Seed of the start vectors.
    band : int
        Modes a slice.
    watch : callable, optional
        Called after each band with the modes found and k.

    Returns
    -------
    (n, k) array
        The vectors, ascending, B-orthonormal.

    Raises
    ------
    ArithmeticError
        If a band stays incomplete.

    Examples
    --------
    >>> A, eye = sp.csr_array(np.diag(np.arange(400.0) ** 1.5)), sp.eye_array(400, format="csr")
    >>> X = slice_spectrum(A, eye, np.eye(400)[:, :1], 30, 1.0, tol=1e-9, seed=0, band=12)
    >>> bool(abs(abs(X[:30]) - np.eye(30)).max() < 1e-6)
    True
    """
    n, have = zero.shape
    X = np.empty((n, k), order="F")
    X[:, :have] = zero
    last = 0.0
    while have < k:
        values, vectors, spacing = _band(A, B, last, have, min(band, k - have + 8), spacing, tol, seed)
        taken = min(_cut(values, spacing), k - have)
        X[:, have : have + taken] = vectors[:, :taken]
        last, have = float(values[taken - 1]), have + taken
        if watch is not None:
            watch(have, k)
    _rayleigh_ritz(A, B, X)
    return X


def _band(
    A: sp.csr_array, B: sp.csr_array, last: float, have: int, band: int, spacing: float, tol: float, seed: int
) -> tuple[FloatArray, FloatArray, float]:
    """The next eigenvalues above `last`, which is the eigenvalue number `have`, and their vectors; a better spacing."""
    solve, sigma, below = _shift(A, B, last, have, band, spacing)
    spacing = (sigma - last) / max(below, 1)
    want = 2 * max(below, band // 4) + 4
    none = np.zeros((A.shape[0], 0))
    for _ in range(4):
        capacity = min(4 * want + 10 * BLOCK, A.shape[0] - BLOCK)
        mu, vectors = block_lanczos(
            solve, none, np.zeros(0), want, capacity=capacity, block=BLOCK, M=B, tol=tol, seed=seed
        )
        values = sigma + 1.0 / mu
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
        start = int((values < sigma).sum()) - below
        if start >= 0 and len(values) > start:
            return values[start:], vectors[:, start:], spacing
        want = want + 2 * max(-start, 4)
    raise ArithmeticError(f"{below} eigenvalues between {last:.6g} and {sigma:.6g} exist, {below + start} were found")


def _shift(
    A: sp.csr_array, B: sp.csr_array, last: float, have: int, band: int, spacing: float
) -> tuple[Solve, float, int]:
    """A shift with about half a band of new eigenvalues below it: its factor, itself, and that number."""
    sigma = last + 0.5 * band * spacing
    for _ in range(30):
        try:
            shifted = sp.csr_array(A - sigma * B)
            lu = symmetric_lu(shifted)
        except ArithmeticError:
            sigma += 0.1 * spacing
            continue
        below = int((lu.U.diagonal() < 0).sum()) - have
        if not trustworthy(lu, shifted):
            sigma += 0.1 * (sigma - last) / max(below, 1)
        elif below > 2 * band:
            sigma = last + (sigma - last) * 0.5 * band / below
        elif below < band // 8:
            sigma = last + 4 * (sigma - last)
        else:
            return lu.solve, sigma, below
    raise ArithmeticError(f"no shift above {last:.6g} could be found")


def _cut(values: FloatArray, spacing: float) -> int:
    """How many to accept: up to the last clear gap, so that no group of equal eigenvalues is split between bands."""
    gaps = np.diff(values)
    clear = np.flatnonzero(gaps > 0.3 * spacing)
    return int(clear[-1] if len(clear) else np.argmax(gaps)) + 1


def _rayleigh_ritz(A: sp.csr_array, B: sp.csr_array, X: FloatArray) -> None:
    """Make the columns of X the best approximate eigenvectors within their span, in place, B-orthonormal."""
    k = X.shape[1]
    H, G = np.empty((k, k)), np.empty((k, k))
    for start in range(0, k, 16):
        part = X[:, start : start + 16]
        H[:, start : start + 16] = X.T @ (A @ part)
        G[:, start : start + 16] = X.T @ (B @ part)
    _, Y = scipy.linalg.eigh((H + H.T) / 2, (G + G.T) / 2)
    for start in range(0, len(X), ROWS):
        X[start : start + ROWS] = X[start : start + ROWS] @ Y
