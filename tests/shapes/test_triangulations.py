"""Patterns of triangles: counts, orientation, and which sides meet."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.meshes import TriangleMesh, boundary_loops, edges_with_counts, euler_characteristic, face_normals
from spectral_notes.shapes.triangulations import grid_faces, ring_coordinates, ring_faces, split_triangle


def test_grid_has_two_triangles_a_cell_counter_clockwise() -> None:
    x, y = np.repeat(np.arange(4.0), 3), np.tile(np.arange(3.0), 4)
    mesh = TriangleMesh(np.column_stack([x, y, 0 * x]), grid_faces(4, 3))
    assert mesh.n_faces == 2 * 3 * 2
    assert mesh.area == 6.0
    assert (face_normals(mesh)[:, 2] == 1.0).all()
    assert euler_characteristic(mesh) == 1


def test_closed_grid_is_a_torus() -> None:
    mesh = TriangleMesh(np.random.default_rng(0).normal(size=(20, 3)), grid_faces(5, 4, closed=True))
    assert mesh.n_faces == 40
    assert (edges_with_counts(mesh)[1] == 2).all()
    assert euler_characteristic(mesh) == 0


@pytest.mark.parametrize("n_rings", [1, 2, 5])
def test_rings_fill_a_polygon(n_rings: int) -> None:
    ring, angle = ring_coordinates(n_rings)
    assert len(ring) == 1 + 3 * n_rings * (n_rings + 1)
    mesh = TriangleMesh(np.column_stack([ring * np.cos(angle), ring * np.sin(angle), 0 * ring]), ring_faces(n_rings))
    assert mesh.n_faces == 6 * n_rings**2
    assert (face_normals(mesh)[:, 2] > 0.99).all()
    assert euler_characteristic(mesh) == 1
    assert [len(loop) for loop in boundary_loops(mesh)] == [6 * n_rings]
    assert mesh.area == pytest.approx(3 * n_rings * n_rings**2 * np.sin(np.pi / (3 * n_rings)), rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 7])
def test_split_triangle_is_made_of_equal_parts(n: int) -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [1.0, 2.0]])
    points, faces = split_triangle(corners, n)
    mesh = TriangleMesh(np.column_stack([points, np.zeros(len(points))]), faces)
    assert mesh.n_vertices == (n + 1) * (n + 2) // 2
    assert mesh.n_faces == n**2
    a, b, c = (points[faces[:, k]] for k in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    np.testing.assert_allclose(doubled, 6.0 / n**2, rtol=1e-12)  # equal and counter-clockwise
    assert euler_characteristic(mesh) == 1
