"""Flat domains whose spectra are known: rectangle, disk, equilateral triangle, flat torus, and two isospectral drums.

All but the flat torus lie in the plane z = 0, counter-clockwise.
"""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray, IntArray, as_count, as_number
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.triangulations import grid_faces, ring_coordinates, ring_faces, split_triangle

# The tiles of the drums, right angle first, neighbours mirror images in their common side; four of seven are in both.
_COMMON_TILES = (
    ((-1, 1), (-3, 1), (-1, -1)), ((-1, 1), (1, 1), (-1, -1)), ((1, -1), (1, 1), (-1, -1)), ((1, -1), (1, 1), (3, -1)),
)
_DRUM_TILES = (
    (*_COMMON_TILES, ((3, 1), (1, 1), (3, -1)), ((1, -1), (1, -3), (3, -1)), ((-1, 1), (-3, 1), (-1, 3))),
    (*_COMMON_TILES, ((1, -1), (1, -3), (-1, -1)), ((-1, 1), (-3, 1), (-1, 3)), ((-3, 3), (-3, 1), (-1, 3))),
)


def rectangle(width: float = 1.0, height: float = 1.0, n_x: int = 41, n_y: int = 41) -> TriangleMesh:
    """Return a rectangle from the origin, on a grid of n_x by n_y vertices, each cell cut along the same diagonal.

    Vertex ``i * n_y + j`` lies at the i-th x and the j-th y.

    Parameters
    ----------
    width, height : extent in x and in y, positive
    n_x, n_y : vertices along x and along y, at least 2

    Examples
    --------
    >>> round(rectangle(2.0, 3.0).area, 12)
    6.0
    """
    width, height = as_number("width", width, above=0.0), as_number("height", height, above=0.0)
    n_x, n_y = as_count("n_x", n_x, 2), as_count("n_y", n_y, 2)
    x, y = np.linspace(0.0, width, n_x), np.linspace(0.0, height, n_y)
    vertices = np.column_stack([np.repeat(x, n_y), np.tile(y, n_x), np.zeros(n_x * n_y)])
    return TriangleMesh(vertices, grid_faces(n_x, n_y), "rectangle")


def disk(radius: float = 1.0, n_rings: int = 32) -> TriangleMesh:
    """Return a disk about the origin, made of rings of triangles; its boundary is a polygon inscribed in the circle.

    Ring k holds 6 k vertices at the distance ``radius * k / n_rings``.

    Parameters
    ----------
    radius : radius, positive
    n_rings : rings of triangles, at least 1; the mesh has ``1 + 3 * n_rings * (n_rings + 1)`` vertices

    Examples
    --------
    >>> disk(n_rings=2)
    TriangleMesh('disk', 19 vertices, 24 faces)
    """
    radius = as_number("radius", radius, above=0.0)
    n_rings = as_count("n_rings", n_rings, 1)
    ring, around = ring_coordinates(n_rings)
    distance = radius * ring / n_rings
    vertices = np.column_stack([distance * np.cos(around), distance * np.sin(around), np.zeros(len(ring))])
    return TriangleMesh(vertices, ring_faces(n_rings), "disk")


def equilateral_triangle(side: float = 1.0, refinement: int = 32) -> TriangleMesh:
    """Return an equilateral triangle, its base along x, cut into refinement**2 equilateral triangles.

    Parameters
    ----------
    side : length of a side, positive
    refinement : parts into which each side is cut, at least 1

    Examples
    --------
    >>> equilateral_triangle(refinement=4)
    TriangleMesh('triangle', 15 vertices, 16 faces)
    """
    side = as_number("side", side, above=0.0)
    refinement = as_count("refinement", refinement, 1)
    corners = side * np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])
    points, faces = split_triangle(corners, refinement)
    return TriangleMesh(np.column_stack([points, np.zeros(len(points))]), faces, "triangle")


def gww_drums(refinement: int = 16) -> tuple[TriangleMesh, TriangleMesh]:
    """Return the two drums of Gordon, Webb and Wolpert (1992): different shapes with the same spectrum.

    Each is made of seven right isosceles triangles with legs of length 2, neighbours being mirror images. Every tile is
    refined in the same way, so that the two meshes, too, have the same discrete spectrum. Both have area 14 and
    perimeter 12 + 6 sqrt(2).

    Parameters
    ----------
    refinement : parts into which each leg of a tile is cut, at least 1

    Examples
    --------
    >>> one, other = gww_drums()
    >>> one.area, other.area
    (14.0, 14.0)
    """
    refinement = as_count("refinement", refinement, 1)
    one, other = (_drum(tiles, refinement) for tiles in _DRUM_TILES)
    return TriangleMesh(*one, "drum_1"), TriangleMesh(*other, "drum_2")


def flat_torus(width: float = 1.0, height: float = 1.0, n_x: int = 32, n_y: int = 32) -> tuple[IntArray, FloatArray]:
    r"""Return a rectangle whose opposite sides are one, as faces and edge lengths: no surface in space is needed.

    The cotan Laplacian takes lengths alone. The smooth eigenvalues are :math:`4\pi^2 (j^2/a^2 + k^2/b^2)` for all
    integers :math:`j, k`, with :math:`a, b` the width and height.

    Parameters
    ----------
    width, height : lengths of the two shortest closed straight lines along the sides, positive
    n_x, n_y : vertices along each, at least 3

    Returns
    -------
    faces : (m, 3); vertex ``i * n_y + j`` lies at (i width / n_x, j height / n_y)
    lengths : (m, 3); column c holds the edge opposite to corner c of each face, as in libigl

    Examples
    --------
    >>> faces, lengths = flat_torus(4.0, 3.0, n_x=4, n_y=3)
    >>> lengths[0].round(6).tolist()
    [1.0, 1.414214, 1.0]
    """
    width, height = as_number("width", width, above=0.0), as_number("height", height, above=0.0)
    n_x, n_y = as_count("n_x", n_x, 3), as_count("n_y", n_y, 3)
    step_x, step_y = width / n_x, height / n_y
    along_x, along_y, diagonal = step_x, step_y, float(np.hypot(step_x, step_y))
    lengths = np.tile([[along_y, diagonal, along_x], [along_x, along_y, diagonal]], (n_x * n_y, 1))
    return grid_faces(n_x, n_y, closed=True), lengths


def _drum(tiles: tuple[tuple[tuple[int, int], ...], ...], n: int) -> tuple[FloatArray, IntArray]:
    """Return the vertices and faces of tiles refined alike and sewn together."""
    points, faces = [], []
    for number, tile in enumerate(tiles):
        corners = np.array(tile, dtype=np.float64)
        tile_points, tile_faces = split_triangle(corners, n)
        side_1, side_2 = corners[1] - corners[0], corners[2] - corners[0]
        if side_1[0] * side_2[1] < side_1[1] * side_2[0]:
            tile_faces = tile_faces[:, ::-1]  # a mirrored tile, clockwise until turned
        points.append(tile_points)
        faces.append(tile_faces + number * len(tile_points))
    lattice = np.rint(np.vstack(points) * n).astype(np.int64)  # all coordinates are whole multiples of 2 / n
    positions, same = np.unique(lattice, axis=0, return_inverse=True)
    vertices = np.column_stack([positions / n, np.zeros(len(positions))])
    return vertices, same.ravel()[np.vstack(faces)].astype(np.int64)
