"""What a file of a surface holds before it is a mesh: vertices, and polygons that are cut into triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray, Refusal
from spectral_notes.meshes import TriangleMesh, row_norms

FLAT = 1e-9  # twice an area, of a polygon of size one, below which a corner is straight
BENT = 1e-3  # height over extent above which a polygon is not planar


@dataclass(frozen=True)
class Polygons:
    """Hold vertices (n, 3) and polygons as a file names them, nothing checked, with the lines they stand on."""

    vertices: FloatArray
    corners: IntArray  # (c,), vertex indices of all polygons, one polygon after the other
    sizes: IntArray  # (m,), how many corners each polygon has
    vertex_lines: IntArray | None = None  # where they stand in a text; None in a binary file
    polygon_lines: IntArray | None = None
    first: int = 0  # number of the first vertex as the file counts

    @property
    def starts(self) -> IntArray:
        """Place of each polygon's first corner, shape (m,)."""
        return np.cumsum(self.sizes) - self.sizes

    @property
    def owners(self) -> IntArray:
        """Polygon of each corner, shape (c,)."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)


def no_polygons(vertices: FloatArray) -> Polygons:
    """Return vertices alone."""
    none = np.zeros(0, dtype=np.int64)
    return Polygons(vertices, none, none)


def strips(corners: IntArray, sizes: IntArray) -> tuple[IntArray, IntArray]:
    """Return the triangles of triangle strips as corners and sizes; -1 ends a strip, every second triangle is turned.

    >>> strips(np.array([0, 1, 2, 3, -1, 4, 5, 6]), np.array([8]))[0].reshape(-1, 3).tolist()
    [[0, 1, 2], [2, 1, 3], [4, 5, 6]]
    """
    ends = np.unique(np.r_[np.cumsum(sizes), np.flatnonzero(corners == -1), np.flatnonzero(corners == -1) + 1])
    first = np.arange(max(len(corners) - 2, 0))
    strip = np.searchsorted(ends, first, side="right")
    whole = strip == np.searchsorted(ends, first + 2, side="right")
    begin = np.r_[0, ends][strip]
    odd = (first - begin) % 2 == 1
    triangles = np.stack([corners[first + odd], corners[first + 1 - odd], corners[first + 2]], axis=1)
    a, b, c = triangles.T
    kept = whole & (a != b) & (b != c) & (c != a)  # a corner given twice joins two strips
    return triangles[kept].ravel(), np.full(int(kept.sum()), 3)


def checked_polygons(polygons: Polygons, *, clean: bool) -> Polygons:
    """Return polygons that make a mesh, or refuse by line and word; `clean` drops those that name a vertex twice."""
    finite = np.isfinite(polygons.vertices).all(axis=1)
    if not finite.all():
        worst = int(np.argmin(finite))
        value = next(x for x in polygons.vertices[worst] if not np.isfinite(x))
        place = _place("vertex", worst, polygons.vertex_lines)
        raise ValueError(f"{place}: {str(value)!r} is no position: leave such points out when the file is written")
    n = len(polygons.vertices)
    outside = (polygons.corners < 0) | (polygons.corners >= n)
    if outside.any():
        corner = int(np.argmax(outside))
        named = int(polygons.corners[corner]) + polygons.first
        place = _place("polygon", int(polygons.owners[corner]), polygons.polygon_lines)
        last = n - 1 + polygons.first
        raise ValueError(f"{place}: a face names vertex {named}; the file's vertices are {polygons.first} .. {last}")
    broken = _broken(polygons)
    if broken.any() and (not clean or broken.all()):
        worst = int(np.argmax(broken))
        start, size = int(polygons.starts[worst]), int(polygons.sizes[worst])
        named = (polygons.corners[start : start + size][:9] + polygons.first).tolist()
        fault = "a face has fewer than three corners" if size < 3 else "a face names a vertex twice"
        place = _place("polygon", worst, polygons.polygon_lines)
        mended = "" if broken.all() else "; $reclean drops such faces"
        raise Refusal(f"{place}: {fault}: {named}{mended}")
    if not broken.any():
        return polygons
    kept = ~broken
    lines = None if polygons.polygon_lines is None else polygons.polygon_lines[kept]
    return replace(
        polygons, corners=polygons.corners[kept[polygons.owners]], sizes=polygons.sizes[kept], polygon_lines=lines
    )


def _place(kind: str, number: int, lines: IntArray | None) -> str:
    """Where a vertex or polygon stands."""
    return f"line {lines[number]}" if lines is not None else f"{kind} {number}"


def _broken(polygons: Polygons) -> NDArray[np.bool_]:
    """Polygons with fewer than three corners, and triangles that name a vertex twice."""
    broken = polygons.sizes < 3
    triangles = np.flatnonzero(polygons.sizes == 3)
    a, b, c = (polygons.corners[polygons.starts[triangles] + i] for i in range(3))
    broken[triangles] = (a == b) | (b == c) | (c == a)
    return broken


def triangles_of(polygons: Polygons) -> IntArray:
    """Return the polygons cut into triangles, shape (t, 3), in their order; no cut leaves a polygon of its plane.

    A convex polygon becomes a fan about its first corner; any other is cut ear by ear in its plane (Meisters 1975).
    """
    pieces: list[IntArray] = []
    order: list[IntArray] = []
    for size in np.unique(polygons.sizes):
        which = np.flatnonzero(polygons.sizes == size)
        loops = polygons.corners[polygons.starts[which][:, None] + np.arange(size)]  # (p, size)
        fan = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], axis=1)
        cut = loops[:, fan]  # (p, size - 2, 3)
        if size > 3:
            flat, convex = flattened(polygons.vertices[loops])
            for i in np.flatnonzero(~convex):
                cut[i] = loops[i][ears(flat[i])]
        pieces.append(cut.reshape(-1, 3))
        order.append(np.repeat(which, size - 2))
    if not pieces:
        return np.zeros((0, 3), dtype=np.int64)
    return np.concatenate(pieces)[np.argsort(np.concatenate(order), kind="stable")]


def flattened(loops: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return polygons, shape (p, size, 3), in the coordinates of their planes, (p, size, 2), and which are convex.

    The plane is that of the area vector (Newell); coordinates are of size one, and the polygon goes anticlockwise.
    """
    points = loops - loops.mean(axis=1, keepdims=True)
    size = np.abs(points).max(axis=(1, 2), keepdims=True)
    points = points / np.where(size > 0, size, 1.0)
    normal = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)  # twice the area
    length = row_norms(normal)
    normal = normal / np.where(length > 0, length, 1.0)[:, None]
    normal[length == 0] = [0.0, 0.0, 1.0]
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
    across /= row_norms(across)[:, None]
    beside = np.cross(normal, across)
    flat = np.stack([np.einsum("psd,pd->ps", points, axis) for axis in (across, beside)], axis=2)
    turns = _turn(np.roll(flat, 1, axis=1), flat, np.roll(flat, -1, axis=1))
    once = np.abs(_angles(flat).sum(axis=1)) < 3 * np.pi  # a pentagram turns left everywhere, too, and goes round twice
    return flat, (turns > FLAT).all(axis=1) & once


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Twice the signed area of plane triangles: positive where a, b, c turn left."""
    u, v = b - a, c - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _angles(flat: FloatArray) -> FloatArray:
    """Turn of the direction at each corner, -pi .. pi."""
    step = np.roll(flat, -1, axis=1) - flat
    before = np.roll(step, 1, axis=1)
    cross = before[..., 0] * step[..., 1] - before[..., 1] * step[..., 0]
    return np.arctan2(cross, (before * step).sum(axis=2))


def ears(flat: FloatArray) -> IntArray:
    """Return the triangles of a plane polygon that goes anticlockwise, shape (size - 2, 3), cut off ear by ear.

    An ear is a corner that turns left and whose triangle holds no other corner; of several the one of the best shape is
    cut. Where there is none, as in a polygon that crosses itself, the corner that turns left most is.

    >>> arrow = np.array([[0.0, 4.0], [0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0]])
    >>> ears(arrow).tolist()
    [[4, 0, 1], [2, 3, 4], [1, 2, 4]]
    """
    left = list(range(len(flat)))
    free = [_is_free(flat, left, i) for i in left]
    triangles = []
    while len(left) > 3:
        a, b, c = flat[np.roll(left, 1)], flat[left], flat[np.roll(left, -1)]
        longest = np.max([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)], axis=0)
        shape = _turn(a, b, c) / np.where(longest > 0, longest, 1.0)
        ear = int(np.argmax(np.where(np.array(free) & (shape > FLAT), shape + 2.0, shape)))
        triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear], free[ear]
        for i in (ear - 1, ear % len(left)):  # a cut changes only whether its neighbours are ears
            free[i] = _is_free(flat, left, i)
    return np.array([*triangles, left], dtype=np.int64)


def _is_free(flat: FloatArray, left: list[int], i: int) -> bool:
    """Whether the triangle at corner i of what is left holds, inside or on an edge, no other corner that may bar it.

    Corners that turn left bar nothing; copies of the triangle's own corners are the ends of a bridge to a hole.
    """
    a, b, c = corner = flat[[left[i - 1], left[i], left[(i + 1) % len(left)]]]
    rest = flat[left]
    others = rest[_turn(np.roll(rest, 1, axis=0), rest, np.roll(rest, -1, axis=0)) <= FLAT]
    others = others[~(others[:, None] == corner).all(axis=2).any(axis=1)]
    edges = (_turn(a, b, others), _turn(b, c, others), _turn(c, a, others))
    return not (np.min(edges, axis=0) >= -FLAT).any() if len(others) else True


def bent_polygons(polygons: Polygons) -> int:
    """Return how many polygons are not planar: a corner lies farther than BENT times the extent off their plane."""
    bent = 0
    for size in np.unique(polygons.sizes[polygons.sizes > 3]):
        which = np.flatnonzero(polygons.sizes == size)
        points = polygons.vertices[polygons.corners[polygons.starts[which][:, None] + np.arange(size)]]
        points = points - points.mean(axis=1, keepdims=True)
        normal = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
        height = np.abs(np.einsum("psd,pd->ps", points, normal)).max(axis=1)
        extent = np.sqrt((points**2).sum(axis=2).max(axis=1))
        bent += int((height > BENT * extent * row_norms(normal)).sum())
    return bent


def mesh_of(polygons: Polygons, name: str) -> TriangleMesh:
    """Return the mesh of polygons that were checked, without the broken triangles of one that passes a vertex twice."""
    faces = triangles_of(polygons)
    broken = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    return TriangleMesh(polygons.vertices, faces[~broken], name)
