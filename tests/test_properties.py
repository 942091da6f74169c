"""Laws that hold for every mesh and every graph, on ones that nobody chose."""

from __future__ import annotations

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from spectral_notes import (
    TriangleMesh,
    clean_mesh,
    compute_eigenbasis,
    cotan_laplacian,
    divergence_matrix,
    gradient_matrix,
    graph_laplacian,
    health,
    mesh_graph,
    read_mesh,
    robust_mesh_laplacian,
    write_mesh,
)
from spectral_notes.meshes import corner_angles, euler_characteristic, face_areas

FEW = settings(max_examples=25, suppress_health_check=list(HealthCheck))


@st.composite
def meshes(draw: st.DrawFn) -> TriangleMesh:
    """Triples of vertices on a jittered grid: in pieces, not manifold, turned anyhow, of any shape that is no sliver."""
    n = draw(st.integers(4, 20))
    faces = draw(hnp.arrays(np.int64, (draw(st.integers(1, 30)), 3), elements=st.integers(0, n - 1)))
    seed = draw(st.integers(0, 2**32 - 1))
    vertices = np.random.default_rng(seed).normal(size=(n, 3)) * draw(st.sampled_from([1e-6, 1.0, 1e6]))
    if draw(st.booleans()):  # a second piece
        vertices, faces = np.r_[vertices, 9 * np.ptp(vertices) - vertices], np.r_[faces, faces + n]
    try:
        mesh = clean_mesh(vertices, faces)
    except ValueError:
        mesh = TriangleMesh(vertices[:3], [[0, 1, 2]])
    assume(np.degrees(corner_angles(mesh).min()) > 0.5)
    return mesh


@FEW
@given(meshes(), st.integers(0, 99))
def test_the_laplacians_annihilate_constants_and_are_energies(mesh: TriangleMesh, seed: int) -> None:
    f = np.random.default_rng(seed).normal(size=mesh.n_vertices)
    for L, M in (cotan_laplacian(mesh), robust_mesh_laplacian(mesh)):
        size = abs(L).max()
        assert abs(L - L.T).max() <= 1e-12 * size
        assert abs(L @ np.ones(mesh.n_vertices)).max() <= 1e-9 * size
        assert f @ L @ f >= -1e-9 * size * (f @ f)
        assert M.sum() == pytest.approx(mesh.area, rel=1e-3)
        assert M.diagonal().min() > 0


@FEW
@given(meshes(), st.integers(0, 99))
def test_gradient_and_divergence_are_adjoint_and_make_the_laplacian(mesh: TriangleMesh, seed: int) -> None:
    rng = np.random.default_rng(seed)
    f, X = rng.normal(size=mesh.n_vertices), rng.normal(size=3 * mesh.n_faces)
    G, D = gradient_matrix(mesh), divergence_matrix(mesh)
    areas = np.tile(face_areas(mesh), 3)
    assert f @ (D @ X) == pytest.approx(-(G @ f) @ (areas * X), rel=1e-9, abs=1e-9 * abs(D).max() * mesh.n_faces)
    L = cotan_laplacian(mesh)[0]
    assert abs(-D @ G - L).max() <= 1e-8 * abs(L).max()


@FEW
@given(meshes(), st.sampled_from([1e-3, 0.5, 7.0, 1e4]), st.integers(0, 99))
def test_motion_changes_nothing_and_scale_changes_only_the_mass(mesh: TriangleMesh, scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    moved = TriangleMesh(scale * (mesh.vertices @ turn), mesh.faces)
    (L, M), (L_moved, M_moved) = cotan_laplacian(mesh), cotan_laplacian(moved)
    assert abs(L - L_moved).max() <= 1e-7 * abs(L).max()
    assert M_moved.diagonal() == pytest.approx(scale**2 * M.diagonal(), rel=1e-7)


@FEW
@given(meshes(), st.integers(0, 99))
def test_renumbering_vertices_and_turning_faces_changes_no_eigenvalue(mesh: TriangleMesh, seed: int) -> None:
    rng = np.random.default_rng(seed)
    number = rng.permutation(mesh.n_vertices)
    faces = np.array([np.roll(face, rng.integers(3))[:: rng.choice([-1, 1])] for face in number[mesh.faces]])
    other = TriangleMesh(mesh.vertices[np.argsort(number)], faces)
    k = mesh.n_vertices
    evals, others = (compute_eigenbasis(*cotan_laplacian(m), k).evals for m in (mesh, other))
    assert others == pytest.approx(evals, rel=1e-6, abs=1e-7 * evals.max())


@FEW
@given(meshes())
def test_zero_modes_are_counted_by_components_and_modes_are_orthonormal(mesh: TriangleMesh) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(mesh), mesh.n_vertices)
    zero = int((basis.evals <= 1e-9 * basis.evals.max()).sum())
    assert zero == health(mesh).components
    assert basis.evecs.T @ basis.M @ basis.evecs == pytest.approx(np.eye(mesh.n_vertices), abs=1e-8)
    f = np.linspace(-1.0, 2.0, mesh.n_vertices)
    assert basis.synthesize(basis.analyze(f)) == pytest.approx(f, abs=1e-6)


@FEW
@given(meshes())
def test_cleaning_twice_is_cleaning_once(mesh: TriangleMesh) -> None:
    again = clean_mesh(mesh.vertices, mesh.faces)
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.faces, mesh.faces)
    assert euler_characteristic(again) == health(again).euler_characteristic


@FEW
@given(meshes(), st.sampled_from(["obj", "off", "ply"]))
def test_files_give_every_mesh_back_digit_by_digit(tmp_path_factory, mesh: TriangleMesh, ending: str) -> None:
    path = tmp_path_factory.getbasetemp() / f"any.{ending}"
    write_mesh(path, mesh)
    back = read_mesh(path)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)


@FEW
@given(meshes(), st.integers(0, 99))
def test_a_graph_laplacian_is_the_sum_over_its_edges(mesh: TriangleMesh, seed: int) -> None:
    W = mesh_graph(mesh)
    f = np.random.default_rng(seed).normal(size=mesh.n_vertices)
    L, M = graph_laplacian(W)
    i, j = W.nonzero()
    assert f @ L @ f == pytest.approx(((f[i] - f[j]) ** 2).sum() / 2)
    assert M.sum() == mesh.n_vertices
