"""Functional maps on cases with a known answer: the identity, renumbering, rotation, mirror images, open shapes, faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from spectral_notes import functional_maps as fm
from spectral_notes import shapes
from spectral_notes.descriptors import unit_area
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching import map_fitting, map_refinement, point_maps
from spectral_notes.meshes import TriangleMesh, farthest_points

K = 40


def basis_of(mesh: TriangleMesh, k: int = K) -> Eigenbasis:
    return compute_eigenbasis(*cotan_laplacian(mesh), k)


def renumbered(mesh: TriangleMesh, seed: int = 0) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh under new numbers, and for each new vertex the old one: p2p_21 if the given mesh is 1."""
    p2p_21 = np.random.default_rng(seed).permutation(mesh.n_vertices)
    return TriangleMesh(mesh.vertices[p2p_21], np.argsort(p2p_21)[mesh.faces]), p2p_21


def flipped(mesh: TriangleMesh, axis: int = 0) -> TriangleMesh:
    """The mirror image, with normals outside."""
    signs = np.where(np.arange(3) == axis, -1.0, 1.0)
    return TriangleMesh(mesh.vertices * signs, mesh.faces[:, ::-1])


@pytest.fixture(scope="module")
def mesh() -> TriangleMesh:
    return shapes.potato(subdivisions=3)


@pytest.fixture(scope="module")
def basis(mesh: TriangleMesh) -> Eigenbasis:
    return basis_of(mesh)


@pytest.fixture(scope="module")
def coarse(mesh: TriangleMesh) -> tuple[TriangleMesh, sp.csr_array]:
    """Another triangulation of the same potato with fewer vertices, and P (n_coarse, n)."""
    return shapes.coarse_copy(mesh, 402)


# --- the matrix of a map ------------------------------------------------------------------------------------------------


def test_identity_is_the_identity(basis: Eigenbasis) -> None:
    np.testing.assert_allclose(fm.functional_map(basis, basis, np.arange(basis.n)), np.eye(K), atol=1e-10)
    np.testing.assert_array_equal(fm.point_map(basis, basis, np.eye(K)), np.arange(basis.n))


def test_map_of_an_isometry_is_diagonal_with_signs(mesh: TriangleMesh, basis: Eigenbasis) -> None:
    other, p2p_21 = renumbered(mesh)
    C_12 = fm.functional_map(basis, basis_of(other), p2p_21)
    np.testing.assert_allclose(abs(np.diag(C_12)), 1.0, atol=1e-6)
    np.testing.assert_allclose(C_12 - np.diag(np.diag(C_12)), 0.0, atol=1e-6)
    np.testing.assert_array_equal(fm.point_map(basis, basis_of(other), C_12), p2p_21)
    assert not point_maps.geodesic_errors(mesh, fm.point_map(basis, basis_of(other), C_12), p2p_21).any()


def test_maps_compose_and_pull_back_against_the_arrow(mesh: TriangleMesh, basis: Eigenbasis) -> None:
    second, p2p_21 = renumbered(mesh, 1)
    third, p2p_32 = renumbered(second, 2)
    basis_2, basis_3 = basis_of(second), basis_of(third)
    C_13 = fm.functional_map(basis_2, basis_3, p2p_32) @ fm.functional_map(basis, basis_2, p2p_21)
    np.testing.assert_allclose(C_13, fm.functional_map(basis, basis_3, p2p_21[p2p_32]), atol=1e-6)
    x = mesh.vertices[:, 0]
    np.testing.assert_array_equal(fm.pull_back(p2p_21, x), second.vertices[:, 0])


def test_scale_of_a_shape_scales_its_map(mesh: TriangleMesh, basis: Eigenbasis) -> None:
    large = basis_of(TriangleMesh(3.0 * mesh.vertices, mesh.faces))
    everyone = np.arange(basis.n)
    C_12 = fm.functional_map(basis, large, everyone)
    np.testing.assert_allclose(C_12, 3.0 * np.eye(K), atol=1e-6)
    few = basis.truncate(10), large.truncate(10)
    np.testing.assert_allclose(map_refinement.icp(*few, C_12[:10, :10], n_rounds=2), 3.0 * np.eye(10), atol=1e-6)
    f_1, f_2 = (map_fitting.point_descriptors(one, [0, 100, 200]) for one in (basis, large))
    np.testing.assert_allclose(f_1, f_2, atol=1e-6)
    np.testing.assert_allclose(map_fitting.fit_functional_map(*few, f_1, f_2), 3.0 * np.eye(10), atol=1e-2)


