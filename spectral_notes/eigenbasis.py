"""The eigenbasis of a domain: the modes of L phi = lambda M phi, and the pair analyze and synthesize.

Only where `(L, M)` come from changes from page to page; what happens here is the same for a circle, a graph,
a mesh and a point cloud.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

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
    evals : (k,) array
        Eigenvalues in ascending order; 1 / length^2 for a Laplacian.
    evecs : (n, k) array
        One mode a column; pointwise values.
    M : (n, n) sparse array
        The mass matrix, symmetric positive definite.
    residuals : (k,) array, optional
        |L phi - lambda M phi| of each mode, in the norm of the inverse of M's diagonal, so in units of the eigenvalues;
        NaN where nobody measured it.
    n_zero : int, optional
        How many of the first modes are zero modes: one for each connected component, for a Laplacian without held
        ends. Where nobody says it, eigenvalues up to 1e-9 of the last one count.

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
        """Return the coefficients of a signal: its inner products with the modes.

        c = Phi^T M f.

        Parameters
        ----------
        f : (n,) or (n, d) array, a signal, or d signals side by side; pointwise values

        Returns
        -------
        (k,) or (k, d) array: the coefficients. Raises ValueError if `f` does not have n rows, or is not finite.
        """
        signal = as_signal("f", f, self.n)
        return np.asarray(self.evecs.T @ (self.M @ signal))

    def synthesize(self, c: ArrayLike) -> FloatArray:
        """Return the signal that has the given coefficients: a sum of modes.

        f = Phi c.  After `analyze` it is the best approximation of a signal by k modes.

        Parameters
        ----------
        c : (k,) or (k, d) array, coefficients, one a mode

        Returns
        -------
        (n,) or (n, d) array: the signal; pointwise values. Raises ValueError if `c` does not have k rows, or is not
        finite.
        """
        return np.asarray(self.evecs @ as_signal("c", c, self.k))

    def truncate(self, k: int) -> Eigenbasis:
        """Return the basis of the first k modes.

        Parameters
        ----------
        k : how many modes to keep, 1 .. the number there are.

        Returns
        -------
        The same modes, fewer of them. Raises ValueError if `k` is not between 1 and the number of modes.
        """
        k = as_count("k", k, 1, self.k)
        assert self.residuals is not None
        assert self.n_zero is not None
        evals, evecs = self.evals[:k], self.evecs[:, :k]
        return _fill(object.__new__(Eigenbasis), evals, evecs, self.M, self.residuals[:k], min(self.n_zero, k))

    def orthonormality_error(self) -> float:
        """Return the largest entry of |Phi^T M Phi - I|: zero to rounding after `compute_eigenbasis`.

        Returns a number without unit.
        """
        return float(abs(self.evecs.T @ (self.M @ self.evecs) - np.eye(self.k)).max())


def compute_eigenbasis(
    L: sp.csr_array, M: sp.csr_array, k: int, *, seed: int = 0, tol: float = 1e-8, certify: bool = False,
    progress: bool = False, threads: int = 1, factor: str = "auto", max_bytes: float | None = None,
) -> Eigenbasis:
    """Compute the k smallest eigenpairs of L phi = lambda M phi, ascending, with L positive semidefinite.

    The columns are orthonormal in M, and in each one the entry of largest magnitude is positive. Every connected
    component on which L annihilates the constants brings one eigenvalue that is exactly zero.

    Parameters
    ----------
    L : (n, n) sparse array, the weak Laplacian, symmetric positive semidefinite
    M : (n, n) sparse array, the mass matrix, symmetric positive definite; lumped (diagonal) or full
    k : how many modes, 1 .. n.
    seed : seed of the random start vectors. The result does not depend on it to the digits that have converged.
    tol : residual, relative to the eigenvalue, at which a mode has converged
    certify : prove, by counting the signs of one more factorization, that no eigenvalue below the last was missed
    progress : show a bar
    threads : most threads that linear algebra may use meanwhile. One is never slow; more help on a machine that is idle
        and hurt on one that is shared, where the threads wait for each other.
    factor : {"auto", "cholespy", "superlu"}, which library factors; see `spectral_notes.solver.factorization.factorize`
    max_bytes : memory the basis may take before the modes are sought a band at a time; half of what is free if not
        given

    Returns
    -------
    `evals` (k,), `evecs` (n, k) pointwise, `M`, and the `residuals` (k,). Raises TypeError if a matrix is not real, or
    k is not an integer; ValueError if a matrix is not symmetric, L not semidefinite, M not definite, or k not between 1
    and n; MemoryError if the modes themselves would not fit into memory; ArithmeticError if the modes do not converge,
    or the certificate finds one missing.

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=3)
    >>> gram = basis.evecs.T @ basis.M @ basis.evecs
    >>> bool(abs(gram - np.eye(3)).max() < 1e-12)
    True

    References
    ----------
    Vallet and Lévy, "Spectral geometry processing with manifold harmonics" (2008), for the shift and the inverse.
    """
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    k = as_count("k", k, 1, L.shape[0])
    seed, threads = as_count("seed", seed, 0), as_count("threads", threads, 1)
    tol = as_number("tol", tol, above=0.0)
    factor = as_choice("factor", factor, FACTORS)
    budget = None if max_bytes is None else as_number("max_bytes", max_bytes, above=0.0)
    with threadpool_limits(limits=threads, user_api="blas"), eigensolver.progress_bar(progress) as watch:
        problem = eigensolver.pose(L, M, k)
        evecs, again = eigensolver.solve(problem, k, tol=tol, seed=seed, factor=factor, max_bytes=budget, watch=watch)
        evals, residuals, n_zero = eigensolver.measure(problem, L, M, evecs, tol, again)
        if certify:
            eigensolver.certify(L, M, evals, residuals)
    fix_signs(evecs)
    return _fill(object.__new__(Eigenbasis), evals, evecs, M, residuals, n_zero)


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

    Parameters
    ----------
    X : (n, k) array
        Modes side by side.

    Examples
    --------
    >>> X = np.array([[1.0, 1.0], [-2.0, 1.0]])
    >>> fix_signs(X)
    >>> X.tolist()
    [[-1.0, 1.0], [2.0, 1.0]]
    """
    for column in X.T:
        size = abs(column)
        if column[np.argmax(size >= (1 - SIGN_TIE) * size.max())] < 0:
            column *= -1.0
