"""Clusters against components, cliques and closed forms; what they must not see: signs, rotations, sampling, chance."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.metrics import adjusted_rand_score

from spectral_notes import clustering, shapes
from spectral_notes.descriptors import global_point_signature
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.graphs import neighbor_graph, path_graph, ring_graph, weights_of_networkx
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian, interval_laplacian
from spectral_notes.meshes import TriangleMesh, connected_components


@pytest.fixture(scope="module")
def standing() -> Eigenbasis:
    return compute_eigenbasis(*cotan_laplacian(shapes.doll()), k=13)


@pytest.fixture(scope="module")
def three_spheres() -> TriangleMesh:
    """Three balls of different size, side by side and not connected."""
    parts = [(shapes.sphere(2), size, place) for size, place in ((1.0, 0.0), (0.7, 3.0), (0.5, 6.0))]
    vertices = [size * ball.vertices + [place, 0, 0] for ball, size, place in parts]
    faces = [ball.faces + i * ball.n_vertices for i, (ball, _, _) in enumerate(parts)]
    return TriangleMesh(np.vstack(vertices), np.vstack(faces))


def cliques(*sizes: int) -> tuple[sp.csr_array, np.ndarray]:
    """Complete graphs in a chain, each joined to the next by one edge; and the clique of each vertex."""
    graph = nx.disjoint_union_all([nx.complete_graph(n) for n in sizes])
    ends = np.cumsum(sizes)
    graph.add_edges_from((end - 1, end) for end in ends[:-1])
    return weights_of_networkx(graph), np.repeat(np.arange(len(sizes)), sizes)


# --- the embedding --------------------------------------------------------------------------------------------------


def test_embedding_is_the_signature_without_its_tail(standing: Eigenbasis) -> None:
    rows = clustering.spectral_embedding(standing, 8)
    np.testing.assert_array_equal(rows, global_point_signature(standing)[:, :8])
    np.testing.assert_allclose(standing.M.diagonal() @ rows, 0, atol=1e-9)


def test_all_zero_modes_are_left_out_of_the_signature(three_spheres: TriangleMesh) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(three_spheres), k=12)
    assert np.count_nonzero(basis.evals < 1e-9) == 3
    rows = clustering.spectral_embedding(basis, 9)
    assert np.isfinite(rows).all() and abs(rows).max() < 10
    with pytest.raises(ValueError, match="d must be at most 9, the modes that the basis offers; got 10"):
        clustering.spectral_embedding(basis, 10)


def test_constant_alone_is_left_out_without_weights(three_spheres: TriangleMesh) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(three_spheres), k=12)
    rows = clustering.spectral_embedding(basis, 11, weights="none")
    np.testing.assert_allclose(rows.T @ basis.M @ rows, np.eye(11), atol=1e-9)
    np.testing.assert_allclose(basis.M.diagonal() @ rows, 0, atol=1e-9)
    with pytest.raises(ValueError, match="d must be at most 11"):
        clustering.spectral_embedding(basis, 12, weights="none")


def test_hall_draws_a_ring_as_a_circle() -> None:
    rows = clustering.spectral_embedding(compute_eigenbasis(*graph_laplacian(ring_graph(20)), k=3), 2, weights="none")
    np.testing.assert_allclose((rows**2).sum(axis=1), 2 / 20, atol=1e-9)


def test_domain_without_zero_mode_keeps_all_modes() -> None:
    basis = compute_eigenbasis(*interval_laplacian(50, ends="dirichlet"), k=3)
    np.testing.assert_array_equal(clustering.spectral_embedding(basis, 3, weights="none"), basis.evecs)
    assert clustering.spectral_embedding(basis, 3).shape == (50, 3)


# --- clusters -------------------------------------------------------------------------------------------------------


def test_components_are_found_exactly(three_spheres: TriangleMesh) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(three_spheres), k=6)
    rows = clustering.spectral_embedding(basis, 2, weights="none")
    with_constant = np.c_[np.ones(basis.n), rows]  # moves all rows alike; "qr" needs as many columns as clusters
    labels = clustering.spectral_clusters(with_constant, 3, mass=basis.M.diagonal())
    assert adjusted_rand_score(labels, connected_components(three_spheres)) == 1.0


def test_cliques_are_found_exactly() -> None:
    W, truth = cliques(12, 8, 6, 9)
    basis = compute_eigenbasis(*graph_laplacian(W, mass="degree"), k=5)
    labels = clustering.spectral_clusters(basis.evecs[:, :4], 4, mass=basis.M.diagonal())
    assert adjusted_rand_score(labels, truth) == 1.0


def test_point_cloud_goes_through_the_same_functions() -> None:
    turn = np.linspace(0, 2 * np.pi, 150, endpoint=False)
    rings = np.vstack([r * np.c_[np.cos(turn), np.sin(turn)] for r in (1.0, 2.0)])
    basis = compute_eigenbasis(*graph_laplacian(neighbor_graph(rings, 8), mass="degree"), k=4)
    rows = clustering.spectral_embedding(basis, 1, weights="none")
    labels = clustering.spectral_clusters(rows, 2, mass=basis.M.diagonal())
    truth = np.repeat([0, 1], 150)
    assert adjusted_rand_score(labels, truth) == 1.0
    assert adjusted_rand_score(clustering.spectral_clusters(rings, 2), truth) < 0.1


def test_signs_and_rotations_change_nothing(standing: Eigenbasis) -> None:
    rng = np.random.default_rng(1)
    rows, mass = clustering.spectral_embedding(standing, 8), standing.M.diagonal()
    labels = clustering.spectral_clusters(rows, 7, mass=mass)
    for turn in (np.diag(rng.choice([-1.0, 1.0], 8)), np.linalg.qr(rng.normal(size=(8, 8)))[0]):
        turned = clustering.spectral_clusters(rows @ turn, 7, mass=mass)
        assert adjusted_rand_score(labels, turned) == 1.0


def test_runs_agree_to_the_last_label(standing: Eigenbasis) -> None:
    rows, mass = clustering.spectral_embedding(standing, 8), standing.M.diagonal()
    runs = []
    for state in range(3):
        np.random.seed(state)  # noqa: NPY002  (the global state must not matter)
        runs.append(clustering.spectral_clusters(rows, 8, mass=mass))
    assert (runs[0] == runs[1]).all() and (runs[0] == runs[2]).all()


@pytest.mark.parametrize("n_parts", [6, 7])
@pytest.mark.parametrize("pose", ["walk", "arms_down"])
def test_doll_has_the_same_parts_in_every_pose(standing: Eigenbasis, pose: str, n_parts: int) -> None:
    moved = compute_eigenbasis(*cotan_laplacian(shapes.doll(pose)), k=13)
    labels = [
        clustering.spectral_clusters(clustering.spectral_embedding(b, 8), n_parts, mass=b.M.diagonal())
        for b in (standing, moved)
    ]
    assert adjusted_rand_score(*labels) > 0.95


def split_faces(mesh: TriangleMesh, marked: np.ndarray) -> TriangleMesh:
    """Put a vertex into the middle of each marked face: the same surface, sampled three times as densely there."""
    a, b, c = mesh.faces[marked].T
    middle = mesh.n_vertices + np.arange(len(a))
    new = np.concatenate([np.c_[a, b, middle], np.c_[b, c, middle], np.c_[c, a, middle]])
    vertices = np.vstack([mesh.vertices, mesh.vertices[mesh.faces[marked]].mean(axis=1)])
    return TriangleMesh(vertices, np.vstack([mesh.faces[~marked], new]))


def test_masses_undo_uneven_sampling(standing: Eigenbasis) -> None:
    doll = uneven = shapes.doll()
    for _ in range(2):
        uneven = split_faces(uneven, uneven.vertices[uneven.faces].mean(axis=1)[:, 0] > 0.05)
    assert uneven.n_vertices > 4 * doll.n_vertices
    dense = compute_eigenbasis(*cotan_laplacian(uneven), k=9)
    agree = {}
    for weighted in (True, False):
        labels = [
            clustering.spectral_clusters(
                clustering.spectral_embedding(b, 8), 6, mass=b.M.diagonal() if weighted else None
            )
            for b in (standing, dense)
        ]
        agree[weighted] = adjusted_rand_score(labels[0], labels[1][: doll.n_vertices])
    assert agree[True] > 0.98 and agree[False] < 0.9


def test_weight_two_is_two_copies() -> None:
    rows = np.random.default_rng(3).normal(size=(40, 2))
    mass = np.repeat([1.0, 2.0], 20)
    twice = np.vstack([rows, rows[20:]])
    assert (clustering.spectral_clusters(rows, 4, mass=mass) == clustering.spectral_clusters(twice, 4)[:40]).all()


# --- seeds ----------------------------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(st.integers(1, 6), st.integers(0, 10_000))
def test_farthest_seeds_cover_as_well_as_twice_the_best(n_seeds: int, seed: int) -> None:
    rows = np.random.default_rng(seed).normal(size=(30, 2))
    seeds = clustering.seed_rows(rows, n_seeds + 1)
    apart = np.linalg.norm(rows[seeds][:, None] - rows[seeds], axis=2)[np.triu_indices(n_seeds + 1, 1)]
    covered = np.linalg.norm(rows[:, None] - rows[seeds[:-1]], axis=2).min(axis=1).max()
    assert covered <= apart.min() + 1e-12  # Gonzalez: the next seed is the worst covered, and no two are closer


# --- gaps and cuts --------------------------------------------------------------------------------------------------


def test_eigengap_counts_cliques_and_components(three_spheres: TriangleMesh) -> None:
    W, _ = cliques(12, 8, 6, 9)
    gaps = clustering.eigengaps(compute_eigenbasis(*graph_laplacian(W, mass="degree"), k=8))
    assert np.argmax(gaps[1:]) + 2 == 4
    gaps = clustering.eigengaps(compute_eigenbasis(*cotan_laplacian(three_spheres), k=6))
    assert gaps[:3].tolist() == [0.0, 0.0, 1.0] and (gaps[3:] < 1).all()


def test_eigengaps_of_an_interval_with_fixed_ends() -> None:
    gaps = clustering.eigengaps(compute_eigenbasis(*interval_laplacian(400, ends="dirichlet"), k=4))
    np.testing.assert_allclose(gaps, [3 / 4, 5 / 9, 7 / 16], atol=1e-4)


def test_cut_of_two_cliques_by_hand() -> None:
    W, truth = cliques(4, 3)
    L, M = graph_laplacian(W, mass="degree")
    assert clustering.normalized_cut(L, M, truth) == pytest.approx(1 / 13 + 1 / 7)  # one edge of 13 and of 7 half-edges
    assert clustering.normalized_cut(*graph_laplacian(W), truth) == pytest.approx(1 / 4 + 1 / 3)


def test_cut_agrees_with_networkx() -> None:
    graph = nx.karate_club_graph()
    labels = np.array([int(graph.nodes[v]["club"] == "Officer") for v in graph])
    W = weights_of_networkx(graph)
    theirs = nx.normalized_cut_size(graph, np.flatnonzero(labels), weight="weight")
    assert clustering.normalized_cut(*graph_laplacian(W, mass="degree"), labels) == pytest.approx(theirs)


@settings(max_examples=40)
@given(st.lists(st.integers(0, 3), min_size=26, max_size=26))
def test_no_cut_is_below_the_sum_of_eigenvalues(labels: list[int]) -> None:
    W, _ = cliques(12, 8, 6)
    for mass in ("identity", "degree"):
        L, M = graph_laplacian(W, mass=mass)
        numbers = np.unique(labels, return_inverse=True)[1]
        evals = compute_eigenbasis(L, M, k=numbers.max() + 1).evals
        assert clustering.normalized_cut(L, M, numbers) >= evals.sum() - 1e-9


# --- names ----------------------------------------------------------------------------------------------------------


@given(st.lists(st.integers(0, 4), min_size=1, max_size=40), st.permutations(range(5)))
def test_renumbering_is_undone(labels: list[int], names: list[int]) -> None:
    renamed = np.array(names)[labels]
    assert (clustering.match_labels(renamed, labels) == labels).all()


# --- refusals -------------------------------------------------------------------------------------------------------

ROWS = np.arange(12.0).reshape(6, 2)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda b: clustering.spectral_embedding(b, 0), ValueError, "d must be at least 1; got 0"),
        (lambda b: clustering.spectral_embedding(b, 2.0), TypeError, "d must be an integer; got float"),
        (lambda b: clustering.spectral_embedding(b, 9), ValueError, "d must be at most 4.*compute more modes"),
        (lambda b: clustering.spectral_embedding(b, 2, weights="frequency"), ValueError, "weights must be one of 'gps', 'none'"),
        (lambda b: clustering.spectral_clusters(ROWS, 7), ValueError, "n_clusters must be between 1 and 6; got 7"),
        (lambda b: clustering.spectral_clusters(ROWS, 0), ValueError, "n_clusters must be between 1 and 6; got 0"),
        (lambda b: clustering.spectral_clusters(ROWS * np.nan, 2), ValueError, "rows must hold finite numbers"),
        (lambda b: clustering.spectral_clusters(ROWS[0], 2), ValueError, r"rows must have shape \(n, d\)"),
        (lambda b: clustering.spectral_clusters(ROWS, 2, mass=np.ones(5)), ValueError, r"mass must have shape \(6,\)"),
        (lambda b: clustering.spectral_clusters(ROWS, 2, mass=np.arange(6)), ValueError, "mass must be positive; found 0"),
        (lambda b: clustering.spectral_clusters(np.repeat(ROWS, 2, axis=0), 7), ValueError, "at most 6, the number of different rows; got 7"),
        (lambda b: clustering.normalized_cut(*graph_laplacian(path_graph(4)), [0, 0, 2, 2]), ValueError, "labels must leave no number out; no sample has 1"),
        (lambda b: clustering.normalized_cut(*graph_laplacian(path_graph(4)), [0, 0, 1]), ValueError, r"labels must have shape \(4,\)"),
        (lambda b: clustering.normalized_cut(*graph_laplacian(path_graph(4)), [0.0, 0, 1, 1]), TypeError, "labels must hold integers"),
        (lambda b: clustering.match_labels([0, 1], [0, 1, 1]), ValueError, r"labels must have shape \(3,\)"),
        (lambda b: clustering.match_labels([0, -1], [0, 1]), ValueError, "labels must lie in"),
    ],
)
def test_bad_input_is_refused_by_name(call: object, error: type[Exception], message: str) -> None:
    basis = compute_eigenbasis(*interval_laplacian(20), k=5)
    with pytest.raises(error, match=message):
        call(basis)  # type: ignore[operator]


def test_all_zero_spectrum_is_refused(three_spheres: TriangleMesh) -> None:
    basis = compute_eigenbasis(*cotan_laplacian(three_spheres), k=5)
    only_zero = replace(basis.truncate(3), evals=np.zeros(3))
    for call in (lambda: clustering.spectral_embedding(only_zero, 1), lambda: clustering.eigengaps(only_zero)):
        with pytest.raises(ValueError, match="at least 1 modes beyond the constants"):
            call()


def test_each_piece_gets_what_it_can_hold():
    """A tetrahedron has most of the area and four vertices: it takes four of nine clusters, the egg the others."""
    corners = 40.0 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    ball = shapes.sphere(2)
    faces = np.concatenate([[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], ball.faces + 4])
    L, M = cotan_laplacian(TriangleMesh(np.r_[corners, ball.vertices], faces))
    for n, of_the_first in ((2, 1), (5, 4), (9, 4)):
        labels = clustering.cut_pieces(L, M, n)
        assert np.unique(labels).tolist() == list(range(n))
        assert len(np.unique(labels[:4])) == of_the_first and not set(labels[:4]) & set(labels[4:])
    for n in (1, 4 + ball.n_vertices + 1):
        with pytest.raises(ValueError, match=f"n must be at least 2, the number of pieces .* at most 166.*; got {n}"):
            clustering.cut_pieces(L, M, n)