def test_precise_map_beats_the_nearest_vertex(
    mesh: TriangleMesh, basis: Eigenbasis, coarse: tuple[TriangleMesh, sp.csr_array]
) -> None:
    small, P = coarse
    basis_2 = basis_of(small)
    C_12 = fm.functional_map(basis, basis_2, P)
    P_21 = point_maps.precise_map(mesh, basis, basis_2, C_12)
    np.testing.assert_allclose(P_21.sum(axis=1), 1.0)
    assert P_21.min() >= 0.0 and np.diff(P_21.indptr).max() <= 3
    by_vertex = mesh.vertices[fm.point_map(basis, basis_2, C_12)] - small.vertices
    by_face = P_21 @ mesh.vertices - small.vertices
    assert np.linalg.norm(by_face, axis=1).mean() < 0.5 * np.linalg.norm(by_vertex, axis=1).mean()


def test_nearest_points_of_triangles_are_those_of_libigl() -> None:
    igl = pytest.importorskip("igl")
    rng = np.random.default_rng(3)
    triangles, points = rng.normal(size=(300, 3, 3)), rng.normal(size=(300, 3))
    weights, gaps = point_maps._nearest_points(triangles, points)
    for triangle, point, weight, gap in zip(triangles, points, weights, gaps, strict=True):
        squared, _, foot = igl.point_mesh_squared_distance(point[None], triangle, np.array([[0, 1, 2]]))
        np.testing.assert_allclose([gap, *(weight @ triangle)], [float(np.ravel(squared)[0]), *np.ravel(foot)], atol=1e-9)


def test_nearest_rows_agree_with_distances() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(500, 30)), rng.normal(size=(5000, 30))
    distances = ((second[:, None, :5] - first[None, :, :5]) ** 2).sum(axis=2)
    np.testing.assert_array_equal(fm.nearest_rows(first[:, :5], second[:, :5]), distances.argmin(axis=1))
    assert len(fm.nearest_rows(first, second)) == 5000


def test_sides_agree_for_an_orthogonal_matrix_only(basis: Eigenbasis, coarse: tuple[TriangleMesh, sp.csr_array]) -> None:
    Q = np.linalg.qr(np.random.default_rng(0).normal(size=(K, K)))[0]
    ours, adjoint = (fm.point_map(basis, basis, Q, side=side) for side in fm.SIDES)
    np.testing.assert_array_equal(ours, adjoint)
    shrunk = np.diag(np.linspace(1.0, 0.05, K))
    sides = [fm.point_map(basis, basis, shrunk, side=side) for side in fm.SIDES]
    assert (sides[0] != sides[1]).any()


# --- fitting ------------------------------------------------------------------------------------------------------------


def test_least_squares_solves_its_normal_equations() -> None:
    rng = np.random.default_rng(0)
    X_1, X_2 = rng.normal(size=(4, 5, 5)), rng.normal(size=(4, 3, 3))
    A, B, penalty = rng.normal(size=(5, 7)), rng.normal(size=(3, 7)), rng.uniform(size=(3, 5))
    C = map_fitting._solve_coupled(A @ A.T, B @ A.T, penalty, list(zip(X_1, X_2, strict=True)), 2.0)

    def energy(C: np.ndarray) -> float:
        commuting = [((C @ a - b @ C) ** 2).sum() / (b**2).sum() for a, b in zip(X_1, X_2, strict=True)]
        return float(((C @ A - B) ** 2).sum() + (penalty * C**2).sum() + 2.0 * np.mean(commuting))

    for _ in range(10):
        step = 1e-3 * rng.normal(size=C.shape)
        assert energy(C) < min(energy(C + step), energy(C - step))


def test_rotations_turn_their_sign_in_a_mirror_and_products_do_not(mesh: TriangleMesh, basis: Eigenbasis) -> None:
    f = mesh.vertices[:, :1]
    image = flipped(mesh, 2)
    turns, products = map_fitting.rotations(mesh, basis, f)[0], map_fitting.multiplications(basis, f)[0]
    np.testing.assert_allclose(map_fitting.rotations(image, basis, f)[0], -turns, atol=1e-12)
    np.testing.assert_allclose(turns, -turns.T, atol=1e-9 * abs(turns).max())
    np.testing.assert_allclose(products, products.T, atol=1e-12)


def test_handed_functions_tell_left_from_right_and_know_neither_place_nor_size(mesh: TriangleMesh, basis: Eigenbasis) -> None:
    f = map_fitting.point_descriptors(basis, n_each=8)
    handed = map_fitting.handed_functions(mesh, basis, f, 2)
    assert handed.shape == (mesh.n_vertices, 6)
    np.testing.assert_allclose((handed * (basis.M @ handed)).sum(axis=0), 1.0)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    moved = TriangleMesh(7.0 * mesh.vertices @ turn.T + 3.0, mesh.faces)
    np.testing.assert_allclose(map_fitting.handed_functions(moved, basis, f, 2), handed, atol=1e-6)
    image = TriangleMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1])
    np.testing.assert_allclose(map_fitting.handed_functions(image, basis, f, 2), -handed, atol=1e-6)


