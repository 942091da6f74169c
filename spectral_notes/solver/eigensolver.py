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
from itertools import count

import numpy as np
import psutil
import scipy.linalg
import scipy.sparse as sp
from scipy.linalg.blas import dtrsm

from spectral_notes._checks import Failure, FloatArray, IntArray
from spectral_notes.solver.factorization import Solve, count_below, factorize
from spectral_notes.solver.lanczos import Watch, block_lanczos, gram

DENSE_BELOW = 400  # samples below which LAPACK's dense solver is faster
DENSE_SHARE = 4  # so it is when more than one mode in four is wanted
EPS = float(np.finfo(np.float64).eps)
SHIFT = 0.1  # of the largest wanted eigenvalue
CLOSED = 64 * EPS  # a row of L sums to zero up to this part of its entries
SMALLEST_BAND = 32  # modes, however little memory is free


@dataclass(frozen=True, eq=False)
class Problem:
    """Hold L phi = lambda M phi as A y = lambda B y with y = phi / scale; B is None, the identity, for a lumped M."""

    A: sp.csr_array
    B: sp.csr_array | None
    scale: FloatArray  # (n, 1)
    zero: FloatArray  # (n, c), c <= k, the modes that are known, orthonormal in B

    @property
    def spacing(self) -> float:
        """Weyl's mean distance of eigenvalues on a surface of this area."""
        area = float((self.scale**-2.0).sum()) if self.B is None else float(self.B.sum())
        return 4.0 * np.pi / area


def pose(L: sp.csr_array, M: sp.csr_array, k: int) -> Problem:
    """Return the problem in the form that is solved, with an exact zero mode for each closed component, k at most."""
    mass = M.diagonal()
    if mass.min() <= 0:
        vertex = int(np.argmin(mass))
        raise ValueError(
            f"M must be positive definite; its diagonal holds {mass[vertex]:.3g} at {vertex}: "
            "is it a vertex that no face uses (clean_mesh removes it)?"
        )
    lumped = sp.csr_array(sp.diags_array(mass))
    zero = zero_modes(closed_components(L), M, k)
    if abs(M - lumped).nnz:
        return Problem(L, M, np.ones((len(mass), 1)), zero)
    scale = 1.0 / np.sqrt(mass)[:, None]
    zero /= scale
    return Problem(sp.csr_array(L.multiply(scale).multiply(scale.T)), None, scale, zero)


def solve(
    problem: Problem, k: int, *, tol: float, seed: int, factor: str, max_bytes: float | None, watch: Watch | None
) -> tuple[FloatArray, Solve | None]:
    """Compute the modes phi of the k smallest eigenvalues, (n, k), M-orthonormal, the exact zero modes first.

    The factor that was used is returned too, for `measure`; None if there was none.
    """
    n, c = problem.zero.shape
    again: Solve | None = None
    free = float(psutil.virtual_memory().available)
    budget = free / 2 if max_bytes is None else max_bytes
    if 8 * n * k > free:
        raise MemoryError(
            f"{k} modes of {n} samples take {8 * n * k / 1e9:.1f} GB and {free / 1e9:.1f} GB are free: "
            "ask for fewer modes, or spread them over machines with python -m spectral_notes.command.distributed"
        )
    if c == k:
        vectors = problem.zero.copy(order="F")
    elif n < DENSE_BELOW or (DENSE_SHARE * k > n and 24.0 * n * n < budget):
        vectors = _dense(problem, k)
    else:
        vectors, again = _iterate(problem, k, tol, seed, factor, budget, watch)
    vectors *= problem.scale
    return vectors, again


def memory_needed(n: int, k: int, zero: int = 1) -> float:
    """Return the bytes that the basis of block Lanczos is expected to take: about three columns a mode.

    Examples
    --------
    >>> memory_needed(1_000_000, 100) / 1e9
    3.024
    """
    return 8.0 * n * (zero + 3 * max(k - zero, 0) + 20 * _block_size(k))


