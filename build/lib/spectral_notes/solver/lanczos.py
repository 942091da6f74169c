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
from scipy.linalg.blas import dgemm, dsyrk, dtrsm

from spectral_notes._checks import FloatArray

Operator = Callable[[FloatArray], FloatArray]
Watch = Callable[[int, int], None]

EPS = float(np.finfo(np.float64).eps)
LOSS = 1e-9  # orthogonality that is kept; losing more than a hundred times this would show in the residuals
USUAL_DECAY = 20.0  # residuals shrink by about e^20 while the basis grows by k columns; only the first guess needs it
ROWS = 8192  # rows of V that are combined at a time, so that V Y can overwrite V


@dataclass
class Krylov:
    """Hold the Krylov space while it grows: op V = V T + Q B e_last^T, with V^T M V = I."""

    operator: Operator
    M: sp.csr_array | None  # None is the identity
    columns: FloatArray  # (capacity + block, n), row j is column j of V: so it can be cut to size at the end
    T: FloatArray  # (capacity + block, capacity + block)
    size: int  # columns of V in use; the next block Q is already stored behind them
    block: int
    fixed: int  # leading columns that are exact eigenvectors
    arrow: int  # T couples the block that starts here with every earlier column (after a start or restart)
    loss: FloatArray  # (size, block), estimate of V^T M Q
    loss_before: FloatArray  # the same one step earlier
    noise: float  # what one step adds to the loss
    rng: np.random.Generator

    @property
    def V(self) -> FloatArray:
        """(n, capacity + block), column-major."""
        return self.columns.T

    @property
    def capacity(self) -> int:
        """How many columns fit."""
        return len(self.T) - self.block

    def mass(self, X: FloatArray) -> FloatArray:
        """M X."""
        return X if self.M is None else np.asarray(self.M @ X)


def block_lanczos(
    operator: Operator, exact: FloatArray, exact_values: FloatArray, k: int, *, capacity: int, block: int = 8,
    M: sp.csr_array | None = None, tol: float = 1e-9, seed: int = 0, watch: Watch | None = None,
    enough: float = np.inf,
) -> tuple[FloatArray, FloatArray]:
    """Compute the k eigenpairs of largest magnitude of an operator that is symmetric in the inner product of M.

    Parameters
    ----------
    operator : callable
        Takes (n, b), returns (n, b).
    exact : (n, c) array
        Eigenvectors that are known already, M-orthonormal; they are kept, and searched for no more.
    exact_values : (c,) array
        Their eigenvalues.
    k : int
        How many pairs to find besides the exact ones.
    capacity : int
        How many columns the basis may have before it is restarted: at least c + k + 3 block.
    block : int
        Columns a step.
    M : (n, n) sparse array, optional
        Mass matrix; None is the identity.
    tol : float
        Residual of each pair, divided by its eigenvalue, below which it has converged.
    seed : int
        Seed of the start vectors.
    watch : callable, optional
        Called after each step with the columns built and an estimate of the columns needed.
    enough : float
        End the search, converged or not, once all k values are known to be larger: Ritz values only grow.

    Returns
    -------
    values : (k,) array
        Eigenvalues of the operator by descending magnitude, without the exact ones.
    vectors : (n, c + k) array
        The exact vectors, then the k found; M-orthonormal.

    Raises
    ------
    ArithmeticError
        If the pairs have not converged after many restarts.

    Examples
    --------
    >>> d = np.arange(200.0)
    >>> values, X = block_lanczos(lambda B: d[:, None] * B, np.zeros((200, 0)), np.zeros(0), 3, capacity=80)
    >>> values.round(9).tolist()
    [199.0, 198.0, 197.0]
    """
    space = _start(operator, exact, exact_values, capacity, block, M, seed)
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
            return values[:k], _assemble(space, values[:k], Y[:, :k])
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
    operator: Operator, exact: FloatArray, exact_values: FloatArray, capacity: int, block: int, M: sp.csr_array | None,
    seed: int,
) -> Krylov:
    """The space of the exact vectors, with a random block orthogonal to them in waiting."""
    n, fixed = exact.shape
    T = np.zeros((capacity + block, capacity + block))
    T[:fixed, :fixed] = np.diag(exact_values)
    rng = np.random.default_rng(seed)
    space = Krylov(
        operator, M, np.empty((capacity + block, n)), T, fixed, block, fixed, fixed,
        np.zeros((fixed, block)), np.zeros((0, block)), 64 * EPS, rng,
    )
    space.V[:, :fixed] = exact
    W = np.asfortranarray(rng.standard_normal((n, block)))
    _project_out(space, fixed, W)
    Q, _ = _orthonormalize(space, W)
    _project_out(space, fixed, Q)
    space.V[:, fixed : fixed + block] = Q
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
    estimate = float(abs(loss).max())
    if j and (estimate > LOSS or not np.isfinite(estimate)):
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
        loss[:j] = T[:j, :j] @ space.loss - space.loss @ T[now, now]
        loss[: j - b] -= space.loss_before @ T[j - b : j, now]
        loss[first:j] = 0.0  # these were taken out explicitly
    amplified = np.linalg.norm(T[: j + b, : j + b], axis=1)[:, None]  # rounding of Q, as op passes it on
    loss += space.noise * amplified * space.rng.standard_normal(loss.shape)
    return np.asarray(np.linalg.solve(B.T, loss.T).T)


