"""The eigenbasis: closed forms, multiplicities, components, extremes of size and scale, certificates, errors."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull
from threadpoolctl import threadpool_info, threadpool_limits

from spectral_notes import eigenbasis
from spectral_notes.descriptors import first_nonzero, global_point_signature
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis, fix_signs
from spectral_notes.files.eigenbasis_files import read_eigenbasis, read_problem, write_eigenbasis, write_problem
from spectral_notes.graphs import ring_graph
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, interval_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import sphere
from spectral_notes.solver import eigensolver, factorization, lanczos

Pair = tuple[sp.csr_array, sp.csr_array]


def blob(n: int, scale: float = 1.0) -> TriangleMesh:
    """An irregular closed surface with slivers: random points on a sphere, joined, then pushed in and out."""
    points = np.random.default_rng(5).standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    hull = ConvexHull(points)
    inward = np.linalg.det(points[hull.simplices]) < 0
    faces = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    return TriangleMesh(scale * points * (1 + 0.3 * np.sin(3 * points[:, :1])), faces)


def copies(pair: Pair, count: int) -> Pair:
    """Disjoint copies of a domain."""
    L, M = pair
    return sp.csr_array(sp.block_diag([L] * count)), sp.csr_array(sp.block_diag([M] * count))


def reference(L: sp.csr_array, M: sp.csr_array, k: int) -> np.ndarray:
    """Eigenvalues by ARPACK."""
    shift = -0.4 * np.pi / M.sum()
    start = np.random.default_rng(1).standard_normal(L.shape[0])
    return np.sort(eigsh(L.tocsc(), k, M.tocsc(), sigma=shift, v0=start, return_eigenvectors=False))


def assert_eigenbasis(basis: Eigenbasis, L: sp.csr_array, M: sp.csr_array, tol: float = 1e-7) -> None:
    """The definition of an eigenbasis, measured here and not by the solver."""
    X = basis.evecs
    assert abs(X.T @ (M @ X) - np.eye(basis.k)).max() < 1e-12
    gap = (L @ X - (M @ X) * basis.evals) / np.sqrt(M.diagonal())[:, None]
    assert np.linalg.norm(gap, axis=0).max() < tol * basis.evals[-1]
    assert np.linalg.norm(gap, axis=0) == pytest.approx(basis.residuals, abs=1e-9 * basis.evals[-1])
    assert (np.diff(basis.evals) >= 0).all()
    assert (X.max(axis=0) >= 0.99999 * abs(X).max(axis=0)).all()


@pytest.fixture(scope="module")
def blob_pair() -> Pair:
    return cotan_laplacian(blob(3000))


def test_interval_has_cosines_with_the_closed_form() -> None:
    n, k = 2001, 12
    L, M = interval_laplacian(n, 3.0)
    basis = compute_eigenbasis(L, M, k)
    assert_eigenbasis(basis, L, M)
    h = 3.0 / (n - 1)
    assert basis.evals == pytest.approx(4 / h**2 * np.sin(np.pi * np.arange(k) / (2 * (n - 1))) ** 2, rel=1e-9)
    cosines = np.cos(np.pi * np.outer(np.arange(n) / (n - 1), np.arange(k)))
    cosines /= np.sqrt(np.einsum("ij,ij->j", cosines, M @ cosines))
    assert abs(abs(basis.evecs) - abs(cosines)).max() < 1e-6


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_sphere_has_complete_multiplicities_at_order_two(mass: str) -> None:
    expected = np.repeat(np.arange(8), 2 * np.arange(8) + 1)  # l, 2 l + 1 times
    errors = []
    for subdivisions in (3, 4):
        L, M = cotan_laplacian(sphere(subdivisions), mass=mass)
        basis = compute_eigenbasis(L, M, 64, certify=True)
        assert_eigenbasis(basis, L, M)
        exact = expected * (expected + 1.0)
        errors.append(abs(basis.evals[1:] / exact[1:] - 1).max())
        assert (np.round(np.sqrt(basis.evals + 0.25) - 0.5) == expected).all()
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.2


@pytest.mark.parametrize("factor", ["cholespy", "superlu"])
@pytest.mark.parametrize("k", [1, 2, 60, 200])
def test_same_eigenvalues_as_arpack(blob_pair: Pair, k: int, factor: str) -> None:
    if factor == "cholespy":
        pytest.importorskip("cholespy")
    L, M = blob_pair
    basis = compute_eigenbasis(L, M, k, factor=factor, certify=k > 1)
    if k > 1:
        assert_eigenbasis(basis, L, M)
        assert basis.evals == pytest.approx(reference(L, M, k), rel=1e-8, abs=1e-8)


def test_full_mass_agrees_with_arpack() -> None:
    L, M = cotan_laplacian(blob(2500), mass="full")
    basis = compute_eigenbasis(L, M, 40, certify=True)
    assert_eigenbasis(basis, L, M)
    assert basis.evals == pytest.approx(reference(L, M, 40), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_tetrahedron_by_hand(tetrahedron: TriangleMesh, k: int) -> None:
    L, M = cotan_laplacian(tetrahedron)
    value = 4 * L[0, 0] / 3 / M[0, 0]  # L = L00 (4 I - 1 1^T) / 3: three times the same eigenvalue
    assert compute_eigenbasis(L, M, k).evals == pytest.approx(np.array([0, value, value, value])[:k], rel=1e-12)


def test_all_modes_are_a_basis(blob_pair: Pair) -> None:
    L, M = cotan_laplacian(blob(300))
    basis = compute_eigenbasis(L, M, 300)
    assert_eigenbasis(basis, L, M)
    f = np.random.default_rng(0).standard_normal((300, 2))
    assert basis.synthesize(basis.analyze(f)) == pytest.approx(f, abs=1e-10)
    c = basis.analyze(f[:, 0])
    assert c @ c == pytest.approx(f[:, 0] @ M @ f[:, 0], rel=1e-12)  # Parseval


def test_twelve_equal_components_are_all_found() -> None:
    one = cotan_laplacian(blob(300))
    L, M = copies(one, 12)
    basis = compute_eigenbasis(L, M, 48, certify=True)
    assert_eigenbasis(basis, L, M)
    assert (basis.evals[:12] == 0).all()
    assert (basis.evals[12:] > 0).all()
    alone = compute_eigenbasis(*one, 4).evals
    assert basis.evals == pytest.approx(np.repeat(alone, 12), rel=1e-9)


def test_more_equal_components_than_a_block_is_wide() -> None:
    one = cotan_laplacian(blob(60))
    L, M = copies(one, 20)
    alone = compute_eigenbasis(*one, 3).evals
    assert compute_eigenbasis(L, M, 55).evals == pytest.approx(np.repeat(alone, 20)[:55], rel=1e-9)


@pytest.mark.parametrize("spread", [1e-3, 1e-6, 1e-9, 1e-12])
def test_clusters_are_complete_however_tight(spread: float) -> None:
    L, M = cotan_laplacian(blob(300))
    parts = [L * (1 + spread * i) for i in range(10)]
    L, M = sp.csr_array(sp.block_diag(parts)), sp.csr_array(sp.block_diag([M] * 10))
    basis = compute_eigenbasis(L, M, 50, certify=True)
    first = reference(parts[0], cotan_laplacian(blob(300))[1], 5)
    expected = np.sort(np.outer(first, 1 + spread * np.arange(10)).ravel())
    assert basis.evals == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_components_of_different_size_and_more_than_modes(blob_pair: Pair) -> None:
    small = cotan_laplacian(blob(40))
    L = sp.csr_array(sp.block_diag([blob_pair[0]] + [small[0]] * 5))
    M = sp.csr_array(sp.block_diag([blob_pair[1]] + [small[1]] * 5))
    for k in (3, 6, 30):
        basis = compute_eigenbasis(L, M, k)
        assert (basis.evals == 0).sum() == min(k, 6)
        assert basis.orthonormality_error() < 1e-12
    assert_eigenbasis(basis, L, M)


def test_no_zero_mode_where_the_ends_are_fixed() -> None:
    basis = compute_eigenbasis(*interval_laplacian(999, ends="dirichlet"), 5)
    assert basis.evals == pytest.approx((np.pi * np.arange(1, 6)) ** 2, rel=1e-4)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_scale_law(scale: float) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(blob(1500, scale)), 30, certify=True)
    unit = compute_eigenbasis(*cotan_laplacian(blob(1500)), 30)
    assert basis.evals * scale**2 == pytest.approx(unit.evals, rel=1e-9)
    assert basis.residuals.max() < 1e-7 * basis.evals[-1]


def test_long_thin_domain_whose_eigenvalues_are_far_below_weyl() -> None:
    n, length = 3000, 1e6
    basis = compute_eigenbasis(*interval_laplacian(n, length), 20)
    h = length / (n - 1)
    expected = 4 / h**2 * np.sin(np.pi * np.arange(20) / (2 * (n - 1))) ** 2
    assert basis.evals == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("thin", [1e-4, 1e-6])
def test_slivers_do_not_spoil_the_residuals(thin: float) -> None:
    mesh = blob(2000)
    vertices = mesh.vertices.copy()
    for a, b, c in mesh.faces[::97]:  # move one corner almost onto the opposite edge
        vertices[a] = 0.5 * (vertices[b] + vertices[c]) + thin * (vertices[a] - vertices[b])
    L, M = cotan_laplacian(TriangleMesh(vertices, mesh.faces))
    assert abs(L).max() > 1 / thin
    basis = compute_eigenbasis(L, M, 40, certify=True)
    assert_eigenbasis(basis, L, M, tol=2e-8)
    assert basis.evals == pytest.approx(reference(L, M, 40), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("name", ["complete", "star"])
def test_graphs_with_few_distinct_eigenvalues(name: str) -> None:
    n, k = 600, 40
    W = np.ones((n, n)) - np.eye(n)
    if name == "star":
        W[1:, 1:] = 0
    L, M = graph_laplacian(sp.csr_array(W))
    basis = compute_eigenbasis(L, M, k)
    assert_eigenbasis(basis, L, M)
    assert basis.evals == pytest.approx(np.r_[0, np.full(k - 1, float(n) if name == "complete" else 1.0)], rel=1e-9)


def test_deterministic_over_runs_seeds_and_threads(blob_pair: Pair) -> None:
    first = compute_eigenbasis(*blob_pair, 50)
    again = compute_eigenbasis(*blob_pair, 50)
    assert (first.evecs == again.evecs).all()
    for other in (compute_eigenbasis(*blob_pair, 50, threads=2), compute_eigenbasis(*blob_pair, 50, seed=7)):
        assert other.evals == pytest.approx(first.evals, rel=1e-11, abs=1e-11)
        assert abs(other.evecs - first.evecs).max() < 1e-5


def test_threads_are_capped_meanwhile_and_put_back(blob_pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    plain = eigensolver.block_lanczos

    def watched(*args: object, **kwargs: object) -> object:
        seen.extend(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        return plain(*args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(eigensolver, "block_lanczos", watched)
    with threadpool_limits(limits=2, user_api="blas"):
        before = [pool["num_threads"] for pool in threadpool_info()]
        compute_eigenbasis(*blob_pair, 10)
        assert set(seen) == {1}
        assert [pool["num_threads"] for pool in threadpool_info()] == before


def test_interruption_leaves_nothing_behind(blob_pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    before = [pool["num_threads"] for pool in threadpool_info()]
    steps = []
    plain = lanczos._extend

    def interrupted(space: lanczos.Krylov) -> None:
        steps.append(space.size)
        if len(steps) == 5:
            raise KeyboardInterrupt
        plain(space)

    monkeypatch.setattr(lanczos, "_extend", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compute_eigenbasis(*blob_pair, 50, progress=True)
    assert len(steps) == 5
    assert [pool["num_threads"] for pool in threadpool_info()] == before
    monkeypatch.setattr(lanczos, "_extend", plain)
    assert compute_eigenbasis(*blob_pair, 5).k == 5


def test_progress_bar_on_request_only(blob_pair: Pair, capsys: pytest.CaptureFixture[str]) -> None:
    compute_eigenbasis(*blob_pair, 20)
    assert capsys.readouterr().err == ""
    compute_eigenbasis(*blob_pair, 20, progress=True)
    assert "block Lanczos" in capsys.readouterr().err


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_bands_agree_when_memory_is_short(mass: str) -> None:
    L, M = cotan_laplacian(blob(2500), mass=mass)
    sliced = compute_eigenbasis(L, M, 150, max_bytes=1e6, certify=True)
    assert_eigenbasis(sliced, L, M)
    assert sliced.evals == pytest.approx(compute_eigenbasis(L, M, 150).evals, rel=1e-9, abs=1e-9)


def test_bands_are_taken_when_half_of_free_memory_is_too_little(
    blob_pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Memory:
        available = 2 * eigensolver.memory_needed(3000, 40) - 1

    bands = []
    plain = eigensolver.block_lanczos
    monkeypatch.setattr(eigensolver.psutil, "virtual_memory", Memory)
    monkeypatch.setattr(eigensolver, "block_lanczos", lambda *a, **kw: bands.append(a[3]) or plain(*a, **kw))
    compute_eigenbasis(*blob_pair, 40)
    assert bands == [38, 1, 4]  # the last one seeks what the others may have missed
    Memory.available += 2
    compute_eigenbasis(*blob_pair, 40)
    assert bands == [38, 1, 4, 39]
    Memory.available = 8 * 3000 * 40 - 1
    with pytest.raises(MemoryError, match="40 modes of 3000 samples take 0.0 GB .* python -m spectral_notes.command.distributed"):
        compute_eigenbasis(*blob_pair, 40)


def test_memory_of_the_basis_is_what_is_said() -> None:
    L, M = cotan_laplacian(sphere(5))
    compute_eigenbasis(L, M, 3)
    tracemalloc.start()
    basis = compute_eigenbasis(L, M, 150)
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert basis.evecs.nbytes < kept < 1.3 * basis.evecs.nbytes + 3 * (L.data.nbytes + L.indices.nbytes)
    assert peak < 2.5 * eigensolver.memory_needed(L.shape[0], 150)  # NumPy counts columns that were never touched


def test_loose_faces_and_isolated_nodes_take_no_more_memory_than_the_modes() -> None:
    corners = np.random.default_rng(0).standard_normal((60_000, 3))
    pairs = [
        cotan_laplacian(TriangleMesh(corners, np.arange(60_000).reshape(-1, 3))),
        graph_laplacian(sp.csr_array((20_000, 20_000))),
    ]
    for L, M in pairs:
        tracemalloc.start()
        basis = compute_eigenbasis(L, M, 10)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert (basis.evals == 0).all()
        assert basis.n_zero == 10
        assert basis.orthonormality_error() < 1e-12
        assert peak < 20 * basis.evecs.nbytes


def test_isolated_nodes_beside_a_graph() -> None:
    ring = ring_graph(500)
    L, M = graph_laplacian(sp.csr_array(sp.block_diag([ring, sp.csr_array((300, 300))])))
    basis = compute_eigenbasis(L, M, 305)
    assert basis.n_zero == 301
    assert basis.evals[301:] == pytest.approx(2 - 2 * np.cos(2 * np.pi * np.array([1, 1, 2, 2]) / 500), rel=1e-9)


@pytest.mark.parametrize("link", [1e-3, 1e-9, 1e-14, 1e-30])
@pytest.mark.parametrize("n", [40, 600])
def test_a_weak_link_is_no_zero_mode(n: int, link: float) -> None:
    W = sp.lil_array(sp.block_diag([ring_graph(n), ring_graph(n)]))
    W[0, n] = W[n, 0] = link
    basis = compute_eigenbasis(*graph_laplacian(sp.csr_array(W)), 4)
    assert basis.n_zero == first_nonzero(basis, 1) == 1
    assert basis.evals[0] == 0.0
    parts = basis.evecs[:, 1] > 0
    assert set(parts[:n]) ^ set(parts[n:]) == {True, False}
    if 1e-14 <= link <= 1e-9:
        assert basis.evals[1] == pytest.approx(2 * link / n, rel=1e-3)  # link (2 c)^2, where c^2 2 n = 1
    gps = global_point_signature(basis)
    assert np.isfinite(gps).all()


def test_zero_modes_are_counted_where_constants_are_none() -> None:
    W = ring_graph(60) + sp.csr_array(sp.coo_array(([3.0, 3.0], ([0, 30], [30, 0])), shape=(60, 60)))
    L, M = graph_laplacian(W)
    d = 1 / np.sqrt(L.diagonal())
    normalised = sp.csr_array(sp.diags_array(d) @ L @ sp.diags_array(d))
    assert compute_eigenbasis(normalised, M, 5).n_zero == 1
    held = sp.csr_array(L + sp.diags_array(np.eye(60)[0]))
    assert compute_eigenbasis(held, M, 5).n_zero == 0


def test_a_basis_made_by_hand_is_checked_and_its_own() -> None:
    evecs = np.eye(3)
    evecs[1, 1] = np.nan
    evecs.setflags(write=False)
    with pytest.raises(ValueError, match=r"evecs must hold finite numbers; found nan at index \(1, 1\)"):
        Eigenbasis(np.arange(3.0), evecs, sp.csr_array(np.eye(3)))
    with pytest.raises(ValueError, match="n_zero must be between 0 and 3; got 4"):
        Eigenbasis(np.arange(3.0), np.eye(3), sp.csr_array(np.eye(3)), n_zero=4)
    mine = np.array([0.0, 1e-12, 1.0])
    basis = Eigenbasis(mine, np.eye(3), sp.csr_array(np.eye(3)))
    mine[:] = 7.0
    assert basis.evals.tolist() == [0.0, 1e-12, 1.0]
    assert basis.n_zero == 2
    assert basis.truncate(1).n_zero == 1
    assert basis.residuals is not None and np.isnan(basis.residuals).all()


def test_matrices_are_checked_once(blob_pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    plain = eigenbasis.as_symmetric
    monkeypatch.setattr(eigenbasis, "as_symmetric", lambda name, *a: seen.append(name) or plain(name, *a))
    basis = compute_eigenbasis(*blob_pair, 3)
    basis.truncate(2)
    assert seen == ["L", "M"]
    assert basis.M is not blob_pair[1]


def test_certificate_notices_a_missing_mode(blob_pair: Pair) -> None:
    L, M = blob_pair
    basis = compute_eigenbasis(L, M, 20)
    eigensolver.certify(L, M, basis.evals, np.asarray(basis.residuals))
    gapped = np.delete(basis.evals, 7), np.delete(np.asarray(basis.residuals), 7)
    with pytest.raises(ArithmeticError, match=r"19 modes were computed where 20 exist|18 .* where 19 exist"):
        eigensolver.certify(L, M, *gapped)
    with pytest.raises(ArithmeticError, match="no gap between the eigenvalues is wide enough"):
        eigensolver.certify(L, M, np.ones(5), np.zeros(5))


def test_certificate_passes_over_a_cluster_that_k_cuts() -> None:
    L, M = cotan_laplacian(sphere(3))
    assert compute_eigenbasis(L, M, 6, certify=True).evals[4] == pytest.approx(6, rel=0.02)


def test_truncate_analyze_synthesize(blob_pair: Pair) -> None:
    basis = compute_eigenbasis(*blob_pair, 20)
    few = basis.truncate(7)
    assert (few.k, few.n) == (7, 3000)
    assert few.M is basis.M or abs(few.M - basis.M).nnz == 0
    f = basis.evecs @ np.arange(20.0)
    assert basis.analyze(f) == pytest.approx(np.arange(20.0), abs=1e-10)
    assert few.analyze(f) == pytest.approx(np.arange(7.0), abs=1e-10)
    with pytest.raises(ValueError, match="read-only"):
        basis.evecs[0, 0] = 1.0


def test_near_ties_do_not_choose_the_sign() -> None:
    X = np.array([[1.0, -1.0], [-1.0 - 1e-9, 1.0 + 1e-9], [0.5, 0.5]])
    fix_signs(X)
    assert X[0].tolist() == [1.0, 1.0]


def test_files_round_trip(blob_pair: Pair, tmp_path) -> None:
    basis = compute_eigenbasis(*blob_pair, 6)
    write_eigenbasis(tmp_path / "basis.npz", basis)
    again = read_eigenbasis(tmp_path / "basis.npz")
    assert (again.evecs == basis.evecs).all() and (again.evals == basis.evals).all()
    assert (again.residuals == basis.residuals).all() and abs(again.M - basis.M).nnz == 0
    write_problem(tmp_path / "pair.npz", *blob_pair)
    L, M = read_problem(tmp_path / "pair.npz")
    assert abs(L - blob_pair[0]).nnz == 0 and abs(M - blob_pair[1]).nnz == 0
    with pytest.raises(ValueError, match=r"path must end in .npz; got 'basis.dat'"):
        write_eigenbasis(tmp_path / "basis.dat", basis)
    with pytest.raises(ValueError, match=r"pair.npz does not hold what is read here; it lacks evals, evecs, residuals"):
        read_eigenbasis(tmp_path / "pair.npz")


def test_errors_name_the_argument(blob_pair: Pair) -> None:
    L, M = blob_pair
    n = L.shape[0]
    with pytest.raises(TypeError, match="L must be real"):
        compute_eigenbasis(L * 1j, M, 3)
    with pytest.raises(TypeError, match="M must be real"):
        compute_eigenbasis(L, M * 1j, 3)
    with pytest.raises(ValueError, match=f"k must be between 1 and {n}; got 0"):
        compute_eigenbasis(L, M, 0)
    with pytest.raises(ValueError, match=f"k must be between 1 and {n}; got {n + 1}"):
        compute_eigenbasis(L, M, n + 1)
    with pytest.raises(ValueError, match="M must have shape"):
        compute_eigenbasis(L, M[:5, :5], 3)
    with pytest.raises(ValueError, match="L must be symmetric"):
        compute_eigenbasis(sp.csr_array(sp.triu(L)), M, 3)
    with pytest.raises(ValueError, match="tol must be greater than 0"):
        compute_eigenbasis(L, M, 3, tol=0)
    with pytest.raises(ValueError, match="factor must be one of"):
        compute_eigenbasis(L, M, 3, factor="lu")
    with pytest.raises(ValueError, match="threads must be at least 1"):
        compute_eigenbasis(L, M, 3, threads=0)
    with pytest.raises(ValueError, match="max_bytes must be greater than 0"):
        compute_eigenbasis(L, M, 3, max_bytes=-1)


@pytest.mark.parametrize("factor", ["cholespy", "superlu"])
@pytest.mark.parametrize("n", [300, 2000])
def test_indefinite_is_refused(n: int, factor: str) -> None:
    if factor == "cholespy":
        pytest.importorskip("cholespy")
    L, M = cotan_laplacian(blob(n))
    with pytest.raises(ValueError, match="L must be positive semidefinite; it has"):
        compute_eigenbasis(-L, M, 3, factor=factor)
    dip = sp.csr_array(L - 0.03 * 4 * np.pi / M.sum() * M)  # negative, but not more than the shift
    with pytest.raises(ValueError, match="L must be positive semidefinite; it has the eigenvalue -"):
        compute_eigenbasis(dip, M, 3, factor=factor)


@pytest.mark.parametrize("bad", [0.0, -1.0])
def test_mass_must_be_positive(blob_pair: Pair, bad: float) -> None:
    mass = blob_pair[1].diagonal()
    mass[17] = bad
    with pytest.raises(ValueError, match=r"M must be positive definite; its diagonal holds .* at 17: .*clean_mesh"):
        compute_eigenbasis(blob_pair[0], sp.csr_array(sp.diags_array(mass)), 3)


def test_large_residuals_are_refused(blob_pair: Pair) -> None:
    L, M = blob_pair
    problem = eigensolver.pose(L, M, 5)
    X = np.array(compute_eigenbasis(L, M, 5).evecs)
    X[3] *= 1.5
    with pytest.raises(ArithmeticError, match="a mode has the residual .*: try robust_mesh_laplacian"):
        eigensolver.measure(problem, L, M, X, 1e-8)


def test_cholespy_asked_for_and_missing(blob_pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(factorization.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match="factor='cholespy' needs the package cholespy: pip install cholespy"):
        compute_eigenbasis(*blob_pair, 5, factor="cholespy")
    assert compute_eigenbasis(*blob_pair, 5).k == 5