def test_rotation_on_the_sphere_is_a_turn_about_the_axis() -> None:
    ball = shapes.sphere(4)
    basis = compute_eigenbasis(*cotan_laplacian(ball), 4)
    turn = map_fitting.rotations(ball, basis, ball.vertices[:, 2:])[0] / ball.area
    x, y, z = (basis.analyze(ball.vertices[:, axis]) for axis in range(3))
    # grad z x grad x . normal is y on the unit sphere: n . (e_z x e_x), as tangent parts give n . of the plain product
    np.testing.assert_allclose(turn @ x, y, atol=5e-3 * np.linalg.norm(y))
    np.testing.assert_allclose(turn @ z, 0.0, atol=5e-3 * np.linalg.norm(z))


# --- refinement ---------------------------------------------------------------------------------------------------------


def test_zoomout_recovers_a_map_from_a_rough_start(mesh: TriangleMesh, basis: Eigenbasis, coarse: tuple[TriangleMesh, sp.csr_array]) -> None:
    small, P = coarse
    basis_2, true = basis_of(small), np.asarray(P.argmax(axis=1)).ravel()
    rough = fm.functional_map(basis.truncate(6), basis_2.truncate(6), true)
    rough = rough + 0.1 * np.random.default_rng(1).normal(size=rough.shape)
    at = np.arange(0, len(true), 10)
    before = point_maps.geodesic_errors(mesh, fm.point_map(basis, basis_2, rough)[at], true[at]).mean()
    refined = map_refinement.zoomout(basis, basis_2, rough, step=2)
    after = point_maps.geodesic_errors(mesh, fm.point_map(basis, basis_2, refined)[at], true[at]).mean()
    assert refined.shape == (K, K)
    assert after < 0.02 and 2.0 * after < before
    both = map_refinement.bijective_zoomout(basis, basis_2, rough, rough.T, step=2)
    assert np.linalg.norm(both[0] @ both[1] - np.eye(K)) < 0.3 * np.sqrt(K)
    some = tuple(farthest_points(one.vertices, 300) for one in (mesh, small))
    sampled, _ = map_refinement.bijective_zoomout(basis, basis_2, rough, rough.T, step=2, samples=some)
    assert point_maps.geodesic_errors(mesh, fm.point_map(basis, basis_2, sampled)[at], true[at]).mean() < 0.05


def test_samples_are_spread_and_nested(mesh: TriangleMesh) -> None:
    fine, few = farthest_points(mesh.vertices, 60), farthest_points(mesh.vertices, 20)
    np.testing.assert_array_equal(fine[:20], few)
    gaps = np.linalg.norm(mesh.vertices[fine][:, None] - mesh.vertices[fine], axis=2)[np.triu_indices(60, 1)]
    cover = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices[fine], axis=2).min(axis=1).max()
    assert cover <= gaps.min() + 1e-12  # what farthest points promise


# --- which side up ------------------------------------------------------------------------------------------------------


def test_orientation_score_is_one_zero_and_half() -> None:
    ball = shapes.sphere(3)
    everyone = np.arange(ball.n_vertices)
    mirrored = fm.nearest_rows(ball.vertices, ball.vertices * [-1.0, 1.0, 1.0])
    assert point_maps.orientation_score(ball, ball, everyone) == 1.0
    assert point_maps.orientation_score(ball, ball, mirrored) == 0.0
    folded = np.where(ball.vertices[:, 0] >= 0.0, everyone, mirrored)  # the left half lies on the right, upside down
    assert point_maps.orientation_score(ball, ball, folded) == pytest.approx(0.5, abs=0.02)
    assert point_maps.orientation_score(ball, ball, np.zeros(ball.n_vertices, dtype=int)) == 0.0


# --- faults -------------------------------------------------------------------------------------------------------------


