"""The mesh of a zero set against its surface."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.meshes import TriangleMesh, corner_angles, edge_lengths, edges_with_counts, euler_characteristic
from spectral_notes.shapes.contouring import mesh_zero_set


def test_mesh_of_a_bead_lies_on_it_and_has_its_genus() -> None:
    def ring(points: np.ndarray) -> np.ndarray:
        return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2]) - 0.4

    vertices, faces = mesh_zero_set(ring, (-1.6, -1.6, -0.6), (1.5, 1.5, 0.5), 0.1)  # grid points lie on it
    mesh = TriangleMesh(vertices, faces)
    assert np.abs(ring(vertices)).max() < 1e-6
    assert euler_characteristic(mesh) == 0
    assert (edges_with_counts(mesh)[1] == 2).all()
    assert np.degrees(corner_angles(mesh).min()) > 25
    assert mesh.area == pytest.approx(4.0 * np.pi**2 * 0.4, rel=0.01)
    assert np.median(edge_lengths(mesh)) == pytest.approx(0.1, rel=0.3)


def test_relaxing_is_what_makes_the_angles_good() -> None:
    def ball(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - 1.0

    box = ((-1.2, -1.2, -1.2), (1.2, 1.2, 1.2), 0.13)
    raw, relaxed = (TriangleMesh(*mesh_zero_set(ball, *box, rounds=rounds)) for rounds in (0, 20))
    assert np.degrees(corner_angles(raw).min()) < 15 < 25 < np.degrees(corner_angles(relaxed).min())


def test_box_that_does_not_hold_the_surface_is_refused() -> None:
    def ball(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) - 1.0

    with pytest.raises(ValueError, match="it reaches the sides of the box"):
        mesh_zero_set(ball, (-1.2, -1.2, -1.2), (1.2, 0.5, 1.2), 0.1)
    with pytest.raises(ValueError, match="no point of the grid lies inside it"):
        mesh_zero_set(ball, (2.0, 2.0, 2.0), (3.0, 3.0, 3.0), 0.1)
