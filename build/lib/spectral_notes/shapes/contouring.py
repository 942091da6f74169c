"""From a signed distance to a closed mesh of good triangles: marching cubes, then a relaxation on the surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import igl
import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import FloatArray, IntArray

Distance = Callable[[FloatArray], FloatArray]


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

    Raises
    ------
    ValueError
        If the surface reaches the sides of the box, or no point of the grid lies inside it.

    Examples
    --------
    >>> ball = lambda points: np.linalg.norm(points, axis=1) - 1.0
    >>> vertices, faces = mesh_zero_set(ball, (-1.2, -1.2, -1.2), (1.2, 1.2, 1.2), 0.2)
    >>> bool(np.abs(ball(vertices)).max() < 1e-6)
    True
    """
    axes = [np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")  # x runs fastest, as libigl expects
    grid = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    values = distance(grid)
    _check_box(values.reshape(x.shape))
    values[np.abs(values) < 1e-9 * step] = 1e-9 * step  # a vertex of the grid on the surface would be met twice
    vertices, faces, _ = igl.marching_cubes(values, grid, *(len(axis) for axis in axes), 0.0)
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    if _signed_volume(vertices, faces) < 0:
        faces = faces[:, ::-1].copy()
    return _relax(distance, vertices, faces, step, rounds), faces


def _check_box(values: FloatArray) -> None:
    """Raise if the surface does not lie inside the grid."""
    inner = values[1:-1, 1:-1, 1:-1]
    if not (inner < 0).any():
        raise ValueError("low and high must span a box that holds the surface; no point of the grid lies inside it")
    if (values <= 0).sum() > (inner <= 0).sum():
        raise ValueError("low and high must span a box that holds the surface; it reaches the sides of the box")


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