def _reorthogonalize(space: Krylov, estimate: float) -> None:
    """Clean the last two blocks, which is enough for the recurrence to start afresh; learn from how much was lost."""
    V, j, b = space.V, space.size, space.block
    pair = V[:, j - b : j + b]
    H = _project_out(space, j - b, pair)
    if not estimate < 1e-3:  # the block had almost nothing new in it: what was left was noise
        Q = np.asfortranarray(V[:, j : j + b])
        for _ in range(2):
            _project_out(space, j, Q)
            Q, R = _orthonormalize(space, Q)
            space.T[j : j + b, j - b : j] = R @ space.T[j : j + b, j - b : j]
        V[:, j : j + b] = Q
    else:
        space.noise *= min(max(1.0, float(abs(H).max()) / estimate), 100.0)
    space.loss_before = space.noise * space.rng.standard_normal((j - b, b))
    space.loss = space.noise * space.rng.standard_normal((j, b))


def _project_out(space: Krylov, stop: int, W: FloatArray, first: int = 0) -> FloatArray:
    """Subtract from W, in place, its part in the columns first .. stop - 1 of V; return the coefficients."""
    U = space.V[:, first:stop]
    if first == stop:
        return np.zeros((0, W.shape[1]))
    H = dgemm(1.0, U, space.mass(W), trans_a=1)  # a quarter faster than U.T @ W on tall, narrow W
    dgemm(-1.0, U, H, 1.0, W, overwrite_c=1)
    return np.asarray(H)


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
    return size + min(max(int(np.log(worst / tol) / max(decay, EPS)), 1), max(k // 4, 1))


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


def _assemble(space: Krylov, values: FloatArray, Y: FloatArray) -> FloatArray:
    """The exact vectors and the purified Ritz vectors op X / value, M-orthonormal; V is used up."""
    c, j, b = space.fixed, space.size, space.block
    _combine(space, Y, space.T[j : j + b, j - b : j] @ Y[-b:] / values)
    space.columns.resize((c + len(values), space.columns.shape[1]), refcheck=False)  # gives the memory back
    X = space.V
    found = X[:, c:]
    _project_out(space, c, found)
    R = scipy.linalg.cholesky(gram(found, space.M))
    dtrsm(1.0, R, found, side=1, overwrite_b=1)
    return X


def gram(X: FloatArray, M: sp.csr_array | None) -> FloatArray:
    """The upper half of X^T M X, of column-major X; without M at half the cost of the whole.

    Examples
    --------
    >>> gram(np.asfortranarray([[1.0, 2.0], [0.0, 1.0]]), None).tolist()
    [[1.0, 2.0], [0.0, 5.0]]
    """
    return np.asarray(dsyrk(1.0, X, trans=1) if M is None else np.triu(X.T @ (M @ X)))


def _combine(space: Krylov, Y: FloatArray, C: FloatArray) -> None:
    """Overwrite the columns after the fixed ones by V Y + Q C, some rows at a time."""
    c, j, b = space.fixed, space.size, space.block
    weights = np.vstack([Y, C])
    for start in range(0, space.columns.shape[1], ROWS):
        rows = space.V[start : start + ROWS]
        rows[:, c : c + Y.shape[1]] = rows[:, c : j + b] @ weights
