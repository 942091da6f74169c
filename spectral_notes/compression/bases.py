"""What both sides rebuild from the faces alone: patches and their eigenbases, cells and lifts of their means, frames.

Encoder and decoder must get the same answer on every machine. So each function is either exact in integers (ties go to
the lower index) or continuous in its input, so that rounding changes positions by rounding too. Any rotation inside an
eigenspace is as good as another: a hashed diagonal of size EPSILON separates repeated ones, and a hash settles signs.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse import csgraph
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from spectral_notes._checks import FloatArray, IntArray

SIZE = 300  # smallest patch of a mesh that has more vertices
TOP = 360  # smallest patch of cells
RADIUS = 3  # of a cell, in edges
EPSILON = 1e-4  # separates repeated eigenvalues by far more than rounding moves them, and bends no mode visibly
ROUNDS = 40  # conjugate gradient steps of the lift: a fixed number, so that no comparison stops it
TILT = np.array([0.36, -0.48, 0.8])  # a direction no symmetric shape prefers; breaks ties of frames


def graph(i: IntArray, j: IntArray, n: int) -> sp.csr_array:
    """The symmetric 0/1 matrix of pairs of different vertices, with sorted indices."""
    i, j = np.r_[i, j][np.r_[i != j, i != j]], np.r_[j, i][np.r_[i != j, i != j]]
    W = sp.csr_array((np.ones(len(i)), (i, j)), shape=(n, n))
    W.sum_duplicates()
    W.sort_indices()
    W.data[:] = 1.0
    return W


def partition(W: sp.csr_array, size: int) -> list[IntArray]:
    """Ascending patches, n // size, whose sizes differ by one at most, each cut across the longest hop distance."""
    done, stack = [], [(np.arange(W.shape[0]), max(W.shape[0] // size, 1))]
    while stack:
        members, parts = stack.pop()
        if parts == 1:
            done.append(members)
            continue
        near = W[members][:, members]
        one = _hops(near, int(_hops(near, 0).argmax()))
        two = _hops(near, int(one.argmax()))
        order = np.lexsort((np.arange(len(members)), one, one - two))
        cut = len(members) * (parts // 2) // parts
        stack.append((np.sort(members[order[cut:]]), parts - parts // 2))
        stack.append((np.sort(members[order[:cut]]), parts // 2))
    return done


def _hops(W: sp.csr_array, start: int) -> IntArray:
    """Number of edges from a vertex to every other; vertices out of reach count one more than the farthest."""
    hops = csgraph.dijkstra(W, unweighted=True, indices=start)
    reached = np.isfinite(hops)
    return np.where(reached, hops, hops[reached].max() + 1).astype(np.int64)


def hashed(n: int, salt: int) -> FloatArray:
    """Numbers in [-1/2, 1/2) that look random, from integer arithmetic (a multiply-shift hash of 1 .. n)."""
    key = (np.arange(1, n + 1, dtype=np.uint64) + np.uint64(salt)) * np.uint64(0x9E3779B97F4A7C15)
    key ^= key >> np.uint64(29)
    key *= np.uint64(0xBF58476D1CE4E5B9)
    key ^= key >> np.uint64(32)
    return (key >> np.uint64(11)).astype(np.float64) / 2.0**53 - 0.5


def bending(W: sp.csr_array) -> sp.csr_array:
    """L D^-1 L, L = D - W: how far vertices are from the mean of their neighbours; it orders modes better than L."""
    degree = np.asarray(W.sum(axis=1)).ravel()
    L = sp.diags_array(degree) - W
    return (L @ sp.diags_array(1 / np.maximum(degree, 1.0)) @ L).tocsr()


def patch_basis(Q: sp.csr_array, members: IntArray) -> FloatArray:
    """The eigenvectors of the bending of one patch, columns from smooth to rough, signs and ties settled."""
    A = Q[members][:, members].toarray()
    A.flat[:: len(A) + 1] += EPSILON * (hashed(len(A), 0) + 0.5)
    evecs = scipy.linalg.eigh(A, driver="evd", overwrite_a=True, check_finite=False)[1]
    return evecs * np.where(hashed(len(A), 7) @ evecs < 0, -1.0, 1.0)


class Patches:
    """A graph in patches with a basis each: coefficients (rows, 3, patches), a smaller patch's last one zero."""

    def __init__(self, W: sp.csr_array, size: int) -> None:
        self.members = partition(W, size)
        patch = np.repeat(range(len(self.members)), [len(i) for i in self.members])
        patch[np.concatenate(self.members)] = patch.copy()
        i, j = W.nonzero()
        Q = bending(graph(i[patch[i] == patch[j]], j[patch[i] == patch[j]], W.shape[0]))
        with threadpool_limits(limits=1):
            self.bases = [patch_basis(Q, i) for i in self.members]
        self.n, self.shape = W.shape[0], (max(map(len, self.members)), 3, len(self.members))

    def forward(self, h: FloatArray) -> FloatArray:
        """Coefficients of a signal (n, 3)."""
        c = np.zeros(self.shape)
        for p, (i, B) in enumerate(zip(self.members, self.bases, strict=True)):
            c[: len(i), :, p] = B.T @ h[i]
        return c

    def inverse(self, c: FloatArray | IntArray) -> FloatArray:
        """The signal (n, 3) of coefficients."""
        h = np.empty((self.n, 3))
        for p, (i, B) in enumerate(zip(self.members, self.bases, strict=True)):
            h[i] = B @ c[: len(i), :, p]
        return h


class Domain:
    """What the faces determine: the patches of the vertices (`fine`) and of the cells (`coarse`), and the lift."""

    def __init__(self, faces: IntArray, n: int) -> None:
        W = graph(faces.ravel(), faces[:, [1, 2, 0]].ravel(), n)
        self.faces, self.label, self.fine, self.bending = faces, cells(W), Patches(W, SIZE), bending(W)
        i, j = W.nonzero()
        self.coarse = Patches(graph(self.label[i], self.label[j], int(self.label.max()) + 1), TOP)
        self._average = sp.csr_array((1 / np.bincount(self.label)[self.label], (self.label, np.arange(n))))

    def means(self, X: FloatArray) -> FloatArray:
        """The mean of the rows of X in each cell."""
        return self._average @ X

    def lift(self, means: FloatArray, softness: int) -> FloatArray:
        """The positions (n, 3) of least X^T bending X + 2^-softness |mean(X) - means|^2, by conjugate gradients."""
        weight, surface = 2.0**-softness, means[self.label]
        scale = 1 / (self.bending.diagonal() + weight)
        for axis in range(3):
            x = surface[:, axis].copy()
            r, p, before = -(self.bending @ x), np.zeros_like(x), np.inf
            for _ in range(ROUNDS):
                z = r * scale
                rz = r @ z
                p = z + rz / max(before, 1e-300) * p
                q = self.bending @ p + (weight * self.means(p))[self.label]
                step = rz / max(p @ q, 1e-300)
                x, r, before = x + step * p, r - step * q, rz
            surface[:, axis] = x
        return surface

    def frames(self, X: FloatArray) -> FloatArray:
        """Orthonormal frames (n, 3, 3): row 0 the normal of the surface X, rows 1 and 2 tangent, smooth over a patch.

        The tangents are those of the patch's mean normal, turned by the shortest rotation. TILT decides where a normal
        or a mean vanishes, so that all is continuous in X.
        """
        corner = X[self.faces]
        area = np.repeat(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), 3, axis=0)
        N: FloatArray = np.stack([np.bincount(self.faces.ravel(), area[:, d], len(X)) for d in range(3)], axis=1)
        N = _unit(N + (1e-6 * np.sqrt((N * N).sum(axis=1).mean()) + 1e-150) * TILT)
        m = np.empty_like(X)
        for i in self.fine.members:
            m[i] = _unit(N[i].mean(axis=0) + 1e-6 * TILT)
        sign = np.where(m[:, 2] < 0, -1.0, 1.0)
        a = -1.0 / (sign + m[:, 2])
        t = np.stack([1 + sign * m[:, 0] ** 2 * a, sign * m[:, 0] * m[:, 1] * a, -sign * m[:, 0]], axis=1)
        v, c = np.cross(m, N), (m * N).sum(axis=1)[:, None]
        t = c * t + np.cross(v, t) + v * ((v * t).sum(axis=1)[:, None] / (1 + c + 1e-9))
        t = _unit(t - (t * N).sum(axis=1)[:, None] * N)
        return np.stack([N, t, np.cross(N, t)], axis=1)


def cells(W: sp.csr_array) -> IntArray:
    """The cell of each vertex, (n,): cells grow around seeds more than RADIUS edges apart, taken in order."""
    n, count = W.shape[0], 0
    label, blocked = np.full(n, n, dtype=np.int64), bytearray(n)
    starts, columns = W.indptr.tolist(), W.indices.tolist()
    for seed in range(n):
        if blocked[seed]:
            continue
        label[seed], count = count, count + 1
        ring, reached = [seed], {seed}
        for _ in range(RADIUS):
            ring = list({w for v in ring for w in columns[starts[v] : starts[v + 1]]} - reached)
            reached.update(ring)
        for w in reached:
            blocked[w] = 1
    rows = np.repeat(np.arange(n), np.diff(W.indptr))
    for _ in range(RADIUS):
        best = np.full(n, n, dtype=np.int64)
        np.minimum.at(best, rows, label[W.indices])
        label = np.where(label == n, best, label)
    return label


def _unit(rows: FloatArray) -> FloatArray:
    return rows / np.sqrt((rows * rows).sum(axis=-1, keepdims=True))
