"""What the decoder rebuilds instead of receiving: patch eigenbases, a smooth lift of coarse positions, frames.

Every function is either exact in integers or a continuous function of its floating-point input, so that rounding that
differs between machines changes positions by rounding too. The graph Laplacian's repeated eigenvalues (a subdivided
icosahedron has many) would break that: any rotation inside an eigenspace is as good as another. A seeded diagonal,
`EPSILON` times a hash of the index, separates them, and a hash settles each sign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.patches import Cells, cells, partition

EPSILON = 1e-4  # separates repeated eigenvalues by far more than rounding moves them, and bends no mode visibly
LIFT_ROUNDS = 40  # conjugate gradient steps of the lift: a fixed number, so that no comparison stops it
TILT = np.array([0.36, -0.48, 0.8])  # a direction no symmetric shape prefers; breaks ties of frames


def hashed(n: int, salt: int) -> FloatArray:
    """Numbers in [-1/2, 1/2) that look random, from integer arithmetic (a multiply-shift hash of 1 .. n)."""
    key = (np.arange(1, n + 1, dtype=np.uint64) + np.uint64(salt)) * np.uint64(0x9E3779B97F4A7C15)
    key ^= key >> np.uint64(29)
    key *= np.uint64(0xBF58476D1CE4E5B9)
    key ^= key >> np.uint64(32)
    return (key >> np.uint64(11)).astype(np.float64) / 2.0**53 - 0.5


def patch_basis(W: sp.csr_array, members: IntArray) -> FloatArray:
    """The eigenvectors of L D^-1 L of one patch, columns from smooth to rough, signs and ties settled.

    L = D - W is the graph Laplacian of the patch. Its square, weighted by 1/D, punishes the distance of each vertex
    from the mean of its neighbours; on irregular meshes that orders the modes slightly better than L does.
    """
    A = W[members][:, members].toarray()
    degree = A.sum(axis=1)
    L = np.diag(degree) - A
    Q = L @ (L / np.maximum(degree, 1.0)[:, None]) + np.diag(EPSILON * (hashed(len(A), 0) + 0.5))
    evecs = scipy.linalg.eigh((Q + Q.T) / 2, driver="evd", overwrite_a=True, check_finite=False)[1]
    return evecs * np.where(hashed(len(A), 7) @ evecs < 0, -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Transform:
    """An orthonormal change of basis, patch by patch, laid out in rows of equal relative frequency.

    `row` (n,) is the row of each coefficient in the order of the patches; column p belongs to patch p.
    """

    patches: list[IntArray]
    bases: list[FloatArray]
    row: IntArray
    column: IntArray
    present: NDArray[np.bool_]  # (rows, patches)

    def forward(self, h: FloatArray) -> FloatArray:
        """Coefficients (rows, patches, d) of a signal (n, d); zero where a patch has no such row."""
        out = np.zeros((*self.present.shape, h.shape[1]))
        out[self.row, self.column] = np.concatenate(
            [B.T @ h[i] for i, B in zip(self.patches, self.bases, strict=True)]
        )
        return out

    def inverse(self, c: FloatArray) -> FloatArray:
        """The signal (n, d) of coefficients (rows, patches, d)."""
        flat, h, at = c[self.row, self.column], np.empty((len(self.row), c.shape[2])), 0
        for i, B in zip(self.patches, self.bases, strict=True):
            h[i] = B @ flat[at : at + len(i)]
            at += len(i)
        return h


def make_transform(W: sp.csr_array, size: int) -> Transform:
    """Partition a graph and decompose its patches."""
    patches = partition(W, size)
    with threadpool_limits(limits=1):
        bases = [patch_basis(W, i) for i in patches]
    rows = max(map(len, patches))
    row = np.concatenate([(2 * np.arange(len(i)) + 1) * rows // (2 * len(i)) for i in patches])
    column = np.repeat(np.arange(len(patches)), [len(i) for i in patches])
    present = np.zeros((rows, len(patches)), dtype=bool)
    present[row, column] = True
    return Transform(patches, bases, row, column, present)


@dataclass(frozen=True, eq=False)
class Level:
    """A graph and the cells that make the next coarser one."""

    W: sp.csr_array
    cells: Cells


def hierarchy(W: sp.csr_array, radius: int, top: int) -> tuple[list[Level], sp.csr_array]:
    """Coarsen a graph at least once and until at most `top` nodes are left, or nothing more can be joined."""
    levels: list[Level] = []
    while not levels or W.shape[0] > top:
        level = Level(W, cells(W, radius))
        if level.cells.graph.shape[0] == W.shape[0] and levels:
            break
        levels.append(level)
        W = level.cells.graph
    return levels, W


def lift(level: Level, means: FloatArray, weight: float) -> FloatArray:
    """The smooth positions (n, 3) with about the given cell means: a fixed number of conjugate gradient steps.

    Minimises |D^-1/2 L X|^2 + weight |mean(X) - means|^2, the second summed over vertices.
    """
    W, label = level.W, level.cells.label
    degree = np.maximum(np.asarray(W.sum(axis=1)).ravel(), 1.0)[:, None]
    lone = np.asarray(W.sum(axis=1)).ravel()[:, None]

    def laplacian(X: FloatArray) -> FloatArray:
        return lone * X - W @ X

    def gradient(X: FloatArray) -> FloatArray:
        return laplacian(laplacian(X) / degree) + weight * level.cells.means(X)[label]

    scale = degree + 1.0 + weight
    X: FloatArray = means[label]
    r: FloatArray = weight * X - gradient(X)
    z = r / scale
    p, rz = z, (r * z).sum(axis=0)
    for _ in range(LIFT_ROUNDS):
        q = gradient(p)
        step = rz / np.maximum((p * q).sum(axis=0), 1e-300)
        X, r = X + step * p, r - step * q
        z = r / scale
        rz, before = (r * z).sum(axis=0), rz
        p = z + rz / np.maximum(before, 1e-300) * p
    return X


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
