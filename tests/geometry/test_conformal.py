"""Conformal maps against flat patches, the sphere's analytic functions, and libigl's least squares conformal maps."""

from __future__ import annotations

import tracemalloc

import igl
import numpy as np
import pytest

from spectral_notes.geometry.conformal import conformal_distortion, conformal_map
from spectral_notes.meshes import TriangleMesh, boundary_loops, face_areas
from spectral_notes.shapes import disk, rectangle, sheet, sphere, spherical_cap, terrain


@pytest.mark.parametrize("patch", [rectangle(2.0, 1.0, 21, 11), disk(1.0, 8), sheet(bend=5.0)], ids=str)
def test_flat_patches_come_back_without_distortion(patch: TriangleMesh) -> None:
    uv = conformal_map(patch)
    np.testing.assert_allclose(conformal_distortion(patch, uv), 1.0, atol=1e-6)
    flat = TriangleMesh(np.column_stack([uv, np.zeros(len(uv))]), patch.faces)
    np.testing.assert_allclose(face_areas(flat), face_areas(patch), rtol=1e-6)  # the scale is the patch's own


def test_a_flat_patch_may_be_two_triangles(unit_square: TriangleMesh) -> None:
    np.testing.assert_allclose(conformal_distortion(unit_square, conformal_map(unit_square)), 1.0, atol=1e-6)


def test_the_map_of_a_cap_is_analytic_in_the_stereographic_projection() -> None:
    gaps = []
    for n_rings in (8, 16):
        cap = spherical_cap(1.2, n_rings)
        x, y, z = cap.vertices.T
        s = (x + 1j * y) / (1 + z)
        w = conformal_map(cap) @ [1, 1j]
        powers = (s / np.abs(s).max())[:, None] ** np.arange(14)
        c = np.linalg.lstsq(powers, w, rcond=None)[0]
        assert np.abs(c[1]) > 50 * np.abs(np.delete(c, 1)).max()
        gaps.append(np.abs(powers @ c - w).max() / np.abs(w).max())
    assert gaps[1] < 0.5 * gaps[0] < 5e-4


@pytest.mark.parametrize("patch", [spherical_cap(2.5, 18), terrain(10)], ids=str)
def test_less_distortion_than_pinned_maps(patch: TriangleMesh) -> None:
    areas = face_areas(patch)
    ours = conformal_distortion(patch, conformal_map(patch))
    assert (ours >= 1.0).all()
    rim = boundary_loops(patch)[0]
    for far in (1, len(rim) // 3):
        pinned = igl.lscm(patch.vertices, patch.faces, np.array([rim[0], rim[far]]), np.eye(2))[0]
        assert areas @ ours < areas @ np.abs(conformal_distortion(patch, pinned))


def test_the_map_does_not_depend_on_place_or_scale() -> None:
    cap = spherical_cap(1.0, 8)
    q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    moved = TriangleMesh(3.0 * cap.vertices @ q.T + 7.0, cap.faces)
    np.testing.assert_allclose(conformal_map(moved), 3.0 * conformal_map(cap), atol=1e-8)


def test_distortion_of_known_maps(unit_square: TriangleMesh) -> None:
    x, y, _ = unit_square.vertices.T
    np.testing.assert_allclose(conformal_distortion(unit_square, np.column_stack([x + y, y])), (3 + 5**0.5) / 2)
    np.testing.assert_allclose(conformal_distortion(unit_square, np.column_stack([2 * x, -y])), -2.0)
    assert np.isposinf(conformal_distortion(unit_square, np.column_stack([x, 0 * x]))).all()


def test_errors(unit_square: TriangleMesh) -> None:
    with pytest.raises(ValueError, match="mesh must be a disk .* it has 0 loops and chi = 2"):
        conformal_map(sphere(1))
    turned = TriangleMesh(unit_square.vertices, [[0, 1, 2], [0, 3, 2]])
    with pytest.raises(ValueError, match="mesh must have its faces turned alike"):
        conformal_map(turned)
    with pytest.raises(ValueError, match="uv must have shape"):
        conformal_distortion(unit_square, np.zeros((3, 2)))


def test_memory_grows_with_the_vertices_and_not_with_those_of_the_rim_times_them() -> None:
    patch = rectangle(1.0, 1.0, 120, 120)
    tracemalloc.start()
    uv = conformal_map(patch)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    np.testing.assert_allclose(conformal_distortion(patch, uv), 1.0, atol=1e-5)
    assert peak < 40e6  # one dense matrix from the rim to the vertices has 55 MB
