"""Parametrized surfaces: closed forms, orders, what a change of parameters or a bend may alter, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes import shapes
from spectral_notes.geometry.parametric import (
    coordinate_lines,
    first_fundamental_form,
    patch_area,
    patch_mesh,
    second_fundamental_form,
    surface_curvatures,
    tangent_vectors,
    torus_curvatures,
    torus_surface,
    unit_normals,
)

FULL = (0.0, 2.0 * np.pi)
TORUS = torus_surface(1.0, 0.4)
U, V = np.meshgrid(np.linspace(-2, 2, 7), np.linspace(-3, 3, 9), indexing="ij")


def catenoid_to_helicoid(turn):
    """Isometric minimal surfaces with metric cosh(v)^2 times the identity."""

    def surface(u, v):
        catenoid = np.stack([np.cosh(v) * np.cos(u), np.cosh(v) * np.sin(u), v], axis=-1)
        helicoid = np.stack([np.sinh(v) * np.sin(u), -np.sinh(v) * np.cos(u), u], axis=-1)
        return np.cos(turn) * catenoid + np.sin(turn) * helicoid

    return surface


def test_the_formula_of_the_torus_is_that_of_its_mesh():
    u, v = 2 * np.pi * np.arange(12) / 12, 2 * np.pi * np.arange(8) / 8
    points = TORUS(*np.meshgrid(u, v, indexing="ij")).reshape(-1, 3)
    assert points == pytest.approx(shapes.torus(12, 8).vertices, abs=1e-15)


def test_forms_of_the_torus():
    around = 1.0 + 0.4 * np.cos(V)
    x_u, x_v = tangent_vectors(TORUS, U, V)
    assert x_u == pytest.approx(np.stack([-around * np.sin(U), around * np.cos(U), 0 * U], axis=-1), abs=1e-10)
    normal = np.stack([np.cos(V) * np.cos(U), np.cos(V) * np.sin(U), np.sin(V)], axis=-1)
    assert unit_normals(TORUS, U, V) == pytest.approx(normal, abs=1e-10)
    assert np.einsum("...d,...d", x_v, normal) == pytest.approx(0 * U, abs=1e-10)
    zero = np.zeros_like(U)
    g = np.stack([around**2, zero, zero, zero + 0.16], axis=-1).reshape(*U.shape, 2, 2)
    b = np.stack([around * np.cos(V), zero, zero, zero + 0.4], axis=-1).reshape(*U.shape, 2, 2)
    assert first_fundamental_form(TORUS, U, V) == pytest.approx(g, abs=1e-10)
    assert second_fundamental_form(TORUS, U, V) == pytest.approx(b, abs=1e-9)


def test_curvatures_of_the_torus():
    K, H = surface_curvatures(TORUS, U, V)
    exact_K, exact_H = torus_curvatures(V.ravel())
    assert K.ravel() == pytest.approx(exact_K, abs=1e-8)
    assert H.ravel() == pytest.approx(exact_H, abs=1e-8)


def test_skew_parameters_change_the_metric_but_no_curvature():
    def skew(a, b):
        return TORUS(a + 0.7 * b, b - 0.2 * a)

    a, b = np.linspace(-1, 1, 5), np.linspace(0, 2, 5)
    assert np.abs(first_fundamental_form(skew, a, b)[..., 0, 1]).min() > 0.01
    here, there = surface_curvatures(skew, a, b), surface_curvatures(TORUS, a + 0.7 * b, b - 0.2 * a)
    assert np.array(here) == pytest.approx(np.array(there), abs=1e-8)


def test_exchanging_the_parameters_turns_the_mean_curvature_alone():
    K, H = surface_curvatures(lambda v, u: TORUS(u, v), V, U)
    assert np.array([K, -H]) == pytest.approx(np.array(surface_curvatures(TORUS, U, V)), abs=1e-8)


def test_curvatures_of_a_saddle_where_the_mixed_derivative_is_all():
    K, H = surface_curvatures(lambda u, v: np.stack([u, v, u * v], axis=-1), 0.0, 0.0)
    np.testing.assert_allclose([K, H], [-1.0, 0.0], atol=1e-8)


@pytest.mark.parametrize("turn", [0.0, 0.7, np.pi / 2])
def test_the_catenoid_bends_into_the_helicoid(turn):
    surface, v = catenoid_to_helicoid(turn), np.linspace(-1, 1, 5)
    u = np.linspace(0, 2, 5)
    assert first_fundamental_form(surface, u, v) == pytest.approx(np.cosh(v)[:, None, None] ** 2 * np.eye(2), abs=1e-9)
    K, H = surface_curvatures(surface, u, v)
    np.testing.assert_allclose(K, -(np.cosh(v) ** -4), atol=1e-8)
    np.testing.assert_allclose(H, 0 * v, atol=1e-8)


def test_areas():
    exact = 4 * np.pi**2 * 0.4
    assert patch_area(TORUS, FULL, FULL, n=4) == pytest.approx(exact, abs=1e-9)  # closed: exact for a cosine
    quarter = np.pi / 2 * 0.4 * (np.pi / 2 + 0.4)
    errors = [abs(patch_area(TORUS, (0, np.pi / 2), (0, np.pi / 2), n=n) - quarter) for n in (8, 16, 32)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2, 2], abs=0.02)


def test_the_mesh_of_a_patch_is_that_of_shapes():
    mesh = patch_mesh(TORUS, (0.0, 1.5), (-1.0, 2.0), 9, 7, name="patch")
    same = shapes.torus_patch((0.0, 1.5), (-1.0, 2.0), 9, 7)
    assert mesh.vertices == pytest.approx(same.vertices, abs=1e-15)
    assert (mesh.faces == same.faces).all()
    assert mesh.name == "patch"


def test_coordinate_lines_lie_where_one_parameter_stands_still():
    lines = coordinate_lines(TORUS, (0.0, 1.0), (-1.0, 2.0), 2, 3)
    assert [line.shape for line in lines] == [(129, 3)] * 5
    assert np.arctan2(lines[1][:, 1], lines[1][:, 0]) == pytest.approx(1.0)  # u = 1
    assert lines[3][:, 2] == pytest.approx(0.4 * np.sin(0.5))  # v = 0.5


def test_a_chart_that_collapses_has_no_curvature_there():
    def globe(u, v):
        return np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)

    K, _ = surface_curvatures(globe, np.zeros(2), np.array([0.3, np.pi / 2]))
    assert K[0] == pytest.approx(1.0, abs=1e-8)
    assert not abs(K[1] - 1.0) < 1e-3


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: torus_surface(1.0, 0.0), ValueError, "r must be greater than 0"),
        (lambda: torus_surface(1.0, 1.0), ValueError, "R must be greater than 1"),
        (lambda: torus_curvatures([0.0], 1.0, 2.0), ValueError, "R must be greater than 2"),
        (lambda: torus_curvatures(0.0), ValueError, r"v must have shape \(n,\)"),
        (lambda: tangent_vectors(TORUS, [0.0, 1.0], [0.0]), ValueError, r"v must have shape \(2,\)"),
        (lambda: first_fundamental_form(TORUS, np.nan, 0.0), ValueError, "u must hold finite numbers"),
        (
            lambda: unit_normals(lambda u, v: u + v, 0.0, 0.0),
            ValueError,
            r"points of the surface must have shape \(3,\)",
        ),
        (lambda: patch_area(TORUS, (1, 1), FULL), ValueError, r"u_range must increase; got \(1, 1\)"),
        (lambda: patch_area(TORUS, FULL, (2, 1)), ValueError, r"v_range must increase; got \(2, 1\)"),
        (lambda: patch_area(TORUS, FULL, FULL, n=0), ValueError, "n must be at least 1"),
        (lambda: patch_mesh(TORUS, FULL, FULL, 1, 5), ValueError, "n_u must be at least 2"),
        (lambda: patch_mesh(TORUS, FULL, FULL, 5, 1.0), TypeError, "n_v must be an integer"),
        (lambda: coordinate_lines(TORUS, FULL, (0, 0)), ValueError, "v_range must increase"),
        (lambda: coordinate_lines(TORUS, FULL, FULL, -1), ValueError, "n_u must be at least 0"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()
