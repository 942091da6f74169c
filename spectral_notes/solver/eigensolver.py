"""From (L, M) and k to the smallest eigenpairs: which method, at what cost, and how good the result is.

The wanted end of the spectrum is turned into the largest eigenvalues of (L + s M)^-1, which block Lanczos finds in a
few dozen steps. The shift s is a tenth of the largest wanted eigenvalue, 4 pi k / area by Weyl's law. It makes L + s M
positive definite in any unit, is small beside the eigenvalues that converge last, and keeps the wanted eigenvalues of
the inverse within a factor of eleven: the larger that factor, the sooner block Lanczos loses orthogonality.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import psutil
import scipy.linalg
import scipy.sparse as sp
from scipy.linalg.blas import dtrsm

from spectral_notes._checks import Failure, FloatArray
from spectral_notes.solver.factorization import Solve, count_below, factorize
from spectral_notes.solver.lanczos import Watch, block_lanczos, gram
from spectral_notes.solver.slicing import slice_spectrum

DENSE_BELOW = 400  # samples below which LAPACK's dense solver is faster
DENSE_SHARE = 4  # so it is when more than one mode in four is wanted
EPS = float(np.finfo(np.float64).eps)
SHIFT = 0.1  # of the largest wanted eigenvalue


@dataclass(frozen=True, eq=False)
class Problem:
    """Hold L phi = lambda M phi in the form that is solved: A y = lambda B y with y = phi / scale.

    A lumped M is taken into A, and B is then None, the identity. `zero` (n, c) holds the modes that are known.
    """

    A: sp.csr_array
    B: sp.csr_array | None
    scale: FloatArray  # (n, 1)
    zero: FloatArray  # (n, c), orthonormal in B

    @property
    def spacing(self) -> float:
        """Weyl's mean distance of eigenvalues on a surface of this area."""
        area = float((self.scale**-2.0).sum()) if self.B is None else float(self.B.sum())
        return 4.0 * np.pi / area

    def shifted(self, shift: float) -> sp.csr_array:
        """A + shift B."""
        B = sp.eye_array(self.A.shape[0], format="csr") if self.B is None else self.B
        return sp.csr_array(self.A + shift * B)


def pose(L: sp.csr_array, M: sp.csr_array) -> Problem:
    """Return the problem in the form that is solved, with one exact zero mode for each closed component.

    Raises
    ------
    ValueError
        If M has an entry on its diagonal that is not positive.
    """
    mass = M.diagonal()
    if mass.min() <= 0:
        vertex = int(np.argmin(mass))
        raise ValueError(
            f"M must be positive definite; its diagonal holds {mass[vertex]:.3g} at {vertex}: "
            "is it a vertex that no face uses (clean_mesh removes it)?"
        )
    lumped = sp.csr_array(sp.diags_array(mass))
    if abs(M - lumped).nnz:
        scale = np.ones((len(mass), 1))
        return Problem(L, M, scale, _zero_modes(L, M, scale))
    scale = 1.0 / np.sqrt(mass)[:, None]
    A = sp.csr_array(L.multiply(scale).multiply(scale.T))
    return Problem(A, None, scale, _zero_modes(L, M, scale))


def solve(
    problem: Problem, k: int, *, tol: float, seed: int, factor: str, max_bytes: float | None, watch: Watch | None
) -> tuple[FloatArray, Solve | None]:
    """Compute the modes phi of the k smallest eigenvalues, (n, k), M-orthonormal, the exact zero modes first.

    The factor that was used is returned too, for `measure`; None if there was none.
    """
    n, c = problem.zero.shape
    again: Solve | None = None
    free = float(psutil.virtual_memory().available)
    needed = memory_needed(n, k, c)
    if 8 * n * k > free:
        raise MemoryError(
            f"{k} modes of {n} samples take {8 * n * k / 1e9:.1f} GB and {free / 1e9:.1f} GB are free: "
            "ask for fewer modes, or spread them over machines with python -m spectral_notes.command.distributed"
        )
    if c >= k:
        vectors = problem.zero[:, :k].copy()
    elif n < DENSE_BELOW or DENSE_SHARE * k > n:
        vectors = _dense(problem, k)
    elif needed > (free / 2 if max_bytes is None else max_bytes):
        B = sp.eye_array(n, format="csr") if problem.B is None else problem.B
        vectors = slice_spectrum(problem.A, B, problem.zero, k, problem.spacing, tol=tol, seed=seed, watch=watch)
    else:
        vectors, again = _iterate(problem, k, tol, seed, factor, watch)
    vectors *= problem.scale
    return vectors, again


