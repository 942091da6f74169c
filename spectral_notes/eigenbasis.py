"""The eigenbasis of a domain: the modes of L phi = lambda M phi, and the pair analyze and synthesize.

Only where `(L, M)` come from changes from page to page; what happens here is the same for a circle, a graph,
a mesh and a point cloud.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats, as_number, as_signal, as_symmetric
from spectral_notes.solver import eigensolver
from spectral_notes.solver.factorization import FACTORS

ZERO = 1e-9  # eigenvalues up to this part of the last one are zero where nobody says how many are
SIGN_TIE = 1e-6  # entries this close in magnitude count as equal, so that rounding does not choose the sign


@dataclass(frozen=True, eq=False)
class Eigenbasis:
    """Hold the first k modes of L phi = lambda M phi: the Fourier basis of a domain.

    The modes are orthonormal in the inner product of the domain, `evecs.T @ M @ evecs = I`, and ordered by
    eigenvalue, which is the square of a frequency.

    Parameters
    ----------
    evals : (k,), eigenvalues in ascending order; 1 / length^2 for a Laplacian
    evecs : (n, k), one mode a column; pointwise values
    M : (n, n) sparse, the mass matrix, symmetric positive definite
    residuals : (k,), |L phi - lambda M phi| of each mode in units of the eigenvalues; NaN where nobody measured it
        The norm is that of the inverse of M's diagonal.
    n_zero : how many of the first modes are zero modes
        One for each connected component, for a Laplacian without held ends. Where nobody says it, eigenvalues up to
        1e-9 of the last one count.

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=3)
    >>> np.round(basis.evals / np.pi**2, 2)
    array([0., 1., 4.])
    """

    evals: FloatArray
    evecs: FloatArray
    M: sp.csr_array
    residuals: FloatArray | None = None
    n_zero: int | None = None

    def __post_init__(self) -> None:
        evals = as_floats("evals", self.evals, ("k",))
        evecs = as_floats("evecs", self.evecs, ("n", len(evals)))
        M = as_symmetric("M", self.M, len(evecs))
        measured = np.full(len(evals), np.nan) if self.residuals is None else np.array(self.residuals)
        n_zero = self.n_zero
        if n_zero is None:
            n_zero = int(np.count_nonzero(evals <= ZERO * evals[-1:]))
        _fill(self, evals, evecs, M, measured, as_count("n_zero", n_zero, 0, len(evals)))

    @property
    def k(self) -> int:
        """The number of modes."""
        return int(self.evecs.shape[1])

    @property
    def n(self) -> int:
        """The number of samples (vertices, points, nodes)."""
        return int(self.evecs.shape[0])

    def analyze(self, f: ArrayLike) -> FloatArray:
        """Return the coefficients c = Phi^T M f, (k,) or (k, d), of a signal f (n,) or of d side by side, pointwise."""
        signal = as_signal("f", f, self.n)
        return np.asarray(self.evecs.T @ (self.M @ signal))

    def synthesize(self, c: ArrayLike) -> FloatArray:
        """Return the signal f = Phi c, pointwise; after `analyze` it is the best approximation by k modes."""
        return np.asarray(self.evecs @ as_signal("c", c, self.k))

    def truncate(self, k: int) -> Eigenbasis:
        """Return the basis of the first k modes."""
        k = as_count("k", k, 1, self.k)
        assert self.residuals is not None
        assert self.n_zero is not None
        evals, evecs = self.evals[:k], self.evecs[:, :k]
        return _fill(object.__new__(Eigenbasis), evals, evecs, self.M, self.residuals[:k], min(self.n_zero, k))

    def orthonormality_error(self) -> float:
        """Return the largest entry of |Phi^T M Phi - I|: zero to rounding after `compute_eigenbasis`."""
        return float(abs(self.evecs.T @ (self.M @ self.evecs) - np.eye(self.k)).max())


def compute_eigenbasis(
    L: sp.csr_array, M: sp.csr_array, k: int, *, seed: int = 0, tol: float = 1e-8, certify: bool = False,
    progress: bool = False, threads: int = 1, factor: str = "auto", max_bytes: float | None = None,
) -> Eigenbasis:
    """Compute the k smallest eigenpairs of L phi = lambda M phi, ascending, with L positive semidefinite.

    The columns are orthonormal in M, and in each one the entry of largest magnitude is positive. Every connected
    component on which L annihilates the constants brings one eigenvalue that is exactly zero (shift and inverse as in
    Vallet and Lévy, "Spectral geometry processing with manifold harmonics", 2008).

    Parameters
    ----------
    L : (n, n) sparse, the weak Laplacian, symmetric positive semidefinite
    M : (n, n) sparse, the mass matrix, symmetric positive definite; lumped (diagonal) or full
    k : how many modes, 1 .. n
    seed : of the random start vectors; converged digits do not depend on it
    tol : residual, relative to the eigenvalue, at which a mode has converged
    certify : prove, by counting the signs of one more factorization, that no eigenvalue below the last was missed
    progress : show a bar
    threads : most threads that linear algebra may use meanwhile
        One is never slow; more help on a machine that is idle and hurt on one that is shared.
    factor : {"auto", "cholespy", "superlu"}, which library factors
    max_bytes : memory the basis may take before the modes are sought a band at a time; by default half of what is free

    Returns
    -------
    basis : evals (k,), evecs (n, k) pointwise, M, and the residuals (k,)

    Raises
    ------
    MemoryError
        If the modes themselves would not fit into memory.
    ArithmeticError
        If the modes do not converge, or the certificate finds one missing.

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=3)
    >>> bool(abs(basis.evecs.T @ basis.M @ basis.evecs - np.eye(3)).max() < 1e-12)
    True
    """
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    k = as_count("k", k, 1, L.shape[0])
    seed, threads = as_count("seed", seed, 0), as_count("threads", threads, 1)
    tol = as_number("tol", tol, above=0.0)
    factor = as_choice("factor", factor, FACTORS)
    budget = None if max_bytes is None else as_number("max_bytes", max_bytes, above=0.0)
    with _blas().limit(limits=threads, user_api="blas"), eigensolver.progress_bar(progress) as watch:
        problem = eigensolver.pose(L, M, k)
        evecs, again = eigensolver.solve(problem, k, tol=tol, seed=seed, factor=factor, max_bytes=budget, watch=watch)
        evals, residuals, n_zero = eigensolver.measure(problem, L, M, evecs, tol, again)
        if certify:
            eigensolver.certify(L, M, evals, residuals)
    fix_signs(evecs)
    return _fill(object.__new__(Eigenbasis), evals, evecs, M, residuals, n_zero)


@cache
def _blas() -> ThreadpoolController:
    """The linear algebra of NumPy and SciPy: to find it takes as long as a few modes of a small mesh."""
    return ThreadpoolController()


def _fill(
    basis: Eigenbasis, evals: FloatArray, evecs: FloatArray, M: sp.csr_array, residuals: FloatArray, n_zero: int
) -> Eigenbasis:
    """Give a basis its fields, which are known to be good, read-only; without checking or copying them."""
    for array in (evals, evecs, residuals):
        array.setflags(write=False)
    fields = {"evals": evals, "evecs": evecs, "M": M, "residuals": residuals, "n_zero": n_zero}
    for name, value in fields.items():
        object.__setattr__(basis, name, value)
    return basis


def fix_signs(X: FloatArray) -> None:
    """Turn columns, in place, so that the first of their entries of largest magnitude is positive.

    >>> X = np.array([[1.0, 1.0], [-2.0, 1.0]])
    >>> fix_signs(X)
    >>> X.tolist()
    [[-1.0, 1.0], [2.0, 1.0]]
    """
    for column in X.T:
        size = abs(column)
        if column[np.argmax(size >= (1 - SIGN_TIE) * size.max())] < 0:
            column *= -1.0
