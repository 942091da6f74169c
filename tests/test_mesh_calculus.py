"""Gradient, divergence, boundary conditions and Poisson: identities, closed forms, and every promised error."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, interval_laplacian, mass_matrix
from spectral_notes.mesh_calculus import (
    PoissonSolver,
    arrows_of_rows,
    boundary_mass_matrix,
    boundary_vertices,
    divergence_matrix,
    face_area_matrix,
    gradient_matrix,
    restrict_to,
    rows_of_arrows,
    solve_poisson,
    spread_faces,
)
from spectral_notes.meshes import TriangleMesh, face_normals
from spectral_notes.shapes import disk, rectangle, sphere


@pytest.fixture
def bumpy():
    """A sphere pushed out of shape, with triangles of all sizes."""
    ball = sphere(3)
    return TriangleMesh(ball.vertices * (1 + 0.3 * np.sin(4 * ball.vertices[:, [1]])) * [1, 0.6, 1.4], ball.faces)


def test_gradient_of_a_coordinate_is_its_axis_laid_flat(bumpy):
    normals = face_normals(bumpy)
    for axis in range(3):
        arrows = arrows_of_rows(gradient_matrix(bumpy) @ bumpy.vertices[:, axis])
        flat = np.eye(3)[axis] - normals[:, [axis]] * normals
        np.testing.assert_allclose(arrows, flat, atol=1e-12)


def test_gradient_agrees_with_libigl_row_by_row(bumpy):
    np.testing.assert_allclose(
        (gradient_matrix(bumpy) - igl.grad(bumpy.vertices, bumpy.faces)).toarray(), 0.0, atol=1e-11
    )


def test_rows_and_arrows_are_inverse(bumpy):
    arrows = np.random.default_rng(0).standard_normal((bumpy.n_faces, 3))
    np.testing.assert_array_equal(arrows_of_rows(rows_of_arrows(arrows)), arrows)
    assert not np.array_equal(rows_of_arrows(arrows).reshape(-1, 3), arrows)  # the order of rows is a trap


def test_gradient_then_adjoint_is_the_cotan_laplacian(bumpy):
    G, A = gradient_matrix(bumpy), face_area_matrix(bumpy)
    L = cotan_laplacian(bumpy)[0]
    np.testing.assert_allclose((G.T @ A @ G - L).toarray(), 0.0, atol=1e-12)
    np.testing.assert_allclose((-divergence_matrix(bumpy) @ G - L).toarray(), 0.0, atol=1e-12)


def test_integration_by_parts(bumpy):
    rng = np.random.default_rng(1)
    f, X = rng.standard_normal(bumpy.n_vertices), rng.standard_normal(3 * bumpy.n_faces)
    flux = (gradient_matrix(bumpy) @ f) @ face_area_matrix(bumpy) @ X
    assert f @ divergence_matrix(bumpy) @ X == pytest.approx(-flux)
    assert divergence_matrix(bumpy).sum(axis=0) == pytest.approx(0.0, abs=1e-12)  # nothing leaves a closed surface


def test_spread_faces_are_even_and_different(bumpy):
    chosen = spread_faces(bumpy, 100)
    assert len(set(chosen.tolist())) == 100
    np.testing.assert_array_equal(spread_faces(bumpy, 50), chosen[:50])
    centers = bumpy.vertices[bumpy.faces].mean(axis=1)
    gaps = np.linalg.norm(centers[:, None] - centers[chosen], axis=2)
    among = gaps[chosen] + 10.0 * np.eye(100)
    assert gaps.min(axis=1).max() <= among.min()  # every face is nearer to a chosen one than any two of those are
    assert sorted(spread_faces(bumpy, bumpy.n_faces)) == list(range(bumpy.n_faces))


def test_boundary_vertices(unit_square, tetrahedron, mobius):
    assert boundary_vertices(unit_square).tolist() == [0, 1, 2, 3]
    assert boundary_vertices(tetrahedron).tolist() == []
    assert boundary_vertices(mobius).tolist() == list(range(12))


def test_restriction_is_the_dirichlet_interval():
    free, fixed = interval_laplacian(9, 2.0), interval_laplacian(7, 2.0, ends="dirichlet")
    for cut, whole in zip(restrict_to(*free, np.arange(1, 8)), fixed, strict=True):
        np.testing.assert_allclose(cut.toarray(), whole.toarray(), atol=1e-14)


def test_poisson_on_the_interval_with_values_at_the_ends():
    L, M = interval_laplacian(11)
    x = np.linspace(0, 1, 11)
    np.testing.assert_allclose(solve_poisson(L, M, 6 * x, fixed=[0, 10], values=[1.0, 2.0]), 1 + 2 * x - x**3, atol=1e-13)


def test_poisson_on_the_sphere_recovers_a_harmonic_at_order_two():
    def error(level):
        mesh = sphere(level)
        z = mesh.vertices[:, 2]
        L, M = cotan_laplacian(mesh)
        gap = solve_poisson(L, M, 2 * z) - z  # -Delta z = 2 z, and the icosphere is balanced
        return np.sqrt(gap @ M @ gap)

    assert np.log2(error(2) / error(3)) > 1.8


def test_an_unbalanced_source_is_refused_or_its_mean_taken_off(bumpy):
    L, M = cotan_laplacian(bumpy)
    f = np.random.default_rng(2).standard_normal((bumpy.n_vertices, 2))
    with pytest.raises(ValueError, match="its mean is .* remove_mean=True takes it away"):
        solve_poisson(L, M, f)
    u = solve_poisson(L, M, f, remove_mean=True)
    mass = M.diagonal()
    np.testing.assert_allclose(mass @ u, 0.0, atol=1e-10)
    np.testing.assert_allclose(L @ u, M @ (f - mass @ f / mass.sum()), atol=1e-10)
    np.testing.assert_allclose(solve_poisson(L, M, load=M @ f, remove_mean=True), u, atol=1e-12)
    np.testing.assert_allclose(solve_poisson(L, M, f - mass @ f / mass.sum()), u, atol=1e-12)


def test_all_vertices_fixed_gives_the_values_back():
    L, M = interval_laplacian(3)
    assert solve_poisson(L, M, [0.0, 0.0, 0.0], fixed=[2, 0, 1], values=[3.0, 1.0, 2.0]).tolist() == [1.0, 2.0, 3.0]


def test_full_mass_is_accepted(bumpy):
    L, M = cotan_laplacian(bumpy)[0], mass_matrix(bumpy, kind="full")
    u = solve_poisson(L, M, bumpy.vertices[:, 0], remove_mean=True)
    assert np.ones(bumpy.n_vertices) @ M @ u == pytest.approx(0.0, abs=1e-10)


@pytest.fixture(scope="module")
def held():
    """A solver on an uneven disk, two of its vertices fixed, and the disk."""
    rng = np.random.default_rng(4)
    patch = disk(1.0, 6)
    inside = np.setdiff1d(np.arange(patch.n_vertices), boundary_vertices(patch))
    moved = patch.vertices.copy()
    moved[inside, :2] += rng.uniform(-0.03, 0.03, (len(inside), 2))
    uneven = TriangleMesh(moved, patch.faces)
    return PoissonSolver(*cotan_laplacian(uneven), fixed=[3, 40], screening=0.5), uneven


@given(seed=st.integers(0, 10**6), a=st.floats(-5, 5))
@settings(max_examples=20)
def test_one_factor_serves_every_right_hand_side(held, seed, a):
    solver, mesh = held
    rng = np.random.default_rng(seed)
    f, g = rng.standard_normal((2, mesh.n_vertices, 3))
    values = rng.standard_normal((2, 3))
    u = solver.solve(f, values=values)
    np.testing.assert_array_equal(u[[3, 40]], values)
    residual = solver.L @ u + 0.5 * solver.M @ u - solver.M @ f
    np.testing.assert_allclose(np.delete(residual, [3, 40], axis=0), 0.0, atol=1e-11)
    for d in range(3):
        np.testing.assert_allclose(solver.solve(f[:, d], values=values[:, d]), u[:, d], atol=1e-13)
    both = solver.solve(f + a * g, values=(1 + a) * values)  # linear in everything at once
    np.testing.assert_allclose(both, u + a * solver.solve(g, values=values), atol=1e-11)


def test_a_solver_is_frozen_and_says_what_it_is(held):
    solver, _ = held
    assert repr(solver) == "PoissonSolver(127 vertices, 2 fixed, screening=0.5)"
    with pytest.raises(AttributeError):
        solver.screening = 0.0


def test_a_robin_term_of_any_size_ties_the_constant_down(unit_square):
    L, M = cotan_laplacian(unit_square)
    B = boundary_mass_matrix(unit_square)
    assert B.sum() == pytest.approx(4.0)
    for a in (1e-6, 1.0, 1e6):
        np.testing.assert_allclose(solve_poisson(L + a * B, M, load=a * B @ np.full(4, 7.0)), 7.0, rtol=1e-6)


def manufactured(mesh, case):
    """A boundary value problem on a piece of the unit square that u solves exactly, and u: the exponential wave."""
    x, y, _ = mesh.vertices.T
    u = np.exp(x) * np.sin(2 * y)  # -Delta u = 3 u
    L, M = cotan_laplacian(mesh)
    rim = boundary_vertices(mesh)
    left, right = np.flatnonzero(x == 0), np.flatnonzero(x == 1)
    low, high = np.flatnonzero(y == 0), np.flatnonzero(y == 1)
    slopes = [(left, -u), (right, u), (low, -2 * np.exp(x) * np.cos(2 * y)), (high, 2 * np.exp(x) * np.cos(2 * y))]
    flux = sum(boundary_mass_matrix(mesh, vertices=side) @ slope for side, slope in slopes)
    if case == "dirichlet":
        return solve_poisson(L, M, 3 * u, fixed=rim, values=u[rim]), u
    if case == "neumann":
        mass = M.diagonal()
        return solve_poisson(L, M, 3 * u, load=flux, remove_mean=True), u - mass @ u / mass.sum()
    if case == "mixed":
        rest = sum(boundary_mass_matrix(mesh, vertices=side) @ slope for side, slope in slopes[1:])
        return solve_poisson(L, M, 3 * u, load=rest, fixed=left, values=u[left]), u
    if case == "robin":
        B = boundary_mass_matrix(mesh)
        return solve_poisson(L + 4 * B, M, 3 * u, load=flux + 4 * B @ u), u
    return solve_poisson(L, M, 8 * u, load=flux, screening=5.0), u


@pytest.mark.parametrize("case", ["dirichlet", "neumann", "mixed", "robin", "screened"])
def test_every_boundary_condition_has_order_two(case):
    def error(n):
        grid = rectangle(1.0, 1.0, n, n)
        inside = np.setdiff1d(np.arange(n * n), boundary_vertices(grid))
        moved = grid.vertices.copy()
        moved[inside, :2] += np.random.default_rng(0).uniform(-0.2, 0.2, (len(inside), 2)) / n
        mesh = TriangleMesh(moved, grid.faces)
        found, exact = manufactured(mesh, case)
        M = mass_matrix(mesh)
        return np.sqrt((found - exact) @ M @ (found - exact))

    assert np.log2(error(17) / error(33)) > 1.8


L3, M3 = interval_laplacian(3)
PIECES = graph_laplacian(np.kron(np.eye(2), [[0, 1], [1, 0]]))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: arrows_of_rows(np.zeros(4)), ValueError, "stacked must have a length that three divides; got 4"),
        (lambda: rows_of_arrows(np.zeros((4, 2))), ValueError, r"arrows must have shape \(m, 3\)"),
        (lambda: spread_faces(sphere(0), 21), ValueError, "n must be between 1 and 20; got 21"),
        (lambda: restrict_to(L3, M3, []), ValueError, "keep must name at least one vertex, and each one once"),
        (lambda: restrict_to(L3, M3, [1, 1]), ValueError, "keep must name at least one vertex, and each one once"),
        (lambda: restrict_to(L3, M3, [3]), ValueError, r"keep must lie in 0 .. 2; found 3"),
        (lambda: restrict_to(L3, sp.eye_array(4), [1]), ValueError, r"M must have shape \(3, 3\)"),
        (lambda: solve_poisson(L3, M3, [1.0, 2.0]), ValueError, r"f must have shape \(3,\); got \(2,\)"),
        (lambda: solve_poisson(L3, M3, np.ones(3), fixed=[0], values=[1, 2]), ValueError, r"values must have shape \(1,\)"),
        (lambda: solve_poisson(*PIECES, np.ones(4)), ValueError, "a vertex of each component; 2 of 2 have none"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_flat_faces_have_no_gradient():
    with pytest.raises(ValueError, match="no face without area; 1 of its faces have none, the first is face 0"):
        gradient_matrix(TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))
