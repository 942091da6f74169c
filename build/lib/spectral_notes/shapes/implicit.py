"""Solids given by signed distances: negative inside, zero on the surface, positive outside, in the unit of the points.

Unions, blends and cuts of solids are formulas in their distances; `shapes.contouring` makes meshes of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spectral_notes._checks import FloatArray


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
