"""Surfaces given by a formula of two parameters: tangent vectors, metric, lengths, areas and curvatures.

A surface is any function of two arrays `u` and `v` of one shape that returns the points, with a last axis of three.
Derivatives are taken numerically, so the formula is all that is needed. The arguments `surface`, `u` and `v` mean the
same everywhere; see `tangent_vectors`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_count, as_floats
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.surfaces import torus_points, torus_radii
from spectral_notes.shapes.triangulations import grid_faces

Surface = Callable[[FloatArray, FloatArray], FloatArray]

STEP = 2e-3  # of the differences: truncation h^4 / 30 and rounding 1e-16 / h^2 both stay near 1e-11 for unit scales


def torus_surface(R: float = 1.0, r: float = 0.4) -> Surface:
    """Return the torus of `shapes.torus` as a function of its two angles, arrays of one shape, to points (..., 3).

    Parameters
    ----------
    R, r : radius of the tube's centre circle and of the tube, 0 < r < R

    Examples
    --------
    >>> torus_surface()(np.array([0.0]), np.array([np.pi])).round(12).tolist()
    [[0.6, 0.0, 0.0]]
    """
    R, r = torus_radii(R, r)
    return lambda u, v: torus_points(u, v, R, r)


def torus_curvatures(v: ArrayLike, R: float = 1.0, r: float = 0.4) -> tuple[FloatArray, FloatArray]:
    r"""Return the Gaussian and the mean curvature of a torus at the angle v round the tube, by formula.

    .. math:: K = \frac{\cos v}{r (R + r \cos v)}, \qquad
              H = \frac12 \left(\frac1r + \frac{\cos v}{R + r \cos v}\right)

    Parameters
    ----------
    v : (n,), angles round the tube in radians, 0 on the outermost circle
    R, r : radius of the tube's centre circle and of the tube, 0 < r < R

    Returns
    -------
    K : (n,), in 1 / squared unit of the radii
    H : (n,), in 1 / unit of the radii; positive where the surface bulges outwards

    Examples
    --------
    >>> K, H = torus_curvatures([0.0, np.pi / 2], R=1.0, r=0.5)
    >>> K.round(6).tolist(), H.round(6).tolist()
    ([1.333333, 0.0], [1.333333, 1.0])
    """
    cos = np.cos(as_floats("v", v, ("n",)))
    R, r = torus_radii(R, r)
    return cos / (r * (R + r * cos)), (1.0 / r + cos / (R + r * cos)) / 2.0


def tangent_vectors(surface: Surface, u: ArrayLike, v: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the two tangent vectors x_u and x_v, (..., 3) each: the velocities of the coordinate lines.

    By fourth-order central differences, to about 1e-11 where the formula has unit scales.

    Parameters
    ----------
    surface : parameters (u, v) to points (..., 3)
    u, v : of one shape, parameters

    Examples
    --------
    >>> x_u, x_v = tangent_vectors(torus_surface(), 0.0, 0.0)
    >>> x_u.round(9).tolist(), x_v.round(9).tolist()
    ([0.0, 1.4, 0.0], [0.0, 0.0, 0.4])
    """
    u, v = _parameters(surface, u, v)
    return _slope(lambda s: surface(u + s, v)), _slope(lambda s: surface(u, v + s))


