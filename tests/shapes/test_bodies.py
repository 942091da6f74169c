"""Goat, doll and bracket: closed, of good triangles, posed nearly without stretching, and the same on every build."""

from __future__ import annotations

from collections.abc import Callable

import bodies as recipes
import igl
import numpy as np
import pytest
from scipy.spatial import cKDTree

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import (
    TriangleMesh,
    connected_components,
    corner_angles,
    edge_lengths,
    edges_with_counts,
    euler_characteristic,
    vertex_normals,
)
from spectral_notes.shapes.bodies import bracket, doll, doll_correspondence, goat
from spectral_notes.shapes.stored import load_stored

DOLL_POSES = ("arms_down", "walk", "wave")
GOAT_POSES = ("walk", "look")


def signed_volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@pytest.mark.parametrize(
    ("make", "chi", "name", "n_least", "n_most"),
    [
        (goat, 2, "goat", 13_000, 16_000),
        (doll, 2, "doll", 8_500, 9_500),
        (lambda: doll(connectivity="remeshed"), 2, "doll_remeshed", 7_000, 8_400),
        (bracket, 2 - 2 * 6, "bracket", 8_000, 10_000),
    ],
    ids=["goat", "doll", "doll_remeshed", "bracket"],
)
def test_body_is_one_closed_surface_of_good_triangles(
    make: Callable[[], TriangleMesh], chi: int, name: str, n_least: int, n_most: int
) -> None:
    mesh = make()
    assert mesh.name == name
    assert n_least < mesh.n_vertices < n_most
    assert (edges_with_counts(mesh)[1] == 2).all()
    assert connected_components(mesh).max() == 0
    assert euler_characteristic(mesh) == chi
    assert len(np.unique(mesh.faces)) == mesh.n_vertices
    assert igl.is_vertex_manifold(mesh.faces).all()
    assert signed_volume(mesh) > 0  # normals point out
    smallest = np.degrees(corner_angles(mesh).min(axis=1))
    assert smallest.min() > 20
    assert np.percentile(smallest, 1) > 30


@pytest.mark.parametrize(("make", "poses"), [(goat, GOAT_POSES), (doll, DOLL_POSES)], ids=["goat", "doll"])
def test_poses_share_faces_and_hardly_stretch(make: Callable[[str], TriangleMesh], poses: tuple[str, ...]) -> None:
    rest = make("rest")
    for pose in poses:
        mesh = make(pose)
        assert mesh.name == f"{rest.name}_{pose}"
        np.testing.assert_array_equal(mesh.faces, rest.faces)
        stretch = np.abs(edge_lengths(mesh) / edge_lengths(rest) - 1.0)
        assert np.median(stretch) < 0.01
        assert np.percentile(stretch, 95) < 0.08
        assert abs(mesh.area / rest.area - 1.0) < 0.03
        assert np.degrees(corner_angles(mesh).min()) > 15
        assert np.abs(mesh.vertices - rest.vertices).max() > 0.2  # it did move


def test_no_body_overlaps_itself() -> None:
    bodies = [
        bracket(),
        *(goat(pose) for pose in ("rest", *GOAT_POSES)),
        *(doll(pose) for pose in ("rest", *DOLL_POSES)),
    ]
    for mesh in bodies:
        normals, vertices, faces = vertex_normals(mesh), np.array(mesh.vertices), np.array(mesh.faces)
        for offset, winding in ((1e-3, 0.0), (-1e-3, 1.0)):  # just outside and just inside
            found = igl.fast_winding_number(vertices, faces, vertices + offset * normals)
            assert np.abs(found - winding).max() < 0.5


