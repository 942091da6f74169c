"""Spectral Geometry Notes: the support library of the course.

One thread runs through it: L phi = lambda M phi, and only where (L, M) come from changes. Import a module by its topic
(`from spectral_notes import fourier, shapes`), or the names below, which are those that a mesh of your own needs.

>>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
>>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=4)
>>> basis.evals.round(2).tolist()  # close to 0, 2, 2, 2
[0.0, 2.0, 2.0, 2.0]
"""

from spectral_notes.clustering import spectral_clusters, spectral_embedding
from spectral_notes.curvature import angle_defects, gaussian_curvature, mean_curvature
from spectral_notes.datasets import fetch_mesh
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.exporting import write_arrays
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.geodesics import geodesic_distances, parallel_transport
from spectral_notes.graphs import mesh_graph, neighbor_graph, path_graph, ring_graph, weights_of_networkx
from spectral_notes.laplacians import (
    cotan_laplacian,
    graph_laplacian,
    interval_laplacian,
    mass_matrix,
    robust_cloud_laplacian,
    robust_mesh_laplacian,
)
from spectral_notes.mesh_calculus import (
    arrows_of_rows,
    boundary_vertices,
    divergence_matrix,
    gradient_matrix,
    restrict_to,
    rows_of_arrows,
    solve_poisson,
)
from spectral_notes.mesh_files import read_mesh, read_shape, write_mesh
from spectral_notes.mesh_health import health
from spectral_notes.meshes import PointCloud, TriangleMesh, clean_mesh
from spectral_notes.plotting import plot_matrix, plot_modes, plot_surfaces, plot_views, use_house_style
from spectral_notes.rendering import SurfaceView
from spectral_notes.shape_matching import match_shapes

__all__ = [
    "TriangleMesh",
    "PointCloud",
    "read_mesh",
    "read_shape",
    "write_mesh",
    "write_arrays",
    "clean_mesh",
    "fetch_mesh",
    "health",
    "path_graph",
    "ring_graph",
    "neighbor_graph",
    "mesh_graph",
    "weights_of_networkx",
    "interval_laplacian",
    "graph_laplacian",
    "cotan_laplacian",
    "robust_mesh_laplacian",
    "robust_cloud_laplacian",
    "mass_matrix",
    "gradient_matrix",
    "divergence_matrix",
    "arrows_of_rows",
    "rows_of_arrows",
    "boundary_vertices",
    "restrict_to",
    "solve_poisson",
    "angle_defects",
    "gaussian_curvature",
    "mean_curvature",
    "geodesic_distances",
    "parallel_transport",
    "Eigenbasis",
    "compute_eigenbasis",
    "spectral_embedding",
    "spectral_clusters",
    "functional_map",
    "point_map",
    "match_shapes",
    "SurfaceView",
    "use_house_style",
    "plot_matrix",
    "plot_surfaces",
    "plot_modes",
    "plot_views",
]
