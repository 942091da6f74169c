"""Patterns of triangles: grids, rings about a centre, and a triangle cut into smaller copies of itself."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray, IntArray


def grid_faces(n_i: int, n_j: int, *, closed: bool = False) -> IntArray:
    """Return the two triangles of each cell of a grid of vertices i * n_j + j, lower one first, counter-clockwise.

    A closed grid joins its last lines to its first.

    >>> grid_faces(2, 2).tolist()
    [[0, 2, 3], [0, 3, 1]]
    """
    i, j = np.meshgrid(np.arange(n_i if closed else n_i - 1), np.arange(n_j if closed else n_j - 1), indexing="ij")
    a, b = i.ravel(), j.ravel()
    c, d = (a + 1) % n_i, (b + 1) % n_j
    lower = np.column_stack([a * n_j + b, c * n_j + b, c * n_j + d])
    upper = np.column_stack([a * n_j + b, c * n_j + d, a * n_j + d])
    return np.stack([lower, upper], axis=1).reshape(-1, 3).astype(np.int64)


def ring_coordinates(n_rings: int) -> tuple[FloatArray, FloatArray]:
    """Return for each vertex of a mesh of rings its ring, 0 to n_rings, and its angle; ring k holds 6 k vertices."""
    sizes = np.maximum(6 * np.arange(n_rings + 1), 1)
    ring = np.repeat(np.arange(n_rings + 1), sizes)
    place = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return ring.astype(np.float64), 2.0 * np.pi * place / sizes[ring]


def ring_faces(n_rings: int) -> IntArray:
    """Return the 6 n_rings^2 faces of the mesh whose vertices `ring_coordinates` places, counter-clockwise."""
    faces = []
    for k in range(1, n_rings + 1):
        start, inner_start = 1 + 3 * k * (k - 1), 1 + 3 * (k - 1) * (k - 2) if k > 1 else 0
        size, inner_size = 6 * k, max(6 * (k - 1), 1)
        sector, j = np.divmod(np.arange(size), k)
        outer = np.arange(size)
        inner = sector * (k - 1) + j
        outward = [start + outer, start + (outer + 1) % size, inner_start + inner % inner_size]
        inward = [inner_start + inner, start + outer + 1, inner_start + (inner + 1) % inner_size]
        faces += [np.column_stack(outward), np.column_stack(inward)[j < k - 1]]
    return np.vstack(faces).astype(np.int64)


def split_triangle(corners: FloatArray, n: int) -> tuple[FloatArray, IntArray]:
    """Return points and faces of a triangle whose sides are cut into n parts: n**2 copies of it, n times smaller.

    Corner 0 comes first, and the faces are oriented like the triangle, whose corners (3, d) may lie in any space.

    >>> split_triangle(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]), 2)[1].tolist()
    [[0, 3, 1], [1, 4, 2], [3, 5, 4], [3, 4, 1]]
    """
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    number = np.cumsum(i + j <= n) - 1  # of the points kept, in this order
    i_kept, j_kept = i[i + j <= n, None], j[i + j <= n, None]
    points = corners[0] + (corners[1] - corners[0]) * i_kept / n + (corners[2] - corners[0]) * j_kept / n
    up = (i + j < n).nonzero()[0]
    down = (i + j < n - 1).nonzero()[0]
    right, above = n + 1, 1  # steps in the numbering of the square of indices
    faces = np.vstack(
        [
            np.column_stack([up, up + right, up + above]),
            np.column_stack([down + right, down + right + above, down + above]),
        ]
    )
    return points, number[faces].astype(np.int64)
