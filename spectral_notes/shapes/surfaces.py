"""Curved surfaces given by formulas: sphere, egg, potato, torus, and a patch of a torus."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_count, as_floats, as_number
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.triangulations import grid_faces


def sphere(subdivisions: int = 5) -> TriangleMesh:
    """Return a unit sphere of nearly equal triangles: an icosahedron, subdivided and pushed out to radius one.

    The mesh has 10 * 4**subdivisions + 2 vertices.

    Parameters
    ----------
    subdivisions : how often each triangle is split in four, 0 to 8

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
    r"""Return an egg 2.6 high: a surface of revolution about the z axis, blunt below and slender above.

    The unit sphere's point :math:`(x, y, z)` goes to :math:`(x e^{-0.18 \cdot 1.3 z}, y e^{-0.18 \cdot 1.3 z}, 1.3 z)`.

    Parameters
    ----------
    subdivisions : as in `sphere`

    Examples
    --------
    >>> float(np.ptp(egg(4).vertices[:, 2]).round(3))
    2.6
    """
    ball = sphere(subdivisions)
    vertices = ball.vertices * np.array([1.0, 1.0, 1.3])
    vertices[:, :2] *= np.exp(-0.18 * vertices[:, 2:])
    return TriangleMesh(vertices, ball.faces, "egg")


def potato(seed: int = 0, subdivisions: int = 5) -> TriangleMesh:
    r"""Return a smooth lump, about 2.8 long: a stretched sphere, pushed along its radii by a few long waves.

    The unit sphere's point :math:`x` goes to :math:`s \odot x\,(1 + \sum_i a_i \sin(k_i \cdot x + \varphi_i))` with six
    waves of amplitude 0.06, random directions, wavelengths from 1.5 to 3.5, and the stretch :math:`s = (1.4, 1, 0.9)`.

    Parameters
    ----------
    seed : each seed is another potato
    subdivisions : as in `sphere`

    Examples
    --------
    >>> potato(seed=1, subdivisions=4)
    TriangleMesh('potato', 2562 vertices, 5120 faces)
    """
    rng = np.random.default_rng(as_count("seed", seed, 0))
    ball = sphere(subdivisions)
    directions = rng.normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = directions * (2.0 * np.pi / rng.uniform(1.5, 3.5, size=(6, 1)))
    phases = rng.uniform(0.0, 2.0 * np.pi, size=6)
    push = 1.0 + 0.06 * np.sin(ball.vertices @ waves.T + phases).sum(axis=1)
    return TriangleMesh(ball.vertices * np.array([1.4, 1.0, 0.9]) * push[:, None], ball.faces, "potato")


def torus(n_major: int = 120, n_minor: int = 50, R: float = 1.0, r: float = 0.4) -> TriangleMesh:
    r"""Return a torus about the z axis, on a grid of n_major by n_minor vertices.

    .. math:: ((R + r\cos v)\cos u,\ (R + r\cos v)\sin u,\ r\sin v)

    Vertex ``i * n_minor + j`` lies at u = 2 pi i / n_major, v = 2 pi j / n_minor.

    Parameters
    ----------
    n_major, n_minor : steps in u, the long way round, and in v, round the tube; at least 3
    R, r : radius of the tube's centre circle and of the tube, 0 < r < R

    Examples
    --------
    >>> torus(30, 12)
    TriangleMesh('torus', 360 vertices, 720 faces)
    """
    n_major, n_minor = as_count("n_major", n_major, 3), as_count("n_minor", n_minor, 3)
    R, r = torus_radii(R, r)
    u = 2.0 * np.pi * np.arange(n_major) / n_major
    v = 2.0 * np.pi * np.arange(n_minor) / n_minor
    points = torus_points(np.repeat(u, n_minor), np.tile(v, n_major), R, r)
    return TriangleMesh(points, grid_faces(n_major, n_minor, closed=True), "torus")


def torus_patch(
    u_range: ArrayLike = (0.0, 1.5 * np.pi), v_range: ArrayLike = (-0.75 * np.pi, 0.75 * np.pi), n_major: int = 91,
    n_minor: int = 41, R: float = 1.0, r: float = 0.4,
) -> TriangleMesh:
    """Return the part of a torus over a rectangle of its two angles: a surface with one boundary loop.

    The points are those of `torus`; the angles are evenly spaced and hold both ends. Vertex ``i * n_minor + j`` lies at
    the i-th u and the j-th v.

    Parameters
    ----------
    u_range, v_range : (2,), first and last angle in radians, the long way round and round the tube
        Increasing, less than a full turn apart.
    n_major, n_minor : vertices in u and in v, at least 2
    R, r : radius of the tube's centre circle and of the tube, 0 < r < R

    Examples
    --------
    >>> from spectral_notes.meshes import boundary_loops
    >>> len(boundary_loops(torus_patch()))
    1
    """
    n_major, n_minor = as_count("n_major", n_major, 2), as_count("n_minor", n_minor, 2)
    R, r = torus_radii(R, r)
    u, v = _angles("u_range", u_range, n_major), _angles("v_range", v_range, n_minor)
    points = torus_points(np.repeat(u, n_minor), np.tile(v, n_major), R, r)
    return TriangleMesh(points, grid_faces(n_major, n_minor), "torus_patch")


def torus_radii(R: float, r: float) -> tuple[float, float]:
    """Return the radii of a torus, checked to be 0 < r < R."""
    r = as_number("r", r, above=0.0)
    return as_number("R", R, above=r), r


def torus_points(u: FloatArray, v: FloatArray, R: float, r: float) -> FloatArray:
    """Return the points (..., 3) of a torus at its two angles, arrays of one shape."""
    around = R + r * np.cos(v)
    return np.stack([around * np.cos(u), around * np.sin(u), r * np.sin(v)], axis=-1)


def _angles(name: str, value: ArrayLike, n: int) -> FloatArray:
    """Return n evenly spaced angles over a range of less than a full turn."""
    first, last = as_floats(name, value, (2,))
    if not 0.0 < last - first < 2.0 * np.pi:
        raise ValueError(f"{name} must increase by less than 2 pi; got ({first:g}, {last:g})")
    return np.linspace(first, last, n)
