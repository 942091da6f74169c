"""Bad input: for every public name, what strangers bring, and the promised error or the promised result.

A row is the public name, what is wrong, the call, and either an error with its message (argument, expectation, and the
remedy where there is one) or a check of the result. `test_every_public_name_is_covered` keeps the table whole.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
import pytest
import scipy.sparse as sp

import spectral_notes
from spectral_notes import (
    Eigenbasis,
    PointCloud,
    PoissonSolver,
    SurfaceView,
    TriangleMesh,
    angle_defects,
    arrows_of_rows,
    boundary_mass_matrix,
    boundary_vertices,
    clean_mesh,
    compression,
    compute_eigenbasis,
    cotan_laplacian,
    divergence_matrix,
    functional_map,
    gaussian_curvature,
    geodesic_distances,
    gradient_matrix,
    graph_laplacian,
    health,
    interval_laplacian,
    mass_matrix,
    match_shapes,
    mean_curvature,
    mesh_graph,
    neighbor_graph,
    parallel_transport,
    path_graph,
    plot_matrix,
    plot_modes,
    plot_surfaces,
    plot_views,
    point_map,
    read_mesh,
    read_shape,
    restrict_to,
    ring_graph,
    robust_cloud_laplacian,
    robust_mesh_laplacian,
    rows_of_arrows,
    shapes,
    solve_poisson,
    spectral_clusters,
    spectral_embedding,
    tetrahedral_laplacian,
    weights_of_networkx,
    write_arrays,
    write_mesh,
)
from spectral_notes.command import cli

WITHOUT_INPUT = {"use_house_style"}


# --- what strangers bring --------------------------------------------------------------------------------------------

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = TriangleMesh(CORNERS, HALVES, name="square")
TWO_SQUARES = TriangleMesh(np.r_[CORNERS, CORNERS + 5], np.r_[HALVES, HALVES + 4])
LONE_VERTEX = TriangleMesh(np.r_[CORNERS, [[9, 9, 9]]], HALVES)
FLAT_FACE = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
POINT = TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]])
DOUBLED = TriangleMesh(CORNERS, [[0, 1, 2], [0, 1, 2], [0, 2, 3]])
FLIPPED = TriangleMesh(CORNERS, [[0, 1, 2], [0, 3, 2]])
THREE_SHEETS = TriangleMesh([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
BOW_TIE = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], [[0, 1, 2], [0, 3, 4]])
SPHERE = shapes.sphere(2)
L, M = cotan_laplacian(SPHERE)
BASIS = compute_eigenbasis(L, M, 6)
PATH_BASIS = compute_eigenbasis(*graph_laplacian(path_graph(9)), 4)
CLOUD = PointCloud(SPHERE.vertices)
IDENTITY = sp.csr_array(np.eye(5))
NO_MESH = r"mesh must be a TriangleMesh; got tuple. TriangleMesh\(vertices, faces\) makes one of two arrays"
NO_AREA = "mesh must have no face without area; 1 "
LONE = r"mesh must have no vertex without a face; 1 have none, the first is vertex 4. clean_mesh drops them"
ARRAYS: Any = (CORNERS, HALVES)


class Row(NamedTuple):
    """One row of the table: a public name, what is wrong, the call, and the error or the result that is promised."""

    name: str
    fault: str
    call: Callable[[], Any]
    error: type[Exception]
    message: str


class Kept(NamedTuple):
    """A row whose input is odd but right: the result is promised."""

    name: str
    oddity: str
    call: Callable[[], Any]
    holds: Callable[[Any], Any]


REFUSED = [
    Row("TriangleMesh", "NaN", lambda: TriangleMesh([[0, 0, np.nan]] * 3, [[0, 1, 2]]), ValueError, r"vertices must hold finite numbers; found nan at index \(0, 2\)"),
    Row("TriangleMesh", "infinite", lambda: TriangleMesh([[0, 0, -np.inf]] * 3, [[0, 1, 2]]), ValueError, "vertices must hold finite numbers; found -inf"),
    Row("TriangleMesh", "areas overflow", lambda: TriangleMesh(1e200 * CORNERS, HALVES), ValueError, r"vertices must lie within 1e\+50 of the origin; found 1e\+200: choose another unit"),
    Row("TriangleMesh", "words", lambda: TriangleMesh([["a"] * 3] * 3, [[0, 1, 2]]), TypeError, "vertices must be an array of real numbers; got dtype <U1"),
    Row("TriangleMesh", "complex", lambda: TriangleMesh(1j * CORNERS, HALVES), TypeError, "vertices must be an array of real numbers; got dtype complex128"),
    Row("TriangleMesh", "ragged", lambda: TriangleMesh([[0, 0, 0], [1]], HALVES), TypeError, "vertices must be an array of numbers; got rows of different lengths"),
    Row("TriangleMesh", "in the plane", lambda: TriangleMesh(CORNERS[:, :2], HALVES), ValueError, r"vertices must have shape \(n, 3\); got \(4, 2\)"),
    Row("TriangleMesh", "quadrilaterals", lambda: TriangleMesh(CORNERS, [[0, 1, 2, 3]]), ValueError, r"faces must have shape \(m, 3\); got \(1, 4\)"),
    Row("TriangleMesh", "negative index", lambda: TriangleMesh(CORNERS, [[0, 1, -1]]), ValueError, "faces must lie in 0 .. 3; found -1"),
    Row("TriangleMesh", "index out of range", lambda: TriangleMesh(CORNERS, [[0, 1, 4]]), ValueError, "faces must lie in 0 .. 3; found 4"),
    Row("TriangleMesh", "float indices", lambda: TriangleMesh(CORNERS, [[0.0, 1, 2]]), TypeError, "faces must hold integers; got dtype float64"),
    Row("TriangleMesh", "vertex twice", lambda: TriangleMesh(CORNERS, [[0, 1, 1]]), ValueError, r"faces must name three different vertices each; 1 do not.*clean_mesh\(vertices, faces\) drops them"),
    Row("TriangleMesh", "no face", lambda: TriangleMesh(CORNERS, np.zeros((0, 3), dtype=int)), ValueError, "faces must hold at least one triangle; for points alone use PointCloud"),
    Row("TriangleMesh", "name", lambda: TriangleMesh(CORNERS, HALVES, name=3), TypeError, "name must be a string; got int"),
    Row("PointCloud", "empty", lambda: PointCloud(np.zeros((0, 3))), ValueError, "points must hold at least one point"),
    Row("PointCloud", "shape", lambda: PointCloud([1.0, 2.0, 3.0]), ValueError, r"points must have shape \(n, 3\); got \(3,\)"),
    Row("PointCloud", "too far", lambda: PointCloud([[1e51, 0, 0]]), ValueError, "points must lie within"),
    Row("clean_mesh", "all vertices coincide", lambda: clean_mesh(np.zeros((3, 3)), [[0, 1, 2]]), ValueError, "faces must hold at least one triangle"),
    Row("clean_mesh", "index out of range", lambda: clean_mesh(CORNERS, [[0, 1, 7]]), ValueError, "faces must lie in 0 .. 3; found 7"),
    Row("health", "no mesh", lambda: health(ARRAYS), TypeError, NO_MESH),
    Row("health", "negative angle", lambda: health(SQUARE, sliver_angle=-1), ValueError, "sliver_angle must be greater than 0; got -1"),
    Row("path_graph", "one vertex", lambda: path_graph(1), ValueError, "n must be at least 2; got 1"),
    Row("path_graph", "fraction", lambda: path_graph(2.5), TypeError, "n must be an integer; got float"),
    Row("ring_graph", "two vertices", lambda: ring_graph(2), ValueError, "n must be at least 3; got 2"),
    Row("neighbor_graph", "no neighbours", lambda: neighbor_graph(CORNERS, 0), ValueError, "n_neighbors must be between 1 and 3; got 0"),
    Row("neighbor_graph", "more than there are", lambda: neighbor_graph(CORNERS, 4), ValueError, "n_neighbors must be between 1 and 3; got 4"),
    Row("neighbor_graph", "one point", lambda: neighbor_graph([[0.0, 0]], 1), ValueError, "n_neighbors must be at least 1, but only 0 can be had here: give more data"),
    Row("neighbor_graph", "points coincide", lambda: neighbor_graph(np.zeros((5, 3)), 2), ValueError, "points must not coincide so often .*; give a width"),
    Row("neighbor_graph", "negative width", lambda: neighbor_graph(CORNERS, 2, width=-1), ValueError, "width must be greater than 0; got -1"),
    Row("mesh_graph", "no mesh", lambda: mesh_graph(ARRAYS), TypeError, NO_MESH),
    Row("mesh_graph", "weights", lambda: mesh_graph(SQUARE, weights="cotan"), ValueError, "weights must be one of 'unit', 'inverse_length'; got 'cotan'"),
    Row("mesh_graph", "edge without length", lambda: mesh_graph(POINT, weights="inverse_length"), ValueError, "mesh must have no edge of length zero"),
    Row("weights_of_networkx", "directed", lambda: weights_of_networkx(nx.DiGraph([(0, 1)])), TypeError, r"graph must be undirected; graph.to_undirected\(\) makes it so"),
    Row("weights_of_networkx", "NaN", lambda: weights_of_networkx(nx.Graph([(0, 1, {"weight": np.nan})])), ValueError, "weight must be finite; got nan"),
    Row("weights_of_networkx", "word", lambda: weights_of_networkx(nx.Graph([(0, 1, {"weight": "far"})])), TypeError, "weight must be a real number; got str"),
    Row("weights_of_networkx", "dict", lambda: weights_of_networkx({0: [1]}), TypeError, "graph must be a networkx graph; got dict"),
    Row("interval_laplacian", "two samples", lambda: interval_laplacian(2), ValueError, "n must be at least 3; got 2"),
    Row("interval_laplacian", "negative length", lambda: interval_laplacian(5, -1.0), ValueError, "length must be greater than 0; got -1"),
    Row("interval_laplacian", "ends", lambda: interval_laplacian(5, ends="free"), ValueError, "ends must be one of 'periodic', 'dirichlet', 'neumann'; got 'free'"),
    Row("graph_laplacian", "NaN", lambda: graph_laplacian([[0, np.nan], [np.nan, 0]]), ValueError, "W must hold finite numbers"),
    Row("graph_laplacian", "not symmetric", lambda: graph_laplacian([[0, 1], [0, 0]]), ValueError, "W must be symmetric; it differs from its transpose by 1"),
    Row("graph_laplacian", "negative weight", lambda: graph_laplacian([[0, -1], [-1, 0]]), ValueError, "W must hold no negative weight; the smallest is -1"),
    Row("graph_laplacian", "isolated", lambda: graph_laplacian(np.zeros((2, 2)), mass="degree"), ValueError, "W must give every vertex an edge when mass='degree'; vertex 0 has none"),
    Row("graph_laplacian", "three axes", lambda: graph_laplacian(np.zeros((2, 2, 2))), ValueError, r"W must be square; got shape \(2, 2, 2\)"),
    Row("cotan_laplacian", "no mesh", lambda: cotan_laplacian(ARRAYS), TypeError, NO_MESH),
    Row("cotan_laplacian", "degenerate face", lambda: cotan_laplacian(FLAT_FACE), ValueError, rf"{NO_AREA}.*robust_mesh_laplacian\(mesh\) works on such meshes"),
    Row("cotan_laplacian", "vertex without a face", lambda: cotan_laplacian(LONE_VERTEX), ValueError, LONE),
    Row("cotan_laplacian", "mass", lambda: cotan_laplacian(SQUARE, mass="barycentric"), ValueError, "mass must be one of 'lumped', 'voronoi', 'full'; got 'barycentric'"),
    Row("robust_mesh_laplacian", "no mesh", lambda: robust_mesh_laplacian(ARRAYS), TypeError, NO_MESH),
    Row("robust_mesh_laplacian", "vertex without a face", lambda: robust_mesh_laplacian(LONE_VERTEX), ValueError, LONE),
    Row("robust_mesh_laplacian", "a point", lambda: robust_mesh_laplacian(POINT), ValueError, "mesh must not be a point, nor so small that its areas vanish"),
    Row("robust_cloud_laplacian", "a mesh", lambda: robust_cloud_laplacian(SQUARE), TypeError, r"cloud must be a PointCloud; got TriangleMesh.*for a mesh, robust_mesh_laplacian"),
    Row("robust_cloud_laplacian", "points coincide", lambda: robust_cloud_laplacian(PointCloud(np.zeros((50, 3)))), ValueError, "cloud must lie on a surface; it holds 1 different points"),
    Row("robust_cloud_laplacian", "no area in numbers", lambda: robust_cloud_laplacian(PointCloud(1e-170 * SPHERE.vertices)), ValueError, "areas that numbers can hold; .* change its unit"),
    Row("robust_cloud_laplacian", "on a line", lambda: robust_cloud_laplacian(PointCloud(np.c_[np.arange(50.0), np.zeros((50, 2))])), ValueError, "no triangle was found at 50 points, the first is point 0: .* on a line. A larger n_neighbors"),
    Row("robust_cloud_laplacian", "too few points", lambda: robust_cloud_laplacian(PointCloud(CORNERS)), ValueError, "n_neighbors must be between 3 and 3; got 30"),
    Row("tetrahedral_laplacian", "triangles", lambda: tetrahedral_laplacian(np.eye(3), [[0, 1, 2]]), ValueError, r"tets must have shape \(m, 4\); got \(1, 3\)"),
    Row("tetrahedral_laplacian", "flat places", lambda: tetrahedral_laplacian(np.eye(4), [[0, 1, 2, 3]]), ValueError, r"vertices must have shape \(n, 3\); got \(4, 4\)"),
    Row("tetrahedral_laplacian", "NaN", lambda: tetrahedral_laplacian(CORNERS * np.nan, [[0, 1, 2, 3]]), ValueError, "vertices must hold finite numbers"),
    Row("tetrahedral_laplacian", "no such corner", lambda: tetrahedral_laplacian(CORNERS, [[0, 1, 2, 4]]), ValueError, r"tets must lie in 0 .. 3; found 4"),
    Row("tetrahedral_laplacian", "no volume", lambda: tetrahedral_laplacian(CORNERS, [[0, 1, 2, 3]]), ValueError, "tets must have a volume; 1 have none, the first is tetrahedron 0: drop them"),
    Row("tetrahedral_laplacian", "a corner twice", lambda: tetrahedral_laplacian(np.r_[np.zeros((1, 3)), np.eye(3)], [[0, 1, 2, 3], [1, 2, 3, 3]]), ValueError, "1 have none, the first is tetrahedron 1"),
    Row("tetrahedral_laplacian", "none", lambda: tetrahedral_laplacian(np.eye(3), np.zeros((0, 4), dtype=int)), ValueError, "tets must use every vertex; 3 have none, the first is vertex 0: drop them"),
    Row("tetrahedral_laplacian", "mass", lambda: tetrahedral_laplacian(np.r_[np.zeros((1, 3)), np.eye(3)], [[0, 1, 2, 3]], mass="voronoi"), ValueError, "mass must be one of 'lumped', 'full'; got 'voronoi'"),
    Row("mass_matrix", "no mesh", lambda: mass_matrix(ARRAYS), TypeError, NO_MESH),
    Row("mass_matrix", "vertex without a face", lambda: mass_matrix(LONE_VERTEX), ValueError, LONE),
    Row("mass_matrix", "vertex without area", lambda: mass_matrix(FLAT_FACE), ValueError, "mesh must have a face with an area at every vertex; those of vertex 2 have none"),
    Row("mass_matrix", "kind", lambda: mass_matrix(SQUARE, kind="mixed"), ValueError, "kind must be one of 'lumped', 'voronoi', 'full'; got 'mixed'"),
    Row("gradient_matrix", "no mesh", lambda: gradient_matrix(ARRAYS), TypeError, NO_MESH),
    Row("gradient_matrix", "degenerate face", lambda: gradient_matrix(FLAT_FACE), ValueError, NO_AREA),
    Row("divergence_matrix", "no mesh", lambda: divergence_matrix(ARRAYS), TypeError, NO_MESH),
    Row("divergence_matrix", "degenerate face", lambda: divergence_matrix(FLAT_FACE), ValueError, NO_AREA),
    Row("arrows_of_rows", "length", lambda: arrows_of_rows(np.zeros(4)), ValueError, "stacked must have a length that three divides; got 4"),
    Row("rows_of_arrows", "shape", lambda: rows_of_arrows(np.zeros((3, 2))), ValueError, r"arrows must have shape \(m, 3\); got \(3, 2\)"),
    Row("boundary_vertices", "no mesh", lambda: boundary_vertices(ARRAYS), TypeError, NO_MESH),
    Row("boundary_mass_matrix", "no mesh", lambda: boundary_mass_matrix(ARRAYS), TypeError, NO_MESH),
    Row("boundary_mass_matrix", "closed", lambda: boundary_mass_matrix(SPHERE), ValueError, "mesh must have a boundary edge, with both ends among the vertices; it has none"),
    Row("boundary_mass_matrix", "one end", lambda: boundary_mass_matrix(SQUARE, vertices=[0, 2]), ValueError, "mesh must have a boundary edge, with both ends among the vertices"),
    Row("boundary_mass_matrix", "mask", lambda: boundary_mass_matrix(SQUARE, vertices=np.ones(4, dtype=bool)), TypeError, "vertices must hold integers; got dtype bool"),
    Row("restrict_to", "twice", lambda: restrict_to(L, M, [1, 1]), ValueError, "keep must name at least one vertex, and each one once"),
    Row("restrict_to", "none", lambda: restrict_to(L, M, []), ValueError, "keep must name at least one vertex"),
    Row("restrict_to", "negative index", lambda: restrict_to(L, M, [-1]), ValueError, "keep must lie in 0 .. 161; found -1"),
    Row("restrict_to", "mask", lambda: restrict_to(L, M, np.ones(162, dtype=bool)), TypeError, "keep must hold integers; got dtype bool"),
    Row("PoissonSolver", "not symmetric", lambda: PoissonSolver(np.triu(np.ones((5, 5))), IDENTITY), ValueError, "L must be symmetric; it differs from its transpose by 1"),
    Row("PoissonSolver", "libigl's sign", lambda: PoissonSolver(-L, M, [0]), ValueError, "L must be positive semidefinite.*turn it"),
    Row("PoissonSolver", "screening", lambda: PoissonSolver(L, M, screening=-1.0), ValueError, "screening must be at least 0; got -1"),
    Row("PoissonSolver", "mask", lambda: PoissonSolver(L, M, np.ones(162, dtype=bool)), TypeError, "fixed must hold integers; got dtype bool"),
    Row("PoissonSolver", "out of range", lambda: PoissonSolver(L, M, [162]), ValueError, "fixed must lie in 0 .. 161; found 162"),
    Row("solve_poisson", "no drain", lambda: solve_poisson(L, M, np.ones(162)), ValueError, r"the source must integrate to zero where nothing ties u down; its mean is 1. remove_mean=True takes it away, fixed=\[...\] gives it a drain"),
    Row("solve_poisson", "load without drain", lambda: solve_poisson(L, M, load=np.ones((162, 2))), ValueError, "the source must integrate to zero"),
    Row("solve_poisson", "load", lambda: solve_poisson(L, M, np.zeros(162), load=np.zeros((162, 2))), ValueError, r"load must have shape \(162,\); got \(162, 2\)"),
    Row("solve_poisson", "values of nothing", lambda: solve_poisson(L, M, values=[1.0]), ValueError, r"values must have shape \(0,\); got \(1,\)"),
    Row("solve_poisson", "size", lambda: solve_poisson(L, M, np.zeros(4)), ValueError, r"f must have shape \(162,\); got \(4,\)"),
    Row("solve_poisson", "components", lambda: solve_poisson(*cotan_laplacian(TWO_SQUARES), np.zeros(8)), ValueError, "fixed must name a vertex of each component; 2 of 2 have none"),
    Row("solve_poisson", "one free component", lambda: solve_poisson(*cotan_laplacian(TWO_SQUARES), np.ones(8), fixed=[0]), ValueError, "fixed must name a vertex of each component; 1 of 2 have none"),
    Row("solve_poisson", "values", lambda: solve_poisson(L, M, np.zeros(162), fixed=[0], values=[1, 2]), ValueError, r"values must have shape \(1,\); got \(2,\)"),
    Row("solve_poisson", "two values", lambda: solve_poisson(L, M, np.zeros(162), fixed=[0, 0], values=[1, 2]), ValueError, "fixed must name each vertex once"),
    Row("angle_defects", "no mesh", lambda: angle_defects(ARRAYS), TypeError, NO_MESH),
    Row("gaussian_curvature", "vertex without a face", lambda: gaussian_curvature(LONE_VERTEX), ValueError, LONE),
    Row("gaussian_curvature", "vertex without area", lambda: gaussian_curvature(FLAT_FACE), ValueError, "mesh must have a face with an area at every vertex"),
    Row("gaussian_curvature", "mass", lambda: gaussian_curvature(SQUARE, mass="full"), ValueError, "mass must be one of 'voronoi', 'lumped'; got 'full'"),
    Row("mean_curvature", "mass", lambda: mean_curvature(SQUARE, mass="full"), ValueError, "mass must be one of 'voronoi', 'lumped'; got 'full'"),
    Row("mean_curvature", "degenerate face", lambda: mean_curvature(FLAT_FACE), ValueError, NO_AREA),
    Row("geodesic_distances", "no mesh", lambda: geodesic_distances(ARRAYS, [0]), TypeError, NO_MESH),
    Row("geodesic_distances", "no source", lambda: geodesic_distances(SQUARE, []), ValueError, "sources must name at least one vertex"),
    Row("geodesic_distances", "out of range", lambda: geodesic_distances(SQUARE, [4]), ValueError, "sources must lie in 0 .. 3; found 4"),
    Row("parallel_transport", "no path", lambda: parallel_transport(SQUARE, [], [1, 0, 0]), ValueError, "path must name at least one face"),
    Row("parallel_transport", "a jump", lambda: parallel_transport(BOW_TIE, [0, 1], [1, 0, 0]), ValueError, "path must go from face to neighbouring face; 0 and 1 share no single edge"),
    Row("parallel_transport", "flat face", lambda: parallel_transport(FLAT_FACE, [0, 1], [1, 0, 0]), ValueError, "path must name .* only faces with an area"),
    Row("parallel_transport", "arrow", lambda: parallel_transport(SQUARE, [0], [1, 0]), ValueError, r"arrow must have shape \(3,\); got \(2,\)"),
    Row("Eigenbasis", "sizes", lambda: Eigenbasis(np.zeros(3), np.zeros((5, 4)), IDENTITY), ValueError, r"evecs must have shape \(n, 3\); got \(5, 4\)"),
    Row("Eigenbasis", "analyze another size", lambda: BASIS.analyze(np.zeros(5)), ValueError, r"f must have shape \(162,\); got \(5,\)"),
    Row("Eigenbasis", "synthesize another size", lambda: BASIS.synthesize(np.zeros(99)), ValueError, r"c must have shape \(6,\); got \(99,\)"),
    Row("Eigenbasis", "truncate to nothing", lambda: BASIS.truncate(0), ValueError, "k must be between 1 and 6; got 0"),
    Row("compute_eigenbasis", "k = 0", lambda: compute_eigenbasis(L, M, 0), ValueError, "k must be between 1 and 162; got 0"),
    Row("compute_eigenbasis", "k > n", lambda: compute_eigenbasis(L, M, 163), ValueError, "k must be between 1 and 162; got 163"),
    Row("compute_eigenbasis", "libigl's sign, small", lambda: compute_eigenbasis(-L, M, 3), ValueError, "L must be positive semidefinite; it has the eigenvalue -"),
    Row("compute_eigenbasis", "libigl's sign, large", lambda: compute_eigenbasis(-cotan_laplacian(shapes.sphere(3))[0], mass_matrix(shapes.sphere(3)), 3), ValueError, r"is its sign that of libigl \(turn it\)"),
    Row("compute_eigenbasis", "mismatched sizes", lambda: compute_eigenbasis(L, IDENTITY, 3), ValueError, r"M must have shape \(162, 162\); got \(5, 5\)"),
    Row("compute_eigenbasis", "negative mass", lambda: compute_eigenbasis(L, -M, 3), ValueError, "M must be positive definite; its diagonal holds"),
    Row("compute_eigenbasis", "zero mass", lambda: compute_eigenbasis(L, 0 * M, 3), ValueError, r"is it a vertex that no face uses \(clean_mesh removes it\)\?"),
    Row("compute_eigenbasis", "singular full mass", lambda: compute_eigenbasis(IDENTITY, np.ones((5, 5)), 2), ValueError, "M must be positive definite"),
    Row("compute_eigenbasis", "NaN", lambda: compute_eigenbasis(np.nan * L, M, 3), ValueError, "L must hold finite numbers"),
    Row("compute_eigenbasis", "empty", lambda: compute_eigenbasis(sp.csr_array((0, 0)), sp.csr_array((0, 0)), 1), ValueError, "k must be at least 1, but only 0 can be had here"),
    Row("compute_eigenbasis", "negative tolerance", lambda: compute_eigenbasis(L, M, 3, tol=-1), ValueError, "tol must be greater than 0; got -1"),
    Row("compute_eigenbasis", "factor", lambda: compute_eigenbasis(L, M, 3, factor="qr"), ValueError, "factor must be one of .*; got 'qr'"),
    Row("spectral_embedding", "more than the basis has", lambda: spectral_embedding(BASIS, 6), ValueError, "d must be at most 5, the modes that the basis offers; got 6: compute more modes"),
    Row("spectral_embedding", "no dimension", lambda: spectral_embedding(BASIS, 0), ValueError, "d must be at least 1; got 0"),
    Row("spectral_clusters", "more than rows", lambda: spectral_clusters(np.eye(4), 5), ValueError, "n_clusters must be between 1 and 4; got 5"),
    Row("spectral_clusters", "rows coincide", lambda: spectral_clusters(np.zeros((5, 2)), 2), ValueError, "n_clusters must be at most 1, the number of different rows; got 2"),
    Row("spectral_clusters", "NaN", lambda: spectral_clusters([[np.nan, 0]], 1), ValueError, r"rows must hold finite numbers; found nan at index \(0, 0\)"),
    Row("functional_map", "number of vertices", lambda: functional_map(BASIS, BASIS, [0, 1]), ValueError, r"p2p_21 must have shape \(162,\); got \(2,\)"),
    Row("functional_map", "index out of range", lambda: functional_map(BASIS, BASIS, np.full(162, 162)), ValueError, "p2p_21"),
    Row("functional_map", "not whole", lambda: functional_map(BASIS, BASIS, np.full(162, 0.5)), TypeError, "p2p_21 must hold integers"),
    Row("functional_map", "from 1 to 2", lambda: functional_map(BASIS, PATH_BASIS, np.zeros(162, dtype=int)), ValueError, "looks like a map from 1 to 2. Swap the shapes"),
    Row("point_map", "C_21", lambda: point_map(BASIS, BASIS.truncate(3), np.eye(6)[:, :3]), ValueError, "it looks like C_21. Swap the shapes"),
    Row("point_map", "NaN", lambda: point_map(BASIS, BASIS, np.full((2, 2), np.nan)), ValueError, "C_12 must hold finite numbers"),
    Row("point_map", "side", lambda: point_map(BASIS, BASIS, np.eye(3), side="left"), ValueError, "side must be"),
    Row("match_shapes", "several components", lambda: match_shapes(SPHERE, TWO_SQUARES), ValueError, "mesh_2 must be connected; it has 2 components. Match them one by one"),
    Row("match_shapes", "landmark out of range", lambda: match_shapes(SPHERE, SPHERE, [[0, 162]]), ValueError, "landmarks"),
    Row("match_shapes", "k", lambda: match_shapes(SPHERE, SPHERE, k=163), ValueError, "k must be between 8 and 162; got 163"),
    Row("spectral_clusters", "mass", lambda: spectral_clusters(np.eye(4), 2, mass=[-1, 1, 1, 1]), ValueError, "mass must be positive; found -1"),
    Row("SurfaceView", "no surface", lambda: SurfaceView(ARRAYS), TypeError, "surface must be a TriangleMesh or a PointCloud; got tuple"),
    Row("SurfaceView", "size of values", lambda: SurfaceView(SQUARE, np.zeros(3)), ValueError, r"values must hold one number per vertex or face, \(4, 2\); got 3"),
    Row("SurfaceView", "NaN", lambda: SurfaceView(SQUARE, [0, 0, np.nan, 0]), ValueError, "values must hold finite numbers; found nan"),
    Row("SurfaceView", "limits", lambda: SurfaceView(SQUARE, limits=(1, 0)), ValueError, r"limits must be \(low, high\); got \(1, 0\)"),
    Row("SurfaceView", "arrows", lambda: SurfaceView(SQUARE, arrows=(CORNERS, CORNERS[:2])), ValueError, r"arrows' vectors must have shape \(4, 3\); got \(2, 3\)"),
    Row("plot_matrix", "empty", lambda: plot_matrix(np.zeros((0, 0))), ValueError, r"A must hold at least one number; got shape \(0, 0\)"),
    Row("plot_matrix", "vector", lambda: plot_matrix([1.0, 2.0]), ValueError, r"A must have shape \(m, n\); got \(2,\)"),
    Row("plot_surfaces", "nothing", lambda: plot_surfaces(None), TypeError, "surfaces must be a TriangleMesh, a PointCloud or several; got NoneType"),
    Row("plot_surfaces", "titles", lambda: plot_surfaces(SQUARE, titles=["a", "b"]), ValueError, "titles must hold one text for each of the 1 pictures; got 2"),
    Row("plot_surfaces", "no column", lambda: plot_surfaces(SQUARE, n_columns=0), ValueError, "n_columns must be at least 1; got 0"),
    Row("plot_modes", "beyond the basis", lambda: plot_modes(SPHERE, BASIS, [6]), ValueError, "modes must be between 0 and 5; got 6"),
    Row("plot_modes", "another mesh", lambda: plot_modes(SQUARE, BASIS, [1]), ValueError, r"values must hold one number per vertex or face, \(4, 2\); got 162"),
    Row("plot_modes", "no basis", lambda: plot_modes(SPHERE, BASIS.evecs, [1]), TypeError, r"basis must be an? Eigenbasis; got ndarray. compute_eigenbasis\(L, M, k\) returns one"),
    Row("plot_views", "none", lambda: plot_views([]), ValueError, "views must hold at least one view"),
    Row("plot_views", "a mesh", lambda: plot_views([SQUARE]), TypeError, r"views must be a SurfaceView; got TriangleMesh. SurfaceView\(mesh, values\) makes one"),
    Row("read_mesh", "ending", lambda: read_mesh("shape.blend"), ValueError, "path must end in one of .*; got '.blend'"),
    Row("read_mesh", "missing", lambda: read_mesh("no such.obj"), FileNotFoundError, "path must name an existing file"),
    Row("read_shape", "ending", lambda: read_shape("shape.blend"), ValueError, "path must end in one of .*.xyz.*; got '.blend'"),
    Row("read_shape", "missing", lambda: read_shape("no such.xyz"), FileNotFoundError, "path must name an existing file"),
    Row("write_arrays", "no shape", lambda: write_arrays("shape.vtp", ARRAYS, {}), TypeError, "shape must be a TriangleMesh; got tuple"),
    Row("write_arrays", "too short", lambda: write_arrays("shape.vtp", SQUARE, {"f": [1.0, 2]}), ValueError, r"f must have shape \(4,\); got \(2,\)"),
    Row("write_mesh", "no mesh", lambda: write_mesh("shape.obj", ARRAYS), TypeError, "mesh must be a TriangleMesh; got tuple"),
    Row("write_mesh", "folder", lambda: write_mesh("no such folder/shape.obj", SQUARE), FileNotFoundError, "path must be in an existing folder"),
    Row("shapes.person", "name", lambda: shapes.person("giant"), ValueError, "name must be one of 'average', .*'round'; got 'giant'"),
    Row("shapes.person", "pose", lambda: shapes.person("tall", "sit"), ValueError, "pose must be one of 'stand', 'walk', 'reach'; got 'sit'"),
    Row("shapes.person_segments", "path", lambda: shapes.person_segments("../person_tall"), ValueError, "name must be one of"),
    Row("shapes.person_segments", "pose", lambda: shapes.person_segments("tall", None), ValueError, "pose must be one of 'stand', 'walk', 'reach'; got None"),
    Row("shapes.person_correspondence", "name", lambda: shapes.person_correspondence("tall", "walk", "giant", "walk"), ValueError, "name_2 must be one of .*; got 'giant'"),
    Row("shapes.person_correspondence", "pose", lambda: shapes.person_correspondence("tall", "fly", "short", "walk"), ValueError, "pose_1 must be one of .*; got 'fly'"),
    Row("compression.encode", "no mesh", lambda: compression.encode(ARRAYS, error=1), TypeError, NO_MESH),
    Row("compression.encode", "no extent", lambda: compression.encode(POINT, error=1), ValueError, "mesh must have an extent between"),
    Row("compression.encode", "two targets", lambda: compression.encode(SQUARE, error=1, bits_per_vertex=1), ValueError, "give exactly one of error and bits_per_vertex"),
    Row("compression.decode", "path", lambda: compression.decode("shape.sgn"), TypeError, "data must be bytes; got str"),
    Row("compression.decode", "another format", lambda: compression.decode(b"ply\n"), ValueError, "data does not start with 'SGN': not a file of this format"),
    Row("compression.describe", "cut", lambda: compression.describe(compression.encode(SQUARE, error=1)[:-3]), ValueError, "data does not match its checksum: bytes were changed or are missing"),
]

KEPT = [
    Kept("clean_mesh", "duplicates, soup, unused vertices", lambda: clean_mesh(np.r_[CORNERS, CORNERS, [[9, 9, 9]]], [[0, 1, 2], [4, 5, 6], [0, 6, 7], [0, 0, 1]]), lambda mesh: (mesh.n_vertices, mesh.n_faces) == (4, 2)),
    Kept("health", "duplicated faces", lambda: health(DOUBLED).faults, lambda faults: faults["duplicate_faces"] == 1 and faults["nonmanifold_edges"] == 1),
    Kept("health", "flipped face", lambda: health(FLIPPED).faults, lambda faults: faults["misoriented_edges"] == 1),
    Kept("health", "three sheets", lambda: health(THREE_SHEETS).faults, lambda faults: faults["nonmanifold_edges"] == 1),
    Kept("health", "two sheets in a point", lambda: health(BOW_TIE).faults, lambda faults: faults["nonmanifold_vertices"] == 1),
    Kept("health", "unused vertex", lambda: health(LONE_VERTEX), lambda report: report.faults["unreferenced_vertices"] == 1 and report.components == 1),
    Kept("health", "a point", lambda: health(POINT).faults, lambda faults: faults["degenerate_faces"] == 1 and faults["duplicate_vertices"] == 2),
    Kept("health", "components", lambda: health(TWO_SQUARES).components, lambda components: components == 2),
    Kept("cotan_laplacian", "flipped face", lambda: cotan_laplacian(FLIPPED)[0] - cotan_laplacian(SQUARE)[0], lambda gap: abs(gap).max() < 1e-15),
    Kept("robust_mesh_laplacian", "three sheets", lambda: robust_mesh_laplacian(THREE_SHEETS)[0], lambda stiff: abs(stiff.sum(axis=1)).max() < 1e-12),
    Kept("robust_mesh_laplacian", "degenerate face", lambda: robust_mesh_laplacian(FLAT_FACE)[1], lambda mass: mass.diagonal().min() > 0),
    Kept("angle_defects", "lone vertex has none", lambda: angle_defects(LONE_VERTEX), lambda defects: defects[4] == 0),
    Kept("geodesic_distances", "another component", lambda: geodesic_distances(TWO_SQUARES, [0]), lambda d: np.isinf(d[4:]).all() and d[2] == pytest.approx(2**0.5)),
    Kept("geodesic_distances", "unused vertex", lambda: geodesic_distances(LONE_VERTEX, [0]), lambda d: np.isinf(d[4]) and np.isfinite(d[:4]).all()),
    Kept("geodesic_distances", "tiny unit", lambda: geodesic_distances(TriangleMesh(1e-30 * SPHERE.vertices, SPHERE.faces), [0]), lambda d: d * 1e30 == pytest.approx(geodesic_distances(SPHERE, [0]), rel=1e-9)),
    Kept("parallel_transport", "flipped face", lambda: parallel_transport(FLIPPED, [0, 1], [1, 0, 0]), lambda arrows: arrows == pytest.approx(np.array([[1.0, 0, 0], [1, 0, 0]]))),
    Kept("compute_eigenbasis", "k = n", lambda: compute_eigenbasis(*cotan_laplacian(SQUARE), 4), lambda basis: basis.evecs.T @ basis.M @ basis.evecs == pytest.approx(np.eye(4), abs=1e-12)),
    Kept("compute_eigenbasis", "only isolated points", lambda: compute_eigenbasis(*graph_laplacian(np.zeros((4, 4))), 3).evals, lambda evals: not evals.any()),
    Kept("compute_eigenbasis", "dense matrices", lambda: compute_eigenbasis(L.toarray(), M.toarray(), 3).evals, lambda evals: evals == pytest.approx(BASIS.evals[:3])),
    Kept("compression.decode", "flat, doubled, flipped", lambda: [compression.decode(compression.encode(m, error=1)).n_faces for m in (FLAT_FACE, DOUBLED, FLIPPED)], lambda faces: faces == [2, 3, 2]),
]


# --- the table -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", REFUSED, ids=[f"{row.name}: {row.fault}" for row in REFUSED])
def test_refused(row: Row) -> None:
    with pytest.raises(row.error, match=row.message):
        row.call()


@pytest.mark.parametrize("row", KEPT, ids=[f"{row.name}: {row.oddity}" for row in KEPT])
def test_kept(row: Kept) -> None:
    assert row.holds(row.call())


def test_the_table_is_long_and_says_each_thing_once() -> None:
    faults = [(row.name, row.fault) for row in REFUSED]
    assert len(faults) == len(set(faults)) >= 60


def test_every_public_name_is_covered() -> None:
    """Each name that the package offers has a row, but for what takes no input."""
    offered = set(spectral_notes.__all__)
    assert {name for name in offered if not inspect.signature(getattr(spectral_notes, name)).parameters} == WITHOUT_INPUT
    assert offered - {row.name for row in REFUSED} == WITHOUT_INPUT


# --- hostile files through every command ------------------------------------------------------------------------------

READERS = (
    ["modes", "FILE", "-k", "4", "-o", "out.npz"],
    ["segment", "FILE", "-n", "2", "-o", "out.csv"],
    ["map", "FILE", "FILE", "-o", "out.csv"],
    ["health", "FILE"],
    ["compress", "FILE", "-o", "out.sgn"],
)
HOSTILE = {
    "empty.obj": b"",
    "empty.ply": b"",
    "binary.obj": bytes(range(256)) * 40,
    "a picture.stl": b"\x89PNG\r\n\x1a\n" + bytes(200),
    "huge.off": b"OFF\n300000000000 300000000000 0\n0 0 0\n",
    "huge.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nend_header\n" + bytes(64),
    "huge.stl": bytes(80) + b"\xff\xff\xff\xff" + bytes(100),
    "cut.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty fl",
    "nan.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "far.obj": b"v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "out of range.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -5\n",
    "another format.obj": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
    "shape.gltf": b"{}",
}


def said_by(capsys: pytest.CaptureFixture[str], words: list[str]) -> tuple[int, list[str]]:
    """Run a command in this process; its exit code and the lines of its complaint."""
    code = cli.main(words)
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return code, err.strip().splitlines()


@pytest.mark.parametrize("name", HOSTILE)
def test_every_command_refuses_a_hostile_file_in_one_line_and_writes_nothing(name, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(HOSTILE[name])
    for words in READERS:
        code, lines = said_by(capsys, [name if word == "FILE" else word for word in words])
        assert code != 0 and len(lines) == 1, (words, lines)
        assert lines[0].startswith("spectral-notes: ")
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("cut", [0, 3, 9, 40])
def test_a_damaged_file_is_not_decompressed(cut: int, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("shape.sgn").write_bytes(compression.encode(SPHERE, error=0.5)[:cut])
    code, lines = said_by(capsys, ["decompress", "shape.sgn", "-o", "shape.obj"])
    assert code != 0 and len(lines) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["shape.sgn"]


def test_every_command_that_reads_a_file_is_among_them() -> None:
    assert {words[0] for words in READERS} | {"decompress", "doctor"} == set(cli.COMMANDS)


# --- several components, and what ended the interpreter --------------------------------------------------------------


@pytest.mark.parametrize("copies", [2, 5, 12])
@pytest.mark.parametrize("laplacian", [cotan_laplacian, robust_mesh_laplacian])
def test_several_components_give_as_many_zero_modes(copies: int, laplacian: Callable[..., Any]) -> None:
    n = SPHERE.n_vertices
    vertices = np.concatenate([SPHERE.vertices + np.array([3.0 * copy, 0, 0]) for copy in range(copies)])
    faces = np.concatenate([SPHERE.faces + n * copy for copy in range(copies)])
    mesh = TriangleMesh(vertices, faces)
    evals = compute_eigenbasis(*laplacian(mesh), copies + 3).evals
    assert int((evals < 1e-9).sum()) == copies == health(mesh).components
    assert evals[copies] > 1.9


def test_two_clouds_far_apart_give_two_zero_modes() -> None:
    cloud = PointCloud(np.r_[SPHERE.vertices, SPHERE.vertices + 100])
    evals = compute_eigenbasis(*robust_cloud_laplacian(cloud, n_neighbors=12), 4).evals
    assert int((evals < 1e-9).sum()) == 2


@pytest.mark.parametrize("name", ["THREE_SHEETS", "DOUBLED"])
def test_what_ended_the_interpreter_raises(name: str) -> None:
    """An edge with three faces is a segmentation fault in igl.exact_geodesic; so this runs in a process of its own."""
    code = f"import test_bad_input as t; t.geodesic_distances(t.{name}, [0])"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=Path(__file__).parent
    )
    assert result.returncode == 1
    assert "ValueError: mesh must have at most two faces on each edge; 1 edges have more: see health(mesh)" in result.stderr


def test_a_moebius_strip_is_a_surface_like_others(mobius: TriangleMesh) -> None:
    assert health(mobius).faults["misoriented_edges"] > 0
    assert compute_eigenbasis(*cotan_laplacian(mobius), 3).evals[1] > 0.1
    assert np.isfinite(geodesic_distances(mobius, [0])).all()
    round_trip = np.r_[np.arange(12), 0]
    arrows = parallel_transport(mobius, round_trip, [0.0, 0.0, 1.0])
    lengths = np.linalg.norm(arrows, axis=1)
    assert lengths == pytest.approx(np.full(13, lengths[0]))
