"""One sparse factorization, used many times: solves with a positive definite matrix, and inertia.

The factor costs as much as a hundred solves, so the eigenbasis engine makes one and keeps it. CHOLMOD (through the
package cholespy, wherever it has a wheel) is used when it is installed; else SuperLU, which comes with SciPy, runs
without row exchanges.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU, splu

from spectral_notes._checks import FloatArray, as_choice

Solve = Callable[[FloatArray], FloatArray]

FACTORS = ("auto", "cholespy", "superlu")
INDEFINITE = (
    "L must be positive semidefinite; it has a negative eigenvalue: is its sign that of libigl (turn it), "
    "or does the mesh have broken triangles (robust_mesh_laplacian)?"
)
RHS_AT_A_TIME = 8  # CHOLMOD's simplicial solve is fastest with eight right-hand sides: more leave the cache


def factorize(A: sp.csr_array, *, factor: str = "auto") -> Solve:
    """Return the function that solves A X = B, (n, q), for a symmetric positive definite A; "auto" prefers cholespy.

    Sources: Chen, Davis, Hager and Rajamanickam, "Algorithm 887: CHOLMOD" (2008); Li, "An overview of SuperLU" (2005).

    >>> solve = factorize(sp.csr_array([[2.0, -1.0], [-1.0, 2.0]]), factor="superlu")
    >>> solve(np.array([[1.0], [1.0]])).ravel().round(12).tolist()
    [1.0, 1.0]
    """
    factor = as_choice("factor", factor, FACTORS)
    installed = importlib.util.find_spec("cholespy") is not None
    if factor == "cholespy" and not installed:
        raise ModuleNotFoundError("factor='cholespy' needs the package cholespy: pip install cholespy")
    return _cholmod(A) if installed and factor != "superlu" else _superlu(A)


def factor_in_use() -> str:
    """Return which library factors by default, and in which version.

    Examples
    --------
    >>> factor_in_use().split()[0] in ("CHOLMOD", "SuperLU")
    True
    """
    if importlib.util.find_spec("cholespy") is None:
        return f"SuperLU (SciPy {importlib.metadata.version('scipy')})"
    return f"CHOLMOD (cholespy {importlib.metadata.version('cholespy')})"


def symmetric_lu(A: sp.csr_array) -> SuperLU:
    """Factor a symmetric matrix, definite or not, without row exchanges: P A P^T = L D L^T with U = D L^T.

    The order of the rows is chosen once, for few nonzeros, and the same for the columns; so the signs on the
    diagonal of U are the signs of the eigenvalues of A (Sylvester's law of inertia). A pivot that is zero, or so small
    that rows had to be exchanged, is an ArithmeticError.
    """
    try:
        # relax=1: SuperLU's wish to join columns into wider ones, ten at a time, stores seven times what is needed,
        # on subdivided meshes, because it does not sort the elimination tree in symmetric mode.
        lu = splu(
            sp.csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, relax=1, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        raise ArithmeticError(f"the shifted matrix cannot be factored ({error}): move the shift") from None
    if (lu.perm_r != lu.perm_c).any():
        raise ArithmeticError("the shifted matrix has a zero pivot: move the shift")
    return lu


def count_below(L: sp.csr_array, M: sp.csr_array, value: float) -> int:
    """Count the eigenvalues of L phi = lambda M phi below a value, without computing any: the inertia of L - value M.

    Sylvester's law of inertia: Parlett, *The Symmetric Eigenvalue Problem* (1998), section 3.3.

    Parameters
    ----------
    L, M : (n, n) sparse, symmetric, M positive definite
    value : in units of the eigenvalues

    Raises
    ------
    ArithmeticError
        If `value` is an eigenvalue to working precision.

    Examples
    --------
    >>> count_below(sp.csr_array(np.diag([0.0, 1.0, 4.0])), sp.eye_array(3, format="csr"), 2.0)
    2
    """
    A = sp.csr_array(L - value * M)
    lu = symmetric_lu(A)
    if not trustworthy(lu, A):
        raise ArithmeticError(f"{value:g} is too close to an eigenvalue to count from: move the shift")
    return int((lu.U.diagonal() < 0).sum())


def trustworthy(lu: SuperLU, A: sp.csr_array) -> bool:
    """Return whether a factor without row exchanges solves a system with A, as it does unless A is all but singular."""
    probe = np.sin(np.arange(1.0, A.shape[0] + 1))
    return bool(abs(A @ lu.solve(probe) - probe).max() < 1e-4)


def _cholmod(A: sp.csr_array) -> Solve:
    """Solves by CHOLMOD's Cholesky factor."""
    from cholespy import CholeskySolverD, MatrixType

    # Rows, not columns: cholespy re-allocates arrays it is given as columns, which belong to NumPy.
    rows, columns = A.indptr.astype(np.int32), A.indices.astype(np.int32)
    try:
        solver = CholeskySolverD(A.shape[0], rows, columns, A.data.copy(), MatrixType.CSR)
    except ValueError:
        raise ValueError(INDEFINITE) from None

    def solve(B: FloatArray) -> FloatArray:
        X = np.empty_like(B)
        for start in range(0, B.shape[1], RHS_AT_A_TIME):
            part = np.ascontiguousarray(B[:, start : start + RHS_AT_A_TIME])
            found = np.empty_like(part)
            solver.solve(part, found)
            X[:, start : start + RHS_AT_A_TIME] = found
        return X

    return solve


def _superlu(A: sp.csr_array) -> Solve:
    """Solves by SuperLU run as an L D L^T factorization."""
    try:
        lu = symmetric_lu(A)
    except ArithmeticError:
        raise ValueError(INDEFINITE) from None
    if lu.U.diagonal().min() <= 0:
        raise ValueError(INDEFINITE)

    def solve(B: FloatArray) -> FloatArray:
        return np.asarray(lu.solve(B))

    return solve
