"""Graphs as symmetric matrices of edge weights W: path, ring, neighbours in space, mesh edges, networkx's graphs.

`graph_laplacian(W)` turns each of them into the pair (L, M) of the course.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats, as_number
from spectral_notes.meshes import TriangleMesh, edge_lengths, edges


def path_graph(n: int) -> sp.csr_array:
    """Return the weights of n vertices in a row, each joined to the next with weight 1.

    The eigenvalues of its Laplacian are 2 - 2 cos(pi k / n), k = 0 .. n - 1, and its modes the cosines of the DCT.

    Parameters
    ----------
    n : number of vertices, at least 2

    Returns
    -------
    W : (n, n) csr_array, symmetric, with zeros and ones

    Examples
    --------
    >>> path_graph(3).toarray().tolist()
    [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    """
    n = as_count("n", n, 2)
    return _weights(np.arange(n - 1), np.arange(1, n), np.ones(n - 1), n)


def ring_graph(n: int) -> sp.csr_array:
    """Return the weights of n vertices round a circle, each joined to both neighbours with weight 1.

    The eigenvalues of its Laplacian are 2 - 2 cos(2 pi k / n), k = 0 .. n - 1, and its modes the waves of the DFT.

    Parameters
    ----------
    n : number of vertices, at least 3

    Returns
    -------
    W : (n, n) csr_array, symmetric, with zeros and ones

    Examples
    --------
    >>> ring_graph(4).toarray()[0].tolist()
    [0.0, 1.0, 0.0, 1.0]
    """
    n = as_count("n", n, 3)
    return _weights(np.arange(n), (np.arange(n) + 1) % n, np.ones(n), n)


def neighbor_graph(points: ArrayLike, n_neighbors: int = 10, *, width: float | None = None) -> sp.csr_array:
    """Return Gaussian weights between each point and its nearest ones: W[i, j] = exp(-|x_i - x_j|^2 / (2 width^2)).

    Two points are joined when either is among the nearest of the other, which makes W symmetric.

    Parameters
    ----------
    points : (n, d), positions in a space of any dimension
    n_neighbors : nearest points each point chooses, 1 .. n - 1
    width : length at which weights fall off, positive; by default the median distance of chosen neighbours

    Returns
    -------
    W : (n, n) csr_array, symmetric, without loops; positive where joined

    Examples
    --------
    >>> neighbor_graph([[0.0], [1.0], [3.0]], 1, width=1.0).toarray().round(3).tolist()
    [[0.0, 0.607, 0.0], [0.607, 0.0, 0.135], [0.0, 0.135, 0.0]]
    """
    points = as_floats("points", points, ("n", "d"))
    n = len(points)
    n_neighbors = as_count("n_neighbors", n_neighbors, 1, n - 1)
    distances, chosen = cKDTree(points).query(points, n_neighbors + 1)
    i, j, d = np.repeat(np.arange(n), n_neighbors + 1), chosen.ravel(), distances.ravel()
    i, j, d = (array[i != j] for array in (i, j, d))  # a point is its own nearest, but not always the first of equals
    spread = float(np.median(d)) if width is None else as_number("width", width, above=0.0)
    if spread == 0.0:
        raise ValueError("points must not coincide so often that the median distance is zero; give a width")
    pairs, first = np.unique(np.sort(np.c_[i, j], axis=1), axis=0, return_index=True)
    return _weights(pairs[:, 0], pairs[:, 1], np.exp(-(d[first] ** 2) / (2 * spread**2)), n)


def mesh_graph(mesh: TriangleMesh, *, weights: str = "unit") -> sp.csr_array:
    """Return the weights of a mesh's edges: what is left of the mesh when only its connectivity counts.

    Parameters
    ----------
    mesh : with n vertices
    weights : {"unit", "inverse_length"}, 1 for each edge, or 1 / its length, which must not be zero

    Returns
    -------
    W : (n, n) csr_array, symmetric, without loops

    Examples
    --------
    >>> mesh_graph(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).toarray()[0].tolist()
    [0.0, 1.0, 1.0]
    """
    weights = as_choice("weights", weights, ("unit", "inverse_length"))
    i, j = edges(mesh).T
    values = np.ones(len(i))
    if weights == "inverse_length":
        lengths = edge_lengths(mesh)
        if not lengths.all():
            raise ValueError("mesh must have no edge of length zero where weights are 1 / length")
        values = 1.0 / lengths
    return _weights(i, j, values, mesh.n_vertices)


def weights_of_networkx(graph: Any, *, weight: str = "weight") -> sp.csr_array:
    """Return the weights of an undirected networkx graph, in the order of its nodes; 1 where an edge names none.

    Parameters
    ----------
    graph : networkx.Graph, not directed
    weight : name of the edge attribute that holds the weight

    Returns
    -------
    W : (n, n) csr_array, symmetric
        A loop stands on the diagonal, as in networkx's adjacency matrix, and counts in the degree.

    Examples
    --------
    >>> import networkx as nx
    >>> weights_of_networkx(nx.path_graph(3)).toarray().tolist()
    [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    """
    if not hasattr(graph, "is_directed") or not hasattr(graph, "edges"):
        raise TypeError(f"graph must be a networkx graph; got {type(graph).__name__}")
    if graph.is_directed():
        raise TypeError("graph must be undirected; graph.to_undirected() makes it so")
    number = {node: index for index, node in enumerate(graph)}
    rows = [(number[a], number[b], as_number(weight, value)) for a, b, value in graph.edges(data=weight, default=1.0)]
    i, j, values = (np.array(column) for column in zip(*rows, strict=True)) if rows else np.zeros((3, 0))
    return _weights(i.astype(np.int64), j.astype(np.int64), values, len(number))


def _weights(i: Any, j: Any, values: FloatArray, n: int) -> sp.csr_array:
    """Symmetric matrix of the given edges, each given once; a loop stands once on the diagonal."""
    back = i != j
    return sp.csr_array((np.r_[values, values[back]], (np.r_[i, j[back]], np.r_[j, i[back]])), (n, n))
