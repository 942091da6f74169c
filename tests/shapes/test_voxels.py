"""Voxels: boxes by hand, balls by formula, the bracket's topology, and every promised error."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.geometry.mesh_health import health
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, tetrahedral_laplacian
from spectral_notes.meshes import TriangleMesh, euler_characteristic, face_normals, is_closed
from spectral_notes.shapes import bracket, rectangle, sphere, torus
from spectral_notes.shapes.voxels import (
    VoxelGrid,
    voxel_euler_characteristic,
    voxel_graph,
    voxel_shell,
    voxel_skin,
    voxel_tetrahedra,
    voxelize,
)


def solid(inside, step=1.0):
    return VoxelGrid(np.asarray(inside, dtype=bool), (0.0, 0.0, 0.0), step)


def enclosed_volume(mesh):
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_a_ball_has_the_centres_nearer_than_its_radius():
    ball = voxelize(sphere(4), 0.1)
    distance = np.linalg.norm(
        ball.corner + ball.step * (np.indices(ball.inside.shape).reshape(3, -1).T + 0.5), axis=1
    ).reshape(ball.inside.shape)
    clear = np.abs(distance - 1) > 5e-3  # the icosphere lies a little inside the sphere
    np.testing.assert_array_equal(ball.inside[clear], distance[clear] < 1)
    assert not ball.inside[[0, -1]].any() and not ball.inside[:, [0, -1]].any() and not ball.inside[..., [0, -1]].any()


def test_inside_is_inside_whichever_way_the_faces_turn():
    ball = sphere(3)
    turned = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    np.testing.assert_array_equal(voxelize(turned, 0.2).inside, voxelize(ball, 0.2).inside)


def test_volume_converges_but_the_skin_of_a_ball_keeps_three_halves_of_its_area():
    for step, tolerance in ((0.1, 0.03), (0.04, 0.01)):
        ball = voxelize(sphere(5), step)
        assert ball.volume == pytest.approx(4 * np.pi / 3, rel=tolerance)
        assert voxel_skin(ball).area == pytest.approx(1.5 * 4 * np.pi, rel=2 * tolerance)


@settings(max_examples=15)
@given(st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(1, 4)), st.floats(0.1, 3.0))
def test_boxes(shape, step):
    box = solid(np.ones(shape), step)
    a, b, c = (step * n for n in shape)
    skin = voxel_skin(box)
    assert skin.area == pytest.approx(2 * (a * b + b * c + c * a))
    assert box.volume == pytest.approx(a * b * c) == pytest.approx(enclosed_volume(skin))
    assert is_closed(skin) and euler_characteristic(skin) == 2 and voxel_euler_characteristic(box) == 1
    roots = [2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in shape]
    expected = np.add.outer(np.add.outer(roots[0], roots[1]), roots[2]).ravel()
    L, _ = graph_laplacian(voxel_graph(box))
    np.testing.assert_allclose(scipy.linalg.eigvalsh(L.toarray()), np.sort(expected), atol=1e-12)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_random_solids_have_closed_skins_that_enclose_their_volume(seed):
    grid = solid(np.random.default_rng(seed).random((4, 4, 4)) < 0.5)
    skin = voxel_skin(grid)
    assert enclosed_volume(skin) == pytest.approx(grid.n_voxels)
    normals = face_normals(skin)
    np.testing.assert_allclose(normals.sum(axis=0), 0, atol=1e-12)


def test_cubes_that_touch_in_an_edge_make_a_skin_that_is_no_manifold():
    report = health(voxel_skin(solid([[[True], [False]], [[False], [True]]])))
    assert report.faults["nonmanifold_edges"] == 1
    assert voxel_graph(solid([[[True], [False]], [[False], [True]]])).nnz == 0


def test_the_topology_of_ball_torus_and_bracket():
    assert voxel_euler_characteristic(voxelize(torus(), 0.1)) == 0
    part = voxelize(bracket(), 0.05)
    assert voxel_euler_characteristic(part) == -5  # one piece, six tunnels
    assert health(voxel_skin(part)).genus == 6
    hollow = np.ones((3, 3, 3), dtype=bool)
    hollow[1, 1, 1] = False
    assert voxel_euler_characteristic(solid(hollow)) == 2  # one piece, one cavity
    assert voxel_euler_characteristic(solid([[[1, 0, 1]]])) == 2


def test_on_a_skin_the_cotan_laplacian_is_the_graph_of_its_square_edges():
    skin = voxel_skin(solid(np.ones((3, 2, 2)), 0.3))
    L, _ = cotan_laplacian(skin)
    a, b = L.tocoo().coords
    length = np.linalg.norm(skin.vertices[a] - skin.vertices[b], axis=1)
    off = (a != b) & (abs(L.tocoo().data) > 1e-12)
    np.testing.assert_allclose(length[off], 0.3)
    np.testing.assert_allclose(L.tocoo().data[off], -1.0)


def test_a_shell_tends_to_the_surface_as_its_width_grows_in_steps():
    for half_width in (1, 2, 3):
        shell = voxel_shell(sphere(4), 0.08, half_width)
        radius = np.linalg.norm(shell.centers, axis=1)
        assert abs(radius - 1).max() < half_width * 0.08 + 5e-3
        basis = compute_eigenbasis(*graph_laplacian(voxel_graph(shell)), k=4)
        ragged = (2 * half_width - 0.5) / (
            2 * half_width
        )  # the outermost cubes are dead ends: half a step conducts not
        np.testing.assert_allclose(basis.evals[1:] / shell.step**2, 2 * ragged, rtol=0.03)


def test_a_shell_along_the_grid_has_the_eigenvalues_of_the_rectangle():
    shell = voxel_shell(rectangle(2.0, 1.0, 5, 5), 0.1, 0.9)
    basis = compute_eigenbasis(*graph_laplacian(voxel_graph(shell)), k=3)
    n_x, n_y, n_z = np.ptp(np.argwhere(shell.inside), axis=0) + 1
    assert shell.n_voxels == n_x * n_y * n_z and n_z == 2
    np.testing.assert_allclose(basis.evals[1:], 2 - 2 * np.cos(np.pi / np.array([n_x, n_y])), rtol=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3.0))
def test_tetrahedra_fill_every_solid_and_fit_face_to_face(seed, step):
    grid = solid(np.random.default_rng(seed).random((4, 3, 2)) < 0.6, step)
    vertices, tets = voxel_tetrahedra(grid)
    sides = vertices[tets[:, 1:]] - vertices[tets[:, :1]]
    np.testing.assert_allclose(abs(np.linalg.det(sides)) / 6, step**3 / 6)
    faces = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    _, times = np.unique(faces, axis=0, return_counts=True)
    assert times.max() <= 2  # and the triangles that only one of them has are those of the skin
    assert (times == 1).sum() == voxel_skin(grid).n_faces


def test_on_cubes_the_tetrahedra_give_the_slopes_along_edges_alone():
    vertices, tets = voxel_tetrahedra(solid(np.ones((3, 3, 4)), 0.5))
    L = tetrahedral_laplacian(vertices, tets)[0].tocoo()
    used = (abs(L.data) > 1e-12) & (L.coords[0] != L.coords[1])
    np.testing.assert_allclose(np.linalg.norm(vertices[L.coords[0]] - vertices[L.coords[1]], axis=1)[used], 0.5)


def test_a_cube_of_tetrahedra_pushed_to_a_ball_has_bessels_zeros_at_order_two():
    zeros = np.array([2.0815759778, 3.3420936578])  # of the slope of j_1 and of j_2

    def errors(n):
        """Relative errors of the first two groups of the free ball."""
        vertices, tets = voxel_tetrahedra(VoxelGrid(np.ones((2 * n,) * 3, dtype=bool), (-1, -1, -1), 1 / n))
        length = np.maximum(np.linalg.norm(vertices, axis=1), 1e-15)
        pushed = vertices * (abs(vertices).max(axis=1) / length)[:, None]
        sides = pushed[tets[:, 1:]] - pushed[tets[:, :1]]
        assert (abs(np.linalg.det(sides)) / 6 > 0.02 * np.linalg.norm(sides, axis=2).max(axis=1) ** 3).all()  # none is flat
        evals = compute_eigenbasis(*tetrahedral_laplacian(pushed, tets, mass="full"), 9).evals
        return np.array([evals[1:4].mean(), evals[4:9].mean()]) / zeros**2 - 1

    assert np.log2(errors(4) / errors(8)) == pytest.approx([2, 2], abs=0.15)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: VoxelGrid(np.ones((2, 2), dtype=bool), (0, 0, 0), 1.0), TypeError, "inside must be a three-dim.* 2 axes"),
        (lambda: VoxelGrid(np.ones((2, 2, 2)), (0, 0, 0), 1.0), TypeError, "inside must be .* booleans; got float64"),
        (lambda: solid(np.zeros((2, 2, 2))), ValueError, "inside must mark at least one voxel; a smaller step"),
        (lambda: VoxelGrid(np.ones((1, 1, 1), dtype=bool), (0, 0), 1.0), ValueError, r"corner must have shape \(3,\)"),
        (lambda: solid(np.ones((1, 1, 1)), 0.0), ValueError, "step must be greater than 0; got 0"),
        (lambda: voxelize(sphere(1), 0.0), ValueError, "step must be greater than 0; got 0"),
        (lambda: voxelize(sphere(1), 1e-4), ValueError, "step must leave at most 30000000 voxels .* 0.0001 needs more"),
        (lambda: voxel_shell(sphere(1), 0.1, -1), ValueError, "half_width must be greater than 0; got -1"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_an_open_mesh_has_no_inside(unit_square):
    with pytest.raises(ValueError, match="mesh must be closed to have an inside; it has boundary edges"):
        voxelize(unit_square, 0.1)
    assert voxel_shell(unit_square, 0.1).n_voxels > 100


def test_grids_are_read_only_and_named_after_their_mesh():
    ball = sphere(2)
    grid = voxelize(ball, 0.3)
    assert (grid.name, voxel_skin(grid).name) == ("sphere_voxels", "sphere_voxels")
    assert voxelize(TriangleMesh(ball.vertices, ball.faces), 0.3).name == "voxels"
    assert grid.centers.shape == (grid.n_voxels, 3)
    with pytest.raises(ValueError, match="read-only"):
        grid.inside[0, 0, 0] = True
