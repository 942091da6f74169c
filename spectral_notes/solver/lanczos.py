"""Block Lanczos: the largest eigenpairs of a symmetric operator that is only known by what it does to vectors.

From a block of start vectors Q the operator makes op Q, op op Q, ...; the space they span holds the wanted eigenvectors
better with every step, and in an orthonormal basis V of it the operator is a small, block tridiagonal matrix
T = V^T M op V. Its eigenvectors Y give the operator's as X = V Y. Four things make it fast and safe:

- blocks: every product is matrix times matrix, so each vector is read from memory once for many uses;
- partial reorthogonalization: rounding spoils V^T M V = I slowly and by a law that T itself follows, so the loss is
  simulated on small matrices, and only when it nears 1e-9 is V cleaned;
- thick restart: when memory is full the best Ritz vectors are kept and everything else is dropped;
- purification: one step of op on every result, which costs no solve since the next block is already there.

Sources: Grimes, Lewis and Simon, "A shifted block Lanczos algorithm" (1994); Simon, "The Lanczos algorithm with
partial reorthogonalization" (1984); Wu and Simon, "Thick-restart Lanczos method" (2000).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.linalg.blas import dgemm, dtrsm

from spectral_notes._checks import FloatArray

Operator = Callable[[FloatArray], FloatArray]
Watch = Callable[[int, int], None]

EPS = float(np.finfo(np.float64).eps)
LOSS = 1e-9  # orthogonality that is kept; losing more than a hundred times this would show in the residuals
USUAL_DECAY = 20.0  # residuals shrink by about e^20 while the basis grows by k columns; only the first guess needs it
KEPT_LOSS = 1e-3 * LOSS  # cleaning leaves columns that lost less alone
ONCE = 1e-6  # of a larger loss one cleaning leaves more than KEPT_LOSS, its square
PIECE = 16  # columns that are cleaned or left together
SAFETY = 30.0  # how much larger than the loss that was found the simulation is held
WAIT = 16  # columns that the next check may wait for, where a quarter of the modes are fewer
GROUP = 128  # modes that are combined at a time
ROWS = 8192  # rows of V that are combined at a time, so that V Y can overwrite V


@dataclass(kw_only=True)
class Krylov:
    """Hold the Krylov space while it grows: op V = V T + Q B e_last^T, with V^T M V = I."""

    operator: Operator
    M: sp.csr_array | None  # None is the identity
    V: FloatArray  # (n, capacity + block), column-major; behind the columns in use waits the next block Q
    T: FloatArray  # (capacity + block, capacity + block)
    fixed: int  # leading columns that are exact eigenvectors
    block: int
    rng: np.random.Generator
    size: int  # columns of V in use
    arrow: int  # T couples the block that starts here with every earlier column (after a start or restart)
    loss: FloatArray  # (size, block), estimate of V^T M Q
    loss_before: FloatArray  # the same one step earlier
    doubt: float  # relative residual of the exact eigenvectors
    noise: float = 64 * EPS  # what one step adds to the loss

    @property
    def capacity(self) -> int:
        """How many columns fit."""
        return len(self.T) - self.block

    def mass(self, X: FloatArray) -> FloatArray:
        """M X."""
        return X if self.M is None else np.asarray(self.M @ X)


def block_lanczos(
    operator: Operator, columns: FloatArray, exact_values: FloatArray, k: int, *, block: int = 8,
    M: sp.csr_array | None = None, tol: float = 1e-9, seed: int = 0, watch: Watch | None = None,
    enough: float = np.inf, doubt: float = 0.0,
) -> FloatArray:
    """Compute the k eigenpairs of largest magnitude of an operator that is symmetric in the inner product of M.

    `columns` (rows, n) is the memory to work in, a vector a row. Its first rows hold eigenvectors that are known, with
    the `exact_values`, M-orthonormal, whose relative residual is `doubt`; the k found ones are written behind them. It
    needs c + k + 4 block rows at least, and restarts seldom with c + 3 k + 20 block. `enough` ends the search,
    converged or not, once all k values are known to be larger: Ritz values only grow. Returns the k values by
    descending magnitude; raises ArithmeticError after fifty restarts.

    >>> d, columns = np.arange(200.0), np.empty((80, 200))
    >>> block_lanczos(lambda B: d[:, None] * B, columns, np.zeros(0), 3).round(9).tolist()
    [199.0, 198.0, 197.0]
    """
    space = _start(operator, columns, exact_values, block, M, seed, doubt)
    history: list[tuple[int, float]] = []
    check, restarts = space.fixed + 5 * k // 2, 0
    while True:
        _extend(space)
        if watch is not None:
            watch(space.size, max(check, space.fixed + 3 * k))
        full = space.size + space.block > space.capacity
        if space.size < max(check, space.fixed + k) and not full:
            continue
        values, Y, residuals = _ritz(space, k)
        worst = float(residuals.max())
        if worst < tol or abs(values[k - 1]) > enough:
            _assemble(space, values[:k], Y[:, :k])
            return values[:k]
        history.append((space.size, worst))
        check = _next_check(history, tol, k)
        if full:
            restarts += 1
            if restarts > 50:
                raise ArithmeticError(
                    f"{int((residuals < tol).sum())} of {k} modes converged: allow more memory or a larger tol"
                )
            _restart(space, values, Y, k)
            history.clear()
            check = space.size + k


def _start(
    operator: Operator, columns: FloatArray, exact_values: FloatArray, block: int, M: sp.csr_array | None, seed: int,
    doubt: float,
) -> Krylov:
    """The space of the exact vectors, with a random block orthogonal to them in waiting."""
    c = len(exact_values)
    T = np.zeros((len(columns), len(columns)))
    T[range(c), range(c)] = exact_values
    space = Krylov(
        operator=operator, M=M, V=columns.T, T=T, fixed=c, block=block, rng=np.random.default_rng(seed),
        size=c, arrow=c, loss=np.zeros((c, block)), loss_before=np.zeros((0, block)), doubt=doubt,
    )
    W = np.asfortranarray(space.rng.standard_normal((columns.shape[1], block)))
    _project_out(space, c, W)
    Q, _ = _orthonormalize(space, W)
    _project_out(space, c, Q)
    space.V[:, c : c + block] = Q
    return space


def _extend(space: Krylov) -> None:
    """One step: apply op to the waiting block Q, take out what is known, and put the rest in waiting."""
    V, T, j, b = space.V, space.T, space.size, space.block
    now = slice(j, j + b)
    W = np.asfortranarray(space.operator(space.mass(V[:, now])))
    first = 0 if j == space.arrow else j - b  # op is symmetric: only the last two blocks can have a share in op Q
    T[first : j + b, now] = _project_out(space, j + b, W, first)
    if first == 0:
        T[: j + b, now] += _project_out(space, j + b, W)
    T[now, now] = (T[now, now] + T[now, now].T) / 2
    T[now, first:j] = T[first:j, now].T
    Q, B = _orthonormalize(space, W)
    loss = _simulated_loss(space, B, first)
    V[:, j + b : j + 2 * b] = Q
    T[j + b : j + 2 * b, now] = B
    space.size = j + b
    space.loss_before, space.loss = space.loss, loss
    estimate = float(_weighted_loss(space).max())
    if j and not estimate <= LOSS:
        _reorthogonalize(space, estimate)


def _simulated_loss(space: Krylov, B: FloatArray, first: int) -> FloatArray:
    """Estimate V^T M Q of the next block by the recurrence that V itself follows.

    From Q_next B = op Q - Q A - Q_before B_before^T + noise:
    loss_next B = T loss - loss A - loss_before B_before^T + noise.
    """
    T, j, b = space.T, space.size, space.block
    now = slice(j, j + b)
    loss = np.zeros((j + b, b))
    if first:
        loss[:j] = _times(space, space.loss) - space.loss @ T[now, now]
        loss[: j - b] -= space.loss_before @ T[j - b : j, now]
        loss[first:j] = 0.0  # these were taken out explicitly
    norms = abs(T.diagonal()[: j + b, None])  # of op on each column: rounding of Q, as op passes it on
    norms[: space.fixed] *= 1.0 + space.doubt / space.noise  # and what is left of op on an eigenvector, which is small
    loss += space.noise * norms * space.rng.standard_normal(loss.shape)
    return np.asarray(np.linalg.solve(B.T, loss.T).T)


def _weighted_loss(space: Krylov) -> FloatArray:
    """The loss of each column, (size,); in doubtful exact ones it counts less, as it is taken out at the end."""
    loss = np.asarray(abs(space.loss).max(axis=1))
    if space.doubt:
        loss[: space.fixed] *= 1e-3
    return loss


def _times(space: Krylov, X: FloatArray) -> FloatArray:
    """T X for the columns in use: T is block tridiagonal from the arrow on, and diagonal before it."""
    T, a, b = space.T, space.arrow, space.block
    parts = X[a:].reshape(-1, b, b)
    beside = _blocks(T, a + b, a, len(parts) - 1, b)
    below = _blocks(T, a, a, len(parts), b) @ parts
    below[1:] += beside @ parts[:-1]
    below[:-1] += beside.transpose(0, 2, 1) @ parts[1:]
    below[0] += T[a : a + b, :a] @ X[:a]
    above = T.diagonal()[:a, None] * X[:a] + T[:a, a : a + b] @ X[a : a + b]
    return np.concatenate([above, below.reshape(-1, b)])


def _blocks(T: FloatArray, row: int, column: int, count: int, b: int) -> FloatArray:
    """The b x b blocks of T from (row, column) down along the diagonal, as a view (count, b, b)."""
    stride = T.strides[0] + T.strides[1]
    return np.lib.stride_tricks.as_strided(T[row:, column:], (count, b, b), (b * stride, *T.strides))


def _reorthogonalize(space: Krylov, estimate: float) -> None:
    """Clean the last two blocks, which is enough for the recurrence to start afresh; learn from how much was lost.

    Only those parts of V are taken out that hold loss: early columns, where the converged modes are, and the latest.
    A step loses 3 LOSS |T| |B^-1| at most: much only where B is small, where it weighs little in op V = V T + Q B.
    """
    V, j, b = space.V, space.size, space.block
    Q, pair = V[:, j : j + b], V[:, j - b : j + b]
    parts = _lossy_parts(_weighted_loss(space)[: j - b])
    lost = max([0.0] + [abs(_project_out(space, part.stop, pair, part.start)[:, b:]).max() for part in parts])
    _project_out(space, j, Q, j - b)
    if max(lost, estimate) > ONCE:  # the block had little new in it: what was left was noise
        parts, fresh = [slice(0, j - b)], np.asfortranarray(Q)
        for _ in range(2):
            _project_out(space, j, fresh)
            fresh, R = _orthonormalize(space, fresh)
            space.T[j : j + b, j - b : j] = R @ space.T[j : j + b, j - b : j]
        V[:, j : j + b] = fresh
    if lost and estimate <= ONCE:
        space.noise = max(space.noise * float(np.clip(SAFETY * lost / estimate, 0.1, 100.0)), EPS)
    for part in [*parts, slice(j - b, j)]:
        space.loss[part] = space.noise * space.rng.standard_normal(space.loss[part].shape)
        space.loss_before[part] = space.noise * space.rng.standard_normal(space.loss_before[part].shape)


def _lossy_parts(loss: FloatArray) -> list[slice]:
    """The runs of columns, in pieces of PIECE, in which the loss is worth cleaning."""
    starts = np.arange(0, len(loss), PIECE)
    lossy = np.maximum.reduceat(loss, starts) > KEPT_LOSS if len(loss) else np.zeros(0, dtype=bool)
    edges = np.flatnonzero(np.diff(lossy, prepend=False, append=False)) * PIECE
    return [slice(int(start), min(int(stop), len(loss))) for start, stop in edges.reshape(-1, 2)]


def _project_out(space: Krylov, stop: int, W: FloatArray, first: int = 0) -> FloatArray:
    """Subtract from W, in place, its part in the columns first .. stop - 1 of V; return the coefficients."""
    U = space.V[:, first:stop]
    if first == stop:
        return np.zeros((0, W.shape[1]))
    H = (space.mass(W).T @ U).T  # four times faster than SciPy's dgemm(U, W, trans_a=1) on tall, narrow W
    dgemm(-1.0, U, H, 1.0, W, overwrite_c=1)
    return H


def _orthonormalize(space: Krylov, W: FloatArray) -> tuple[FloatArray, FloatArray]:
    """W = Q B with Q^T M Q = I, by the eigenvectors of the Gram matrix: only matrix products touch the long side."""
    B = np.eye(W.shape[1])
    for _ in range(3):
        squares, U = np.linalg.eigh(W.T @ space.mass(W))
        if squares[-1] == 0.0:
            fresh, _ = _orthonormalize(space, np.asfortranarray(space.rng.standard_normal(W.shape)))
            return fresh, np.finfo(np.float64).tiny * B
        lengths = np.sqrt(np.maximum(squares, EPS**2 * squares[-1]))
        W = W @ (U / lengths)
        B = (lengths[:, None] * U.T) @ B
        if squares[0] > 1e-4 * squares[-1]:
            break
    return np.asfortranarray(W), B


def _ritz(space: Krylov, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The k largest Ritz values, their vectors in V's coordinates, and their relative residuals."""
    c, j, b = space.fixed, space.size, space.block
    T = np.tril(space.T[c:j, c:j])
    values, Y = scipy.linalg.eigh(T, lower=True, driver="evd", overwrite_a=True, check_finite=False)
    order = np.argsort(-abs(values), kind="stable")
    values, Y = values[order], Y[:, order]
    B = space.T[j : j + b, j - b : j]
    with np.errstate(divide="ignore", invalid="ignore"):
        residuals = np.linalg.norm(B @ Y[-b:, :k], axis=0) / abs(values[:k])
    return values, Y, residuals


