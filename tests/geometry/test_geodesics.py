"""Geodesics and transport: closed forms on the plane and the sphere, and every promised error."""

from __future__ import annotations

import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.files import read_mesh
from spectral_notes.geometry.curvature import angle_defects
from spectral_notes.geometry.geodesics import faces_under_arcs, geodesic_distances, parallel_transport, path_lengths
from spectral_notes.meshes import TriangleMesh, face_normals
from spectral_notes.shapes import sphere

DATA = Path(__file__).parents[1] / "data"


def test_distances_on_a_flat_square_are_straight(unit_square):
    np.testing.assert_allclose(geodesic_distances(unit_square, [1]), [1, 0, 1, np.sqrt(2)])
    np.testing.assert_allclose(geodesic_distances(unit_square, [1, 3]), [1, 0, 1, 0])


def test_paths_keep_to_edges_and_end_at_their_reach():
    strip = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 3], [1, 4, 3], [1, 2, 4]])
    np.testing.assert_allclose(path_lengths(strip, np.array([0, 2])), [[0, 1, 2, 1, 2], [2, 1, 0, 1 + np.sqrt(2), np.sqrt(2)]])
    np.testing.assert_allclose(path_lengths(strip, np.array([0, 2]), reach=1.2, from_nearest=True), [0, 1, 0, 1, np.inf])


def test_distances_on_the_sphere_approach_great_circles_at_order_two():
    def error(level):
        ball = sphere(level)
        angle = np.arccos(np.clip(ball.vertices @ ball.vertices[0], -1, 1))
        return np.abs(geodesic_distances(ball, [0]) - angle).max()

    assert np.log2(error(2) / error(3)) > 1.7


@pytest.mark.parametrize("short", [0.0, 1e-13, 1e-8, 1e-6, 1e-5, 1e-3])
def test_short_edges_end_and_keep_the_distances(short):
    corners = [[0, 0, 0], [1, 0, 0], [1, short, 0], [0, 1, 0], [1, 1, 0]]
    strip = TriangleMesh(corners, [[0, 1, 3], [1, 2, 3], [2, 4, 3]])
    for source in range(5):
        straight = np.linalg.norm(strip.vertices - strip.vertices[source], axis=1)
        np.testing.assert_allclose(geodesic_distances(strip, [source]), straight, atol=3e-6)


@settings(max_examples=30)
@given(st.integers(0, 2**31), st.floats(-14, -4))
def test_vertices_moved_onto_neighbours_change_little(seed, exponent):
    rng, ball = np.random.default_rng(seed), sphere(2)
    vertices = ball.vertices.copy()
    moved, onto = ball.faces[rng.integers(ball.n_faces, size=3), :2].T
    vertices[moved] = vertices[onto] + 10.0**exponent * rng.standard_normal((3, 3))
    d = geodesic_distances(TriangleMesh(vertices, ball.faces), [0])
    assert np.isfinite(d).all() and d.max() == pytest.approx(np.pi, rel=0.2)


def test_a_sphere_of_marching_cubes_with_edges_of_a_billionth_has_the_distances_of_a_sphere():
    ball = read_mesh(DATA / "marching_cubes_sphere.ply")
    rays = ball.vertices / np.linalg.norm(ball.vertices, axis=1)[:, None]
    angle = np.arccos(np.clip(rays @ rays[0], -1, 1))
    np.testing.assert_allclose(geodesic_distances(ball, [0]), angle, atol=0.03)


def test_long_chains_of_short_edges_are_refused_before_the_work():
    x = np.r_[1.0, 1e-7 * np.arange(300)]
    ladder = TriangleMesh(np.c_[x, x == 1, 0 * x], [[0, i, i + 1] for i in range(1, 300)])
    with pytest.raises(ValueError, match=r"no chain of edges shorter than 1e-06 .* \d+ vertices.*heat_distances"):
        geodesic_distances(ladder, [0])
    ends = [[0, d, z] for z in (0, 1) for d in (0, 1e-7, 2e-7)]
    pages = TriangleMesh(
        [*ends, [1, 0, 0], [0, 1, 0], [-1, 0, 0]],
        [[0, 3, 6], [1, 4, 7], [2, 5, 8], [0, 1, 6], [1, 2, 7], [3, 4, 6], [4, 5, 7]],
    )
    with pytest.raises(ValueError, match="1 edges have more, when those below 1e-06 of the size are points"):
        geodesic_distances(pages, [0])


