"""The whole matcher on cases with a known answer: renumbered, moved, remeshed, inside out, symmetric, open, faulty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from spectral_notes import shapes
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, nearest_rows
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching import ShapeMatch, geodesic_errors, match_shapes
from spectral_notes.meshes import TriangleMesh


@dataclass(frozen=True)
class Pair:
    """Two shapes, and the true vertex of 1 for each vertex of 2."""

    one: TriangleMesh
    two: TriangleMesh
    true_21: np.ndarray

    def error(self, match: ShapeMatch) -> float:
        gaps = self.one.vertices[match.p2p_21] - self.one.vertices[self.true_21]
        return float(np.linalg.norm(gaps, axis=1).mean() / np.sqrt(self.one.area))


def basis_of(mesh: TriangleMesh, k: int) -> Eigenbasis:
    return compute_eigenbasis(*cotan_laplacian(mesh), k)


def rotation(seed: int) -> np.ndarray:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return np.asarray(turn * np.sign(np.linalg.det(turn)))


def renumbered(mesh: TriangleMesh, seed: int = 0) -> Pair:
    p2p_21 = np.random.default_rng(seed).permutation(mesh.n_vertices)
    return Pair(mesh, TriangleMesh(mesh.vertices[p2p_21], np.argsort(p2p_21)[mesh.faces]), p2p_21)


def inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def turned(shape: Callable[[np.ndarray], np.ndarray], subdivisions: int = 3, seed: int = 3) -> Pair:
    """A shape given by where it sends the unit sphere, and the same surface with the sphere's triangles turned."""
    ball, R = shapes.sphere(subdivisions), rotation(seed)
    directions = ball.vertices @ R.T
    return Pair(TriangleMesh(shape(ball.vertices), ball.faces), TriangleMesh(shape(directions), ball.faces),
                nearest_rows(ball.vertices, directions))


def bumpy(directions: np.ndarray) -> np.ndarray:
    """A body whose only symmetry is the mirror of y."""
    x, y, z = directions.T
    horns = 0.5 * np.exp(-12 * ((x - 0.5) ** 2 + (abs(y) - 0.8) ** 2 + (z + 0.2) ** 2))
    nose = 0.25 * np.exp(-8 * ((x - 0.3) ** 2 + (z - 0.9) ** 2 + y**2))
    return np.asarray(directions * (1 + 0.35 * x + nose + horns + 0.2 * z * x + 0.3 * z**3)[:, None])


def lopsided(directions: np.ndarray) -> np.ndarray:
    """The same with a bump on one side, so that no symmetry is left."""
    x, y, z = directions.T
    bump = 0.35 * np.exp(-10 * ((x + 0.6) ** 2 + (y - 0.7) ** 2 + (z - 0.3) ** 2))
    return np.asarray(bumpy(directions) * (1 + bump)[:, None])


@pytest.fixture(scope="module")
def potatoes() -> Pair:
    """Two potatoes, the second of other triangles, twice as large and turned in space."""
    fine = shapes.potato(subdivisions=4)
    coarse, P = shapes.coarse_copy(fine, 1202)
    moved = TriangleMesh(2.0 * coarse.vertices @ rotation(5).T, coarse.faces)
    return Pair(fine, moved, np.asarray(P.argmax(axis=1)).ravel())


def test_a_moved_scaled_and_remeshed_shape_is_found(potatoes: Pair) -> None:
    landmarks = np.column_stack([potatoes.true_21[[0, 400, 800]], [0, 400, 800]])
    match = match_shapes(potatoes.one, potatoes.two, landmarks, k=100, n_samples=500)
    assert match.is_sure and match.orientation > 0.98 and match.doubt < 0.2
    assert potatoes.error(match) < 0.01


def test_without_landmarks_a_nearly_symmetric_shape_is_right_or_doubted(potatoes: Pair) -> None:
    match = match_shapes(potatoes.one, potatoes.two, k=60, n_samples=500)  # nearly an ellipsoid: three half turns
    assert potatoes.error(match) < 0.03 or not match.is_sure


def test_a_person_in_two_poses_is_mapped_without_landmarks_and_no_limb_is_exchanged() -> None:
    poses = ("tall", "walk"), ("tall", "reach")  # whose mirror image fits the signatures better
    one, (two, P) = shapes.coarse_copy(shapes.person(*poses[0]), 1200)[0], shapes.coarse_copy(shapes.person(*poses[1]), 1000)
    places = P @ (shapes.person_correspondence(*poses[1], *poses[0]) @ shapes.person(*poses[0]).vertices)
    pair = Pair(one, two, nearest_rows(one.vertices, places))
    match = match_shapes(one, two, k=60)
    off = np.linalg.norm(one.vertices[match.p2p_21] - one.vertices[pair.true_21], axis=1) / np.sqrt(one.area)
    assert pair.error(match) < 0.03 and (off > 0.2).mean() < 0.01


def test_the_map_does_not_depend_on_numbering() -> None:
    pair = renumbered(shapes.coarse_copy(shapes.goat(), 800)[0])
    match = match_shapes(pair.one, pair.two, k=60)
    np.testing.assert_array_equal(match.p2p_21, pair.true_21)
    assert match.is_sure and match.doubt < 0.2
    known = match_shapes(pair.one, pair.two, k=60, bases=(basis_of(pair.one, 60), basis_of(pair.two, 80)))
    np.testing.assert_array_equal(known.p2p_21, match.p2p_21)


