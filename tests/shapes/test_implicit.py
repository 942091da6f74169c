"""Signed distances against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.shapes.implicit import (
    blend,
    cut,
    infinite_cylinder,
    round_cone,
    rounded_box,
    rounded_extrusion,
)


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(3).uniform(-2.0, 2.0, size=(400, 3))


def test_round_cone_is_the_smallest_distance_to_its_balls(points: np.ndarray) -> None:
    start, end, a, b = np.array([-0.5, 0.2, 0.1]), np.array([0.7, -0.3, 0.4]), 0.6, 0.25
    t = np.linspace(0.0, 1.0, 20_001)[:, None]
    centers, radii = start + t * (end - start), (a + t * (b - a)).ravel()
    direct = [float((np.linalg.norm(p - centers, axis=1) - radii).min()) for p in points]
    np.testing.assert_allclose(round_cone(points, start, end, a, b), direct, atol=1e-7)
    np.testing.assert_allclose(round_cone(points, end, start, b, a), direct, atol=1e-7)


def test_rounded_box_grows_from_its_core(points: np.ndarray) -> None:
    core = np.clip(points, -np.array([0.7, 0.5, 0.3]), np.array([0.7, 0.5, 0.3]))
    outside = np.linalg.norm(points - core, axis=1)
    distance = rounded_box(points, (0, 0, 0), (0.9, 0.7, 0.5), 0.2)
    far = outside > 0
    np.testing.assert_allclose(distance[far], outside[far] - 0.2, atol=1e-14)
    assert rounded_box(np.zeros((1, 3)), (0, 0, 0), (0.9, 0.7, 0.5), 0.2)[0] == pytest.approx(-0.5)


def test_extrusion_of_an_interval_is_the_rounded_box(points: np.ndarray) -> None:
    profile = rounded_box(points * np.array([1.0, 1.0, 0.0]), (0, 0, 0), (0.9, 0.7, 9.0), 0.0)
    whole = rounded_box(points, (0, 0, 0), (0.9, 0.7, 0.5), 0.0)
    extruded = rounded_extrusion(profile, np.abs(points[:, 2]) - 0.5, 0.0)
    np.testing.assert_allclose(extruded, whole, atol=1e-14)
    assert (rounded_extrusion(profile, np.abs(points[:, 2]) - 0.5, 0.2) >= extruded - 1e-14).all()  # rims only lose


def test_cylinder_leaves_its_axis_out(points: np.ndarray) -> None:
    for axis in range(3):
        across = np.linalg.norm(np.delete(points - np.array([0.1, 0.2, 0.3]), axis, axis=1), axis=1)
        np.testing.assert_allclose(infinite_cylinder(points, (0.1, 0.2, 0.3), axis, 0.5), across - 0.5, atol=1e-14)


def test_blend_and_cut_bound_union_and_difference(points: np.ndarray) -> None:
    a, b = infinite_cylinder(points, (0, 0, 0), 2, 0.8), infinite_cylinder(points, (0.4, 0, 0), 1, 0.6)
    union, smooth = np.minimum(a, b), blend([a, b], 0.05)
    assert (smooth <= union + 1e-15).all()
    assert (union - smooth).max() <= 0.05 * np.log(2.0) + 1e-15
    left = cut(a, b, 0.05)
    assert (left >= np.maximum(a, -b) - 1e-15).all()
    np.testing.assert_allclose(blend([a, a], 0.05), a - 0.05 * np.log(2.0), atol=1e-14)
    np.testing.assert_allclose(blend([a, b], 1e-4), union, atol=1e-4)