def welded(n_balls):
    """Spheres in a row along z, each welded at its north pole to the south pole of the next."""
    ball = sphere(3)
    north, south = ball.vertices[:, 2].argmax(), ball.vertices[:, 2].argmin()
    n = ball.n_vertices
    vertices = np.concatenate([ball.vertices + np.array([0, 0, 2.0 * k]) for k in range(n_balls)])
    faces = np.concatenate([ball.faces + k * n for k in range(n_balls)])
    for k in range(1, n_balls):
        faces[faces == k * n + south] = (k - 1) * n + north
    return TriangleMesh(vertices, faces), n, south


def test_past_a_vertex_where_two_fans_meet_distances_go_on():
    bow = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], [[0, 1, 2], [0, 3, 4]])
    np.testing.assert_allclose(geodesic_distances(bow, [1]), [1, 0, 1, 2, 1 + np.sqrt(2)])
    np.testing.assert_allclose(geodesic_distances(bow, [0]), [0, 1, np.sqrt(2), 1, np.sqrt(2)])
    np.testing.assert_allclose(geodesic_distances(bow, [1, 3]), [1, 0, 1, 0, 1])
    mesh, n, south = welded(3)
    d = geodesic_distances(mesh, [south])
    used = np.unique(mesh.faces)
    for k in range(3):
        own = used[(used >= k * n) & (used < (k + 1) * n)]
        height = np.clip(mesh.vertices[own, 2] - 2 * k, -1, 1)
        np.testing.assert_allclose(d[own], k * np.pi + np.arccos(-height), atol=0.02 * (k + 1))
    np.testing.assert_allclose(geodesic_distances(mesh, used[d[used] > 9.3])[south], 3 * np.pi, atol=0.15)


def test_a_vertex_where_a_surface_meets_itself_is_a_short_cut():
    turn = np.pi * np.arange(7) / 3  # one row of a strip runs round a hexagon and comes back, the other rises
    rows = [np.c_[np.cos(turn), np.sin(turn), y * (1 + turn)] for y in range(2)]
    faces = [face for i in range(6) for face in ([i, i + 1, i + 7], [i + 1, i + 8, i + 7])]
    apart = TriangleMesh(np.concatenate(rows), faces)
    joined = TriangleMesh(apart.vertices, np.where(apart.faces == 6, 0, apart.faces))
    assert geodesic_distances(apart, [1])[5] == pytest.approx(4.0)
    assert geodesic_distances(joined, [1])[5] == pytest.approx(2.0)


def test_large_work_is_done_in_a_process_that_an_interrupt_ends(monkeypatch):
    ball = sphere(3)
    near = geodesic_distances(ball, [0])
    monkeypatch.setattr("spectral_notes.geometry.geodesics.LARGE", 1)
    np.testing.assert_array_equal(geodesic_distances(ball, [0]), near)
    monkeypatch.setattr("spectral_notes.geometry.geodesics.sys.executable", shutil.which("false"))
    with pytest.raises(RuntimeError, match="the process for geodesic distances ended with 1"):
        geodesic_distances(ball, [0])


def fan(n):
    """A flat closed ring of n equal faces round vertex 0."""
    turn = 2 * np.pi * np.arange(n) / n
    rim = np.c_[np.cos(turn), np.sin(turn), np.zeros(n)]
    return TriangleMesh(np.r_[[[0, 0, 0]], rim], [[0, 1 + i, 1 + (i + 1) % n] for i in range(n)])


@pytest.mark.parametrize("lift", [0.0, 0.5, 2.0])
def test_round_a_vertex_the_arrow_turns_by_the_angle_defect(lift):
    flat = fan(6)
    cone = TriangleMesh(flat.vertices + lift * np.eye(7)[:, [0]] * [0, 0, 1], flat.faces)
    start = cone.vertices[1] - cone.vertices[0]
    arrows = parallel_transport(cone, [0, 1, 2, 3, 4, 5, 0], start)
    lengths = np.linalg.norm(arrows, axis=1)
    np.testing.assert_allclose(lengths, lengths[0])
    normal = face_normals(cone)[0]
    turned = np.arctan2(np.cross(arrows[0], arrows[-1]) @ normal, arrows[0] @ arrows[-1])
    miss = (turned - angle_defects(cone)[0] + np.pi) % (2 * np.pi) - np.pi
    assert miss == pytest.approx(0.0, abs=1e-9)  # counter-clockwise round the tip, counter-clockwise the turn


