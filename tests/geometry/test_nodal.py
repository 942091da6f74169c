"""Nodal domains counted by hand and on shapes whose modes are known; every error message."""

import numpy as np
import pytest

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.geometry.nodal import nodal_domains
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, rectangle, sphere
from spectral_notes.shapes.references import spherical_harmonics


def count(mesh, f, tol=0.0):
    return nodal_domains(mesh, f, tol=tol).max() + 1


def test_constant_has_one_domain_and_zero_has_none(tetrahedron):
    assert nodal_domains(tetrahedron, np.full(4, -2.0)).tolist() == [0, 0, 0, 0]
    assert nodal_domains(tetrahedron, np.zeros(4)).tolist() == [-1, -1, -1, -1]


@pytest.mark.parametrize(("p", "q"), [(0, 1), (3, 0), (2, 2), (4, 3)])
def test_products_of_cosines_make_a_chess_board_once_the_crossings_are_cut_out(p, q):
    mesh = rectangle(n_x=82, n_y=77)
    x, y, _ = mesh.vertices.T
    f = np.cos(p * np.pi * x) * np.cos(q * np.pi * y)
    assert count(mesh, f, tol=0.05) == (p + 1) * (q + 1)


def test_an_edge_across_a_crossing_joins_two_opposite_fields():
    mesh = rectangle(n_x=52, n_y=47)
    x, y, _ = mesh.vertices.T
    f = np.cos(np.pi * x) * np.cos(np.pi * y)
    assert (count(mesh, f), count(mesh, f, tol=0.05)) == (3, 4)


def test_spherical_harmonics_have_the_known_numbers():
    ball = sphere(4)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]  # so that no vertex is on a nodal line
    l = 5
    counts = [count(ball, f, tol=0.03) for f in spherical_harmonics(ball.vertices @ turn, l).T]
    assert counts == [l + 1 if m == 0 else 2 * m * (l - m + 1) for m in abs(np.arange(-l, l + 1))]


def test_labels_are_pieces_of_one_sign_with_different_neighbours():
    mesh = egg(3)
    f = compute_eigenbasis(*cotan_laplacian(mesh), k=12).evecs[:, 11]
    labels = nodal_domains(mesh, f)
    i, j, _ = mesh.faces.T
    np.testing.assert_array_equal(labels[i] == labels[j], f[i] * f[j] > 0)
    first = [np.flatnonzero(labels == number)[0] for number in range(labels.max() + 1)]
    assert first == sorted(first)


def test_neither_sign_nor_scale_of_the_function_matters():
    mesh = sphere(3)
    f = mesh.vertices @ [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(nodal_domains(mesh, f), nodal_domains(mesh, -1e-9 * f))


def test_tolerance_widens_the_nodal_set():
    line = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    f = [1.0, 1e-9, 1e-9, -1.0]
    assert nodal_domains(line, f).tolist() == [0, 0, 0, 1]
    assert nodal_domains(line, f, tol=1e-8).tolist() == [0, -1, -1, 1]
    assert nodal_domains(line, 1e3 * np.array(f), tol=1e-8).tolist() == [0, -1, -1, 1]


@pytest.mark.parametrize(
    ("f", "tol", "message"),
    [
        ([1.0, 2.0], 0.0, r"f must have shape \(4,\)"),
        ([1.0, np.nan, 0.0, 0.0], 0.0, "f must hold finite numbers"),
        ([1.0, 2.0, 3.0, 4.0], -0.1, "tol must be at least 0"),
    ],
)
def test_what_is_wrong_is_named(tetrahedron, f, tol, message):
    with pytest.raises(ValueError, match=message):
        nodal_domains(tetrahedron, f, tol=tol)
