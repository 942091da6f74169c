"""The persons: sound meshes of about 5,000 vertices, no two alike, with the same parts and a true correspondence."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from persons import crossing_faces, limb_gap
from storing import pack

from spectral_notes.meshes import TriangleMesh, connected_components, corner_angles, euler_characteristic, is_closed
from spectral_notes.shapes import (
    PERSON_POSES,
    PERSON_SEGMENTS,
    PERSONS,
    person,
    person_correspondence,
    person_segments,
    sphere,
)
from spectral_notes.shapes.stored import unpack

ROOT = Path(__file__).resolve().parents[2]
ALL = list(itertools.product(PERSONS, PERSON_POSES))


@pytest.mark.parametrize(("name", "pose"), ALL)
def test_a_person_is_one_closed_piece_of_good_triangles(name: str, pose: str) -> None:
    mesh, segments = person(name, pose), person_segments(name, pose)
    assert mesh.name == f"person_{name}_{pose}"
    assert 4_400 < mesh.n_vertices < 5_400
    assert is_closed(mesh) and connected_components(mesh).max() == 0 and euler_characteristic(mesh) == 2
    angles = np.degrees(corner_angles(mesh).min(axis=1))
    assert angles.min() > 10
    assert np.percentile(angles, 1) > 28
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0  # normals point out
    assert limb_gap(mesh, segments) > 0.05
    assert set(segments) == set(range(len(PERSON_SEGMENTS)))
    middle = {part: mesh.vertices[segments == i].mean(axis=0) for i, part in enumerate(PERSON_SEGMENTS)}
    assert middle["head"][1] > middle["trunk"][1] > max(middle["left foot"][1], middle["right foot"][1])
    assert middle["left hand"][0] > 0.2 > -0.2 > middle["right hand"][0]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "pose"), ALL)
def test_no_face_of_a_person_cuts_another(name: str, pose: str) -> None:
    assert crossing_faces(person(name, pose)) == 0


def test_crossing_faces_are_found() -> None:
    ball = sphere(2)
    two = TriangleMesh(
        np.vstack([ball.vertices, ball.vertices + np.array([0.5, 0.1, 0.2])]),
        np.vstack([ball.faces, ball.faces + ball.n_vertices]),
    )
    assert crossing_faces(ball) == 0
    assert crossing_faces(two) > 10


@pytest.mark.parametrize("other", [("average", "walk"), ("slim", "stand"), ("round", "reach")])
def test_triangulations_do_not_agree(other: tuple[str, str]) -> None:
    P = person_correspondence("average", "stand", *other)
    on_a_vertex = P.max(axis=1).toarray().ravel() > 0.99
    assert on_a_vertex.mean() < 0.02


@pytest.mark.parametrize(
    "pair",
    [
        (("average", "stand"), ("round", "reach")),
        (("tall", "walk"), ("short", "reach")),
        (("strong", "reach"), ("old", "walk")),
    ],
)
def test_correspondence_goes_to_the_same_place_of_the_body(pair) -> None:
    one, two = pair
    P, back = person_correspondence(*one, *two), person_correspondence(*two, *one)
    mesh_1, mesh_2 = person(*one), person(*two)
    assert P.shape == (mesh_1.n_vertices, mesh_2.n_vertices)
    assert np.diff(P.indptr).max() <= 3 and P.data.min() > 0
    np.testing.assert_allclose(P.sum(axis=1), 1.0, atol=1e-14)
    there_and_back = np.linalg.norm(P @ (back @ mesh_1.vertices) - mesh_1.vertices, axis=1)
    assert np.median(there_and_back) < 0.003 and np.percentile(there_and_back, 99) < 0.015
    same = person_segments(*one) == person_segments(*two)[P.argmax(axis=1)]
    assert same.mean() > 0.97


def test_poses_of_one_person_are_nearly_isometric_and_builds_are_not() -> None:
    areas = {(name, pose): person(name, pose).area for name, pose in ALL}
    for name in PERSONS:
        assert max(areas[name, pose] for pose in PERSON_POSES) < 1.03 * min(areas[name, pose] for pose in PERSON_POSES)
    assert areas["tall", "stand"] > 1.3 * areas["short", "stand"]


def test_the_split_names_each_person_once() -> None:
    split = json.loads((ROOT / "benchmarks" / "tuned_and_reported.json").read_text())["persons"]
    assert sorted(split["tuned_on"] + split["reported_on"]) == sorted(PERSONS)
    assert len(split["tuned_on"]) == 4


def test_what_was_packed_unpacks() -> None:
    rows = np.random.default_rng(0).integers(-(2**20), 2**20, (50, 3))
    np.testing.assert_array_equal(unpack(pack(rows)), rows)
    np.testing.assert_array_equal(unpack(pack(rows * 0.25, 0.25), 0.25), rows * 0.25)
    bits = np.random.default_rng(1).normal(size=(50, 3))
    assert unpack(pack(bits, 0.0), 0.0).tobytes() == bits.tobytes()


def test_the_licence_lies_beside_the_persons() -> None:
    folder = ROOT / "spectral_notes" / "shapes" / "data"
    assert "CC0" in (folder / "README.md").read_text() and "MakeHuman" in (ROOT / "LICENSE").read_text()
    weights = [path.stat().st_size for path in folder.glob("person_*.npz")]
    assert len(weights) == 24 and max(weights) < 75_000
