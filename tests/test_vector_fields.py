"""Vectors as complex numbers: closed-form spectra, Poincare and Hopf, transport, Hodge, and a second opinion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.geometry import angle_defects, parallel_transport
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import arrows_of_rows, divergence_matrix, gradient_matrix, rows_of_arrows
from spectral_notes.meshes import TriangleMesh, euler_characteristic, face_areas
from spectral_notes.shapes import bracket, egg, flat_torus, goat, potato, sphere, terrain, torus
from spectral_notes.vector_fields import (
    arrows_of_field,
    connection_laplacian,
    edge_transport,
    field_indices,
    harmonic_fields,
    hodge_parts,
    smoothest_field,
    transport_vector,
)


@pytest.mark.parametrize("n_fold", [1, 2, 4])
def test_sphere_has_its_eigenvalues_with_their_multiplicities_at_order_two(n_fold: int) -> None:
    """l (l + 1) - n^2 for l >= n, each 2 (2 l + 1) times."""
    exact = np.concatenate([np.full(2 * (2 * l + 1), l * (l + 1) - n_fold**2) for l in (n_fold, n_fold + 1)])
    errors = []
    for subdivisions in (2, 3, 4):
        evals = compute_eigenbasis(*connection_laplacian(sphere(subdivisions), n_fold), len(exact) + 2).evals
        assert evals[-1] > exact[-1] + 1  # none of the next
        errors.append(np.abs(evals[: len(exact)] - exact).max())
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2
    assert 1.8 < np.log2(errors[1] / errors[2]) < 2.2


def test_flat_torus_has_parallel_fields_and_its_pair_is_two_of_the_scalar_one() -> None:
    faces, lengths = flat_torus(2.0, 1.0, 16, 9)
    evals = compute_eigenbasis(*connection_laplacian((faces, lengths)), 6).evals
    assert np.abs(evals[:2]).max() < 1e-10
    assert evals[2:] == pytest.approx(np.full(4, evals[2]))  # pi^2, twice for either sign, for either component
    assert evals[2] == pytest.approx(np.pi**2, rel=0.02)


@pytest.mark.parametrize("n_fold", [1, 2, 4])
@pytest.mark.parametrize("make", [egg, torus, bracket, goat], ids=["egg", "torus", "bracket", "goat"])
def test_indices_of_the_smoothest_field_sum_to_the_euler_characteristic(make, n_fold: int) -> None:
    mesh = make()
    indices = field_indices(mesh, smoothest_field(mesh, n_fold), n_fold)
    assert indices.sum() == euler_characteristic(mesh)
    assert np.count_nonzero(indices) < 0.01 * mesh.n_faces


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), n_fold=st.integers(1, 5))
def test_indices_of_any_field_sum_to_the_euler_characteristic(seed: int, n_fold: int) -> None:
    rng = np.random.default_rng(seed)
    for mesh in (potato(subdivisions=2), torus(n_major=12, n_minor=7)):
        z = rng.normal(size=mesh.n_vertices) + 1j * rng.normal(size=mesh.n_vertices)
        assert field_indices(mesh, z, n_fold).sum() == pytest.approx(euler_characteristic(mesh), abs=1e-9)


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), scale=st.floats(1e-3, 1e3))
def test_spectrum_survives_motion_relabelling_and_scale(seed: int, scale: float) -> None:
    rng, mesh = np.random.default_rng(seed), potato(subdivisions=2)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    new = rng.permutation(mesh.n_vertices)
    vertices = np.empty_like(mesh.vertices)
    vertices[new] = scale * mesh.vertices @ turn.T + rng.normal(size=3)
    faces = np.roll(new[mesh.faces], seed % 3, axis=1)[rng.permutation(mesh.n_faces)]
    moved = compute_eigenbasis(*connection_laplacian(TriangleMesh(vertices, faces)), 8).evals
    assert moved * scale**2 == pytest.approx(compute_eigenbasis(*connection_laplacian(mesh), 8).evals, rel=1e-7)


def test_holonomy_round_a_vertex_is_its_angle_defect() -> None:
    mesh = potato(subdivisions=3)
    defects = angle_defects(mesh)
    for vertex in range(0, mesh.n_vertices, 7):
        fan = [int(np.flatnonzero((mesh.faces == vertex).any(axis=1))[0])]
        while len(fan) == 1 or fan[-1] != fan[0]:
            corner = int(np.flatnonzero(mesh.faces[fan[-1]] == vertex)[0])
            last = mesh.faces[fan[-1], corner - 1]
            beside = (mesh.faces == vertex).any(axis=1) & (mesh.faces == last).any(axis=1)
            fan.append(int(next(face for face in np.flatnonzero(beside) if face != fan[-1])))
        start = mesh.vertices[mesh.faces[fan[0], 1]] - mesh.vertices[mesh.faces[fan[0], 0]]
        arrows = parallel_transport(mesh, fan, start)
        normal = np.cross(*(mesh.vertices[mesh.faces[fan[0], k]] - mesh.vertices[mesh.faces[fan[0], 0]] for k in (1, 2)))
        turn = np.arctan2(np.cross(arrows[0], arrows[-1]) @ normal / np.linalg.norm(normal), arrows[0] @ arrows[-1])
        assert abs(turn - defects[vertex]) < 1e-10


def test_holonomy_of_faces_is_the_product_of_turns_and_sums_to_the_curvature() -> None:
    for mesh in (potato(subdivisions=3), torus(), bracket()):
        edges = edge_transport(mesh)
        round_face = edges.turns[: 3 * mesh.n_faces].reshape(-1, 3).sum(axis=1)
        assert np.abs(np.exp(1j * (round_face + edges.holonomy)) - 1).max() < 1e-10 or np.abs(
            np.exp(1j * (round_face - edges.holonomy)) - 1
        ).max() < 1e-10
        assert edges.holonomy.sum() == pytest.approx(2 * np.pi * euler_characteristic(mesh), abs=1e-10)


def test_weights_are_those_of_the_scalar_laplacian() -> None:
    mesh = potato(subdivisions=3)
    edges, (L, M) = edge_transport(mesh), cotan_laplacian(mesh)
    assert np.abs(edges.weights + L[edges.tails, edges.heads]).max() < 1e-12
    assert edges.vertex_areas == pytest.approx(M.diagonal())


def carried_on_the_sphere(ball: TriangleMesh, arrow: np.ndarray, vertex: int) -> np.ndarray:
    """Rotate an arrow along the great circles from a vertex to all others (Rodrigues)."""
    start = ball.vertices[vertex]
    axis, cosine = np.cross(start, ball.vertices), (ball.vertices @ start)[:, None]
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    k = axis / np.maximum(sine, 1e-15)
    return arrow * cosine + np.cross(k, arrow) * sine + k * (k @ arrow)[:, None] * (1 - cosine)


def test_vector_heat_tends_to_transport_along_great_circles() -> None:
    errors = []
    for subdivisions in (3, 4, 5):
        ball = sphere(subdivisions)
        arrows = arrows_of_field(ball, transport_vector(ball, 0, 1j))
        exact = carried_on_the_sphere(ball, arrows[0], 0)
        angle = np.arccos(np.clip((arrows * exact).sum(axis=1) / np.linalg.norm(arrows, axis=1), -1, 1))
        errors.append(angle[ball.vertices @ ball.vertices[0] > -0.7].max())
    assert errors[2] < 0.006
    assert all(0.6 < order < 1.3 for order in np.log2(np.divide(errors[:-1], errors[1:])))


def test_one_arrow_goes_everywhere_on_a_flat_torus() -> None:
    z = transport_vector(flat_torus(1.0, 1.0, 12, 12), 5, 2 - 1j)
    smooth = smoothest_field(flat_torus(1.0, 1.0, 12, 12), fixed=[5], values=[2 - 1j])
    assert z == pytest.approx(smooth, abs=1e-9)


def test_given_arrows_are_kept() -> None:
    mesh = potato(subdivisions=3)
    z = smoothest_field(mesh, 2, fixed=[3, 40], values=[1j, -2.0])
    assert z[[3, 40]] == pytest.approx([1j, -2.0])
    L, _ = connection_laplacian(mesh, 2)
    pull = L @ np.concatenate([z.real, z.imag])
    free = np.setdiff1d(np.arange(2 * mesh.n_vertices), [3, 40, 3 + mesh.n_vertices, 40 + mesh.n_vertices])
    assert np.abs(pull[free]).max() < 1e-9


@pytest.mark.parametrize(("make", "n_harmonic"), [(egg, 0), (torus, 2), (bracket, 12)], ids=["egg", "torus", "bracket"])
def test_hodge_parts_add_up_are_orthogonal_and_the_harmonic_ones_are_two_a_handle(make, n_harmonic: int) -> None:
    mesh = make()
    areas = face_areas(mesh)[:, None]
    field = np.random.default_rng(1).normal(size=(mesh.n_faces, 3))
    parts = hodge_parts(mesh, field)
    normals = np.cross(*(mesh.vertices[mesh.faces[:, k]] - mesh.vertices[mesh.faces[:, 0]] for k in (1, 2)))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    flat = field - (field * normals).sum(axis=1, keepdims=True) * normals
    assert np.abs(sum(parts) - flat).max() < 1e-12
    energy = (areas * flat**2).sum()
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert abs((areas * parts[one] * parts[other]).sum()) < 1e-10 * energy
    basis = harmonic_fields(mesh)
    assert len(basis) == n_harmonic
    gram = np.einsum("imc,jmc,m->ij", basis, basis, areas[:, 0])
    assert gram == pytest.approx(np.eye(n_harmonic), abs=1e-9)
    for X in (*basis, parts[2]):
        assert np.abs(divergence_matrix(mesh) @ rows_of_arrows(X)).max() < 1e-9
        assert np.abs(divergence_matrix(mesh) @ rows_of_arrows(np.cross(normals, X))).max() < 1e-9
    inside = np.einsum("kmc,mc,m->k", basis, parts[2], areas[:, 0])
    assert parts[2] == pytest.approx(np.einsum("k,kmc->mc", inside, basis), abs=1e-8)  # they span the rest


def test_a_gradient_on_a_terrain_is_found_whole() -> None:
    mesh = terrain(8)
    slope = arrows_of_rows(gradient_matrix(mesh) @ mesh.vertices[:, 2])
    gradient, turned, harmonic = hodge_parts(mesh, slope)
    assert gradient == pytest.approx(slope, abs=1e-10)
    assert max(np.abs(turned).max(), np.abs(harmonic).max()) < 1e-10
    assert len(harmonic_fields(mesh)) == 0


def test_geometry_central_agrees() -> None:
    pp3d = pytest.importorskip("potpourri3d")
    mesh = potato(subdivisions=3)
    solver = pp3d.MeshVectorHeatSolver(mesh.vertices, mesh.faces)
    X, Y, _ = solver.get_tangent_frames()
    mine = arrows_of_field(mesh, transport_vector(mesh, 0))
    start = np.array([mine[0] @ X[0], mine[0] @ Y[0]])
    theirs = solver.transport_tangent_vector(0, start)
    theirs = theirs[:, [0]] * X + theirs[:, [1]] * Y
    cosine = (mine * theirs).sum(axis=1) / np.linalg.norm(mine, axis=1) / np.linalg.norm(theirs, axis=1)
    assert np.percentile(np.arccos(np.clip(cosine, -1, 1)), 95) < 0.05