def test_swapped_direction_is_named(mesh: TriangleMesh, basis: Eigenbasis, coarse: tuple[TriangleMesh, sp.csr_array]) -> None:
    small, P = coarse
    basis_2, p2p_21 = basis_of(small, 30), np.asarray(P.argmax(axis=1)).ravel()
    backwards = f"p2p_21 must hold a vertex of 1 for each of the {mesh.n_vertices} vertices of 2; got {small.n_vertices}, the number of vertices of 1: it looks like a map from 1 to 2"
    with pytest.raises(ValueError, match=backwards):
        fm.functional_map(basis_2, basis, p2p_21)
    with pytest.raises(ValueError, match=backwards):
        fm.functional_map(basis_2, basis, P)
    with pytest.raises(ValueError, match=backwards):
        point_maps.orientation_score(small, mesh, p2p_21)
    C_12 = fm.functional_map(basis, basis_2, p2p_21)
    assert C_12.shape == (30, K)
    with pytest.raises(ValueError, match=r"C_12 must have shape \(k2, k1\), at most \(40, 30\); got \(30, 40\): it looks like C_21"):
        fm.point_map(basis_2, basis, C_12)
    with pytest.raises(ValueError, match="it looks like C_21"):
        fm.transfer(basis_2, basis, C_12, small.vertices)


SMALL = shapes.sphere(2)  # 162 vertices
BASIS = basis_of(SMALL, 8)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: fm.pull_back([0, 3], [1.0, 2.0]), ValueError, "p2p_21 must lie in 0 .. 1; found 3"),
        (lambda: fm.pull_back([0.5], [1.0, 2.0]), TypeError, "p2p_21 must hold integers"),
        (lambda: fm.pull_back([0], 1.0), ValueError, "f_1 must have shape"),
        (lambda: fm.pull_back(sp.csr_array(np.eye(2)), [1.0, 2.0, 3.0]), ValueError, "p2p_21 must have a column for each of the 3 vertices of 1"),
        (lambda: fm.pull_back_labels([0], [0.5]), TypeError, "labels_1 must hold integers"),
        (lambda: fm.point_map(BASIS, BASIS, np.eye(9)), ValueError, r"C_12 must have shape \(k2, k1\), at most \(8, 8\); got \(9, 9\). Compute more"),
        (lambda: fm.point_map(BASIS, BASIS, np.eye(3), side="left"), ValueError, "side must be one of 'functions', 'adjoint'"),
        (lambda: fm.nearest_rows([[0.0]], [[0.0, 1.0]]), ValueError, r"rows_2 must have shape \(n2, 1\)"),
        (lambda: map_refinement.zoomout(BASIS, BASIS, np.eye(5), k=4), ValueError, "k must be between 5 and 8; got 4"),
        (lambda: map_refinement.zoomout(BASIS, BASIS, np.eye(5), step=0), ValueError, "step must be at least 1"),
        (lambda: map_refinement.bijective_zoomout(BASIS, BASIS, np.eye(5), np.eye(5), samples=(np.arange(9), [1])), ValueError, "samples must be at least as many as the 8 modes; got 1"),
        (lambda: map_refinement.icp(BASIS, BASIS, np.eye(5), n_rounds=-1), ValueError, "n_rounds must be at least 0"),
        (lambda: map_refinement.bijective_zoomout(BASIS, BASIS, np.eye(5), np.eye(4)), ValueError, "C_12 and C_21 must be square and of equal size"),
        (lambda: map_fitting.point_descriptors(BASIS, [162]), ValueError, "landmarks must lie in 0 .. 161; found 162"),
        (lambda: map_fitting.point_descriptors(BASIS, n_each=1), ValueError, "n_each must be at least 2; got 1"),
        (lambda: map_fitting.fit_functional_map(BASIS, BASIS, np.ones((162, 2)), np.ones((162, 3))), ValueError, r"descriptors_2 must have shape \(162, 2\)"),
        (lambda: map_fitting.fit_functional_map(BASIS, BASIS, np.ones((162, 2)), np.ones((162, 2)), w_laplacian=-1.0), ValueError, "w_laplacian must be at least 0"),
        (lambda: point_maps.precise_map(shapes.sphere(1), BASIS, BASIS, np.eye(3)), ValueError, "basis_1 must have a row for each of the 42 vertices; it has 162"),
        (lambda: point_maps.geodesic_errors(SMALL, [0, 1], [0]), ValueError, r"p2p_21 must have shape \(1,\)"),
    ],
)
def test_errors_name_the_argument(call: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_labels_are_carried_and_never_averaged() -> None:
    labels = np.where(SMALL.vertices[:, 2] > 0, 7, 2)
    np.testing.assert_array_equal(fm.pull_back_labels(np.arange(162)[::-1], labels), labels[::-1])
    halves = sp.csr_array(np.full((1, 162), 1 / 162))
    assert fm.pull_back_labels(halves, labels).tolist() == [2 if (labels == 2).sum() > 81 else 7]


def test_unit_area_bases_give_the_same_point_map(basis: Eigenbasis) -> None:
    C_12 = np.eye(K)
    np.testing.assert_array_equal(fm.point_map(unit_area(basis), unit_area(basis), C_12), fm.point_map(basis, basis, C_12))
