"""The Laplacian of point clouds: the sphere at every size and place, regular grids, copies, and two ways that agree."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull, Delaunay

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian, robust_cloud_laplacian, robust_mesh_laplacian
from spectral_notes.meshes import PointCloud, TriangleMesh
from spectral_notes.shapes import goat, sample_points


def random_sphere(n, seed=2):
    points = np.random.default_rng(seed).standard_normal((n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def spectrum(L, M, k=4):
    return compute_eigenbasis(L, M, k).evals


def rotation(seed):
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]


@pytest.mark.parametrize("away", [0.0, 10.0])
@pytest.mark.parametrize("n", [500, 3000, 8000])
def test_random_points_on_the_sphere_have_its_area_and_eigenvalues(n, away):
    L, M = robust_cloud_laplacian(PointCloud(random_sphere(n) + away))
    assert_allclose(spectrum(L, M), [0, 2, 2, 2], atol=5 / n)  # order two in the gap between points, whose square is 1/n
    assert M.sum() == pytest.approx(4 * np.pi, rel=8 / n)


def test_on_the_sphere_the_stars_are_the_delaunay_triangulation_which_is_the_convex_hull():
    points = random_sphere(2000)
    L, M = robust_cloud_laplacian(PointCloud(points))
    L_hull, M_hull = robust_mesh_laplacian(TriangleMesh(points, ConvexHull(points).simplices))
    assert abs(L - L_hull).max() < 1e-9 and abs(M - M_hull).max() < 1e-12


def test_inside_a_plane_cloud_the_stars_are_the_delaunay_triangulation():
    points = np.random.default_rng(1).random((800, 2))
    flat = np.c_[points, np.zeros(800)]
    L, M = robust_cloud_laplacian(PointCloud(flat @ rotation(4)))
    L_plane, M_plane = cotan_laplacian(TriangleMesh(flat, Delaunay(points).simplices))
    inside = (abs(points - 0.5) < 0.35).all(axis=1)
    assert abs((L - L_plane)[inside]).max() < 1e-9 and abs((M - M_plane)[inside]).max() < 1e-12


@settings(max_examples=25)
@given(st.integers(0, 2**31), st.floats(-1e3, 1e3), st.floats(-8, 8))
def test_motion_and_units_change_nothing(seed, away, unit):
    points = random_sphere(200, seed) * [1.0, 0.7, 0.4]
    L, M = robust_cloud_laplacian(PointCloud(points))
    scale = 10.0**unit
    L_moved, M_moved = robust_cloud_laplacian(PointCloud(scale * (points @ rotation(seed) + away)))
    # what the position keeps of a gap between points is all that can be asked
    precision = 1e-10 * max(1.0, abs(away))
    assert abs(L - L_moved).max() < precision * abs(L).max()
    assert abs(M - M_moved / scale**2).max() < precision * M.max()


@settings(max_examples=25)
@given(st.integers(0, 2**31))
@example(7)  # four points near one circle, which their own numbers must not part
def test_numbering_changes_nothing(seed):
    points, order = random_sphere(150, seed), np.random.default_rng(seed).permutation(150)
    L, M = robust_cloud_laplacian(PointCloud(points))
    L_new, M_new = robust_cloud_laplacian(PointCloud(points[order]))
    assert abs(L[order][:, order] - L_new).max() < 1e-9 * abs(L).max()
    assert abs(M[order][:, order] - M_new).max() < 1e-9 * M.max()


@pytest.mark.parametrize("m", [6, 21, 60])
def test_a_square_grid_of_points_has_the_area_and_eigenvalues_of_the_square(m):
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(0, 1, m)] * 2))
    points = np.c_[x, y, np.zeros(m * m)]
    L, M = robust_cloud_laplacian(PointCloud(points))
    assert M.sum() == pytest.approx(1.0, abs=1e-9)
    assert_allclose(spectrum(L, M) / np.pi**2, [0, 1, 1, 2], atol=3 / m**2)
    L_moved, M_moved = robust_cloud_laplacian(PointCloud(points @ rotation(3) + 7))
    assert abs(L - L_moved).max() < 1e-10 and abs(M - M_moved).max() < 1e-10


def test_a_grid_of_longitudes_and_latitudes_has_the_area_of_its_band():
    angle, height = np.meshgrid(np.arange(60) * np.pi / 30, np.linspace(-1.2, 1.2, 30))
    points = np.c_[(np.cos(height) * np.cos(angle)).ravel(), (np.cos(height) * np.sin(angle)).ravel(), np.sin(height).ravel()]
    assert robust_cloud_laplacian(PointCloud(points))[1].sum() == pytest.approx(4 * np.pi * np.sin(1.2), rel=0.02)  # 1.33 where corners disagree


def test_copies_share_their_mass_and_leave_the_spectrum():
    points = random_sphere(600)
    L, M = robust_cloud_laplacian(PointCloud(points))
    doubled = np.r_[points, points[:200], points[:50]]
    L_2, M_2 = robust_cloud_laplacian(PointCloud(doubled))
    assert M_2.sum() == pytest.approx(M.sum())
    assert_allclose(M_2.diagonal()[:50], M.diagonal()[:50] / 3)
    basis = compute_eigenbasis(L_2, M_2, 4)
    assert_allclose(basis.evals, spectrum(L, M), atol=0.01)
    assert_allclose(basis.evecs[:200], basis.evecs[600:800], atol=0.01)


def test_signs_and_sums_on_a_thin_and_bent_cloud():
    L, M = robust_cloud_laplacian(sample_points(goat(), 1500))
    off_diagonal = L - sp.diags_array(L.diagonal())
    assert off_diagonal.max() < 1e-9 and abs(L.sum(axis=1)).max() < 1e-9 and abs(L - L.T).max() < 1e-12
    assert M.diagonal().min() > 0
    assert spectrum(L, M)[1] > 0.1


def test_two_clouds_are_two_components():
    points = random_sphere(300)
    L, M = robust_cloud_laplacian(PointCloud(np.r_[points, points + np.eye(3)[0] * 4]))
    assert_allclose(spectrum(L, M, 8)[:2], 0)
    assert_allclose(spectrum(L, M, 8)[2:], 2, atol=0.03)


def test_neighbours_on_one_line_are_refused_and_more_of_them_help():
    lines = np.c_[np.tile(np.arange(40.0), 10), np.repeat(30.0 * np.arange(10), 40), np.zeros(400)]
    with pytest.raises(ValueError, match=r"no triangle was found at \d+ points.*A larger n_neighbors reaches others"):
        robust_cloud_laplacian(PointCloud(lines), n_neighbors=6)
    _, M = robust_cloud_laplacian(PointCloud(lines), n_neighbors=120)
    assert M.sum() == pytest.approx(39 * 270, rel=0.05)


def test_the_number_of_neighbours_is_checked():
    with pytest.raises(ValueError, match="n_neighbors must be between 3 and 9; got 10"):
        robust_cloud_laplacian(PointCloud(np.random.default_rng(0).random((10, 3))), n_neighbors=10)
