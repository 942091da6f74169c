"""Block Lanczos, the factorization and the slices against dense linear algebra."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.graphs import ring_graph
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, interval_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, rectangle, sphere, torus
from spectral_notes.solver import lanczos
from spectral_notes.solver.factorization import count_below, factorize, symmetric_lu, trustworthy
from spectral_notes.solver.lanczos import gram

Pair = tuple[sp.csr_array, sp.csr_array]


@pytest.fixture(scope="module")
def pair() -> Pair:
    """A sphere with its full mass matrix, n = 642."""
    return cotan_laplacian(sphere(3), mass="full")


def inverse(pair: Pair, shift: float = 1.0) -> lanczos.Operator:
    """The operator (L + shift M)^-1."""
    return factorize(sp.csr_array(pair[0] + shift * pair[1]), factor="superlu")


def empty(n: int) -> tuple[np.ndarray, np.ndarray]:
    """No exact vectors."""
    return np.zeros((n, 0)), np.zeros(0)


def block_lanczos(
    operator: lanczos.Operator, exact: np.ndarray, exact_values: np.ndarray, k: int, *, capacity: int, **options: Any
) -> tuple[np.ndarray, np.ndarray]:
    """The values, and the exact vectors with the found ones behind them, (n, c + k)."""
    n, c = exact.shape
    columns = np.full((capacity + options.get("block", 8), n), np.nan)
    columns[:c] = exact.T
    values = lanczos.block_lanczos(operator, columns, exact_values, k, **options)
    return values, columns[: c + k].T


@pytest.mark.parametrize("block", [1, 4, 8, 16])
@pytest.mark.parametrize("k", [1, 3, 40])
def test_equal_to_dense(pair: Pair, k: int, block: int) -> None:
    L, M = pair
    values, X = block_lanczos(inverse(pair), *empty(642), k, capacity=400, block=block, M=M)
    expected = 1 / (1 + scipy.linalg.eigh(L.toarray(), M.toarray(), eigvals_only=True)[: 3 * k + 40])
    assert abs(X.T @ (M @ X) - np.eye(k)).max() < 1e-12
    gap = L @ X - (M @ X) * (1 / values - 1)
    assert abs(gap).max() < 1e-7
    nearest = abs(values[:, None] - expected).min(axis=1)
    assert nearest.max() < 1e-10
    if block > 5 or k == 1:  # no eigenvalue of this mesh is more than five-fold, so none can be missed
        assert values == pytest.approx(expected[:k], rel=1e-9)


def test_restarts_when_memory_is_full(pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    L, M = pair
    restarts = []
    plain = lanczos._restart
    monkeypatch.setattr(lanczos, "_restart", lambda *args: restarts.append(1) or plain(*args))
    values, X = block_lanczos(inverse(pair), *empty(642), 30, capacity=64, block=8, M=M)
    assert len(restarts) > 1
    expected = 1 / (1 + scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[0, 29], eigvals_only=True))
    assert values == pytest.approx(expected, rel=1e-9)
    assert abs(X.T @ (M @ X) - np.eye(30)).max() < 1e-12


def test_too_little_memory_raises(pair: Pair) -> None:
    with pytest.raises(ArithmeticError, match=r"\d+ of 30 modes converged: allow more memory or a larger tol"):
        block_lanczos(inverse(pair), *empty(642), 30, capacity=48, block=8, M=pair[1], tol=1e-30)


def test_exact_vectors_are_kept_and_not_found_again(pair: Pair) -> None:
    L, M = pair
    expected, Y = scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[0, 19])
    values, X = block_lanczos(inverse(pair), Y[:, :4], 1 / (1 + expected[:4]), 16, capacity=200, M=M)
    assert (X[:, :4] == Y[:, :4]).all()
    assert values == pytest.approx(1 / (1 + expected[4:]), rel=1e-9)


def test_both_ends_of_an_indefinite_operator() -> None:
    d = np.concatenate([[-50.0, 49.0, -48.0], np.linspace(-1, 1, 300)])
    values, _ = block_lanczos(lambda B: d[:, None] * B, *empty(303), 3, capacity=100)
    assert values == pytest.approx([-50, 49, -48], rel=1e-12)


def test_invariant_subspace_is_no_accident() -> None:
    d = np.repeat([3.0, 2.0, 1.0], [2, 3, 195])  # three steps exhaust every Krylov space
    values, X = block_lanczos(lambda B: d[:, None] * B, *empty(200), 20, capacity=120, block=4)
    assert values[:5] == pytest.approx([3, 3, 2, 2, 2], rel=1e-12)
    assert abs(X.T @ X - np.eye(20)).max() < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_multiple_of_the_identity(seed: int) -> None:
    values, X = block_lanczos(lambda B: 2.0 * B, *empty(100), 30, capacity=60, block=4, seed=seed)
    assert values == pytest.approx(np.full(30, 2.0), rel=1e-12)
    assert abs(X.T @ X - np.eye(30)).max() < 1e-12


@pytest.mark.parametrize("subdivisions", [3, 4])
def test_simulated_loss_bounds_the_true_loss(subdivisions: int, monkeypatch: pytest.MonkeyPatch) -> None:
    L, M = cotan_laplacian(sphere(subdivisions))
    rows = []
    plain = lanczos._reorthogonalize

    def compare(space: lanczos.Krylov, estimate: float) -> None:
        j, b = space.size, space.block
        V, T = space.V[:, :j], space.T
        true = V.T @ space.mass(space.V[:, j : j + b])
        error = np.linalg.norm(true @ T[j : j + b, j - b : j], 2) / np.linalg.norm(T[:j, :j], 2)
        plain(space, estimate)
        left = abs(V.T @ space.mass(space.V[:, j : j + b])).max()
        rows.append((estimate, abs(true).max(), error, left))

    monkeypatch.setattr(lanczos, "_reorthogonalize", compare)
    block_lanczos(inverse((L, M), 0.1), *empty(L.shape[0]), 60, capacity=300, M=M)
    estimates, true, errors, left = np.array(rows).T
    assert len(rows) > 5
    assert (true < estimates).all()
    assert np.median(true / estimates) > 1e-5  # or the cleaning would be wasted
    # Before a step each loss is at most LOSS, or it would have been cleaned; the recurrence allows 3 LOSS |T| in loss B.
    assert errors.max() < 3 * lanczos.LOSS
    assert left.max() < lanczos.LOSS


def test_orthogonality_is_kept_throughout(monkeypatch: pytest.MonkeyPatch) -> None:
    L, M = cotan_laplacian(sphere(4))
    losses = []
    plain = lanczos._assemble

    def measure(space: lanczos.Krylov, values: np.ndarray, Y: np.ndarray) -> None:
        V = space.V[:, : space.size]
        losses.append(abs(V.T @ (M @ V) - np.eye(space.size)).max())
        plain(space, values, Y)

    monkeypatch.setattr(lanczos, "_assemble", measure)
    block_lanczos(inverse((L, M), 0.1), *empty(L.shape[0]), 100, capacity=500, M=M)
    assert losses[0] < 1e-8


def test_watch_counts_columns(pair: Pair) -> None:
    seen: list[tuple[int, int]] = []
    block_lanczos(
        inverse(pair), *empty(642), 10, capacity=200, M=pair[1], watch=lambda done, needed: seen.append((done, needed))
    )
    assert [done for done, _ in seen] == list(range(8, 8 * len(seen) + 1, 8))
    assert all(needed >= 30 for _, needed in seen)


@pytest.mark.parametrize("factor", ["cholespy", "superlu"])
def test_factor_solves(pair: Pair, factor: str) -> None:
    if factor == "cholespy":
        pytest.importorskip("cholespy")
    A = sp.csr_array(pair[0] + pair[1])
    B = np.asfortranarray(np.random.default_rng(0).standard_normal((642, 11)))
    before = A.copy(), B.copy()
    assert A @ factorize(A, factor=factor)(B) == pytest.approx(B, abs=1e-10)
    assert abs(A - before[0]).nnz == 0 and np.array_equal(B, before[1])
    with pytest.raises(ValueError, match="L must be positive semidefinite; it has a negative eigenvalue: is its sign"):
        factorize(sp.csr_array(pair[0] - pair[1]), factor=factor)


@pytest.mark.parametrize(
    "make",
    [lambda: sphere(5), lambda: egg(5), lambda: torus(160, 80), lambda: rectangle(n_x=110, n_y=110)],
    ids=["sphere", "egg", "torus", "grid"],
)
def test_the_factor_of_a_regular_mesh_stores_little_but_nonzeros(make: Callable[[], TriangleMesh]) -> None:
    L, M = cotan_laplacian(make())
    A = sp.csr_array(L + 0.1 * M)
    lu = symmetric_lu(A)
    assert lu.nnz < 2.1 * lu.L.nnz  # L and its transpose; joined columns stored seven times that on a sphere
    assert lu.nnz < splu(sp.csc_array(A)).nnz  # what SciPy's eigsh factors with


def test_factor_name_is_checked(pair: Pair) -> None:
    with pytest.raises(ValueError, match="factor must be one of"):
        factorize(pair[0], factor="umfpack")


def test_inertia_counts_the_eigenvalues_of_an_interval() -> None:
    n = 500
    L, M = interval_laplacian(n)
    values = 4 * (n - 1) ** 2 * np.sin(np.pi * np.arange(n) / (2 * (n - 1))) ** 2
    for value in (-1.0, 5.0, 1000.0, 1e5):
        assert count_below(L, M, value) == (values < value).sum()


def test_counting_at_an_eigenvalue_is_refused() -> None:
    A, eye = sp.csr_array(np.diag([1.0, 2.0, 3.0])), sp.eye_array(3, format="csr")
    with pytest.raises(ArithmeticError, match="move the shift"):
        count_below(A, eye, 2.0)
    L, M = interval_laplacian(100)
    exact = 4 * 99**2 * np.sin(np.pi * 7 / 198) ** 2
    with pytest.raises(ArithmeticError, match="too close to an eigenvalue to count from: move the shift"):
        count_below(L, M, exact)


def test_zero_pivot_is_refused() -> None:
    with pytest.raises(ArithmeticError, match="move the shift"):
        symmetric_lu(sp.csr_array([[0.0, 1.0], [1.0, 0.0]]))


def test_a_wrong_factor_is_not_trusted() -> None:
    A = sp.csr_array(np.diag([1.0, 2.0, 3.0]))
    assert trustworthy(symmetric_lu(A), A)
    assert not trustworthy(symmetric_lu(A), sp.csr_array(1.01 * A))


@pytest.mark.parametrize("columns", [1, 150, 200, 260])
@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_bands_are_complete_however_little_memory_there_is(mass: str, columns: int) -> None:
    L, M = cotan_laplacian(sphere(3), mass=mass)
    expected = scipy.linalg.eigh(L.toarray(), M.toarray(), subset_by_index=[0, 99], eigvals_only=True)
    basis = compute_eigenbasis(L, M, 100, max_bytes=8.0 * 642 * columns, certify=True)
    assert basis.orthonormality_error() < 1e-12
    assert basis.evals == pytest.approx(expected, rel=1e-10, abs=1e-10)


def hypercube(d: int) -> sp.csr_array:
    """Weights of the graph of the d-dimensional cube: eigenvalue 2 i comes (d over i) times."""
    nodes = np.arange(2**d)
    edges = [(nodes, nodes ^ (1 << i)) for i in range(d)]
    i, j = (np.concatenate(ends) for ends in zip(*edges, strict=True))
    return sp.csr_array((np.ones(len(i)), (i, j)))


def star(n: int) -> sp.csr_array:
    """Weights of one node joined to n - 1: eigenvalues 0, 1 (n - 2 times), n."""
    i, ones = np.arange(1, n), np.ones(n - 1)
    half = sp.coo_array((ones, (i, np.zeros(n - 1, dtype=int))), shape=(n, n))
    return sp.csr_array(half + half.T)


@pytest.mark.parametrize("max_bytes", [None, 1e5])
@pytest.mark.parametrize(
    ("W", "expected"),
    [
        (hypercube(10), np.repeat([0.0, 2.0, 4.0, 6.0], [1, 10, 45, 120])),
        (star(1500), np.repeat([0.0, 1.0], [1, 1498])),
        (sp.csr_array(sp.block_diag([hypercube(8)] * 4)), np.repeat([0.0, 2.0, 4.0, 6.0], [4, 32, 112, 224])),
    ],
    ids=["hypercube", "star", "four hypercubes"],
)
@pytest.mark.parametrize("k", [11, 70, 150])
def test_eigenvalues_of_any_multiplicity_are_complete(
    W: sp.csr_array, expected: np.ndarray, k: int, max_bytes: float | None
) -> None:
    L, M = graph_laplacian(W)
    basis = compute_eigenbasis(L, M, k, max_bytes=max_bytes)
    assert basis.evals == pytest.approx(expected[:k], abs=1e-9)
    assert basis.orthonormality_error() < 1e-12
    assert basis.residuals.max() < 1e-7


@pytest.mark.parametrize("max_bytes", [None, 1e5])
def test_four_equal_spheres(max_bytes: float | None) -> None:
    L, M = (sp.csr_array(sp.block_diag([matrix] * 4)) for matrix in cotan_laplacian(sphere(3)))
    basis = compute_eigenbasis(L, M, 40, max_bytes=max_bytes, certify=False)
    one = compute_eigenbasis(*cotan_laplacian(sphere(3)), 10)
    assert basis.evals == pytest.approx(np.repeat(one.evals, 4), rel=1e-9, abs=1e-9)
    assert basis.n_zero == 4


def test_the_gram_matrix_by_parts(pair: Pair) -> None:
    X = np.asfortranarray(np.random.default_rng(0).standard_normal((642, 300)))
    assert gram(X, None) == pytest.approx(np.triu(X.T @ X), abs=1e-11)
    assert gram(X, pair[1]) == pytest.approx(np.triu(X.T @ (pair[1] @ X)), abs=1e-11)


def test_loose_tolerance_costs_accuracy_and_not_orthonormality(pair: Pair) -> None:
    _, X = block_lanczos(inverse(pair), *empty(642), 30, capacity=300, M=pair[1], tol=1e-2)
    assert abs(X.T @ (pair[1] @ X) - np.eye(30)).max() < 1e-13


def test_a_search_ends_when_the_caller_has_seen_enough(pair: Pair) -> None:
    solve, columns = inverse(pair), []

    def counted(B: np.ndarray) -> np.ndarray:
        columns.append(B.shape[1])
        return solve(B)

    values, _ = block_lanczos(counted, *empty(642), 30, capacity=300, M=pair[1])
    through = sum(columns)
    columns.clear()
    early, X = block_lanczos(counted, *empty(642), 30, capacity=300, M=pair[1], enough=values[-1] / 2)
    assert sum(columns) < through
    assert values[-1] / 2 < early[-1] < values[-1]
    assert abs(X.T @ (pair[1] @ X) - np.eye(30)).max() < 1e-12


def test_a_shift_too_large_for_a_curve_costs_few_solves(monkeypatch: pytest.MonkeyPatch) -> None:
    from spectral_notes.solver import eigensolver

    solves: list[int] = []

    def counted(operator: Callable[..., np.ndarray], *args: Any, **options: Any) -> np.ndarray:
        solves.append(0)

        def op(B: np.ndarray) -> np.ndarray:
            solves[-1] += B.shape[1]
            return operator(B)

        return lanczos.block_lanczos(op, *args, **options)

    monkeypatch.setattr(eigensolver, "block_lanczos", counted)
    n, k = 20_000, 9
    basis = compute_eigenbasis(*graph_laplacian(ring_graph(n)), k)
    assert basis.evals[-1] == pytest.approx(2 - 2 * np.cos(2 * np.pi * 4 / n), rel=1e-6)
    assert len(solves) > 1
    assert max(solves[:-1]) <= 4 * k