def measure(
    problem: Problem, L: sp.csr_array, M: sp.csr_array, evecs: FloatArray, tol: float, again: Solve | None = None
) -> tuple[FloatArray, FloatArray, int]:
    """Return eigenvalues, ascending, and residuals of M-normalised modes, and how many are zero; order the columns.

    At a sliver L is huge, and the last digit of a mode shows in its residual. One more solve takes that away, where the
    factor is given and the residuals ask for it. Where no zero mode is known, those that rounding hides count.
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
        raise Failure(f"a mode has the residual {errors.max():.2g}, more than {allowed:.2g}: try $robust")
    c = problem.zero.shape[1]
    if c:
        _read_off_differences(L, evecs, evals, c + np.flatnonzero(evals[c:] <= rounding))
    np.maximum(evals, 0.0, out=evals)
    if (np.diff(evals) < 0).any():
        order = np.argsort(evals, kind="stable")
        evals, errors = evals[order], errors[order]
        for start in range(0, len(evecs), 8192):
            evecs[start : start + 8192] = evecs[start : start + 8192, order]
    return evals, errors, c or int(np.count_nonzero(evals <= rounding))


def _read_off_differences(L: sp.csr_array, evecs: FloatArray, evals: FloatArray, modes: IntArray) -> None:
    """Write the Rayleigh quotients of some modes anew, without cancellation: sum of -L_ij (x_i - x_j)^2 and the rest.

    So a weak link between two parts has its own small eigenvalue, not the rounding of a large one.
    """
    if len(modes):
        upper, rest = sp.coo_array(sp.triu(L, 1)), np.asarray(L.sum(axis=1))
        rest[abs(rest) <= CLOSED * np.asarray(abs(L).sum(axis=1))] = 0.0
        for mode in modes:
            x = evecs[:, mode]
            evals[mode] = rest @ x**2 - upper.data @ (x[upper.row] - x[upper.col]) ** 2


def _residuals(problem: Problem, L: sp.csr_array, M: sp.csr_array, evecs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rayleigh quotients, exactly zero for the zero modes, and norms of L X - lambda M X."""
    k = evecs.shape[1]
    mass = M.diagonal()[:, None]
    evals, errors = np.zeros(k), np.zeros(k)
    for start in range(0, k, 16):
        part = slice(start, start + 16)
        X = np.ascontiguousarray(evecs[:, part])
        gap = np.asarray(L @ X)
        evals[part] = np.einsum("ij,ij->j", X, gap)
        evals[: problem.zero.shape[1]] = 0.0
        gap -= (mass * X if problem.B is None else np.asarray(M @ X)) * evals[part]
        errors[part] = np.sqrt((gap * gap / mass).sum(axis=0))
    return evals, errors


def _solve_again(problem: Problem, evecs: FloatArray, again: Solve) -> None:
    """Apply the operator once more to the modes beside the zero modes, in place, and make them orthonormal again."""
    Z, B = problem.zero, problem.B
    Y = evecs[:, Z.shape[1] :]
    Y /= problem.scale
    for start in range(0, Y.shape[1], 16):
        part = slice(start, start + 16)
        Y[:, part] = again(Y[:, part] if B is None else np.asarray(B @ Y[:, part]))
        Y[:, part] -= Z @ (Z.T @ (Y[:, part] if B is None else np.asarray(B @ Y[:, part])))
    dtrsm(1.0, scipy.linalg.cholesky(gram(Y, B)), Y, side=1, overwrite_b=1)
    Y *= problem.scale