def unit_normals(surface: Surface, u: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the unit normals, x_u cross x_v over its length, shape (..., 3); not a number where the chart collapses.

    Examples
    --------
    >>> unit_normals(torus_surface(), 0.0, 0.0).round(9).tolist()  # outwards
    [1.0, 0.0, 0.0]
    """
    across = np.cross(*tangent_vectors(surface, u, v))
    with np.errstate(invalid="ignore"):
        return across / np.linalg.norm(across, axis=-1, keepdims=True)


def first_fundamental_form(surface: Surface, u: ArrayLike, v: ArrayLike) -> FloatArray:
    r"""Return the metric g (..., 2, 2): the symmetric matrices of inner products of the tangent vectors.

    .. math:: g = J^\mathsf{T} J, \qquad J = (x_u \; x_v)

    Positive definite where the tangent vectors are independent; singular where the chart collapses.

    Examples
    --------
    >>> first_fundamental_form(torus_surface(), 0.0, 0.0).round(9).tolist()
    [[1.96, 0.0], [0.0, 0.16]]
    """
    J = np.stack(tangent_vectors(surface, u, v), axis=-1)  # (..., 3, 2)
    return np.swapaxes(J, -1, -2) @ J


def second_fundamental_form(surface: Surface, u: ArrayLike, v: ArrayLike) -> FloatArray:
    r"""Return how fast the surface bends away from its tangent plane, positive where it bulges along its normal N.

    .. math:: b = -\begin{pmatrix} x_{uu} \cdot N & x_{uv} \cdot N \\ x_{uv} \cdot N & x_{vv} \cdot N \end{pmatrix}

    Symmetric, (..., 2, 2). Most books have the opposite sign; this one makes an outward normal see a sphere as
    positive. Second derivatives by fourth-order differences, to about 1e-10 where the formula has unit scales.

    Examples
    --------
    >>> second_fundamental_form(torus_surface(), 0.0, 0.0).round(8).diagonal().tolist()
    [1.4, 0.4]
    """
    u, v = _parameters(surface, u, v)
    normal = unit_normals(surface, u, v)
    uu, vv = _bend(lambda s: surface(u + s, v)), _bend(lambda s: surface(u, v + s))
    uv = (_bend(lambda s: surface(u + s, v + s)) - _bend(lambda s: surface(u + s, v - s))) / 4.0
    derivatives = np.stack([uu, uv, uv, vv], axis=-2)  # (..., 4, 3)
    along_normal = -np.einsum("...kd,...d->...k", derivatives, normal)
    return along_normal.reshape(*along_normal.shape[:-1], 2, 2)


def surface_curvatures(surface: Surface, u: ArrayLike, v: ArrayLike) -> tuple[FloatArray, FloatArray]:
    r"""Return the Gaussian and the mean curvature from the two fundamental forms.

    .. math:: K = \det(g^{-1} b), \qquad H = \tfrac12 \operatorname{tr}(g^{-1} b)

    In 1 / squared unit and 1 / unit of the points; not a number where the chart collapses. Exchanging u and v turns the
    normal and the sign of H, never that of K (Gray, Abbena and Salamon, "Modern Differential Geometry of Curves and
    Surfaces", 2006, chapter 13).

    Examples
    --------
    >>> K, H = surface_curvatures(torus_surface(), 0.0, 0.0)
    >>> exact = torus_curvatures([0.0])
    >>> bool(abs(K - exact[0][0]) < 1e-8), bool(abs(H - exact[1][0]) < 1e-8)
    (True, True)
    """
    g = first_fundamental_form(surface, u, v)
    b = second_fundamental_form(surface, u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        area = np.linalg.det(g)
        trace = g[..., 1, 1] * b[..., 0, 0] - 2.0 * g[..., 0, 1] * b[..., 0, 1] + g[..., 0, 0] * b[..., 1, 1]
        return np.linalg.det(b) / area, 0.5 * trace / area


def patch_area(surface: Surface, u_range: ArrayLike, v_range: ArrayLike, n: int = 64) -> float:
    r"""Return the area of a patch by the midpoint rule on n x n cells of its parameters: an error of order two.

    .. math:: A = \int\!\!\int \sqrt{\det g}\; du\, dv

    On a patch that closes up smoothly in both directions the error falls faster than any power.

    Parameters
    ----------
    surface : parameters (u, v) to points (..., 3)
    u_range, v_range : (2,), first and last value of each parameter, increasing
    n : cells in each direction

    Examples
    --------
    >>> bool(abs(patch_area(torus_surface(), (0, 2 * np.pi), (0, 2 * np.pi)) - 4 * np.pi**2 * 0.4) < 1e-9)
    True
    """
    n = as_count("n", n, 1)
    (u_first, u_last), (v_first, v_last) = _range("u_range", u_range), _range("v_range", v_range)
    middle = (np.arange(n) + 0.5) / n
    u, v = np.meshgrid(u_first + (u_last - u_first) * middle, v_first + (v_last - v_first) * middle, indexing="ij")
    det = np.linalg.det(first_fundamental_form(surface, u, v))
    return float(np.sqrt(np.maximum(det, 0.0)).mean() * (u_last - u_first) * (v_last - v_first))


def patch_mesh(
    surface: Surface, u_range: ArrayLike, v_range: ArrayLike, n_u: int = 61, n_v: int = 61, name: str = ""
) -> TriangleMesh:
    """Return the mesh of a patch on an even grid of its parameters, both ends included.

    Vertex ``i * n_v + j`` lies at the i-th u and the j-th v; faces wind as x_u turns to x_v.

    Parameters
    ----------
    surface, u_range, v_range : as in `patch_area`
    n_u, n_v : vertices in each direction, at least 2
    name : what the mesh is called

    Examples
    --------
    >>> patch_mesh(torus_surface(), (0, 1), (0, 1), 11, 5)
    TriangleMesh('', 55 vertices, 80 faces)
    """
    n_u, n_v = as_count("n_u", n_u, 2), as_count("n_v", n_v, 2)
    us, vs = np.linspace(*_range("u_range", u_range), n_u), np.linspace(*_range("v_range", v_range), n_v)
    points = surface(np.repeat(us, n_v), np.tile(vs, n_u))
    return TriangleMesh(points, grid_faces(n_u, n_v), name)


def coordinate_lines(
    surface: Surface, u_range: ArrayLike, v_range: ArrayLike, n_u: int = 7, n_v: int = 7
) -> tuple[FloatArray, ...]:
    """Return the curves on a patch along which u, then those along which v stands still, as polylines (129, 3).

    Parameters
    ----------
    surface, u_range, v_range : as in `patch_area`
    n_u, n_v : curves of constant u and of constant v, evenly spaced from end to end

    Examples
    --------
    >>> len(coordinate_lines(torus_surface(), (0, 1), (0, 1), 3, 4))
    7
    """
    us = np.linspace(*_range("u_range", u_range), as_count("n_u", n_u, 0))
    vs = np.linspace(*_range("v_range", v_range), as_count("n_v", n_v, 0))
    along_u, along_v = np.linspace(*_range("u_range", u_range), 129), np.linspace(*_range("v_range", v_range), 129)
    of_constant_u = [surface(np.full(129, u), along_v) for u in us]
    return (*of_constant_u, *(surface(along_u, np.full(129, v)) for v in vs))


def _range(name: str, value: ArrayLike) -> tuple[float, float]:
    """Return the two ends of a range that increases."""
    first, last = as_floats(name, value, (2,))
    if not first < last:
        raise ValueError(f"{name} must increase; got ({first:g}, {last:g})")
    return float(first), float(last)


def _parameters(surface: Surface, u: ArrayLike, v: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the parameters as float arrays of one shape to which the surface gives points in space."""
    shape = np.shape(u)
    u, v = as_floats("u", u, shape), as_floats("v", v, shape)
    as_floats("points of the surface", surface(u, v), (*shape, 3))
    return u, v


def _slope(x: Callable[[float], FloatArray]) -> FloatArray:
    """Derivative of x(s) at 0 by the five-point formula."""
    return (8.0 * (x(STEP) - x(-STEP)) - (x(2 * STEP) - x(-2 * STEP))) / (12.0 * STEP)


def _bend(x: Callable[[float], FloatArray]) -> FloatArray:
    """Second derivative of x(s) at 0 by the five-point formula."""
    near, far = x(STEP) + x(-STEP), x(2 * STEP) + x(-2 * STEP)
    return (16.0 * near - far - 30.0 * x(0.0)) / (12.0 * STEP**2)
