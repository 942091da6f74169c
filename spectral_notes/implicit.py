"""Surfaces given as zero sets of signed distances, and the way from a distance to a good triangle mesh.

A distance is a function of points (n, 3) to values (n,): negative inside, zero on the surface, positive outside.
Blends and cuts of distances are formulas; marching cubes and a relaxation make the mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Distance = Callable[[FloatArray], FloatArray]


def round_cone(
    points: FloatArray, start: Sequence[float], end: Sequence[float], start_radius: float, end_radius: float
) -> FloatArray:
    r"""Return the signed distance to the hull of two balls: a capsule whose radius changes along its axis.

    .. math:: d(x) = \min_{0 \le t \le \ell} |x - c(t)| - r(t)

    with the centre :math:`c(t)` on the axis and the radius :math:`r(t)` linear in :math:`t`. With :math:`y` along the
    axis and :math:`q` across it, the minimum lies at :math:`y - t = q \tan\alpha` with
    :math:`\sin\alpha = (r_0 - r_1)/\ell`.

    Parameters
    ----------
    points : ndarray (n, 3)
        Where to measure.
    start, end : sequence of 3 floats
        The centres of the two balls.
    start_radius, end_radius : float
        Their radii; they may differ by less than the distance of the centres.

    Returns
    -------
    ndarray (n,)
        Negative inside, positive outside, in the unit of the points.

    Examples
    --------
    >>> points = np.array([[0.0, 0.5, 0.0], [0.0, 2.0, 0.0]])
    >>> round_cone(points, (0, 0, 0), (1, 0, 0), 0.2, 0.2)
    array([0.3, 1.8])
    """
    origin = np.asarray(start, dtype=np.float64)
    axis = np.asarray(end, dtype=np.float64) - origin
    length = float(np.linalg.norm(axis))
    offset = points - origin
    along = offset @ (axis / length)
    across = np.sqrt(np.maximum(np.einsum("ij,ij->i", offset, offset) - along**2, 0.0))
    slope = (start_radius - end_radius) / length
    t = np.clip(along - across * slope / np.sqrt(1.0 - slope**2), 0.0, length)
    return np.asarray(np.sqrt((along - t) ** 2 + across**2) - (start_radius - slope * t))


def rounded_box(points: FloatArray, center: Sequence[float], half_size: Sequence[float], radius: float) -> FloatArray:
    """Return the signed distance to an upright box whose edges are rounded.

    Parameters
    ----------
    points : ndarray (n, 3)
        Where to measure.
    center, half_size : sequence of 3 floats
        The middle of the box, and half its extent along each axis.
    radius : float
        Radius of the edges, at most the smallest half size.

    Returns
    -------
    ndarray (n,)
        Negative inside, positive outside.

    Examples
    --------
    >>> rounded_box(np.array([[2.0, 0.0, 0.0]]), (0, 0, 0), (1, 1, 1), 0.1)
    array([1.])
    """
    excess = np.abs(points - np.asarray(center)) - (np.asarray(half_size) - radius)
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return np.asarray(outside + np.minimum(excess.max(axis=1), 0.0) - radius)


def rounded_extrusion(profile: FloatArray, slab: FloatArray, radius: float) -> FloatArray:
    """Return the signed distance to the part of an endless prism inside a slab, its rims rounded.

    Parameters
    ----------
    profile : ndarray (n,)
        Signed distance to the prism.
    slab : ndarray (n,)
        Signed distance to the slab across it.
    radius : float
        Radius of the rims.

    Returns
    -------
    ndarray (n,)
        Negative inside, positive outside.

    Examples
    --------
    >>> rounded_extrusion(np.array([3.0]), np.array([4.0]), 0.0)
    array([5.])
    """
    a, b = profile + radius, slab + radius
    outside = np.sqrt(np.maximum(a, 0.0) ** 2 + np.maximum(b, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(a, b), 0.0) - radius)


def infinite_cylinder(points: FloatArray, center: Sequence[float], axis: int, radius: float) -> FloatArray:
    """Return the signed distance to an endless cylinder along coordinate axis 0, 1 or 2.

    Parameters
    ----------
    points : ndarray (n, 3)
        Where to measure.
    center : sequence of 3 floats
        A point on the axis.
    axis : int
        The coordinate along which the cylinder runs.
    radius : float
        Its radius.

    Returns
    -------
    ndarray (n,)
        Negative inside, positive outside.

    Examples
    --------
    >>> infinite_cylinder(np.array([[3.0, 9.0, 4.0]]), (0, 0, 0), 1, 2.0)
    array([3.])
    """
    across = np.delete(points - np.asarray(center), axis, axis=1)
    return np.asarray(np.linalg.norm(across, axis=1) - radius)


def blend(distances: Sequence[FloatArray], width: float) -> FloatArray:
    r"""Return the smooth union of shapes: never above the smallest distance, with fillets where two come close.

    .. math:: d = -w \log \sum_i e^{-d_i / w}

    Parameters
    ----------
    distances : sequence of ndarray (n,)
        One array a shape.
    width : float
        Width :math:`w` of the fillets; the surface moves out by :math:`w \log 2` where two shapes touch.

    Returns
    -------
    ndarray (n,)
        The blended distances.

    Examples
    --------
    >>> blend([np.array([0.0]), np.array([9.0])], 0.1).round(6) + 0.0
    array([0.])
    """
    nearest = np.min(distances, axis=0)
    return np.asarray(nearest - width * np.log(sum(np.exp((nearest - d) / width) for d in distances)))


def cut(distance: FloatArray, tool: FloatArray, width: float) -> FloatArray:
    """Return the smooth difference, the shape with the tool taken away: never below the given distance.

    Parameters
    ----------
    distance, tool : ndarray (n,)
        Signed distances to the shape and to what is cut from it.
    width : float
        Width of the rounding along the cut.

    Returns
    -------
    ndarray (n,)
        The distances to what is left.

    Examples
    --------
    >>> cut(np.array([-1.0]), np.array([-0.5]), 0.01).round(6)
    array([0.5])
    """
    return -blend([-distance, tool], width)


def mesh_zero_set(
    distance: Distance, low: Sequence[float], high: Sequence[float], step: float, *, rounds: int = 20
) -> tuple[FloatArray, IntArray]:
    """Return a triangle mesh of the zero set, of edges near `step`, closed if the box holds the surface.

    Marching cubes leaves slivers. Each round moves every vertex half-way to the mean of its neighbours, but only along
    the surface, and then one Newton step back onto it.

    Parameters
    ----------
    distance : callable
        Takes points (n, 3), returns signed distances (n,).
    low, high : sequence of 3 floats
        Corners of a box that holds the surface.
    step : float
        Grid step.
    rounds : int
        Number of relaxation rounds.

    Returns
    -------
    vertices : ndarray (n, 3)
        Points of the zero set.
    faces : ndarray (m, 3)
        Triangles, their normals pointing out.

    Examples
    --------
    >>> ball = lambda points: np.linalg.norm(points, axis=1) - 1.0
    >>> vertices, faces = mesh_zero_set(ball, (-1.2, -1.2, -1.2), (1.2, 1.2, 1.2), 0.2)
    >>> bool(np.abs(ball(vertices)).max() < 1e-6)
    True
    """
    axes = [np.arange(a, b, step) for a, b in zip(low, high, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")  # x runs fastest, as libigl expects
    grid = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    sizes = [len(axis) for axis in axes]
    vertices, faces, _ = igl.marching_cubes(distance(grid), grid, *sizes, 0.0)
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    if _signed_volume(vertices, faces) < 0:
        faces = faces[:, ::-1].copy()
    return _relax(distance, vertices, faces, step, rounds), faces


def _relax(distance: Distance, vertices: FloatArray, faces: IntArray, step: float, rounds: int) -> FloatArray:
    """Spread the vertices evenly over the zero set."""
    n = len(vertices)
    pairs = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    adjacency = sp.csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))  # each edge both ways
    degree = adjacency.sum(axis=1)
    _, gradient = _value_and_gradient(distance, vertices)
    for _ in range(rounds):
        pull = adjacency @ vertices / degree[:, None] - vertices
        pull -= _along(gradient, np.einsum("ij,ij->i", pull, gradient))
        vertices = vertices + 0.5 * pull
        value, gradient = _value_and_gradient(distance, vertices)
        vertices = vertices - _along(gradient, np.clip(value, -step, step))
    return vertices


def _along(gradient: FloatArray, value: FloatArray) -> FloatArray:
    """Return the step along the gradient that changes a linear function by `value`; slopes count as 1/2 at least."""
    squared = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 0.25)
    return np.asarray((value / squared)[:, None] * gradient)


def _value_and_gradient(distance: Distance, points: FloatArray, h: float = 1e-7) -> tuple[FloatArray, FloatArray]:
    """Return a distance (n,) and its forward differences (n, 3)."""
    value = distance(points)
    return value, np.column_stack([(distance(points + h * axis) - value) / h for axis in np.eye(3)])


def _signed_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Return six times the enclosed volume: positive when the normals point out."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)))
