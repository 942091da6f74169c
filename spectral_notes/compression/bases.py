"""What both sides rebuild from the faces alone: patches and their eigenbases, cells and lifts of their means, frames.

Encoder and decoder must get the same answer on every machine. So each function is either exact in integers (hop
distances are unique, ties go to the lower index) or continuous in its input, so that rounding changes positions by
rounding too. Repeated eigenvalues (a subdivided icosahedron has many) would break that: any rotation inside an
eigenspace is as good as another. A hashed diagonal of size EPSILON separates them, and a hash settles each sign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from spectral_notes._checks import FloatArray, IntArray

SIZE = 300  # largest patch
TOP = 700  # largest patch of coarse graphs, and largest graph that is not coarsened further
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
    """Return ceil(n / size) ascending patches, each vertex in one, whose sizes differ by one at most.

    Each cut goes across the longest hop distance; a piece out of reach counts as one hop beyond the farthest vertex.
    """
    done, stack = [], [(np.arange(W.shape[0]), -(-W.shape[0] // size))]
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


def patch_basis(W: sp.csr_array, members: IntArray) -> FloatArray:
    """The eigenvectors of L D^-1 L of one patch, L = D - W, columns from smooth to rough, signs and ties settled.

    The square punishes the distance of each vertex from the mean of its neighbours; on irregular meshes that orders
    the modes slightly better than L does.
    """
    A = W[members][:, members].toarray()
    degree = A.sum(axis=1)
    L = np.diag(degree) - A
    Q = L @ (L / np.maximum(degree, 1.0)[:, None]) + np.diag(EPSILON * (hashed(len(A), 0) + 0.5))
    evecs = scipy.linalg.eigh((Q + Q.T) / 2, driver="evd", overwrite_a=True, check_finite=False)[1]
    return evecs * np.where(hashed(len(A), 7) @ evecs < 0, -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Level:
    """A graph, the orthonormal bases of its patches, and the cell `label` (n,) of each vertex.

    Coefficients lie in rows of equal relative frequency: `row` (n,) in the order of the patches, column p for patch p.
    """

    W: sp.csr_array
    label: IntArray
    average: sp.csr_array  # (cells, n)
    patches: list[IntArray]
    bases: list[FloatArray]
    row: IntArray
    column: IntArray
    present: NDArray[np.bool_]  # (rows, patches)

    def forward(self, h: FloatArray) -> FloatArray:
        """Coefficients (rows, d, patches) of a signal (n, d); zero where a patch has no such row."""
        out = np.zeros((len(self.present), h.shape[1], len(self.patches)))
        parts = [B.T @ h[i] for i, B in zip(self.patches, self.bases, strict=True)]
        out[self.row, :, self.column] = np.concatenate(parts)
        return out

    def inverse(self, c: FloatArray) -> FloatArray:
        """The signal (n, d) of coefficients (rows, d, patches)."""
        h, parts = np.empty((len(self.row), c.shape[1])), np.cumsum([len(i) for i in self.patches])[:-1]
        for i, B, flat in zip(self.patches, self.bases, np.split(c[self.row, :, self.column], parts), strict=True):
            h[i] = B @ flat
        return h

    def means(self, X: FloatArray) -> FloatArray:
        """The mean of the rows of X in each cell, (cells, 3)."""
        return self.average @ X

    def lift(self, means: FloatArray, softness: int) -> FloatArray:
        """The smooth positions (n, 3) with about the given cell means: a fixed number of conjugate gradient steps.

        Minimises |D^-1/2 L X|^2 + 2^-softness |mean(X) - means|^2, the second summed over vertices.
        """
        weight, degree = 2.0**-softness, np.asarray(self.W.sum(axis=1)).ravel()[:, None]
        X, safe = means[self.label], np.maximum(degree, 1.0)

        def gradient(X: FloatArray) -> FloatArray:
            Y = (degree * X - self.W @ X) / safe
            return degree * Y - self.W @ Y + weight * self.means(X)[self.label]

        r: FloatArray = weight * X - gradient(X)
        p, before = np.zeros_like(X), np.full(3, np.inf)
        for _ in range(ROUNDS):
            z = r / (safe + 1.0 + weight)
            rz = (r * z).sum(axis=0)
            p = z + rz / np.maximum(before, 1e-300) * p
            q = gradient(p)
            step = rz / np.maximum((p * q).sum(axis=0), 1e-300)
            X, r, before = X + step * p, r - step * q, rz
        return X


def hierarchy(faces: IntArray, n: int) -> list[Level]:
    """The levels from fine to coarse, at least two; a level's cells are the vertices of the next."""
    W = graph(faces.ravel(), faces[:, [1, 2, 0]].ravel(), n)
    levels: list[Level] = []
    while True:
        patches = partition(W, TOP if levels else SIZE)
        with threadpool_limits(limits=1):
            bases = [patch_basis(W, i) for i in patches]
        rows = max(map(len, patches))
        row = np.concatenate([(2 * np.arange(len(i)) + 1) * rows // (2 * len(i)) for i in patches])
        column = np.repeat(np.arange(len(patches)), [len(i) for i in patches])
        present = np.zeros((rows, len(patches)), dtype=bool)
        present[row, column] = True
        label = cells(W)
        average = sp.csr_array((1 / np.bincount(label)[label], (label, np.arange(len(label)))))
        levels.append(Level(W, label, average, patches, bases, row, column, present))
        if len(levels) > 1 and (len(label) <= TOP or label.max() + 1 == len(label)):
            return levels
        i, j = label[W.nonzero()[0]], label[W.nonzero()[1]]
        W = graph(i, j, int(label.max()) + 1)


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


def frames(X: FloatArray, faces: IntArray, patches: list[IntArray]) -> FloatArray:
    """Orthonormal frames (n, 3, 3): row 0 the normal of the surface X, rows 1 and 2 tangent, smooth over a patch.

    The tangents are those of the patch's mean normal, turned by the shortest rotation. All is continuous in X: the
    regularisation by TILT decides where a normal or a mean vanishes.
    """
    corner = X[faces]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    N: FloatArray = np.stack([np.bincount(faces.ravel(), np.repeat(area[:, d], 3), len(X)) for d in range(3)], axis=1)
    N = _unit(N + (1e-6 * np.sqrt((N * N).sum(axis=1).mean()) + 1e-150) * TILT)
    m = np.empty_like(X)
    for i in patches:
        m[i] = _unit(N[i].mean(axis=0) + 1e-6 * TILT)
    sign = np.where(m[:, 2] < 0, -1.0, 1.0)
    a = -1.0 / (sign + m[:, 2])
    t = np.stack([1 + sign * m[:, 0] ** 2 * a, sign * m[:, 0] * m[:, 1] * a, -sign * m[:, 0]], axis=1)
    v, c = np.cross(m, N), (m * N).sum(axis=1)[:, None]
    t = c * t + np.cross(v, t) + v * ((v * t).sum(axis=1)[:, None] / (1 + c + 1e-9))
    t = _unit(t - (t * N).sum(axis=1)[:, None] * N)
    return np.stack([N, t, np.cross(N, t)], axis=1)


def _unit(rows: FloatArray) -> FloatArray:
    return rows / np.sqrt((rows * rows).sum(axis=-1, keepdims=True))
