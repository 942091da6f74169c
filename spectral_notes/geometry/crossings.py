"""Where a mesh is not the surface that it looks like: faces that cross, corners on the middle of an edge, cracks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.meshes import TriangleMesh, edges_with_counts, row_norms

MARGIN = 1e-9  # of a face: what only touches it does not cross it
NEAR = 1e-4  # of the diagonal: vertices of the boundary that are nearer than that and not joined lie at a crack
AT_ONCE = 1 << 20  # pairs of faces that are tested together


def crossing_faces(mesh: TriangleMesh) -> IntArray:
    """Return the faces that another face, with which they share no vertex, cuts through, ascending.

    Two triangles in general position cross where an edge of one pierces the other; faces in one plane are not counted.
    """
    vertices = _placed(mesh)
    _, same = np.unique(mesh.vertices + 0.0, axis=0, return_inverse=True)
    names = same.ravel()[mesh.faces]
    corners = vertices[mesh.faces]  # (m, 3, 3)
    low, high = corners.min(axis=1), corners.max(axis=1)
    found: list[IntArray] = []
    for pairs in _close_pairs(corners):
        for start in range(0, len(pairs), AT_ONCE):
            i, j = pairs[start : start + AT_ONCE].T
            met = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)
            met &= ~(names[i][:, :, None] == names[j][:, None, :]).any(axis=(1, 2))
            i, j = i[met], j[met]
            cut = np.zeros(len(i), dtype=bool)
            for k in range(3):
                cut |= _pierces(corners[i, k], corners[i, k - 1], corners[j])
                cut |= _pierces(corners[j, k], corners[j, k - 1], corners[i])
            found += [i[cut], j[cut]]
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *found]))


def _placed(mesh: TriangleMesh) -> FloatArray:
    """Positions about the middle of the mesh, of size one: nothing is lost to a far origin or an odd unit."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return (mesh.vertices - (low + high) / 2) / (float((high - low).max()) or 1.0)


def _close_pairs(corners: FloatArray) -> Iterator[IntArray]:
    """Pairs of triangles whose spheres meet, by classes of size, so that few large ones do not slow many small."""
    middle = (corners.min(axis=1) + corners.max(axis=1)) / 2
    radius = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
    level = np.frexp(np.maximum(radius, 1e-12))[1]
    classes = [np.flatnonzero(level == step) for step in np.unique(level)]
    trees = [cKDTree(middle[members]) for members in classes]
    for a, (mine, tree) in enumerate(zip(classes, trees, strict=True)):
        for b in range(a + 1):
            reach = radius[mine].max() + radius[classes[b]].max()
            if a == b:
                yield mine[tree.query_pairs(reach, output_type="ndarray")]
            else:
                near = tree.sparse_distance_matrix(trees[b], reach, output_type="ndarray")
                yield np.stack([mine[near["i"]], classes[b][near["j"]]], axis=1)


def _pierces(start: FloatArray, end: FloatArray, triangles: FloatArray) -> NDArray[np.bool_]:
    """Whether each segment goes through the inside of its triangle (Möller and Trumbore 1997)."""
    a, b, c = triangles.transpose(1, 0, 2)
    u, v, way = b - a, c - a, end - start
    across = np.cross(way, v)
    volume = np.einsum("nd,nd->n", u, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / volume
        from_a = start - a
        first = inverse * np.einsum("nd,nd->n", from_a, across)
        turned = np.cross(from_a, u)
        second = inverse * np.einsum("nd,nd->n", way, turned)
        along = inverse * np.einsum("nd,nd->n", v, turned)
        inside = np.minimum(np.minimum(first, second), 1 - first - second) > MARGIN
        scale = row_norms(u) * row_norms(v) * row_norms(way)
        return inside & (along > MARGIN) & (along < 1 - MARGIN) & (np.abs(volume) > 1e-12 * scale)


def t_junctions(mesh: TriangleMesh) -> int:
    """Return how many boundary vertices lie on the middle of a boundary edge: a neighbour has a corner less there."""
    pairs, counts = edges_with_counts(mesh)
    border = pairs[counts == 1]
    if not len(border):
        return 0
    vertices = _placed(mesh)
    ends = np.unique(border)
    tree = cKDTree(vertices[ends])
    start, way = vertices[border[:, 0]], vertices[border[:, 1]] - vertices[border[:, 0]]
    length = row_norms(way)
    near = tree.query_ball_point(start + way / 2, length / 2, return_sorted=False)
    edge = np.repeat(np.arange(len(border)), [len(hits) for hits in near])
    hit = ends[np.concatenate([np.asarray(hits, dtype=np.int64) for hits in near])]
    away = vertices[hit] - start[edge]
    along = np.einsum("nd,nd->n", away, way[edge]) / np.maximum(length[edge] ** 2, 1e-300)
    off = row_norms(away - along[:, None] * way[edge])
    on = (along > 1e-3) & (along < 1 - 1e-3) & (off < 1e-4 * length[edge])
    return len(np.unique(hit[on]))


def near_duplicates(mesh: TriangleMesh) -> tuple[int, float]:
    """Return how many boundary vertices lie at a crack, nearer than NEAR to one that no edge joins, and its width.

    The width, the largest of these distances in units of the vertices, is what a weld must bridge.
    """
    pairs, counts = edges_with_counts(mesh)
    ends = np.unique(pairs[counts == 1])
    if not len(ends):
        return 0, 0.0
    middle = mesh.vertices.mean(axis=0)
    vertices = mesh.vertices[ends] - middle
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    close = cKDTree(vertices).query_pairs(NEAR * diagonal, output_type="ndarray")
    i, j = ends[close].T
    joined = np.isin(np.minimum(i, j) * mesh.n_vertices + np.maximum(i, j), pairs[:, 0] * mesh.n_vertices + pairs[:, 1])
    apart = row_norms(vertices[close[:, 0]] - vertices[close[:, 1]])
    crack = ~joined & (apart > 0)
    return len(np.unique(np.r_[i[crack], j[crack]])), float(apart[crack].max(initial=0.0))
