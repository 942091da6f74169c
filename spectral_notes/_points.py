"""Sets of points: those that lie far apart, and each point's Delaunay star in its tangent plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray, IntArray

BLOCK = 20_000  # points whose neighbourhoods are held at once
FLAT_ANGLE = 1e-9  # sine of the angle at the point, below which a triangle of its star is a line
TIE = 1e-3  # of the squared gap to the nearest point: by how much a point's own number parts four on one circle


def farthest_points(points: FloatArray, n: int, first: int = 0) -> IntArray:
    """Numbers of n points from coarse to fine: each lies farthest, in space, from those before it; none comes twice.

    Gonzalez, "Clustering to minimize the maximum intercluster distance" (1985): the first m of them cover all points
    within twice the radius of the best m.
    """
    chosen = np.full(n, first, dtype=np.int64)
    apart = np.full(len(points), np.inf)  # squared distance to the chosen
    for number in range(1, n):
        gaps = points - points[chosen[number - 1]]
        apart = np.minimum(apart, np.einsum("ij,ij->i", gaps, gaps))
        apart[chosen[number - 1]] = -1.0  # also where points coincide
        chosen[number] = apart.argmax()
    return chosen


def star_triangles(points: FloatArray, own: FloatArray, n_neighbors: int) -> tuple[IntArray, IntArray]:
    """The triangles of all stars of different points, each once, and how many of its corners see it, 1 to 3.

    A star is a point's triangles in the Delaunay triangulation of its neighbours; where farther points could belong to
    it, twice as many are asked. `own` holds a number 0 .. 1 a point, which decides among four points on one circle.
    """
    tree = cKDTree(points)
    lifts = TIE * tree.query(points, 2)[0][:, 1] ** 2 * own  # smaller than any squared gap
    found = []
    for begin in range(0, len(points), BLOCK):
        here = np.arange(begin, min(begin + BLOCK, len(points)))
        gaps, near = tree.query(points[here], n_neighbors + 1)
        axes = _tangents(points, near)
        corners, sure = _stars(points, lifts, axes, gaps, near)
        found.append(corners[sure[corners[:, 0] - begin]])
        if not sure.all():
            wider = tree.query(points[here[~sure]], min(2 * n_neighbors, len(points) - 1) + 1)
            found.append(_stars(points, lifts, axes[~sure], *wider)[0])
    triangles, seen = np.unique(np.sort(np.concatenate(found), axis=1), axis=0, return_counts=True)
    return triangles.astype(np.int64), seen


def _tangents(points: FloatArray, near: IntArray) -> FloatArray:
    """Two orthonormal axes a point, shape (b, 3, 2), of the plane in which its neighbours spread most."""
    around = points[near] - points[near[:, :1]]
    around -= around.mean(axis=1, keepdims=True)
    return np.asarray(np.linalg.eigh(around.transpose(0, 2, 1) @ around)[1][:, :, 1:])


def _stars(
    points: FloatArray, lifts: FloatArray, axes: FloatArray, gaps: FloatArray, near: IntArray
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Triangles of each point's star among its neighbours, and whether no farther point can belong to it.

    Distances are taken in space: what lies on one circle there does so for each of its points, whatever their planes.
    """
    around = points[near[:, 1:]] - points[near[:, :1]]  # (b, k, 3)
    powers = (around**2).sum(axis=2) + lifts[near[:, :1]] - lifts[near[:, 1:]]
    q = around @ axes / powers[..., None]
    row, one, two, sure = _walk_round(q)
    a, b = q[row, one], q[row, two]
    diameters = np.linalg.norm(b - a, axis=1) / abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])  # of circumscribed circles
    sure[row[diameters > gaps[row, -1]]] = False
    return np.column_stack([near[row, 0], near[row, one + 1], near[row, two + 1]]), sure


def _walk_round(q: FloatArray) -> tuple[IntArray, IntArray, IntArray, NDArray[np.bool_]]:
    """The Delaunay star of the origin among points p, from q = p / |p|^2: rows, and two neighbours that follow there.

    A circle through the origin becomes a line, and an empty one a line with all points on one side. So the triangles at
    the origin are the edges of the convex hull of all q and the origin that do not end there: a walk round the hull
    (Jarvis, "On the identification of the convex hull of a finite set of points in the plane", 1973). Last comes
    whether the walk closed; where a boundary stops it, it goes on the other way round from its start.
    """
    lengths = np.linalg.norm(q, axis=2)
    start = lengths.argmax(axis=1)  # the nearest point, surely on the hull
    closed = np.ones(len(q), dtype=bool)
    rows = np.arange(len(q))
    found = []
    for turn in (1.0, -1.0):
        at = start[rows]
        for _ in range(q.shape[1]):
            here = q[rows, at]
            across = turn * (here[:, None, 0] * q[rows, :, 1] - here[:, None, 1] * q[rows, :, 0])
            along = (q[rows] @ here[:, :, None])[..., 0] - (here**2).sum(axis=1)[:, None]
            ahead = across > FLAT_ANGLE * lengths[rows, at][:, None] * lengths[rows]
            following = np.where(ahead, along / np.where(ahead, across, 1.0), -np.inf).argmax(axis=1)
            goes = ahead.any(axis=1)
            closed[rows[~goes]] = False
            found.append((rows[goes], at[goes], following[goes]))
            goes &= following != start[rows]
            rows, at = rows[goes], following[goes]
        rows = np.flatnonzero(~closed)
    row, one, two = (np.concatenate(column) for column in zip(*found, strict=True))
    return row, one, two, closed