def certify(L: sp.csr_array, M: sp.csr_array, evals: FloatArray, errors: FloatArray) -> None:
    """Prove that no eigenvalue below the last group of `evals` is missing, by Sylvester's law of inertia.

    Eigenvalues come within their residual of the computed ones, so a value in a gap that is wider than the residuals
    on both sides has as many eigenvalues below it as modes were computed below it, or some were missed.
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
def progress_bar(shown: bool) -> Iterator[Watch]:
    """Give the function that moves a bar."""
    from tqdm import tqdm

    with tqdm(unit="column", desc="block Lanczos", disable=not shown) as bar:

        def watch(done: int, needed: int) -> None:
            bar.total = max(done, needed)
            bar.update(done - bar.n)

        yield watch


def _iterate(
    problem: Problem, k: int, tol: float, seed: int, factor: str, budget: float, watch: Watch | None
) -> tuple[FloatArray, Solve]:
    """The modes by block Lanczos on one factor, a band at a time, and that factor.

    All modes are one band where memory allows; else each band is sought beside the modes that are there. Two guesses
    are tested on the result. The shift must be small beside the largest wanted eigenvalue, as Weyl's law promises on
    surfaces and not on curves. And a block finds at most as many copies of an eigenvalue as it has columns: where it
    may have missed some, and after bands, more modes are sought until none comes before the last.
    """
    n, c = problem.zero.shape
    block = _block_size(k)
    most = budget / (8.0 * n) - k - 20 * block
    band = min(k - c, max(int(most / 2), SMALLEST_BAND))
    columns = np.empty((min((c + 6 * band if band == k - c else k + 2 * band) + 12 * block, n), n))
    columns[:c] = problem.zero.T
    shift, solver = SHIFT * k * problem.spacing, None
    values = np.full(c, 1.0 / shift)
    B = sp.eye_array(n, format="csr") if problem.B is None else problem.B
    while len(values) < k:
        solver = solver or factorize(sp.csr_array(problem.A + shift * B), factor=factor)
        share = min(len(values) + band, k) / k
        found = block_lanczos(
            solver, columns, values, min(band, k - len(values)), M=problem.B, block=block, tol=tol, watch=watch,
            seed=seed + len(values), enough=1.0 / (shift + share * shift), doubt=0.0 if len(values) == c else tol,
        )
        largest = (1.0 / float(found[-1]) - shift) / share
        if len(values) == c and EPS * float(problem.A.diagonal().max()) < largest < shift:
            shift, solver = SHIFT * largest, None
            values = np.full(c, 1.0 / shift)
        else:
            values = np.concatenate([values, found])
    assert solver is not None
    if band < k - c or _widest_cluster(values[c:], 100 * tol) >= block:
        _complete(problem, solver, columns, values, block, tol, seed)
    columns.resize((k, n), refcheck=False)  # gives the memory back
    return columns.T, solver


def _complete(
    problem: Problem, solver: Solve, columns: FloatArray, values: FloatArray, block: int, tol: float, seed: int
) -> None:
    """Seek more modes beside those in `columns`, and let them take the place of larger ones, until none does."""
    k, c = len(values), problem.zero.shape[1]
    for turn in count(1):  # another seed each time: what one start block missed it would miss again
        wanted = min(turn, 4) * block
        more = block_lanczos(
            solver, columns, values, wanted, M=problem.B, block=wanted, tol=tol, seed=seed + k + turn, doubt=tol
        )
        last = c + np.argsort(values[c:], kind="stable")[:wanted]  # the largest eigenvalues, the last one first
        new = [i for i, place in enumerate(last) if more[i] > values[place] * (1.0 + 10 * tol)]
        for i in new:
            values[last[i]], columns[last[i]] = more[i], columns[k + i]
        if len(new) < len(last):
            return


def _block_size(k: int) -> int:
    """Columns a step: wide blocks multiply faster, narrow ones converge in fewer solves."""
    return 4 if k < 300 else 8


def _widest_cluster(values: FloatArray, tol: float) -> int:
    """The largest number of neighbours that are equal to a relative tol."""
    breaks = np.flatnonzero(abs(np.diff(values)) > tol * abs(values[1:]))
    return int(np.diff(np.concatenate([[-1], breaks, [len(values) - 1]])).max())


def _dense(problem: Problem, k: int) -> FloatArray:
    """The modes by LAPACK, with the eigenvalue of the zero modes, which are known, moved past all others."""
    Z, n = problem.zero, len(problem.scale)
    B = np.eye(n) if problem.B is None else problem.B.toarray()
    A = problem.A.toarray()
    MZ = B @ Z
    A += 10.0 * float((abs(A).sum(axis=1) / B.diagonal()).max()) * MZ @ MZ.T
    try:
        _, Y = scipy.linalg.eigh(A, None if problem.B is None else B, subset_by_index=[0, k - 1 - Z.shape[1]])
    except np.linalg.LinAlgError as error:
        raise ValueError(f"M must be positive definite: {error}") from None
    Y = np.asfortranarray(np.concatenate([Z, Y], axis=1))
    return np.asarray(dtrsm(1.0, scipy.linalg.cholesky(gram(Y, problem.B)), Y, side=1))


def closed_components(L: sp.csr_array) -> IntArray:
    """Number the components on which L annihilates the constants: a number a sample, -1 on the other components."""
    pattern = L.copy()
    pattern.eliminate_zeros()
    parts, labels = sp.csgraph.connected_components(pattern, directed=False)
    closed = np.ones(parts, dtype=bool)
    closed[labels[abs(L.sum(axis=1)) > CLOSED * abs(L).sum(axis=1)]] = False
    return np.asarray(np.where(closed, np.cumsum(closed) - 1, -1)[labels], dtype=np.int64)


def zero_modes(component: IntArray, M: sp.csr_array, k: int) -> FloatArray:
    """The constants of the first k closed components, M-normalised: (n, k), or fewer columns if there are fewer."""
    Z = np.zeros((len(component), min(int(component.max()) + 1, k)), order="F")
    inside = np.flatnonzero((component >= 0) & (component < k))
    Z[inside, component[inside]] = 1.0
    Z /= np.sqrt(np.bincount(component[inside], weights=(M.sum(axis=0))[inside], minlength=Z.shape[1]))
    return Z
