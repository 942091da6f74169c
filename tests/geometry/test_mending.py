"""Mending: cracks are sewn, floaters dropped, faces agree and point outward; and health sees each fault in space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.geometry import cut_mesh, health, keep_pieces, orient_faces, weld_vertices
from spectral_notes.geometry.crossings import crossing_faces
from spectral_notes.geometry.mending import outward, wrong_side_out
from spectral_notes.meshes import TriangleMesh, clean_mesh, face_normals, signed_volume
from spectral_notes.shapes import coarse_copy, goat, rectangle, sphere, torus

BALL = sphere(2)


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    """Meshes side by side in one."""
    shift = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, shift, strict=False)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def moved(mesh: TriangleMesh, shift, scale: float = 1.0) -> TriangleMesh:
    """A copy, scaled and moved."""
    return TriangleMesh(scale * mesh.vertices + np.asarray(shift), mesh.faces)


def cracked(mesh: TriangleMesh, width: float) -> TriangleMesh:
    """Every triangle with corners of its own, shaken by up to half a width."""
    vertices = mesh.vertices[mesh.faces].reshape(-1, 3)
    shake = np.random.default_rng(0).uniform(-1, 1, vertices.shape) * width / (2 * np.sqrt(3))
    return TriangleMesh(vertices + shake, np.arange(len(vertices)).reshape(-1, 3))


def turned(mesh: TriangleMesh, which) -> TriangleMesh:
    """Some faces turned around."""
    faces = mesh.faces.copy()
    faces[which] = faces[which][:, ::-1]
    return TriangleMesh(mesh.vertices, faces)


@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-7, 0.0), (1e-3, 1e7), (1e6, -1e9)])
def test_a_cracked_scan_is_seen_and_sewn_by_the_width_that_health_names(scale, shift):
    scan = cracked(moved(BALL, shift, scale), 1e-5 * scale)
    report = health(scan)
    assert report.faults["near_duplicate_vertices"] == scan.n_vertices
    assert 0 < report.crack <= 1.01e-5 * scale
    assert "up to" in str(report) and "weld_vertices(mesh, tolerance) sews it up" in str(report)
    sewn = weld_vertices(scan, report.crack)
    assert (sewn.n_vertices, health(sewn).components, health(sewn).is_closed) == (BALL.n_vertices, 1, True)


def test_a_weld_of_zero_is_a_cleaning_and_one_too_wide_is_refused():
    soup = cracked(BALL, 0.0)
    np.testing.assert_array_equal(weld_vertices(soup, 0.0).faces, clean_mesh(soup.vertices, soup.faces).faces)
    with pytest.raises(ValueError, match="tolerance must be well below the size of the mesh, 3.46; got 1"):
        weld_vertices(BALL, 1.0)
    with pytest.raises(ValueError, match="tolerance must be at least 0"):
        weld_vertices(BALL, -1.0)


def test_floaters_go_and_the_largest_piece_stays():
    dust = [moved(BALL, [3 + i, 0, 0], 0.1) for i in range(3)]
    scene = joined(dust[0], moved(BALL, [9, 0, 0], 0.9), BALL, *dust[1:])
    assert keep_pieces(scene, largest_only=True).n_faces == BALL.n_faces
    assert signed_volume(keep_pieces(scene, largest_only=True)) == pytest.approx(signed_volume(BALL))
    assert health(keep_pieces(scene, smallest=0.5)).components == 2
    assert health(keep_pieces(scene)).components == 5
    with pytest.raises(ValueError, match="smallest must be a share of the largest piece, at most 1; got 2"):
        keep_pieces(scene, smallest=2.0)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-6, 1.0, 1e6]), st.sampled_from([0.0, 1e6]))
def test_faces_agree_and_point_outward_whatever_was_turned(seed, scale, shift):
    rng = np.random.default_rng(seed)
    mesh = moved(torus(12, 9), shift * scale, scale)
    mixed = turned(mesh, rng.random(mesh.n_faces) < rng.random())
    mended = orient_faces(mixed)
    assert (np.sort(mended.faces, axis=1) == np.sort(mesh.faces, axis=1)).all()
    np.testing.assert_allclose(face_normals(mended), face_normals(mesh), atol=1e-6)


def test_an_open_piece_keeps_the_side_that_most_of_its_faces_had(unit_square, mobius):
    fine = TriangleMesh(BALL.vertices, BALL.faces[BALL.vertices[BALL.faces].mean(axis=1)[:, 2] > 0])
    assert (orient_faces(turned(fine, [0, 5, 7])).faces[:, 0].size, health(orient_faces(turned(fine, [0, 5, 7]))).faults["misoriented_edges"]) == (fine.n_faces, 0)
    np.testing.assert_allclose(face_normals(orient_faces(turned(fine, [0, 5, 7]))), face_normals(fine))
    assert health(orient_faces(mobius)).faults["misoriented_edges"] > 0


def test_the_wall_of_a_hollow_points_into_the_hollow():
    hollow = joined(BALL, turned(moved(BALL, 0.0, 0.5), slice(None)))
    assert not wrong_side_out(hollow).any()
    both_out = joined(BALL, moved(BALL, 0.0, 0.5))
    assert wrong_side_out(both_out).sum() == BALL.n_faces
    assert signed_volume(orient_faces(both_out)) == pytest.approx(signed_volume(BALL) * (1 - 1 / 8))
    nested = joined(*(moved(BALL, 0.0, 0.5**k) for k in range(4)))
    assert signed_volume(orient_faces(nested)) == pytest.approx(signed_volume(BALL) * (1 - 1 / 8 + 1 / 64 - 1 / 512))


def test_an_inside_out_mesh_is_named():
    report = health(turned(BALL, slice(None)))
    assert report.faults["inside_out_faces"] == BALL.n_faces
    assert report.volume == pytest.approx(-signed_volume(BALL))
    assert health(BALL).volume == pytest.approx(signed_volume(BALL))
    apart = joined(BALL, turned(moved(BALL, [5, 0, 0]), slice(None)))
    assert health(apart).faults["inside_out_faces"] == BALL.n_faces


@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-7, 0.0), (1e-3, 1e7)])
def test_bodies_that_pass_through_each_other_are_seen(scale, shift):
    apart, through = ([moved(moved(BALL, [x, 0.1, 0.2]), shift, 1.0) for x in (0.0, gap)] for gap in (2.5, 1.0))
    for pair, crosses in ((apart, False), (through, True)):
        mesh = joined(*pair)
        mesh = TriangleMesh(scale * (mesh.vertices - shift) + shift, mesh.faces)
        assert (len(crossing_faces(mesh)) > 0) == crosses


def test_faces_that_only_touch_do_not_cross(unit_square):
    assert len(crossing_faces(unit_square)) == 0
    assert len(crossing_faces(cracked(BALL, 0.0))) == 0  # each touches its neighbours along whole edges
    stacked = joined(unit_square, moved(unit_square, [0, 0, 1e-3]))
    assert len(crossing_faces(stacked)) == 0
    spear = TriangleMesh([[0.6, 0.3, -1], [0.6, 0.3, 1], [5, 0, 0]], [[0, 1, 2]])
    assert crossing_faces(joined(unit_square, spear)).tolist() == [0, 2]


def test_a_few_large_faces_beside_many_small_ones():
    floor = TriangleMesh([[-99, -99, 0.01], [99, -99, 0.01], [0, 99, 0.01]], [[0, 1, 2]])
    found = crossing_faces(joined(sphere(3), floor))
    heights = sphere(3).vertices[sphere(3).faces][:, :, 2] - 0.01
    assert len(found) == ((heights.min(axis=1) < 0) & (heights.max(axis=1) > 0)).sum() + 1


def test_a_corner_on_the_middle_of_an_edge():
    vertices = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [1, 0, 0], [0, -1, 0], [2, -1, 0]]
    hanging = TriangleMesh(vertices, [[0, 1, 2], [0, 4, 3], [3, 4, 5], [3, 5, 1]])
    assert health(hanging).faults["t_junctions"] == 1
    whole = TriangleMesh(vertices, [[0, 3, 2], [3, 1, 2], [0, 4, 3], [3, 4, 5], [3, 5, 1]])
    assert health(whole).faults["t_junctions"] == 0
    assert health(moved(hanging, 1e6, 1e-2)).faults["t_junctions"] == 1


def test_bent_polygons_are_counted_by_whoever_read_them(unit_square):
    report = health(unit_square, nonplanar_polygons=3)
    assert report.faults["nonplanar_polygons"] == 3
    assert "nonplanar polygons: 3\n    A polygon of the file is bent" in str(report)


def turned_over(mesh: TriangleMesh) -> TriangleMesh:
    """All faces turned around."""
    return turned(mesh, slice(None))


def _apart(mesh: TriangleMesh, around: np.ndarray) -> list[int]:
    """Two of the faces around a vertex that share nothing else."""
    first = around[0]
    return [first, next(face for face in around if len(np.intersect1d(mesh.faces[first], mesh.faces[face])) == 1)]


def test_outward_turns_bodies_even_with_a_hole_and_leaves_fields_alone() -> None:
    animal = coarse_copy(goat(), 800)[0]
    cut = TriangleMesh(animal.vertices, animal.faces[animal.vertices[animal.faces, 1].mean(axis=1) > 0.1])  # without hooves
    for body in (animal, cut):
        assert outward(body) is body
        np.testing.assert_array_equal(outward(turned_over(body)).faces, body.faces)
    ball = sphere(3)  # two holes that meet in one vertex
    around = np.flatnonzero((ball.faces == 0).any(axis=1))
    pinched = TriangleMesh(ball.vertices, np.delete(ball.faces, _apart(ball, around), axis=0))
    np.testing.assert_array_equal(outward(turned_over(pinched)).faces, pinched.faces)
    assert outward(pinched) is pinched
    field = rectangle(1.5, 1.0, 9, 7)
    assert outward(field) is field and outward(turned_over(field)).faces[0, 0] == field.faces[0, 2]


def test_a_cut_keeps_the_largest_piece_and_its_corners() -> None:
    strip = rectangle(9.0, 1.0, 10, 2)
    part, kept = cut_mesh(strip, abs(strip.vertices[:, 0] - 3.0) > 0.1)  # 2 squares before the cut, 5 after it
    assert part.n_faces == 10 and kept.sum() == part.n_vertices == 12
    np.testing.assert_array_equal(part.vertices, strip.vertices[kept])
    assert part.vertices[:, 0].min() == 4.0
    everything, all_kept = cut_mesh(strip, np.ones(strip.n_vertices, dtype=bool))
    assert all_kept.all() and np.array_equal(everything.faces, strip.faces)


@pytest.mark.parametrize(("keep", "told"), [
    (np.zeros(162, dtype=bool), "keep must leave a face of the mesh"),
    ([True, False], r"keep must hold True or False for each of the 162 vertices; got dtype bool and shape \(2,\)"),
    (np.ones(162), "keep must hold True or False for each of the 162 vertices; got dtype float64"),
])
def test_a_cut_names_what_is_wrong(keep, told):
    with pytest.raises(ValueError, match=told):
        cut_mesh(BALL, keep)