@pytest.mark.parametrize("pose", ["rest", *DOLL_POSES])
def test_remeshed_doll_has_true_correspondence(pose: str) -> None:
    original, copy, P = doll(pose), doll(pose, "remeshed"), doll_correspondence()
    assert P.shape == (copy.n_vertices, original.n_vertices)
    assert P.data.min() > 0
    assert np.diff(P.indptr).max() <= 3
    np.testing.assert_allclose(P.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(P @ original.vertices, copy.vertices, atol=1e-14)
    nearest = P.argmax(axis=1)
    gap = np.linalg.norm(original.vertices[nearest] - copy.vertices, axis=1)
    assert gap.max() < 0.025  # less than an edge
    assert copy.name.endswith("remeshed")


def test_round_trip_over_the_remeshed_doll_ends_at_the_same_place() -> None:
    original, copy, P = doll(), doll(connectivity="remeshed"), doll_correspondence()
    back = cKDTree(copy.vertices).query(original.vertices)[1]  # at rest the nearest vertex of the copy
    there = P.argmax(axis=1)[back]
    assert np.linalg.norm(original.vertices[there] - original.vertices, axis=1).max() < 0.04


def test_vertices_of_the_remeshed_doll_lie_in_faces_of_the_doll() -> None:
    original, P = doll(), doll_correspondence()
    inside = np.flatnonzero(np.diff(P.indptr) == 3)
    assert len(inside) > 0.8 * P.shape[0]
    corners = np.array([np.sort(P.indices[P.indptr[i] : P.indptr[i + 1]]) for i in inside])
    together = np.unique(np.vstack([np.sort(original.faces, axis=1), corners]), axis=0)
    assert len(together) == original.n_faces  # the triples add no face


def test_ball_tells_left_from_right() -> None:
    mesh = doll()
    basis = compute_eigenbasis(*cotan_laplacian(mesh), 4)
    mode = np.asarray(basis.evecs)[:, 1]
    left, right = mesh.vertices[:, 0] > 0.5, mesh.vertices[:, 0] < -0.5
    strengths = sorted(float(np.mean(mode[side] ** 2)) for side in (left, right))
    assert strengths[1] > 3 * strengths[0]
    without_ball = mesh.vertices[mesh.vertices[:, 0] < 0.7]
    mirrored = without_ball * np.array([-1.0, 1.0, 1.0])
    on_right = mirrored[mirrored[:, 0] < -0.05]
    squared, _, _ = igl.point_mesh_squared_distance(on_right, mesh.vertices, mesh.faces)
    assert np.sqrt(squared.max()) < 2e-3  # the person alone is its own mirror image


@pytest.mark.slow
def test_recipe_and_data_agree() -> None:
    """To rounding; libigl turns limbs in single precision, so that poses agree to that only, should its version change."""
    built = recipes.build_bodies()
    for name, arrays in built.items():
        stored = load_stored(name)
        assert stored.keys() == arrays.keys()
        np.testing.assert_array_equal(stored["faces"], arrays["faces"])
        for pose, vertices in arrays.items():
            assert np.abs(stored[pose] - vertices).max() <= (1e-12 if pose in ("rest", "faces") else 1e-4)
    copy, stored = recipes.build_doll_copy(doll()), load_stored("doll_copy")
    for key in ("faces", "corners"):
        np.testing.assert_array_equal(stored[key], copy[key])
    np.testing.assert_allclose(stored["weights"], copy["weights"], atol=1e-12)


def test_recipe_of_a_limb_that_turns() -> None:
    arm = [recipes.Limb("arm", None, ((0, 0, 0, 0.1), (1, 0, 0, 0.1)))]
    vertices, faces = recipes.mesh_zero_set(recipes.body_distance(arm, 0.02), (-0.2, -0.2, -0.2), (1.2, 0.2, 0.2), 0.05)
    turned = recipes.pose_body(vertices, faces, arm, {"arm": [(0, 0, np.pi / 2)]})
    np.testing.assert_allclose(turned, np.column_stack([-vertices[:, 1], vertices[:, 0], vertices[:, 2]]), atol=1e-3)
    with pytest.raises(ValueError, match="it reaches the sides of the box"):
        recipes.mesh_zero_set(recipes.body_distance(arm, 0.02), (0.2, -0.2, -0.2), (1.2, 0.2, 0.2), 0.05)
    with pytest.raises(ValueError, match="no point of the grid lies inside it"):
        recipes.mesh_zero_set(recipes.body_distance(arm, 0.02), (5.0, 5.0, 5.0), (6.0, 6.0, 6.0), 0.2)


def test_unknown_poses_are_named() -> None:
    with pytest.raises(ValueError, match=r"pose must be one of 'rest', 'walk', 'look'; got 'fly'"):
        goat("fly")
    with pytest.raises(ValueError, match=r"pose must be one of 'rest', 'arms_down', 'walk', 'wave'; got 'sit'"):
        doll("sit")
    with pytest.raises(ValueError, match=r"connectivity must be one of 'same', 'remeshed'; got 'other'"):
        doll("walk", connectivity="other")
