"""Spectral Geometry Notes: the support library of the course.

One thread runs through it: L phi = lambda M phi, and only where (L, M) come from changes. Import a module by its topic
(`from spectral_notes import fourier, shapes`), or the names below, which are those that a mesh of your own needs.

Everywhere an argument that is not what its entry says raises `TypeError` or `ValueError`, with its name, what was
expected, what came, and the remedy; an entry "Raises" stands where there is more to say.

>>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
>>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=4)
>>> basis.evals.round(2).tolist()  # close to 0, 2, 2, 2
[0.0, 2.0, 2.0, 2.0]
"""

from importlib import import_module
from typing import Any

_HOMES = {  # where each name lives; it is loaded when it is first used (PEP 562)
    "meshes": ("TriangleMesh", "PointCloud", "clean_mesh"),
    "files": ("read_mesh", "read_shape", "write_mesh", "write_arrays"),
    "geometry": (
        "health", "angle_defects", "gaussian_curvature", "mean_curvature", "geodesic_distances", "parallel_transport",
    ),
    "graphs": ("path_graph", "ring_graph", "neighbor_graph", "mesh_graph", "weights_of_networkx"),
    "laplacians": (
        "interval_laplacian", "graph_laplacian", "cotan_laplacian", "robust_mesh_laplacian", "robust_cloud_laplacian",
        "tetrahedral_laplacian", "mass_matrix",
    ),
    "mesh_calculus": (
        "gradient_matrix", "divergence_matrix", "arrows_of_rows", "rows_of_arrows", "boundary_vertices",
        "boundary_mass_matrix", "restrict_to", "PoissonSolver", "solve_poisson",
    ),
    "eigenbasis": ("Eigenbasis", "compute_eigenbasis"),
    "clustering": ("spectral_embedding", "spectral_clusters"),
    "functional_maps": ("functional_map", "point_map"),
    "matching": ("match_shapes",),
    "plotting": ("SurfaceView", "use_house_style", "plot_matrix", "plot_surfaces", "plot_modes", "plot_views"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    """Load a public name from its home."""
    if name not in _HOME:
        raise AttributeError(f"module 'spectral_notes' has no attribute {name!r}")
    return getattr(import_module(f"spectral_notes.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*globals(), *__all__])
