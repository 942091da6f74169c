"""Laplacians: closed forms, invariants, orders of convergence, second opinions, and every promised error."""

from __future__ import annotations

from functools import partial

import igl
import networkx as nx
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.sparse as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import laplacian as scipy_laplacian

from spectral_notes.laplacians import (
    cotan_laplacian,
    graph_laplacian,
    interval_laplacian,
    mass_matrix,
    robust_mesh_laplacian,
    tetrahedral_laplacian,
)
from spectral_notes.meshes import TriangleMesh


def spectrum(L, M):
    """All eigenvalues, by a dense solver."""
    return scipy.linalg.eigh(L.toarray(), M.toarray(), eigvals_only=True)


def icosphere(levels):
    """A subdivided icosahedron on the unit sphere."""
    vertices, faces = igl.icosahedron()
    faces = np.asarray(faces, dtype=np.int64)
    for _ in range(levels):
        vertices, faces = igl.upsample(vertices, faces)
        vertices = vertices / np.linalg.norm(vertices, axis=1)[:, None]
    return TriangleMesh(vertices, faces, "sphere")


def grid_patch(n, seed=None):
    """An n x n grid on the unit square; with a seed its inner vertices are moved and the sheet waves."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(0, 1, n)], indexing="ij"))
    z = np.zeros(n * n)
    if seed is not None:
        rng = np.random.default_rng(seed)
        inside = (x > 0) & (x < 1) & (y > 0) & (y < 1)
        x, y = (axis + inside * rng.uniform(-0.2, 0.2, n * n) / n for axis in (x, y))
        z = 0.2 * np.sin(4 * x) * np.cos(5 * y)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.r_[np.c_[corner, corner + n, corner + n + 1], np.c_[corner, corner + n + 1, corner + 1]]
    return TriangleMesh(np.c_[x, y, z], faces)


# -- the interval and the circle ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [3, 8, 25])
@pytest.mark.parametrize("length", [1.0, 2 * np.pi])
def test_interval_has_the_closed_form_spectrum(n, length):
    k = np.arange(n)
    h = length / (n - 1)
    free = 4 / h**2 * np.sin(np.pi * k / (2 * (n - 1))) ** 2
    np.testing.assert_allclose(spectrum(*interval_laplacian(n, length)), free, atol=1e-10 * free.max())
    h = length / (n + 1)
    fixed = 4 / h**2 * np.sin(np.pi * (k + 1) / (2 * (n + 1))) ** 2
    np.testing.assert_allclose(spectrum(*interval_laplacian(n, length, ends="dirichlet")), fixed, rtol=1e-10)
    h = length / n
    ring = np.sort(4 / h**2 * np.sin(np.pi * k / n) ** 2)
    np.testing.assert_allclose(spectrum(*interval_laplacian(n, length, ends="periodic")), ring, atol=1e-10 * ring.max())


@pytest.mark.parametrize(("ends", "exact"), [("neumann", 1.0), ("dirichlet", 1.0), ("periodic", 4.0)])
def test_interval_converges_to_the_continuum_at_order_two(ends, exact):
    errors = [abs(spectrum(*interval_laplacian(n, np.pi, ends=ends))[0 if ends == "dirichlet" else 1] - exact) for n in (20, 40, 80)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.9).all()


def test_interval_mass_is_the_trapezoid_rule():
    x = np.linspace(0.0, 2.0, 9)
    M = interval_laplacian(9, 2.0)[1]
    assert np.ones(9) @ M @ x**2 == pytest.approx(scipy.integrate.trapezoid(x**2, x))


# -- graphs ------------------------------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(st.integers(2, 30), st.integers(0, 2**32 - 1))
def test_graph_laplacian_agrees_with_scipy_and_networkx(n, seed):
    rng = np.random.default_rng(seed)
    W = np.triu(rng.random((n, n)) * (rng.random((n, n)) < 0.3), 1)
    W = W + W.T
    L, M = graph_laplacian(sp.csr_array(W))
    np.testing.assert_allclose(L.toarray(), scipy_laplacian(W), atol=1e-14)
    np.testing.assert_allclose(L.toarray(), nx.laplacian_matrix(nx.from_numpy_array(W)).toarray(), atol=1e-14)
    np.testing.assert_array_equal(M.toarray(), np.eye(n))


@pytest.mark.parametrize("n", [3, 10, 31])
def test_ring_and_path_have_closed_form_spectra(n):
    path = np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
    k = np.arange(n)
    np.testing.assert_allclose(spectrum(*graph_laplacian(path)), 2 - 2 * np.cos(np.pi * k / n), atol=1e-12)
    ring = path.copy()
    ring[0, -1] = ring[-1, 0] = 1.0
    np.testing.assert_allclose(spectrum(*graph_laplacian(ring)), np.sort(2 - 2 * np.cos(2 * np.pi * k / n)), atol=1e-12)


def test_degree_mass_gives_the_spectrum_of_the_normalised_laplacian():
    graph = nx.karate_club_graph()
    L, M = graph_laplacian(nx.to_scipy_sparse_array(graph, dtype=float))
    np.testing.assert_array_equal(M.diagonal(), 1.0)
    L, M = graph_laplacian(nx.to_scipy_sparse_array(graph, dtype=float), mass="degree")
    np.testing.assert_allclose(spectrum(L, M), nx.normalized_laplacian_spectrum(graph), atol=1e-12)


def test_loops_cancel():
    assert graph_laplacian([[5.0, 1.0], [1.0, 0.0]])[0].toarray().tolist() == [[1.0, -1.0], [-1.0, 1.0]]


# -- meshes ------------------------------------------------------------------------------------------------------------


def test_weights_of_the_square_by_hand(unit_square):
    L, M = cotan_laplacian(unit_square)
    by_hand = [[1, -0.5, 0, -0.5], [-0.5, 1, -0.5, 0], [0, -0.5, 1, -0.5], [-0.5, 0, -0.5, 1]]  # cot 90 = 0 on the diagonal
    np.testing.assert_allclose(L.toarray(), by_hand, atol=1e-15)
    np.testing.assert_allclose(M.diagonal(), [1 / 3, 1 / 6, 1 / 3, 1 / 6])


@pytest.mark.parametrize("mesh", [grid_patch(12, seed=3), icosphere(3)], ids=["patch", "sphere"])
def test_cotan_laplacian_agrees_with_libigl_up_to_sign(mesh):
    L, M = cotan_laplacian(mesh)
    np.testing.assert_allclose((L + igl.cotmatrix(mesh.vertices, mesh.faces)).toarray(), 0.0, atol=1e-12)
    barycentric = igl.massmatrix(mesh.vertices, mesh.faces, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    np.testing.assert_allclose((M - barycentric).toarray(), 0.0, atol=1e-15)
    full = igl.massmatrix(mesh.vertices, mesh.faces, igl.MASSMATRIX_TYPE_FULL)
    np.testing.assert_allclose((cotan_laplacian(mesh, mass="full")[1] - full).toarray(), 0.0, atol=1e-15)
    mixed = igl.massmatrix(mesh.vertices, mesh.faces, igl.MASSMATRIX_TYPE_VORONOI)
    np.testing.assert_allclose((cotan_laplacian(mesh, mass="voronoi")[1] - mixed).toarray(), 0.0, atol=1e-15)


TRIANGLES = st.lists(st.tuples(*2 * [st.floats(-3, 3)]), min_size=3, max_size=3, unique=True)


@given(TRIANGLES, st.floats(0.1, 10), st.floats(0, 6))
def test_voronoi_shares_are_what_lies_nearest_and_move_with_the_triangle(corners, scale, turn):
    p = np.column_stack([np.array(corners), np.zeros(3)])
    sides = np.roll(p, -1, axis=0) - p
    area = abs(np.cross(sides[0], -sides[2])[2]) / 2
    assume(area > 1e-3 * (sides**2).sum())
    shares = mass_matrix(TriangleMesh(p, [[0, 1, 2]]), kind="voronoi").diagonal()
    assert shares.sum() == pytest.approx(area)
    unit = sides / np.linalg.norm(sides, axis=1)[:, None]
    angles = np.arccos(-np.einsum("ij,ij->i", unit, np.roll(unit, 1, axis=0)))
    corner = int(np.argmax(angles))
    assume(abs(angles[corner] - np.pi / 2) > 1e-6)
    if angles[corner] > np.pi / 2:  # Meyer's rule: half to the obtuse corner, a quarter to the others
        np.testing.assert_allclose(shares, area * (1 + (np.arange(3) == corner)) / 4, rtol=1e-9)
    else:  # two right triangles a corner, from the corner to the middle of a side to the centre of the circumcircle
        radius = np.prod(np.linalg.norm(sides, axis=1)) / (4 * area)
        to_middle = np.linalg.norm(sides, axis=1) / 2
        kites = to_middle * np.sqrt(np.maximum(radius**2 - to_middle**2, 0)) / 2  # of side i, given to both of its ends
        np.testing.assert_allclose(shares, kites + np.roll(kites, 1), rtol=1e-6, atol=1e-9)
    turned = p @ np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    moved = mass_matrix(TriangleMesh(scale * turned + 5.0, [[1, 2, 0]]), kind="voronoi").diagonal()
    np.testing.assert_allclose(moved, scale**2 * shares, rtol=1e-5)


def test_voronoi_mass_counts_no_flat_face():
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]], [[0, 1, 2], [0, 1, 3], [1, 2, 4]])
    np.testing.assert_allclose(mass_matrix(flat, kind="voronoi").diagonal(), [0.25, 0.25, 0.25, 0.125, 0.125])


def test_cotan_and_robust_agree_on_a_delaunay_mesh():
    mesh = icosphere(3)
    for ours, theirs in zip(cotan_laplacian(mesh), robust_mesh_laplacian(mesh), strict=True):
        np.testing.assert_allclose(ours.toarray(), theirs.toarray(), atol=1e-4)  # it mollifies lengths by 1e-5


@pytest.mark.parametrize(
    "make",
    [cotan_laplacian, *(partial(cotan_laplacian, mass=kind) for kind in ("voronoi", "full")), robust_mesh_laplacian],
)
def test_invariants_of_mesh_laplacians(make):
    mesh = grid_patch(10, seed=1)
    L, M = make(mesh)
    assert isinstance(L, sp.csr_array)
    assert isinstance(M, sp.csr_array)
    np.testing.assert_allclose((L - L.T).toarray(), 0.0, atol=1e-14)
    np.testing.assert_allclose(L @ np.ones(100), 0.0, atol=1e-13)
    assert M.sum() == pytest.approx(mesh.area, rel=1e-4 if make is robust_mesh_laplacian else 1e-13)
    evals = spectrum(L, M)
    assert evals[0] == pytest.approx(0.0, abs=1e-11)
    assert evals[1] > 1.0


def test_linear_functions_are_harmonic_inside_a_flat_mesh():
    mesh = grid_patch(9, seed=2)
    flat = TriangleMesh(mesh.vertices * [1, 1, 0], mesh.faces)
    x, y, _ = flat.vertices.T
    inside = (x > 0) & (x < 1) & (y > 0) & (y < 1)
    residual = cotan_laplacian(flat)[0] @ (2 * x - 3 * y)
    np.testing.assert_allclose(residual[inside], 0.0, atol=1e-12)
    assert abs(residual[~inside]).max() > 0.1  # on the boundary the flux shows


def test_moving_changes_nothing_and_scaling_changes_the_mass_only():
    mesh = grid_patch(8, seed=5)
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    L, M = cotan_laplacian(mesh)
    for moved, factor in ((mesh.vertices @ rotation.T + 7.0, 1.0), (5.0 * mesh.vertices, 25.0)):
        L2, M2 = cotan_laplacian(TriangleMesh(moved, mesh.faces))
        np.testing.assert_allclose((L2 - L).toarray(), 0.0, atol=1e-12)
        np.testing.assert_allclose((M2 - factor * M).toarray(), 0.0, atol=1e-12)


def test_sphere_converges_to_l_times_l_plus_one_at_order_two():
    exact = np.repeat([0.0, 2.0, 6.0], [1, 3, 5])
    errors = [abs(spectrum(*cotan_laplacian(icosphere(level)))[:9] - exact)[1:].max() for level in (1, 2, 3)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])  # each level halves the edges
    assert (orders > 1.8).all()


def test_flat_torus_has_its_closed_form_spectrum_in_the_limit():
    def error(n):
        """Largest relative error of modes 1 to 8 on an n x n grid of the unit flat torus, glued by indices."""
        ring = sp.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[-1, 1]).tolil()
        ring[0, n - 1] = ring[n - 1, 0] = 1.0
        W = sp.kron(ring, sp.eye_array(n)) + sp.kron(sp.eye_array(n), ring)  # cot 90 = 0 on the diagonals of the squares
        evals = spectrum(graph_laplacian(W)[0], sp.eye_array(n * n) / n**2)
        exact = 4 * np.pi**2 * np.repeat([1.0, 2.0], 4)
        return abs(evals[1:9] / exact - 1).max()

    assert np.log2(error(8) / error(16)) > 1.9


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-6, 1.0, 1e6]), st.sampled_from(["lumped", "full"]))
def test_laws_of_tetrahedra_however_they_lie(seed, scale, mass):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(7, 3))
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5], [6, 0, 1, 2]])
    volumes = abs(np.linalg.det(corners[tets[:, 1:]] - corners[tets[:, :1]])) / 6
    assume(volumes.min() > 1e-2)
    L, M = tetrahedral_laplacian(corners, tets, mass=mass)
    assert M.sum() == pytest.approx(volumes.sum()) and abs(L - L.T).max() < 1e-12 * abs(L).max()
    np.testing.assert_allclose(L @ np.ones(7), 0.0, atol=1e-12 * abs(L).max())
    slope = rng.normal(size=3)  # the energy of a linear function is its squared slope times the volume
    assert (corners @ slope) @ L @ (corners @ slope) == pytest.approx(slope @ slope * volumes.sum())
    turn, order = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.permutation(7)
    moved = scale * (corners @ turn + 5.0)[order]
    L_moved, M_moved = tetrahedral_laplacian(moved, rng.permuted(np.argsort(order)[tets], axis=1), mass=mass)
    np.testing.assert_allclose(L_moved.toarray(), scale * L.toarray()[order][:, order], atol=1e-9 * scale * abs(L).max())
    np.testing.assert_allclose(M_moved.toarray(), scale**3 * M.toarray()[order][:, order], atol=1e-9 * scale**3)


def test_tetrahedra_agree_with_libigl_up_to_sign_and_with_products_integrated():
    vertices, tets = np.vstack([np.zeros((1, 3)), np.diag([1.0, 2.0, 3.0]), [[1.0, 2.0, 3.0]]]), [[0, 1, 2, 3], [1, 2, 3, 4]]
    L, M = tetrahedral_laplacian(vertices, tets, mass="full")
    np.testing.assert_allclose(L.toarray(), -igl.cotmatrix(vertices, np.array(tets)).toarray(), atol=1e-12)
    one = tetrahedral_laplacian(vertices[:4], tets[:1], mass="full")[1]
    x = vertices[:4, 0]  # on the first tetrahedron, of volume 1, the integral of x^2 is a^2 V / 10
    assert x @ one @ x == pytest.approx(1.0 / 10)
    lumped = tetrahedral_laplacian(vertices, tets)[1]
    np.testing.assert_allclose(lumped.diagonal(), M.sum(axis=1))


def test_robust_laplacian_survives_what_cotan_refuses(book_of_three):
    needle = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(ValueError, match=r"no face without area; 1 of its faces .* face 0. robust_mesh_laplacian"):
        cotan_laplacian(needle)
    for mesh in (needle, book_of_three):
        L, M = robust_mesh_laplacian(mesh)
        assert np.isfinite(L.toarray()).all()
        off_diagonal = L.toarray() - np.diag(L.diagonal())
        assert off_diagonal.max() < 1e-9
        assert (M.diagonal() > 0).all()


# -- errors ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: interval_laplacian(2), ValueError, "n must be at least 3; got 2"),
        (lambda: interval_laplacian(2.5), TypeError, "n must be an integer; got float"),
        (lambda: interval_laplacian(True), TypeError, "n must be an integer; got a boolean"),
        (lambda: interval_laplacian(5, 0.0), ValueError, "length must be greater than 0; got 0"),
        (lambda: interval_laplacian(5, np.nan), ValueError, "length must be finite; got nan"),
        (lambda: interval_laplacian(5, "1"), TypeError, "length must be a real number; got str"),
        (lambda: interval_laplacian(5, ends="free"), ValueError, "ends must be one of 'periodic', 'dirichlet', 'neumann'"),
        (lambda: graph_laplacian([[0, 1], [2, 0]]), ValueError, "W must be symmetric; it differs from its transpose by 1"),
        (lambda: graph_laplacian([[0, 1, 0], [1, 0, 0]]), ValueError, r"W must be square; got shape \(2, 3\)"),
        (lambda: graph_laplacian([[0, -1], [-1, 0]]), ValueError, "W must hold no negative weight; the smallest is -1"),
        (lambda: graph_laplacian([[0, 1j], [1j, 0]]), TypeError, "W must be an array of real numbers; got dtype complex128"),
        (lambda: graph_laplacian(sp.csr_array([[0, 1j], [1j, 0]])), TypeError, "W must be real; got dtype complex128"),
        (lambda: graph_laplacian([[0, np.nan], [np.nan, 0]]), ValueError, "W must hold finite numbers"),
        (lambda: graph_laplacian(np.zeros((2, 2)), mass="degree"), ValueError, "every vertex an edge .* vertex 0 has none"),
        (lambda: graph_laplacian(np.zeros((2, 2)), mass="area"), ValueError, "mass must be one of 'identity', 'degree'"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


@pytest.mark.parametrize("make", [cotan_laplacian, robust_mesh_laplacian, mass_matrix])
def test_a_vertex_without_face_is_refused(make):
    mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2]])
    with pytest.raises(ValueError, match=r"no vertex without a face; 1 have none, the first is vertex 3. clean_mesh"):
        make(mesh)


def test_options_of_meshes_are_checked(unit_square):
    with pytest.raises(ValueError, match="mass must be one of 'lumped', 'voronoi', 'full'; got 'mixed'"):
        cotan_laplacian(unit_square, mass="mixed")
    with pytest.raises(ValueError, match="kind must be one of 'lumped', 'voronoi', 'full'; got 'mixed'"):
        mass_matrix(unit_square, kind="mixed")