def test_there_and_back_is_the_same_arrow():
    ball = sphere(1)
    here = 0
    there = next(f for f in range(1, ball.n_faces) if len(np.intersect1d(ball.faces[0], ball.faces[f])) == 2)
    arrows = parallel_transport(ball, [here, there, here], [0.3, -0.2, 0.9])
    np.testing.assert_allclose(arrows[2], arrows[0], atol=1e-14)
    assert abs(arrows[1] @ face_normals(ball)[there]) < 1e-14


def open_ball():
    """A sphere without the faces half way from the first corner of the triangle to the second."""
    ball = sphere(3)
    way = faces_under_arcs(ball, TRIANGLE[:2])
    return TriangleMesh(ball.vertices, np.delete(ball.faces, way[len(way) // 2], axis=0))


TRIANGLE = np.array([[0.9, 0.1, 0.2], [-0.1, 0.8, 0.3], [0.1, -0.2, 0.7]])  # generic, counter-clockwise


def test_faces_under_arcs_are_neighbours_and_lie_under_the_arcs():
    ball = sphere(3)
    path = faces_under_arcs(ball, TRIANGLE[[0, 1, 2, 0]])
    assert path[0] == path[-1]
    for here, there in pairwise(path):
        assert len(np.intersect1d(ball.faces[here], ball.faces[there])) == 2
    way = np.concatenate([np.linspace(a, b, 400) for a, b in zip(TRIANGLE, np.roll(TRIANGLE, -1, 0), strict=True)])
    sides = np.cross(ball.vertices[ball.faces], ball.vertices[np.roll(ball.faces, -1, axis=1)])
    assert set(np.argmax((sides @ way.T).min(axis=1), axis=0)) == set(path)  # dense samples fall on these faces


def test_the_arrow_turns_by_the_defects_inside_the_triangle():
    ball = sphere(3)
    path = faces_under_arcs(ball, TRIANGLE[[0, 1, 2, 0]])
    arrows = parallel_transport(ball, path, [0.2, 0.3, 0.9])
    turned = np.arctan2(np.cross(arrows[0], arrows[-1]) @ face_normals(ball)[path[0]], arrows[0] @ arrows[-1])
    inside = (ball.vertices @ np.cross(TRIANGLE, np.roll(TRIANGLE, -1, axis=0)).T >= 0).all(axis=1)
    assert turned == pytest.approx(angle_defects(ball)[inside].sum(), abs=1e-12)


def test_arcs_may_follow_a_circle_the_other_way():
    ball = sphere(2)
    there = faces_under_arcs(ball, TRIANGLE[:2])
    np.testing.assert_array_equal(faces_under_arcs(ball, TRIANGLE[1::-1]), there[::-1])
    assert faces_under_arcs(ball, [TRIANGLE[0], 1.001 * TRIANGLE[0] + 1e-9 * TRIANGLE[1]]).tolist() == [there[0]]


def test_refusals(unit_square):
    ball = sphere(1)
    far = next(f for f in range(1, ball.n_faces) if len(np.intersect1d(ball.faces[0], ball.faces[f])) == 0)
    cases = [
        (lambda: geodesic_distances(unit_square, []), "sources must name at least one vertex"),
        (lambda: geodesic_distances(unit_square, [4]), "sources must lie in 0 .. 3; found 4"),
        (lambda: parallel_transport(ball, [], [1, 0, 0]), "path must name at least one face"),
        (lambda: parallel_transport(ball, [0, far], [1, 0, 0]), f"0 and {far} share no single edge"),
        (lambda: faces_under_arcs(ball, TRIANGLE[:1]), "corners must hold at least two points; got 1"),
        (lambda: faces_under_arcs(ball, [TRIANGLE[0], -TRIANGLE[0]]), "0 and 1 lie on a line with the origin"),
        (lambda: faces_under_arcs(ball, [ball.vertices[0], TRIANGLE[0]]), "corners must lie over the inside of faces"),
        (lambda: faces_under_arcs(open_ball(), TRIANGLE[:2]), "no way leads from corner 0 to 1"),
        (lambda: parallel_transport(ball, [0], [1, 0]), r"arrow must have shape \(3,\)"),
    ]
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()