def _next_check(history: list[tuple[int, float]], tol: float, k: int) -> int:
    """The size at which the worst residual should pass tol, from the slope between the last two checks."""
    size, worst = history[-1]
    decay = USUAL_DECAY / k
    if len(history) > 1:
        before, worse = history[-2]
        decay = max(float(np.log(worse / worst)) / (size - before), 0.0)
    return size + min(max(int(np.log(worst / tol) / max(decay, EPS)), 1), max(k // 4, WAIT))


def _restart(space: Krylov, values: FloatArray, Y: FloatArray, k: int) -> None:
    """Keep the best Ritz vectors, coupled by an arrow of T to the waiting block, and drop the rest."""
    c, j, b = space.fixed, space.size, space.block
    kept = min(k + (len(values) - k) // 2, len(values) - 2 * b)
    _combine(space, Y[:, :kept], np.zeros((b, kept)))
    space.V[:, c + kept : c + kept + b] = space.V[:, j : j + b]
    space.T[c:, c:] = 0.0
    space.T[range(c, c + kept), range(c, c + kept)] = values[:kept]
    space.size = space.arrow = c + kept
    Q = space.V[:, space.size : space.size + b]
    _project_out(space, space.size, Q)
    space.loss = np.zeros((space.size, b))
    space.loss_before = np.zeros((space.size - b, b))


def _assemble(space: Krylov, values: FloatArray, Y: FloatArray) -> None:
    """Write the purified Ritz vectors op X / value behind the exact ones, M-orthonormal."""
    c, j, b = space.fixed, space.size, space.block
    _combine(space, Y, space.T[j : j + b, j - b : j] @ Y[-b:] / values)
    found = space.V[:, c : c + len(values)]
    _project_out(space, c, found)
    R = scipy.linalg.cholesky(gram(found, space.M))
    dtrsm(1.0, R, found, side=1, overwrite_b=1)


def gram(X: FloatArray, M: sp.csr_array | None) -> FloatArray:
    """Return the upper half of X^T M X, of column-major X, at half the cost of the whole, and zeros below."""
    G = np.zeros((X.shape[1], X.shape[1]))
    for start in range(0, len(G), GROUP):
        part = X[:, start : start + GROUP]
        stop = start + part.shape[1]
        G[:stop, start:stop] = X[:, :stop].T @ (part if M is None else np.asarray(M @ part))
    return np.triu(G)


def _combine(space: Krylov, Y: FloatArray, C: FloatArray) -> None:
    """Overwrite the columns after the fixed ones by V Y + Q C, some rows at a time.

    A mode that converged early has no share in late columns of V; groups of modes are combined without them.
    """
    c = space.fixed
    weights = np.vstack([Y, C])
    groups = []
    for start in range(0, weights.shape[1], GROUP):
        part = weights[:, start : start + GROUP]
        height = int(np.flatnonzero(abs(part).max(axis=1) > EPS)[-1]) + 1
        groups.append((slice(start, start + part.shape[1]), np.asfortranarray(part[:height])))
    rows = np.empty((ROWS, weights.shape[1]), order="F")
    for start in range(0, len(space.V), ROWS):
        V = space.V[start : start + ROWS]
        for columns, part in groups:
            rows[: len(V), columns] = V[:, c : c + len(part)] @ part
        V[:, c : c + weights.shape[1]] = rows[: len(V)]