def memory_needed(n: int, k: int, zero: int = 1) -> float:
    """Return the bytes that the basis of block Lanczos is expected to take: about three columns a mode.

    Examples
    --------
    >>> memory_needed(1_000_000, 100) / 1e9
    3.024
    """
    block = _block_size(k)
    return 8.0 * n * (zero + 3 * max(k - zero, 0) + 20 * block)


def measure(
    problem: Problem, L: sp.csr_array, M: sp.csr_array, evecs: FloatArray, tol: float, again: Solve | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return the Rayleigh quotients of M-normalised modes, ascending, and residuals; put the columns in order.

    At a sliver L is huge, and the last digit of a mode shows in its residual. One more solve takes that away, where the
    factor is given and the residuals ask for it.

    Raises
    ------
    ValueError
        If an eigenvalue is negative beyond rounding.
    ArithmeticError
        If a residual is larger than asked for and than rounding explains.
    """
    evals, errors = _residuals(problem, L, M, evecs)
    if again is not None and errors.max() > tol * evals.max():
        _solve_again(problem, evecs, again)
        evals, errors = _residuals(problem, L, M, evecs)
    rounding = 100 * EPS * float((L.diagonal() / M.diagonal()).max())
    if evals.min() < -rounding:
        raise ValueError(f"L must be positive semidefinite; it has the eigenvalue {evals.min():.3g}")
    allowed = 100 * tol * evals.max() + rounding
    if errors.max() > allowed:
        raise Failure(
            f"a mode has the residual {errors.max():.2g}, more than {allowed:.2g}: try $robust"
        )
    if (np.diff(evals) < 0).any():
        order = np.argsort(evals, kind="stable")
        evals, errors = evals[order], errors[order]
        for start in range(0, len(evecs), 8192):
            evecs[start : start + 8192] = evecs[start : start + 8192, order]
    return evals, errors


def _residuals(problem: Problem, L: sp.csr_array, M: sp.csr_array, evecs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rayleigh quotients, exactly zero for the zero modes, and norms of L X - lambda M X."""
    k = evecs.shape[1]
    evals, errors = np.zeros(k), np.zeros(k)
    for start in range(0, k, 16):
        part = slice(start, start + 16)
        X = evecs[:, part]
        gap, MX = np.asarray(L @ X), np.asarray(M @ X)
        evals[part] = np.einsum("ij,ij->j", X, gap)
        evals[: problem.zero.shape[1]] = 0.0
        gap -= MX * evals[part]
        errors[part] = np.sqrt(np.einsum("ij,ij,i->j", gap, gap, 1.0 / M.diagonal()))
    return evals, errors


def _solve_again(problem: Problem, evecs: FloatArray, again: Solve) -> None:
    """Apply the operator once more to the modes beside the zero modes, in place, and make them orthonormal again."""
    c = problem.zero.shape[1]
    Y = evecs[:, c:] / problem.scale
    Y = np.asfortranarray(again(Y if problem.B is None else np.asarray(problem.B @ Y)))
    Y -= problem.zero @ (problem.zero.T @ (Y if problem.B is None else np.asarray(problem.B @ Y)))
    R = scipy.linalg.cholesky(gram(Y, problem.B))
    evecs[:, c:] = dtrsm(1.0, R, Y, side=1, overwrite_b=1) * problem.scale


def certify(L: sp.csr_array, M: sp.csr_array, evals: FloatArray, errors: FloatArray) -> None:
    """Prove that no eigenvalue below the last group of `evals` is missing, by Sylvester's law of inertia.

    Eigenvalues come within their residual of the computed ones, so a value in a gap that is wider than the residuals
    on both sides has as many eigenvalues below it as modes were computed below it, or some were missed.

    Raises
    ------
    ArithmeticError
        If the count differs, or there is no gap to count in.
    """
    gaps = np.diff(evals)
    wide = np.flatnonzero(gaps > 10 * (errors[1:] + errors[:-1]) + 1e-7 * abs(evals[1:]))
    for last in wide[::-1][:5]:
        for share in (0.5, 0.3, 0.7):
            try:
                below = count_below(L, M, float(evals[last] + share * gaps[last]))
            except ArithmeticError:
                continue
            if below != last + 1:
                raise ArithmeticError(
                    f"{last + 1} modes were computed where {below} exist: use another seed or a smaller tol"
                )
            return
    raise ArithmeticError("no gap between the eigenvalues is wide enough to count in: ask for more modes")


@contextmanager
def progress_bar(shown: bool) -> Iterator[Watch | None]:
    """Give the function that moves a bar, or None."""
    if not shown:
        yield None
        return
    from tqdm import tqdm

    with tqdm(unit="column", desc="block Lanczos") as bar:

        def watch(done: int, needed: int) -> None:
            bar.total = max(done, needed)
            bar.update(done - bar.n)

        yield watch


def _iterate(
    problem: Problem, k: int, tol: float, seed: int, factor: str, watch: Watch | None
) -> tuple[FloatArray, Solve]:
    """The modes by block Lanczos on one factor, and that factor.

    Two guesses are tested on the result. The block must be wider than any eigenvalue is multiple, or copies are missed.
    The shift must be small beside the largest wanted eigenvalue, as Weyl's law promises on surfaces and not on curves.
    """
    n, c = problem.zero.shape
    shift, solver = SHIFT * k * problem.spacing, None
    block = _block_size(k)
    while True:
        solver = solver or factorize(problem.shifted(shift), factor=factor)
        values, vectors = block_lanczos(
            solver, problem.zero, np.full(c, 1.0 / shift), k - c, M=problem.B,
            capacity=min(c + 6 * (k - c) + 10 * block, n - block), block=block, tol=tol, seed=seed, watch=watch,
            enough=0.5 / shift,
        )
        largest = 1.0 / float(values[-1]) - shift
        if EPS * float(problem.A.diagonal().max()) < largest < shift:
            shift, solver = SHIFT * largest, None
        elif block < k and _widest_cluster(values, 100 * tol) >= block:
            block *= 2
        else:
            return vectors, solver


def _block_size(k: int) -> int:
    """Columns a step: wide blocks multiply faster, narrow ones converge in fewer solves."""
    return 4 if k < 300 else 8


def _widest_cluster(values: FloatArray, tol: float) -> int:
    """The largest number of neighbours that are equal to a relative tol."""
    breaks = np.flatnonzero(abs(np.diff(values)) > tol * abs(values[1:]))
    return int(np.diff(np.concatenate([[-1], breaks, [len(values) - 1]])).max())


def _dense(problem: Problem, k: int) -> FloatArray:
    """The modes by LAPACK, on the orthogonal complement of the zero modes."""
    Z = problem.zero
    c = Z.shape[1]
    B = None if problem.B is None else problem.B.toarray()
    try:
        _, Y = scipy.linalg.eigh(problem.A.toarray(), B, subset_by_index=[0, k - 1])
    except np.linalg.LinAlgError as error:
        raise ValueError(f"M must be positive definite: {error}") from None
    Y[:, :c] = Z
    MY = Y if B is None else B @ Y
    Y[:, c:] -= Z @ (MY[:, :c].T @ Y[:, c:])
    R = scipy.linalg.cholesky(gram(Y, problem.B))
    return np.asarray(scipy.linalg.solve_triangular(R, Y.T, trans="T").T)


def _zero_modes(L: sp.csr_array, M: sp.csr_array, scale: FloatArray) -> FloatArray:
    """The constants of the components on which L annihilates them, M-normalised, divided by the scale: (n, c)."""
    pattern = L.copy()
    pattern.eliminate_zeros()
    count, labels = sp.csgraph.connected_components(pattern, directed=False)
    leak = abs(L.sum(axis=1)) > 64 * EPS * abs(L).sum(axis=1)
    closed = np.setdiff1d(np.arange(count), labels[leak])
    Z = np.asfortranarray(labels[:, None] == closed[None, :], dtype=np.float64)
    return np.asarray(Z / np.sqrt(np.einsum("ij,ij->j", Z, M @ Z)) / scale)
