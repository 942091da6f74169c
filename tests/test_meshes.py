"""Meshes: facts of small meshes worked out by hand, laws, and every promised error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spectral_notes import meshes
from spectral_notes.meshes import PointCloud, TriangleMesh, clean_mesh

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_facts_of_the_tetrahedron(tetrahedron):
    assert len(meshes.edges(tetrahedron)) == 6
    np.testing.assert_allclose(meshes.edge_lengths(tetrahedron), np.sqrt(8.0))
    np.testing.assert_allclose(meshes.face_areas(tetrahedron), np.sqrt(12.0))  # side^2 sqrt(3) / 4
    np.testing.assert_allclose(meshes.corner_angles(tetrahedron), np.pi / 3)
    assert meshes.euler_characteristic(tetrahedron) == 2
    assert meshes.is_closed(tetrahedron)
    assert meshes.boundary_loops(tetrahedron) == []
    np.testing.assert_array_equal(meshes.connected_components(tetrahedron), [0, 0, 0, 0])


def test_normals_of_the_tetrahedron_point_outward(tetrahedron):
    outward = tetrahedron.vertices / np.sqrt(3.0)  # each vertex normal lies along its vertex
    np.testing.assert_allclose(meshes.vertex_normals(tetrahedron), outward, atol=1e-15)
    centres = tetrahedron.vertices[tetrahedron.faces].mean(axis=1)
    assert (np.einsum("fd,fd->f", meshes.face_normals(tetrahedron), centres) > 0).all()


def test_square_has_one_boundary_loop_and_one_inner_edge(unit_square):
    assert unit_square.area == pytest.approx(1.0)
    assert meshes.edges_with_counts(unit_square)[1].tolist() == [1, 2, 1, 1, 1]
    assert [loop.tolist() for loop in meshes.boundary_loops(unit_square)] == [[0, 1, 2, 3]]
    assert not meshes.is_closed(unit_square)
    assert meshes.euler_characteristic(unit_square) == 1


def test_mobius_strip_has_a_single_boundary_loop(mobius):
    (loop,) = meshes.boundary_loops(mobius)
    assert sorted(loop.tolist()) == list(range(12))
    steps = {tuple(sorted(step)) for step in zip(loop, np.roll(loop, -1), strict=True)}
    pairs, counts = meshes.edges_with_counts(mobius)
    assert steps == {tuple(edge) for edge in pairs[counts == 1]}
    assert meshes.euler_characteristic(mobius) == 0


def test_longest_boundary_loop_comes_first():
    grid = np.stack(np.meshgrid(range(5), range(5), indexing="ij"), axis=-1).reshape(-1, 2)
    corners = [(i, j) for i in range(4) for j in range(4) if (i, j) not in [(1, 1), (2, 1)]]
    faces = [[5 * i + j, 5 * i + j + 5, 5 * i + j + 6] for i, j in corners]
    faces += [[5 * i + j, 5 * i + j + 6, 5 * i + j + 1] for i, j in corners]
    loops = meshes.boundary_loops(TriangleMesh(np.c_[grid, np.zeros(25)], faces))
    assert [len(loop) for loop in loops] == [16, 6]


def test_edge_with_three_faces_is_counted_and_its_ends_are_no_simple_boundary(book_of_three):
    pairs, counts = meshes.edges_with_counts(book_of_three)
    assert pairs[counts == 3].tolist() == [[0, 1]]
    with pytest.raises(ValueError, match="separate boundary loops; 3 boundary edges meet at vertex 0"):
        meshes.boundary_loops(book_of_three)


def test_components_count_a_vertex_without_face_alone():
    mesh = TriangleMesh(np.eye(7)[:, :3], [[0, 1, 2], [3, 4, 5]])
    assert meshes.connected_components(mesh).tolist() == [0, 0, 0, 1, 1, 1, 2]


@given(st.integers(0, 2**32 - 1))
def test_areas_and_angles_do_not_depend_on_where_the_mesh_stands(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.standard_normal((3, 3))
    rotation = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    here = TriangleMesh(vertices, [[0, 1, 2]])
    there = TriangleMesh(vertices @ rotation.T + rng.standard_normal(3), [[0, 1, 2]])
    np.testing.assert_allclose(meshes.face_areas(here), meshes.face_areas(there), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(meshes.corner_angles(here), meshes.corner_angles(there), atol=1e-8)
    assert meshes.corner_angles(here).sum() == pytest.approx(np.pi)


def test_a_face_without_area_has_a_zero_normal():
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert meshes.face_areas(mesh).tolist() == [0.0]
    assert meshes.face_normals(mesh).tolist() == [[0.0, 0.0, 0.0]]


def test_arrays_are_copied_and_read_only():
    vertices = np.eye(3)
    mesh = TriangleMesh(vertices, [[0, 1, 2]])
    vertices[0, 0] = 7.0
    assert mesh.vertices[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 2.0
    with pytest.raises(AttributeError):
        mesh.name = "other"
    with pytest.raises(ValueError, match="read-only"):
        PointCloud(vertices).points[0, 0] = 2.0


def test_clean_mesh_merges_drops_and_renumbers():
    vertices = [[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]
    faces = [[1, 2, 3], [4, 5, 3], [2, 4, 3], [3, 1, 4]]  # the third is a line, the fourth repeats the first
    mesh = clean_mesh(vertices, faces, "square")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert mesh.name == "square"


@pytest.mark.parametrize(
    ("vertices", "faces", "error", "message"),
    [
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], ValueError, r"vertices must have shape \(n, 3\); got \(3, 2\)"),
        ([[0, 0, np.nan]], [[0, 1, 2]], ValueError, r"vertices must hold finite numbers; found nan at index \(0, 2\)"),
        ("abc", [[0, 1, 2]], TypeError, "vertices must be an array of real numbers"),
        ([[1j, 0, 0]], [[0, 1, 2]], TypeError, "vertices must be an array of real numbers; got dtype complex128"),
        ([[0, 0, 0], [1, 0]], [[0, 1, 2]], TypeError, "vertices must be an array of numbers; got rows of different"),
        (TRIANGLE, [[0, 1, 3]], ValueError, r"faces must lie in 0 .. 2; found 3"),
        (TRIANGLE, [[0, 1, -1]], ValueError, r"faces must lie in 0 .. 2; found -1"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], TypeError, "faces must hold integers; got dtype float64"),
        (TRIANGLE, [[0, 1, 2, 0]], ValueError, r"faces must have shape \(m, 3\); got \(1, 4\)"),
        (TRIANGLE, np.zeros((0, 3), dtype=int), ValueError, "faces must hold at least one triangle; .* PointCloud"),
        (TRIANGLE, [[0, 1, 2], [1, 1, 2]], ValueError, r"1 do not, the first is face 1: \[1, 1, 2\]. clean_mesh"),
    ],
)
def test_mesh_refuses(vertices, faces, error, message):
    with pytest.raises(error, match=message):
        TriangleMesh(vertices, faces)


def test_clouds_and_names_are_checked():
    with pytest.raises(ValueError, match=r"points must have shape \(n, 3\); got \(3,\)"):
        PointCloud([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="points must hold at least one point"):
        PointCloud(np.zeros((0, 3)))
    with pytest.raises(TypeError, match="name must be a string; got int"):
        PointCloud(np.zeros((1, 3)), name=3)
    with pytest.raises(TypeError, match="name must be a string; got NoneType"):
        TriangleMesh(TRIANGLE, [[0, 1, 2]], name=None)
    with pytest.raises(ValueError, match="faces must hold at least one triangle"):
        clean_mesh(TRIANGLE, [[0, 0, 1]])
