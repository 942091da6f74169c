"""The course's shapes, each made by a formula or a recipe, the same on every machine.

Surfaces given by a formula stand here; `spectral_notes.bodies` holds those that are built from signed distances.
"""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import as_count, as_number
from spectral_notes.bodies import bracket, doll, doll_correspondence, goat
from spectral_notes.meshes import TriangleMesh

__all__ = ["bracket", "doll", "doll_correspondence", "egg", "goat", "sheet", "sphere", "torus"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def sphere(subdivisions: int = 5) -> TriangleMesh:
    """Return a unit sphere of nearly equal triangles: an icosahedron, subdivided and pushed out to radius one.

    The mesh has 10 * 4**subdivisions + 2 vertices.

    Parameters
    ----------
    subdivisions : int
        How often each triangle is split in four, 0 to 8.

    Returns
    -------
    TriangleMesh
        Closed, genus 0.

    Raises
    ------
    TypeError, ValueError
        If `subdivisions` is not an integer between 0 and 8.

    Examples
    --------
    >>> sphere(3)
    TriangleMesh('sphere', 642 vertices, 1280 faces)
    """
    subdivisions = as_count("subdivisions", subdivisions, 0, 8)
    vertices, faces = igl.icosahedron()
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(subdivisions):
        vertices, faces = igl.upsample(vertices, faces)
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return TriangleMesh(vertices, np.asarray(faces, dtype=np.int64), "sphere")


def egg(subdivisions: int = 5) -> TriangleMesh:
    r"""Return an egg: a surface of revolution about the z axis, blunt below and slender above.

    The unit sphere's point :math:`(x, y, z)` goes to :math:`(x e^{-0.18 \cdot 1.3 z}, y e^{-0.18 \cdot 1.3 z}, 1.3 z)`.

    Parameters
    ----------
    subdivisions : int
        How often each triangle of an icosahedron is split in four, 0 to 8.

    Returns
    -------
    TriangleMesh
        Closed, genus 0; 2.6 high.

    Raises
    ------
    TypeError, ValueError
        If `subdivisions` is not an integer between 0 and 8.

    Examples
    --------
    >>> float(np.ptp(egg(4).vertices[:, 2]).round(3))
    2.6
    """
    ball = sphere(subdivisions)
    vertices = ball.vertices * np.array([1.0, 1.0, 1.3])
    vertices[:, :2] *= np.exp(-0.18 * vertices[:, 2:])
    return TriangleMesh(vertices, ball.faces, "egg")


def torus(n_major: int = 120, n_minor: int = 50, R: float = 1.0, r: float = 0.4) -> TriangleMesh:
    r"""Return a torus about the z axis, on a grid of n_major by n_minor vertices.

    .. math:: ((R + r\cos v)\cos u,\ (R + r\cos v)\sin u,\ r\sin v)

    Parameters
    ----------
    n_major, n_minor : int
        Steps in u, the long way round, and in v, round the tube; at least 3.
    R, r : float
        Radius of the tube's centre circle and of the tube, 0 < r < R.

    Returns
    -------
    TriangleMesh
        Closed, genus 1; vertex ``i * n_minor + j`` lies at u = 2 pi i / n_major, v = 2 pi j / n_minor.

    Raises
    ------
    TypeError, ValueError
        If a count is below 3, or the radii do not satisfy 0 < r < R.

    Examples
    --------
    >>> torus(30, 12)
    TriangleMesh('torus', 360 vertices, 720 faces)
    """
    n_major, n_minor = as_count("n_major", n_major, 3), as_count("n_minor", n_minor, 3)
    r = as_number("r", r, above=0.0)
    R = as_number("R", R, above=r)
    u = 2.0 * np.pi * np.arange(n_major) / n_major
    v = 2.0 * np.pi * np.arange(n_minor) / n_minor
    return TriangleMesh(_torus_points(u, v, R, r), _grid_faces(n_major, n_minor, closed=True), "torus")


def sheet(bend: float = 0.0, n_long: int = 61, n_wide: int = 37) -> TriangleMesh:
    r"""Return a sheet of paper, 1 by 0.6, bent without stretching: every edge keeps its length to rounding.

    Its cross-section is a chain of equal chords that follows a logarithmic spiral whose radius doubles with each turn,
    so that a rolled sheet does not meet itself. The rulings run along y.

    Parameters
    ----------
    bend : float
        The angle in radians by which the sheet turns from its first chord to its last: 0 is flat, 2.4 an arch,
        4 pi a roll of two turns; negative values bend the other way.
    n_long, n_wide : int
        Vertices along the length and across, at least 2.

    Returns
    -------
    TriangleMesh
        With a boundary; the faces do not depend on `bend`: vertex ``i * n_wide + j`` is always the same point of paper.

    Raises
    ------
    TypeError, ValueError
        If `bend` is not a finite number, or a count is below 2.

    Examples
    --------
    >>> from spectral_notes.meshes import edge_lengths
    >>> flat, rolled = sheet(), sheet(bend=4 * np.pi)
    >>> bool(np.abs(edge_lengths(flat) - edge_lengths(rolled)).max() < 1e-15)
    True
    """
    bend = as_number("bend", bend)
    n_long, n_wide = as_count("n_long", n_long, 2), as_count("n_wide", n_wide, 2)
    growth = np.log(2.0) / (2.0 * np.pi)
    s = np.linspace(0.0, 1.0, n_long - 1)
    turn = np.sign(bend) * np.log1p(s * np.expm1(growth * abs(bend))) / growth
    angle = bend / 2.0 - turn
    step = 1.0 / (n_long - 1)
    x = np.concatenate([[0.0], np.cumsum(step * np.cos(angle))])
    z = np.concatenate([[0.0], np.cumsum(step * np.sin(angle))])
    y = np.linspace(0.0, 0.6, n_wide)
    vertices = np.column_stack([np.repeat(x, n_wide), np.tile(y, n_long), np.repeat(z, n_wide)])
    return TriangleMesh(vertices, _grid_faces(n_long, n_wide), "sheet")


def _torus_points(u: FloatArray, v: FloatArray, R: float, r: float) -> FloatArray:
    """Return the points of a torus at all pairs (u, v), v running fastest."""
    u, v = np.repeat(u, len(v)), np.tile(v, len(u))
    return np.column_stack([(R + r * np.cos(v)) * np.cos(u), (R + r * np.cos(v)) * np.sin(u), r * np.sin(v)])


def _grid_faces(n_i: int, n_j: int, *, closed: bool = False) -> IntArray:
    """Return two triangles a cell of a grid of vertices i * n_j + j; a closed grid joins last lines to first."""
    i, j = np.meshgrid(np.arange(n_i if closed else n_i - 1), np.arange(n_j if closed else n_j - 1), indexing="ij")
    a, b = i.ravel(), j.ravel()
    c, d = (a + 1) % n_i, (b + 1) % n_j
    lower = np.column_stack([a * n_j + b, c * n_j + b, c * n_j + d])
    upper = np.column_stack([a * n_j + b, c * n_j + d, a * n_j + d])
    return np.stack([lower, upper], axis=1).reshape(-1, 3).astype(np.int64)