@pytest.mark.parametrize("turn_over", [(False, True), (True, False), (True, True)])
@pytest.mark.parametrize("n_landmarks", [0, 3])
def test_a_body_that_is_inside_out_is_turned_first(turn_over: tuple[bool, bool], n_landmarks: int) -> None:
    pair = turned(bumpy)
    one, two = (inside_out(mesh) if over else mesh for mesh, over in zip((pair.one, pair.two), turn_over, strict=True))
    landmarks = [[pair.true_21[i], i] for i in (0, 100, 300)[:n_landmarks]]
    match = match_shapes(one, two, landmarks, k=60)
    assert pair.error(match) < 0.02 and match.orientation > 0.97 and match.is_sure


@pytest.mark.parametrize("n_landmarks", [0, 5])
def test_a_mirror_image_is_doubted(n_landmarks: int) -> None:
    pair = turned(lopsided)
    landmarks = [[pair.true_21[i], i] for i in (0, 100, 200, 300, 400)[:n_landmarks]]
    image = TriangleMesh(pair.two.vertices * [1, -1, 1], pair.two.faces[:, ::-1])
    match = match_shapes(pair.one, image, landmarks, k=60)
    assert not match.is_sure and match.reason
    right = match_shapes(pair.one, pair.two, landmarks, k=60)
    assert right.is_sure and pair.error(right) < 0.02


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("axes", [(1.0, 1.3, 1.7), (1.0, 1.5, 2.0)])
def test_half_turns_of_an_ellipsoid_are_doubted(seed: int, axes: tuple[float, float, float]) -> None:
    pair = turned(lambda directions: directions * axes, seed=seed)
    match = match_shapes(pair.one, pair.two, k=60)
    assert match.doubt > 0.5 and "symmetry" in match.reason


@pytest.mark.parametrize("name", ["egg", "torus"])
def test_a_shape_that_turns_into_itself_is_doubted(name: str) -> None:
    one = {"egg": shapes.egg(3), "torus": shapes.torus(40, 20)}[name]
    two = {"egg": shapes.coarse_copy(shapes.egg(4), 500)[0], "torus": shapes.torus(36, 22)}[name]
    assert not match_shapes(one, two, k=60).is_sure


def test_shapes_that_differ_are_doubted() -> None:
    match = match_shapes(shapes.potato(subdivisions=3), shapes.torus(32, 16), k=60)
    assert not match.is_sure


def test_a_common_upward_direction_settles_which_end_is_up() -> None:
    pair = turned(lambda directions: directions * (1.0, 1.3, 1.7))
    match = match_shapes(pair.one, pair.two, k=60, up=[0, 0, 2])
    heights = pair.one.vertices[match.p2p_21, 2], pair.two.vertices[:, 2]
    assert np.corrcoef(*heights)[0, 1] > 0.99
    assert not match.is_sure  # the half turn about the axis is left


def test_open_shapes_match() -> None:
    flat = shapes.rectangle(1.5, 1.0, 31, 21)
    x, y = flat.vertices[:, :2].T
    hills = TriangleMesh(
        np.column_stack([x, y, 0.3 * np.exp(-8 * ((x - 0.4) ** 2 + (y - 0.3) ** 2))]), flat.faces)
    pair = renumbered(hills)
    match = match_shapes(hills, pair.two, [[pair.true_21[i], i] for i in (0, 200, 500)], k=60)
    assert match.is_sure
    np.testing.assert_array_equal(match.p2p_21, pair.true_21)


def test_fast_carries_the_map_of_copies_over() -> None:
    fine = shapes.goat()
    copy, P = shapes.coarse_copy(fine, 2000)
    pair = Pair(fine, copy, np.asarray(P.argmax(axis=1)).ravel())
    match = match_shapes(fine, copy, k=60, fast=True)
    assert match.is_sure and pair.error(match) < 0.02 and match.basis_1.n == fine.n_vertices
    np.testing.assert_allclose(match.C_12, functional_map(match.basis_1, match.basis_2, match.p2p_21))


def test_disconnected_shapes_keep_their_matrices_but_are_not_matched() -> None:
    mesh = shapes.potato(subdivisions=2)
    two = TriangleMesh(np.r_[mesh.vertices, mesh.vertices + 9.0], np.r_[mesh.faces, mesh.faces + mesh.n_vertices])
    basis = basis_of(two, 10)
    np.testing.assert_allclose(functional_map(basis, basis, np.arange(two.n_vertices)), np.eye(10), atol=1e-8)
    assert geodesic_errors(two, [mesh.n_vertices], [0]).tolist() == [np.inf]
    with pytest.raises(ValueError, match="mesh_2 must be connected; it has 2 components. Match them one by one"):
        match_shapes(mesh, two)


SMALL = shapes.sphere(2)  # 162 vertices
BASIS = basis_of(SMALL, 8)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: match_shapes(SMALL, SMALL, [[0, 162]]), ValueError, "landmarks must lie in 0 .. 161"),
        (lambda: match_shapes(SMALL, shapes.sphere(1), [[0, 100]], k=10), ValueError, "landmarks of shape 2 must lie in 0 .. 41; found 100"),
        (lambda: match_shapes(SMALL, SMALL, k=200), ValueError, "k must be between 8 and 162; got 200"),
        (lambda: match_shapes(SMALL, SMALL, n_samples=79, k=10), ValueError, "n_samples must be at least 80; got 79"),
        (lambda: match_shapes(SMALL, SMALL, up=[0, 0, 0], k=10), ValueError, "up must not be the zero vector"),
        (lambda: match_shapes(SMALL, SMALL, up=[0, 1], k=10), ValueError, r"up must have shape \(3,\)"),
        (lambda: match_shapes(SMALL, SMALL, k=10, bases=(BASIS, BASIS)), ValueError, "bases must hold 10 modes of 162 vertices for shape 1; got 8 of 162"),
    ],
)
def test_errors_name_the_argument(call: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()
