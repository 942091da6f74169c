"""Distances from heat: let it flow for a moment, keep only the direction it comes from, and integrate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_indices, as_number
from spectral_notes.diffusion import implicit_steps
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import (
    arrows_of_rows,
    divergence_matrix,
    gradient_matrix,
    rows_of_arrows,
    solve_poisson,
)
from spectral_notes.meshes import TriangleMesh, connected_components, edge_lengths


def heat_distances(mesh: TriangleMesh, sources: ArrayLike, *, step: float | None = None) -> FloatArray:
    """Return the distance along the surface from each vertex to the nearest source, to about one edge length.

    One implicit heat step u from the sources; X = -grad u / |grad u| points away from them and has length one;
    the distance is the function whose gradient is closest to X: L d = -div X, with d = 0 at the sources.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh; a boundary is insulated.
    sources : array_like of int, shape (p,)
        Vertices where the distance is zero; each component of the mesh needs one.
    step : float, optional
        Time of the heat step; by default the square of the mean edge length.

    Returns
    -------
    ndarray, shape (n,)
        In units of the vertices.

    Raises
    ------
    TypeError, ValueError
        If no source is given, one is out of range, or a component has none; if the step is not positive.
    ArithmeticError
        If the step is so short that the heat of a vertex is zero in floating point.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> ball = sphere(4)
    >>> d = heat_distances(ball, [0])
    >>> exact = np.arccos(np.clip(ball.vertices @ ball.vertices[0], -1, 1))
    >>> bool(np.abs(d - exact).mean() < 0.02)
    True

    References
    ----------
    Crane, Weischedel and Wardetzky, "Geodesics in heat" (2013), algorithm 1.
    """
    sources = as_indices("sources", sources, ("p",), mesh.n_vertices)
    _check_sources(mesh, sources)
    h = edge_lengths(mesh).mean()
    step = float(h**2) if step is None else as_number("step", step, above=0.0)
    L, M = cotan_laplacian(mesh)
    drop = np.zeros(mesh.n_vertices)
    drop[sources] = 1.0 / M.diagonal()[sources]
    u = implicit_steps(L, M, drop, step)
    if not u.all():
        raise ArithmeticError(f"heat reaches {np.count_nonzero(u)} of {mesh.n_vertices} vertices; take a longer step")
    grad_u = arrows_of_rows(gradient_matrix(mesh) @ u)  # (m, 3)
    size = np.linalg.norm(grad_u, axis=1, keepdims=True)
    away = -grad_u / np.where(size > 0.0, size, 1.0)
    outflow = divergence_matrix(mesh) @ rows_of_arrows(away)  # integrated over each vertex's patch
    return solve_poisson(L, M, -outflow / M.diagonal(), fixed=np.unique(sources))


def _check_sources(mesh: TriangleMesh, sources: IntArray) -> None:
    """Refuse an empty list of sources, and a component of the mesh without one."""
    if not len(sources):
        raise ValueError("sources must name at least one vertex")
    component = connected_components(mesh)
    without = np.setdiff1d(component, component[sources])
    if len(without):
        raise ValueError(f"sources must name a vertex of each component; {len(without)} have none")
