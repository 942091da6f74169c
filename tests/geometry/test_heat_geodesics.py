"""Distances from heat against the sphere's angle, the exact polyhedral distances, and their own laws."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.geometry.geodesics import geodesic_distances
from spectral_notes.geometry.heat_geodesics import HeatMethod, heat_distances
from spectral_notes.meshes import TriangleMesh, edge_lengths
from spectral_notes.shapes import rectangle, sphere, torus


def test_error_on_the_sphere_falls_with_the_mesh() -> None:
    errors = []
    for subdivisions in (2, 3, 4):
        ball = sphere(subdivisions)
        angle = np.arccos(np.clip(ball.vertices @ ball.vertices[7], -1, 1))
        errors.append(np.abs(heat_distances(ball, [7]) - angle).mean())
    assert errors[2] < errors[1] < errors[0] < 0.1
    assert errors[2] < 0.02


@pytest.mark.parametrize("sources", [[0], [0, 900]])
def test_close_to_exact_on_the_torus(sources: list[int]) -> None:
    ring = torus(60, 24)
    exact = geodesic_distances(ring, sources)
    error = np.abs(heat_distances(ring, sources) - exact)
    assert error.mean() < edge_lengths(ring).mean()
    assert error.mean() < 0.03 * exact.max()


def test_zero_at_the_sources_and_scales_with_the_mesh() -> None:
    ball = sphere(3)
    d = heat_distances(ball, [3, 50, 50])
    assert (d[[3, 50]] == 0.0).all()
    bigger = TriangleMesh(10.0 * ball.vertices, ball.faces)
    np.testing.assert_allclose(heat_distances(bigger, [3, 50]), 10.0 * d, atol=1e-8)


def test_each_component_with_a_source_has_its_own_distances() -> None:
    ball = sphere(2)
    n = ball.n_vertices
    two = TriangleMesh(np.vstack([ball.vertices, ball.vertices + 5.0]), np.vstack([ball.faces, ball.faces + n]))
    d = heat_distances(two, [4, n + 4])
    np.testing.assert_allclose(d[:n], heat_distances(ball, [4]), atol=1e-8)
    np.testing.assert_allclose(d[n:], d[:n], atol=1e-8)
    with pytest.raises(ValueError, match="sources must name a vertex of each component; 1 have none"):
        heat_distances(two, [4])


def test_errors() -> None:
    ball = sphere(2)
    with pytest.raises(ValueError, match="sources must name at least one vertex"):
        heat_distances(ball, [])
    with pytest.raises(ValueError, match="sources must lie in 0"):
        heat_distances(ball, [ball.n_vertices])
    with pytest.raises(ValueError, match="step must be greater than 0"):
        heat_distances(ball, [0], step=0.0)
    strip = rectangle(100.0, 1.0, 401, 5)
    with pytest.raises(ArithmeticError, match="heat does not reach [0-9]+ faces; take a longer step"):
        heat_distances(strip, [0], step=1e-300)


@pytest.mark.parametrize("length", [500, 1500])
@pytest.mark.parametrize("source", [0, 751])
def test_heat_does_not_underflow_on_a_long_strip(length: int, source: int) -> None:
    strip = rectangle(float(length), 2.0, length + 1, 3)
    exact = np.linalg.norm(strip.vertices - strip.vertices[source], axis=1)
    assert np.abs(heat_distances(strip, [source]) - exact).max() < 0.6


def test_heat_does_not_underflow_on_a_long_grid() -> None:
    grid = rectangle(339.0, 339.0, 340, 340)
    exact = np.linalg.norm(grid.vertices - grid.vertices[0], axis=1)
    gap = np.abs(heat_distances(grid, [0]) - exact)
    assert gap.max() < 11.0  # 61 where the gradient had underflowed; 9.2 on 300 x 300, where it had not
    assert gap.mean() < 0.02 * exact.mean()


def test_distances_of_a_long_strip_scale_with_its_unit() -> None:
    strip = rectangle(900.0, 2.0, 901, 3)
    d = heat_distances(strip, [450])
    assert np.abs(d - d[::-1]).max() > 0.0  # the diagonals of the strip are no mirror image of themselves
    for unit in (1e-6, 1e6):
        small = TriangleMesh(unit * strip.vertices, strip.faces)
        np.testing.assert_allclose(heat_distances(small, [450]), unit * d, rtol=1e-6)


def test_one_method_serves_many_sources_and_keeps_no_memory_of_them() -> None:
    ball = sphere(3)
    method = HeatMethod(ball)
    first = method.distances([5])
    for sources in ([7], [3, 50], [5]):
        np.testing.assert_array_equal(method.distances(sources), heat_distances(ball, sources))
    np.testing.assert_array_equal(method.distances([5]), first)
    with pytest.raises(AttributeError):
        method.step = 1.0  # type: ignore[misc]


def test_a_face_as_warm_at_each_corner_does_no_harm(tetrahedron: TriangleMesh) -> None:
    d = heat_distances(tetrahedron, [0])
    assert d[0] == 0.0
    np.testing.assert_allclose(d[1:], d[1])  # the face opposite the source has no gradient
    assert d[1] > 0.0
