"""Graphs: weights by hand, spectra in closed form, networkx as second opinion, and every promised error."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.manifold import spectral_embedding

from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.graphs import mesh_graph, neighbor_graph, path_graph, ring_graph, weights_of_networkx
from spectral_notes.laplacians import graph_laplacian
from spectral_notes.meshes import TriangleMesh, edges


def spectrum(W):
    return scipy.linalg.eigvalsh(graph_laplacian(W)[0].toarray())


@pytest.mark.parametrize("n", [3, 4, 17, 40])
def test_path_and_ring_have_their_closed_form_spectra(n):
    k = np.arange(n)
    np.testing.assert_allclose(spectrum(path_graph(n)), 2 - 2 * np.cos(np.pi * k / n), atol=1e-12)
    np.testing.assert_allclose(spectrum(ring_graph(n)), np.sort(2 - 2 * np.cos(2 * np.pi * k / n)), atol=1e-12)


def test_path_and_ring_are_those_of_networkx():
    for ours, theirs in ((path_graph(7), nx.path_graph(7)), (ring_graph(7), nx.cycle_graph(7))):
        np.testing.assert_array_equal(ours.toarray(), nx.to_numpy_array(theirs))


@settings(max_examples=25)
@given(st.integers(5, 40), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_neighbour_graph_joins_each_point_to_its_nearest(n, n_neighbors, seed):
    points = np.random.default_rng(seed).standard_normal((n, 2))
    W = neighbor_graph(points, n_neighbors).toarray()
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(distance, np.inf)
    chosen = np.zeros((n, n), dtype=bool)
    np.put_along_axis(chosen, np.argsort(distance, axis=1)[:, :n_neighbors], True, axis=1)
    width = np.median(distance[chosen])
    expected = np.where(chosen | chosen.T, np.exp(-(distance**2) / (2 * width**2)), 0.0)
    np.testing.assert_allclose(W, expected, atol=1e-12)


def test_repeated_points_are_joined_to_each_other_and_not_to_themselves():
    W = neighbor_graph([[0.0], [0.0], [0.0], [1.0]], 2, width=1.0).toarray()
    assert W.diagonal().tolist() == [0, 0, 0, 0]
    assert W[0, 1] == 1.0


def test_mesh_graph_has_the_edges_of_the_mesh(tetrahedron, unit_square):
    np.testing.assert_array_equal(mesh_graph(tetrahedron).toarray(), 1 - np.eye(4))
    W = mesh_graph(unit_square, weights="inverse_length").toarray()
    assert W[0, 2] == pytest.approx(1 / np.sqrt(2))
    assert W[1, 3] == 0.0
    assert (W > 0).sum() == 2 * len(edges(unit_square))


def test_networkx_graphs_keep_order_weights_and_loops():
    graph = nx.Graph()
    graph.add_nodes_from("cab")
    graph.add_edge("a", "b", weight=2.5)
    graph.add_edge("c", "a")
    graph.add_edge("b", "b", weight=9.0)
    assert weights_of_networkx(graph).toarray().tolist() == [[0, 1, 0], [1, 0, 2.5], [0, 2.5, 9]]
    assert weights_of_networkx(nx.empty_graph(2)).toarray().tolist() == [[0, 0], [0, 0]]
    karate = nx.karate_club_graph()
    ours = graph_laplacian(weights_of_networkx(karate))[0].toarray()
    np.testing.assert_array_equal(ours, nx.laplacian_matrix(karate).toarray())


def test_a_loop_counts_in_the_degree_of_normalised_cuts_as_in_networkx():
    graph = nx.path_graph(3)
    graph.add_edge(1, 1)
    L, M = graph_laplacian(weights_of_networkx(graph), mass="degree")
    evals = scipy.linalg.eigh(L.toarray(), M.toarray(), eigvals_only=True)
    np.testing.assert_allclose(evals, [0, 1, 5 / 3], atol=1e-12)
    np.testing.assert_allclose(evals, np.sort(nx.normalized_laplacian_spectrum(graph)), atol=1e-12)


def test_laplacian_eigenmaps_are_those_of_scikit_learn():
    W = neighbor_graph(np.random.default_rng(0).random((80, 2)), 8)
    ours = compute_eigenbasis(*graph_laplacian(W, mass="degree"), k=4).evecs[:, 1:]
    theirs = spectral_embedding(W.toarray(), n_components=3, eigen_solver="arpack", random_state=0)
    signs = np.sign(np.sum(ours * theirs, axis=0))
    scale = np.linalg.norm(ours, axis=0) / np.linalg.norm(theirs, axis=0)
    np.testing.assert_allclose(theirs * signs * scale, ours, atol=1e-8)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: path_graph(1), ValueError, "n must be at least 2; got 1"),
        (lambda: ring_graph(2), ValueError, "n must be at least 3; got 2"),
        (lambda: neighbor_graph([[0.0], [1.0]], 2), ValueError, "n_neighbors must be between 1 and 1; got 2"),
        (lambda: neighbor_graph([0.0, 1.0]), ValueError, r"points must have shape \(n, d\)"),
        (lambda: neighbor_graph([[0.0], [1.0]], 1, width=0), ValueError, "width must be greater than 0"),
        (lambda: neighbor_graph(np.zeros((4, 1)), 2), ValueError, "points must not coincide so often .* give a width"),
        (lambda: weights_of_networkx([[0, 1]]), TypeError, "graph must be a networkx graph; got list"),
        (lambda: weights_of_networkx(nx.DiGraph()), TypeError, "graph must be undirected"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_refusals_of_meshes(unit_square):
    with pytest.raises(ValueError, match="weights must be one of 'unit', 'inverse_length'; got 'cotan'"):
        mesh_graph(unit_square, weights="cotan")
    with pytest.raises(ValueError, match="mesh must have no edge of length zero where"):
        mesh_graph(TriangleMesh([[0, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 1, 2]]), weights="inverse_length")
