"""Health reports: each fault made on purpose and found, alone."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.geometry.mesh_health import CONSEQUENCES, health
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import sphere, torus


def faults_of(mesh, **options):
    """The faults that a mesh has, without the zeros."""
    return {fault: count for fault, count in health(mesh, **options).faults.items() if count}


def changed(mesh, vertices=None, faces=None):
    """The mesh with other arrays."""
    return TriangleMesh(mesh.vertices if vertices is None else vertices, mesh.faces if faces is None else faces)


def test_a_sound_mesh_has_no_fault():
    report = health(sphere(2))
    assert (report.components, report.boundary_loops, report.euler_characteristic, report.genus) == (1, 0, 2, 0)
    assert not any(report.faults.values())
    assert report.is_closed
    assert report.is_manifold
    assert str(report).endswith("no fault found")


def test_topology_of_torus_annulus_and_two_pieces(unit_square):
    assert health(torus()).genus == 1
    ball = sphere(2)
    away = ~np.isin(ball.faces, [0, 3]).any(axis=1)
    holes = health(changed(ball, faces=ball.faces[away]))
    assert (holes.boundary_loops, holes.genus, holes.euler_characteristic) == (2, 0, 0)
    twice = TriangleMesh(np.r_[ball.vertices, ball.vertices + 9], np.r_[ball.faces, ball.faces + ball.n_vertices])
    assert (health(twice).components, health(twice).genus) == (2, 0)
    assert (health(unit_square).boundary_loops, health(unit_square).genus) == (1, 0)


def test_mobius_strip_and_book(mobius, book_of_three):
    strip = health(mobius)
    assert strip.faults["misoriented_edges"] > 0
    assert strip.genus is None
    assert strip.boundary_loops == 1
    pages = health(book_of_three)
    assert pages.faults["nonmanifold_edges"] == 1
    assert not pages.is_manifold
    assert "genus not defined" in str(pages)


def test_each_fault_is_found_alone():
    ball = sphere(2)
    n = ball.n_vertices
    extra = np.r_[ball.vertices, [[9.0, 9, 9]]]
    assert faults_of(changed(ball, vertices=extra)) == {"unreferenced_vertices": 1}
    assert faults_of(changed(ball, faces=np.r_[ball.faces[:1, [1, 0, 2]], ball.faces[1:]])) == {"misoriented_edges": 3}
    split = ball.faces.copy()
    split[0, 0] = n
    torn = faults_of(changed(ball, vertices=np.r_[ball.vertices, ball.vertices[ball.faces[:1, 0]]], faces=split))
    assert torn["duplicate_vertices"] == 1
    assert torn["boundary_edges"] == 4


def test_thin_and_flat_faces(unit_square):
    thin = changed(unit_square, vertices=[[0, 0, 0], [1, 0, 0], [1, 0.01, 0], [0, 1, 0]])
    assert faults_of(thin)["sliver_faces"] == 1
    assert "sliver_faces" not in faults_of(thin, sliver_angle=0.1)
    flat = changed(unit_square, vertices=[[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert faults_of(flat)["degenerate_faces"] == 1
    assert "sliver_faces" not in faults_of(flat)


def test_duplicate_faces_and_a_vertex_where_sheets_touch(tetrahedron):
    doubled = changed(tetrahedron, faces=np.r_[tetrahedron.faces, tetrahedron.faces[:1]])
    assert faults_of(doubled)["duplicate_faces"] == 1
    tip = tetrahedron.vertices[0]
    touching = TriangleMesh(
        np.r_[tetrahedron.vertices, 2 * tip - tetrahedron.vertices[1:]],
        np.r_[tetrahedron.faces, np.array([0, 4, 5, 6])[tetrahedron.faces]],
    )
    assert faults_of(touching)["nonmanifold_vertices"] == 1


def test_every_fault_has_a_consequence_and_the_report_prints_it(book_of_three):
    assert set(health(book_of_three).faults) == set(CONSEQUENCES)
    assert CONSEQUENCES["nonmanifold_edges"] in str(health(book_of_three))


def test_the_angle_is_checked(unit_square):
    with pytest.raises(ValueError, match="sliver_angle must be greater than 0; got 0"):
        health(unit_square, sliver_angle=0)
