"""The eigenbasis of a domain: the modes of L phi = lambda M phi, and the pair analyze and synthesize.

Only where `(L, M)` come from changes from page to page; what happens here is the same for a circle, a graph,
a mesh and a point cloud.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import eigsh

from spectral_notes._checks import FloatArray, as_count, as_floats, as_signal, as_symmetric

SIGN_TIE = 1e-6


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

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=3)
    >>> np.round(basis.evals / np.pi**2, 3)
    array([0., 1., 4.])
    """

    evals: FloatArray
    evecs: FloatArray
    M: sp.csr_array

    def __post_init__(self) -> None:
        evals = as_floats("evals", self.evals, ("k",))
        evecs = as_floats("evecs", self.evecs, ("n", len(evals)))
        evals.setflags(write=False)
        evecs.setflags(write=False)
        object.__setattr__(self, "evals", evals)
        object.__setattr__(self, "evecs", evecs)
        object.__setattr__(self, "M", as_symmetric("M", self.M, len(evecs)))

    @property
    def k(self) -> int:
        """The number of modes."""
        return self.evecs.shape[1]

    @property
    def n(self) -> int:
        """The number of samples (vertices, points, nodes)."""
        return self.evecs.shape[0]

    def analyze(self, f: ArrayLike) -> FloatArray:
        """Return the coefficients of a signal: its inner products with the modes.

        c = Phi^T M f.

        Parameters
        ----------
        f : (n,) or (n, d) array
            A signal, or d signals side by side; pointwise values.

        Returns
        -------
        (k,) or (k, d) array
            The coefficients.

        Raises
        ------
        ValueError
            If `f` does not have n rows, or is not finite.
        """
        signal = as_signal("f", f, self.n)
        return np.asarray(self.evecs.T @ (self.M @ signal))

    def synthesize(self, c: ArrayLike) -> FloatArray:
        """Return the signal that has the given coefficients: a sum of modes.

        f = Phi c.  After `analyze` it is the best approximation of a signal by k modes.

        Parameters
        ----------
        c : (k,) or (k, d) array
            Coefficients, one a mode.

        Returns
        -------
        (n,) or (n, d) array
            The signal; pointwise values.

        Raises
        ------
        ValueError
            If `c` does not have k rows, or is not finite.
        """
        return np.asarray(self.evecs @ as_signal("c", c, self.k))

    def truncate(self, k: int) -> Eigenbasis:
        """Return the basis of the first k modes.

        Parameters
        ----------
        k : int
            How many modes to keep, 1 .. the number there are.

        Returns
        -------
        Eigenbasis
            The same modes, fewer of them.

        Raises
        ------
        ValueError
            If `k` is not between 1 and the number of modes.
        """
        k = as_count("k", k, 1, self.k)
        return Eigenbasis(self.evals[:k], self.evecs[:, :k], self.M)


def compute_eigenbasis(L: sp.csr_array, M: sp.csr_array, k: int, *, seed: int = 0) -> Eigenbasis:
    """Compute the k smallest eigenpairs of L phi = lambda M phi, ascending, with L positive semidefinite.

    The columns are orthonormal in M, and in each one the entry of largest magnitude is positive. Every connected
    component on which the constants are annihilated brings one eigenvalue that is exactly zero.

    Parameters
    ----------
    L : (n, n) sparse array
        The weak Laplacian, symmetric positive semidefinite.
    M : (n, n) sparse array
        The mass matrix, symmetric positive definite.
    k : int
        How many modes, 1 .. n.
    seed : int
        Seed of the random start vectors.

    Returns
    -------
    Eigenbasis
        `evals` (k,), `evecs` (n, k) pointwise, and `M`.

    Raises
    ------
    TypeError
        If a matrix is not real, or k is not an integer.
    ValueError
        If a matrix is not symmetric, or k is not between 1 and n.

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=3)
    >>> gram = basis.evecs.T @ basis.M @ basis.evecs
    >>> bool(abs(gram - np.eye(3)).max() < 1e-12)
    True
    """
    L = as_symmetric("L", L)
    n = L.shape[0]
    M = as_symmetric("M", M, n)
    k = as_count("k", k, 1, n)
    Z = _zero_modes(L, M)
    Z = Z[:, : min(k, Z.shape[1])]
    X = _smallest(L, M, k, seed)
    X -= Z @ (Z.T @ (M @ X))
    X = np.column_stack([Z, X[:, Z.shape[1] :]])
    R = scipy.linalg.cholesky(X.T @ (M @ X))
    X = scipy.linalg.solve_triangular(R, X.T, trans="T").T
    evals = np.einsum("ij,ij->j", X, L @ X)
    evals[: Z.shape[1]] = 0.0
    return Eigenbasis(evals, _fix_signs(X), M)


def _smallest(L: sp.csr_array, M: sp.csr_array, k: int, seed: int) -> FloatArray:
    """The k smallest eigenvectors, (n, k)."""
    n = L.shape[0]
    if n < 500 or k > n // 5:
        _, X = scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[0, k - 1])
        return np.asarray(X)
    shift = -0.1 * 4 * np.pi / M.sum()
    start = np.random.default_rng(seed).standard_normal(n)
    _, X = eigsh(L.tocsc(), k, M.tocsc(), sigma=shift, v0=start)
    return np.asarray(X)


def _zero_modes(L: sp.csr_array, M: sp.csr_array) -> FloatArray:
    """The constants of the components that L annihilates, M-normalised, (n, number of them)."""
    pattern = L.copy()
    pattern.eliminate_zeros()
    count, labels = sp.csgraph.connected_components(pattern, directed=False)
    leak = abs(L.sum(axis=1)) > 64 * np.finfo(float).eps * abs(L).sum(axis=1)
    closed = np.setdiff1d(np.arange(count), labels[leak])
    Z = (labels[:, None] == closed[None, :]).astype(np.float64)
    return np.asarray(Z / np.sqrt(np.einsum("ij,ij->j", Z, M @ Z)))


def _fix_signs(X: FloatArray) -> FloatArray:
    """X with columns turned so that the first of their entries of largest magnitude is positive."""
    size = abs(X)
    first = np.argmax(size >= (1 - SIGN_TIE) * size.max(axis=0), axis=0)
    return X * np.sign(X[first, np.arange(X.shape[1])])
