"""Closed forms against each other, 1-D solvers against closed forms, and meshes against both; every error message."""

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
import scipy.sparse as sp

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import boundary_vertices, restrict_to
from spectral_notes.shapes import egg, gww_drums, sphere, torus
from spectral_notes.shapes.references import (
    DRUM_EIGENVALUES,
    principal_angles,
    sphere_eigenvalues,
    spherical_harmonics,
    weyl_count,
)
from spectral_notes.shapes.revolution import egg_eigenvalues, revolution_eigenvalues, torus_eigenvalues


@pytest.fixture(scope="module")
def directions():
    points = np.random.default_rng(0).standard_normal((200, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def identity(n):
    return sp.csr_array(sp.eye_array(n))


# --- the sphere


def test_sphere_eigenvalues_come_in_odd_numbers_and_scale_with_the_radius():
    values, copies = np.unique(sphere_eigenvalues(64), return_counts=True)
    np.testing.assert_array_equal(copies, 2 * np.arange(8) + 1)
    np.testing.assert_array_equal(values, [degree * (degree + 1) for degree in range(8)])
    np.testing.assert_allclose(sphere_eigenvalues(10, 3.0), sphere_eigenvalues(10) / 9)
    assert len(sphere_eigenvalues(50)) == 50


def test_harmonics_of_degree_two_are_the_textbook_polynomials(directions):
    x, y, z = directions.T
    expected = [x * y, y * z, (2 * z**2 - x**2 - y**2) / np.sqrt(12), x * z, (x**2 - y**2) / 2]
    Y = spherical_harmonics(directions, 2)
    assert_equal_but_for_sign(Y, np.sqrt(15 / (4 * np.pi)) * np.column_stack(expected))


def assert_equal_but_for_sign(A, B):
    np.testing.assert_allclose(A * np.sign(np.einsum("ij,ij->j", A, B)), B, atol=1e-13)


def test_harmonics_are_orthonormal_on_the_sphere():
    z, weight = np.polynomial.legendre.leggauss(16)
    longitude = 2 * np.pi * np.arange(32) / 32
    Z, P = np.meshgrid(z, longitude, indexing="ij")
    ring = np.sqrt(1 - Z**2)
    points = np.stack([ring * np.cos(P), ring * np.sin(P), Z], axis=-1).reshape(-1, 3)
    Y = np.column_stack([spherical_harmonics(points, degree) for degree in range(8)])
    gram = Y.T @ (Y * (np.repeat(weight, 32) * 2 * np.pi / 32)[:, None])
    np.testing.assert_allclose(gram, np.eye(64), atol=1e-12)


@pytest.mark.parametrize("degree", [1, 3, 6])
def test_harmonics_are_restrictions_of_harmonic_polynomials(directions, degree):
    h = 1e-3

    def solid(p):
        return np.linalg.norm(p, axis=1)[:, None] ** degree * spherical_harmonics(p, degree)

    around = sum(solid(directions + h * side) + solid(directions - h * side) for side in np.eye(3))
    assert np.abs((around - 6 * solid(directions)) / h**2).max() < 1e-4 * degree**4
    assert np.abs(solid(directions)).max() > 0.4


@pytest.mark.parametrize("degree", [0, 1, 4, 9])
def test_squares_of_the_harmonics_of_a_degree_add_up_to_a_constant(directions, degree):
    np.testing.assert_allclose(
        (spherical_harmonics(directions, degree) ** 2).sum(axis=1), (2 * degree + 1) / (4 * np.pi)
    )


def test_eigenspaces_of_the_sphere_mesh_are_the_harmonics_at_order_two():
    angles = []
    for subdivisions in (2, 3, 4):
        ball = sphere(subdivisions)
        basis = compute_eigenbasis(*cotan_laplacian(ball), k=9)
        angles.append(principal_angles(basis.evecs[:, 4:], spherical_harmonics(ball.vertices, 2), basis.M).max())
    order = np.polyfit([0, -1, -2], np.log2(angles), 1)[0]
    assert angles[-1] < 2e-3
    assert 1.8 < order < 2.3


# --- surfaces of revolution


def test_poles_solver_gives_the_sphere():
    evals, orders = revolution_eigenvalues(lambda t: (2 * np.sin(t), np.full_like(t, 2.0)), 100, kind="poles", n=48)
    np.testing.assert_allclose(evals, sphere_eigenvalues(100, 2.0), atol=1e-10)
    np.testing.assert_array_equal(np.sort(orders[1:4]), [0, 1, 1])


def test_poles_solver_does_not_depend_on_how_the_profile_is_run_through():
    def slow_start(t):
        angle = t - 0.3 * np.sin(2 * t)
        return np.sin(angle), 1 - 0.6 * np.cos(2 * t)

    evals, _ = revolution_eigenvalues(slow_start, 36, kind="poles", n=64)
    np.testing.assert_allclose(evals, sphere_eigenvalues(36), atol=1e-9)


def test_ring_solver_gives_the_flat_torus():
    evals, orders = revolution_eigenvalues(lambda t: (np.full_like(t, 0.5), np.full_like(t, 1.5)), 60, kind="ring")
    grid = np.arange(-20, 21)
    expected = np.sort(((grid[:, None] / 0.5) ** 2 + (grid / 1.5) ** 2).ravel())[:60]
    np.testing.assert_allclose(evals, expected, atol=1e-10)
    np.testing.assert_array_equal(np.sort(orders[:5]), [0, 0, 0, 0, 0])
    np.testing.assert_array_equal(np.sort(orders[evals.round(9) == 4.0]), [0, 0, 1, 1])


@pytest.mark.parametrize("reference", [egg_eigenvalues, torus_eigenvalues])
def test_references_are_converged(reference):
    np.testing.assert_allclose(reference(120, n=48)[0], reference(120, n=64)[0], rtol=1e-10, atol=1e-10)


def test_first_pair_of_the_torus_against_a_shooting_method():
    wanted = torus_eigenvalues(4)[0][1]

    def slope_half_way(value):
        def right(t, u):
            r = 1 + 0.4 * np.cos(t)
            return [u[1] / r, (0.16 / r - value * 0.16 * r) * u[0]]

        return scipy.integrate.solve_ivp(right, (0, np.pi), [1.0, 0.0], rtol=1e-11, atol=1e-12).y[1, -1]

    assert scipy.optimize.brentq(slope_half_way, 0.5, 1.5, xtol=1e-10) == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize(
    ("make", "sizes", "reference"),
    [(egg, [(3,), (4,)], egg_eigenvalues), (torus, [(60, 25), (120, 50)], torus_eigenvalues)],
)
def test_meshes_converge_to_the_references_at_order_two(make, sizes, reference):
    exact = reference(12)[0]
    coarse, fine = (compute_eigenbasis(*cotan_laplacian(make(*size)), k=12).evals for size in sizes)
    ratio = np.abs(coarse - exact)[1:] / np.abs(fine - exact)[1:]
    assert ratio.min() > 3.3 and ratio.max() < 4.5
    np.testing.assert_allclose(((4 * fine - coarse) / 3)[1:], exact[1:], rtol=5e-5)


# --- Weyl's law


def test_weyl_count_of_the_square_under_both_conditions():
    m, n = np.meshgrid(np.arange(200), np.arange(200))
    exact = np.pi**2 * (m**2 + n**2)
    at = np.array([20_000.0, 30_000.0, 40_000.0])
    for ends, allowed in (("neumann", exact.ravel()), ("dirichlet", exact[1:, 1:].ravel())):
        counted = np.array([(allowed < value).sum() for value in at])
        np.testing.assert_allclose(weyl_count(at, 1.0, 4.0, ends=ends), counted, rtol=6e-3)
        assert (np.abs(weyl_count(at, 1.0) / counted - 1) > 0.01).all()


# --- drums


@pytest.fixture(scope="module")
def drum_evals():
    """Of drum 1 or 2, cut n times."""

    def solve(number, n, k=25):
        mesh = gww_drums(n)[number - 1]
        L, M = cotan_laplacian(mesh, mass="full")
        inside = np.setdiff1d(np.arange(mesh.n_vertices), boundary_vertices(mesh))
        return compute_eigenbasis(*restrict_to(L, M, inside), k=k).evals

    return solve


def test_drums_sound_the_same_and_as_published(drum_evals):
    one, other = drum_evals(1, 24), drum_evals(2, 24)
    np.testing.assert_allclose(one, other, rtol=1e-11)
    np.testing.assert_allclose(one, DRUM_EIGENVALUES, rtol=0.03)


def test_drum_modes_that_fit_a_tile_are_exact():
    assert DRUM_EIGENVALUES[[8, 20]] == pytest.approx(np.pi**2 * np.array([5, 10]) / 4, rel=1e-9)


def test_drums_converge_at_the_order_their_corners_allow(drum_evals):
    errors = np.array([drum_evals(1, n, 9)[[0, 8]] / DRUM_EIGENVALUES[[0, 8]] - 1 for n in (16, 32, 64)])
    order = np.log2(errors[:-1] / errors[1:])[-1]
    assert 4 / 3 < order[0] < 1.65
    assert order[1] == pytest.approx(2.0, abs=0.02)


# --- angles


def test_principal_angles_see_subspaces_not_bases():
    rng = np.random.default_rng(1)
    M = sp.csr_array(sp.diags_array(rng.uniform(0.1, 3.0, 40)))
    A = rng.standard_normal((40, 4))
    assert principal_angles(A, A @ rng.standard_normal((4, 4)), M).max() < 1e-12
    assert principal_angles(A, A[:, :2] @ rng.standard_normal((2, 2)), M).max() < 1e-12


def test_principal_angles_use_the_mass():
    M = sp.csr_array(np.diag([1.0, 4.0]))
    assert np.degrees(principal_angles([[1.0], [0.0]], [[2.0], [1.0]], M)) == pytest.approx([45.0])
    assert np.degrees(principal_angles([[1.0], [0.0]], [[2.0], [1.0]], identity(2))) == pytest.approx([26.565051], 1e-7)


def test_principal_angles_are_accurate_when_small_and_ascending():
    B = np.array([[1.0, 0.0], [1e-9, 0.0], [0.0, 1.0], [0.0, 0.5]])
    angles = principal_angles(np.eye(4)[:, [0, 2]], B, identity(4))
    np.testing.assert_allclose(angles, [1e-9, np.arctan(0.5)], rtol=1e-6)


# --- every error message


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sphere_eigenvalues(0), "k must be at least 1"),
        (lambda: sphere_eigenvalues(3, 0.0), "radius must be greater than 0"),
        (lambda: spherical_harmonics(np.ones((2, 3)), -1), "degree must be at least 0"),
        (lambda: spherical_harmonics([[1, 0, 0], [0, 0, 0]], 1), "points must lie off the origin; point 1 does not"),
        (lambda: spherical_harmonics(np.ones((2, 2)), 1), r"points must have shape \(n, 3\)"),
        (lambda: weyl_count([1.0, -2.0], 1.0), "values must not be negative; the smallest is -2"),
        (lambda: weyl_count([1.0], 0.0), "area must be greater than 0"),
        (lambda: weyl_count([1.0], 1.0, -1.0), "boundary must be at least 0"),
        (lambda: weyl_count([1.0], 1.0, ends="periodic"), "ends must be one of 'neumann', 'dirichlet'"),
        (lambda: principal_angles(np.eye(3)[:, :1], np.eye(3)[:, :2], identity(3)), "B must have at most as many"),
        (lambda: principal_angles(np.eye(3), np.eye(2), identity(3)), r"B must have shape \(3, q\)"),
        (lambda: principal_angles(np.eye(3), np.eye(3), identity(2)), r"M must have shape \(3, 3\)"),
        (lambda: egg_eigenvalues(257), "k must be between 1 and 256"),
        (lambda: egg_eigenvalues(1, n=7), "n must be at least 8"),
        (lambda: torus_eigenvalues(1, R=0.4), "R must be greater than 0.4"),
        (lambda: torus_eigenvalues(1, r=0.0), "r must be greater than 0"),
        (lambda: revolution_eigenvalues(lambda t: (t, t), 1, kind="cap"), "kind must be one of 'poles', 'ring'"),
    ],
)
def test_what_is_wrong_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_published_values_cannot_be_overwritten():
    with pytest.raises(ValueError, match="read-only"):
        DRUM_EIGENVALUES[0] = 0.0
