"""Filters without modes: against the modes, closed forms, SciPy's exponential and PyGSP; what is promised holds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import expm_multiply

from spectral_notes.diffusion import chebyshev_filter, filter_signal, stable_step
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.graphs import mesh_graph, neighbor_graph, path_graph, ring_graph
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian
from spectral_notes.shapes import sphere

POINTS = np.random.default_rng(0).random((60, 2))
W = neighbor_graph(POINTS, 5)
PAIR = graph_laplacian(W)
F = np.random.default_rng(1).normal(size=(60, 3))


@pytest.mark.parametrize("pair", [PAIR, graph_laplacian(W, mass="degree"), cotan_laplacian(sphere(1))])
def test_it_is_the_filter_of_the_modes(pair):
    basis = compute_eigenbasis(*pair, k=pair[0].shape[0])
    f, top = np.random.default_rng(2).normal(size=basis.n), basis.evals[-1]
    for response in (lambda x: np.exp(-3 * x / top), lambda x: 1 / (1 + x / top), np.ones_like):
        np.testing.assert_allclose(
            chebyshev_filter(*pair, f, response, 60), filter_signal(basis, f, response(basis.evals)), atol=1e-10
        )


@settings(max_examples=30)
@given(st.lists(st.floats(-2, 2), min_size=1, max_size=6), st.integers(0, 3))
def test_a_polynomial_is_met_exactly_from_its_degree_on(coefficients, more):
    L, degree = PAIR[0].toarray(), len(coefficients) - 1
    exact = sum(c * np.linalg.matrix_power(L, power) @ F for power, c in enumerate(coefficients))
    u = chebyshev_filter(*PAIR, F, lambda x: np.polynomial.polynomial.polyval(x, coefficients), degree + more)
    np.testing.assert_allclose(u, exact, atol=1e-9 * max(1.0, np.abs(exact).max()))


@settings(max_examples=30)
@given(st.integers(0, 12), st.integers(0, 24))
def test_a_value_is_felt_as_many_edges_far_as_the_degree(degree, start):
    u = chebyshev_filter(*graph_laplacian(path_graph(25)), np.eye(25)[start], lambda x: np.exp(-x), degree)
    assert (u[abs(np.arange(25) - start) > degree] == 0).all()


@settings(max_examples=20)
@given(st.floats(0.1, 10.0), st.permutations(range(60)))
def test_scale_and_order_of_the_vertices_make_no_difference(scale, order):
    u = chebyshev_filter(*PAIR, F, lambda x: np.exp(-x), 30)
    again = chebyshev_filter(scale * PAIR[0], PAIR[1], F, lambda x: np.exp(-x / scale), 30)
    np.testing.assert_allclose(again, u, atol=1e-10)
    P = np.array(order)
    moved = chebyshev_filter(PAIR[0][P][:, P], PAIR[1], F[P], lambda x: np.exp(-x), 30)
    np.testing.assert_allclose(moved, u[P], atol=1e-10)


def test_the_error_is_at_most_that_of_the_polynomial_and_falls_fast():
    L, M = graph_laplacian(ring_graph(64))
    basis = compute_eigenbasis(L, M, k=64)
    f, errors = F[:, 0].repeat(2)[:64], []
    for degree in (4, 8, 12, 16):
        exact = filter_signal(basis, f, np.exp(-2 * basis.evals))
        errors.append(np.linalg.norm(chebyshev_filter(L, M, f, lambda x: np.exp(-2 * x), degree) - exact))
    assert errors[0] > 1e-3 * np.linalg.norm(f)
    assert (np.divide(errors[1:], errors[:-1]) < [0.05, 0.01, 0.005]).all()


def test_heat_is_that_of_scipy_on_many_vertices():
    L, M = graph_laplacian(mesh_graph(sphere(4)))
    f = np.eye(L.shape[0])[7]
    u = chebyshev_filter(L, M, f, lambda x: np.exp(-2 * x), 50)
    np.testing.assert_allclose(u, expm_multiply(-2 * sp.csc_array(L), f), atol=1e-12)
    assert u.sum() == pytest.approx(1.0)


def test_pygsp_filters_the_same():
    pygsp = pytest.importorskip("pygsp")
    graph = pygsp.graphs.Graph(sp.csr_matrix(W))
    graph.estimate_lmax()
    heat = pygsp.filters.Heat(graph, scale=3.0)  # exp(-3 lambda / its estimate of the largest)
    theirs = heat.filter(F[:, 0], method="chebyshev", order=60)
    ours = chebyshev_filter(*PAIR, F[:, 0], lambda x: np.exp(-3.0 * x / graph.lmax), 60)
    np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_without_an_edge_only_the_gain_at_zero_counts():
    empty = (sp.csr_array((3, 3)), sp.eye_array(3, format="csr"))
    np.testing.assert_allclose(chebyshev_filter(*empty, [1.0, 2, 3], lambda x: 2 + x, 3), [2, 4, 6])
    assert stable_step(*empty) == np.inf


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"f": F[:5]}, ValueError, r"f must have shape \(60, d\); got \(5, 3\)"),
        ({"f": F * np.nan}, ValueError, "f must hold finite numbers"),
        ({"degree": -1}, ValueError, "degree must be at least 0; got -1"),
        ({"degree": 2.5}, TypeError, "degree must be an integer"),
        ({"response": np.ones(60)}, TypeError, "response must be a function of an array of eigenvalues; got ndarray"),
        ({"response": lambda x: 1.0}, ValueError, r"response\(evals\) must have shape \(9,\); got \(\)"),
        ({"response": lambda x: x + np.inf}, ValueError, r"response\(evals\) must hold finite numbers"),
        ({"response": lambda x: 1j * x}, TypeError, r"response\(evals\) must be an array of real numbers"),
        ({"M": cotan_laplacian(sphere(1), mass="full")[1]}, ValueError, "M must"),
        ({"M": W}, ValueError, r"M must be diagonal and positive \(mass='lumped'\)"),
        ({"L": np.triu(W.toarray())}, ValueError, "L must be symmetric"),
    ],
)
def test_refusals(change, error, message):
    given = {"L": PAIR[0], "M": PAIR[1], "f": F, "response": lambda x: np.exp(-x), "degree": 8}
    with pytest.raises(error, match=message):
        chebyshev_filter(**(given | change))
