"""Curvatures: Gauss-Bonnet to roundoff, closed forms at their order, bending that only the mean curvature sees."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes import shapes
from spectral_notes.geometry.curvature import angle_defects, gaussian_curvature, mean_curvature
from spectral_notes.meshes import TriangleMesh, euler_characteristic


@pytest.mark.parametrize(("name", "chi"), [("sphere", 2), ("egg", 2), ("goat", 2), ("torus", 0), ("bracket", -10)])
def test_gauss_bonnet_on_closed_shapes(name, chi):
    mesh = getattr(shapes, name)()
    assert euler_characteristic(mesh) == chi
    assert angle_defects(mesh).sum() == pytest.approx(2 * np.pi * chi, abs=1e-9)


def test_gauss_bonnet_with_a_boundary(unit_square, mobius):
    assert angle_defects(unit_square).sum() == pytest.approx(2 * np.pi)
    assert angle_defects(unit_square) == pytest.approx(np.pi / 2)
    assert angle_defects(mobius).sum() == pytest.approx(0.0, abs=1e-12)


def test_a_vertex_without_face_has_no_defect():
    assert angle_defects(TriangleMesh(np.eye(4)[:, :3], [[0, 1, 2]]))[3] == 0.0


def test_sphere_and_scale():
    ball = shapes.sphere(4)
    big = TriangleMesh(3 * ball.vertices, ball.faces)
    np.testing.assert_allclose(gaussian_curvature(big), gaussian_curvature(ball) / 9, rtol=1e-9)
    np.testing.assert_allclose(mean_curvature(big), mean_curvature(ball) / 3, rtol=1e-9)
    inside_out = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    np.testing.assert_allclose(mean_curvature(inside_out), -mean_curvature(ball), rtol=1e-9)


def test_mean_errors_on_the_sphere_fall_at_order_two():
    def errors(level):
        ball = shapes.sphere(level)
        return np.array([abs(np.mean(c) - 1) for c in (gaussian_curvature(ball), mean_curvature(ball))])

    assert (np.log2(errors(2) / errors(3)) > 1.8).all()


@pytest.mark.parametrize("curvature", [gaussian_curvature, mean_curvature])
def test_every_vertex_of_the_sphere_converges_with_voronoi_areas_and_twelve_do_not_with_thirds(curvature):
    worst = {mass: [abs(curvature(shapes.sphere(level), mass=mass) - 1).max() for level in (3, 4)] for mass in ("voronoi", "lumped")}
    assert np.log2(worst["voronoi"][0] / worst["voronoi"][1]) > 1.8
    assert worst["voronoi"][1] < 2e-3
    assert worst["lumped"][1] == pytest.approx(0.146, abs=2e-3)
    ball = shapes.sphere(4)
    np.testing.assert_array_equal(curvature(ball), curvature(ball, mass="voronoi"))


def test_torus_has_its_closed_form_curvatures():
    mesh = shapes.torus()
    x, y, z = mesh.vertices.T
    big = (np.hypot(x, y).max() + np.hypot(x, y).min()) / 2
    small = z.max()
    outward = (np.hypot(x, y) - big) / small  # cosine of the angle round the tube
    exact = outward / (small * (big + small * outward))
    assert np.abs(gaussian_curvature(mesh) - exact).max() < 0.02 * np.abs(exact).max()
    half_sum = (1 / small + outward / (big + small * outward)) / 2
    assert np.abs(mean_curvature(mesh) - half_sum).max() < 0.02 * np.abs(half_sum).max()
