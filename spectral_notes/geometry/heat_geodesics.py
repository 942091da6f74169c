"""Distances from heat: let it flow for a moment, keep only the direction it comes from, and integrate."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_indices, as_number
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import PoissonSolver, turned_edges
from spectral_notes.meshes import TriangleMesh, as_mesh, connected_components, edge_lengths, row_norms

FAINT = 1e-200  # heat below this share of where it comes from is computed anew, from nearer by
ROUNDING = 1e-12  # share of a face's heat below which the difference of its corners is rounding


@dataclass(frozen=True, eq=False, repr=False)
class HeatMethod:
    """Hold what the heat method factors of a mesh, ready for the distances from one source after the other.

    One implicit heat step u from the sources; X = -grad u / |grad u| points away from them and has length one; the
    distance is the function whose gradient is closest to X: L d = -div X, with d = 0 at the sources (Crane, Weischedel
    and Wardetzky, "Geodesics in heat", 2013, algorithm 1).

    Parameters
    ----------
    mesh : every face with an area, every vertex with a face; a boundary is insulated
    step : time of the heat step, positive; by default the square of the mean edge length
        A step far below the square of the local edge length follows the edges of the mesh, and not its surface.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> ball = sphere(4)
    >>> method = HeatMethod(ball)
    >>> exact = np.arccos(np.clip(ball.vertices @ ball.vertices[[0, 9]].T, -1, 1))
    >>> [round(float(np.abs(method.distances([v]) - exact[:, i]).mean()), 3) for i, v in enumerate([0, 9])]
    [0.013, 0.013]
    """

    mesh: TriangleMesh
    step: float | None = None
    _pieces: IntArray = field(init=False)  # (n,), the component of each vertex
    _turned: FloatArray = field(init=False)  # (m, 3, 3), the gradient of each corner's hat, times twice the area
    _heat: PoissonSolver = field(init=False)
    _poisson: PoissonSolver = field(init=False)

    def __post_init__(self) -> None:
        mesh = as_mesh(self.mesh)
        step = float(edge_lengths(mesh).mean() ** 2) if self.step is None else as_number("step", self.step, above=0.0)
        L, M = cotan_laplacian(mesh)
        pieces = connected_components(mesh)
        first = np.unique(pieces, return_index=True)[1]
        solvers = {"_heat": PoissonSolver(step * L, M, screening=1.0), "_poisson": PoissonSolver(L, M, first)}
        for name, value in ({"step": step, "_pieces": pieces, "_turned": turned_edges(mesh)} | solvers).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"HeatMethod({self.mesh!r}, step={self.step:.3g})"

    def distances(self, sources: ArrayLike) -> FloatArray:
        """Return the distance along the surface from each vertex to the nearest source, (n,), to about an edge length.

        A single source a component costs two substitutions; several of them cost a factorization as well.

        Parameters
        ----------
        sources : (p,) int, vertices where the distance is zero; each component of the mesh needs one

        Raises
        ------
        ArithmeticError
            If the step is so short that the heat of a face is zero in floating point.
        """
        sources = _one_a_piece(sources, self._pieces)
        held = self._pieces[sources]
        arrows = np.einsum("fc,fcd->fd", self._heat_of_faces(sources), self._turned)
        lengths, rounding = row_norms(arrows)[:, None], ROUNDING * np.linalg.norm(self._turned, axis=(1, 2))[:, None]
        away = np.where(lengths > rounding, -arrows, 0.0) / np.maximum(lengths, rounding)  # none where it is even
        lengthening = np.einsum("fd,fcd->fc", away, self._turned) / 2.0  # weak: minus the divergence of each face
        load = np.bincount(self.mesh.faces.ravel(), lengthening.ravel(), self.mesh.n_vertices)
        if len(sources) > len(np.unique(held)):
            return PoissonSolver(self._poisson.L, self._poisson.M, sources).solve(load=load)
        d = self._poisson.solve(load=load)
        return d - d[sources[np.argsort(held)]][self._pieces]

    def _heat_of_faces(self, sources: IntArray) -> FloatArray:
        """Heat at the corners of each face, (m, 3), in the unit of the face's hottest: that of the whole underflows."""
        u = self._heat.solve(load=np.isin(np.arange(self.mesh.n_vertices), sources))
        signs, logs = np.sign(u), _log(u)
        known = logs > logs.max() + np.log(FAINT)
        L, M = self._heat.L, self._heat.M
        while not known.all():
            rim = np.asarray(abs(L)[~known].sum(axis=0) > 0.0) & known
            far = PoissonSolver(L, M, np.flatnonzero(known), screening=1.0)
            hottest = logs[rim].max()
            u = far.solve(values=signs[known] * np.exp(np.minimum(logs[known] - hottest, 0.0)))
            new = ~known & (abs(u) > FAINT)
            if not new.any():
                break
            signs[~known], logs[~known] = np.sign(u[~known]), _log(u[~known]) + hottest
            known |= new
        corners = logs[self.mesh.faces]
        hottest = corners.max(axis=1, keepdims=True)
        if not np.isfinite(hottest).all():
            raise ArithmeticError(f"heat does not reach {np.isinf(hottest).sum()} faces; take a longer step")
        return signs[self.mesh.faces] * np.exp(corners - hottest)


def heat_distances(mesh: TriangleMesh, sources: ArrayLike, *, step: float | None = None) -> FloatArray:
    """Return the distances of `HeatMethod.distances`, for those who ask once.

    Parameters
    ----------
    mesh, step : see `HeatMethod`
    sources : (p,) int, vertices where the distance is zero; each component of the mesh needs one

    Examples
    --------
    >>> from spectral_notes.shapes import rectangle
    >>> round(float(heat_distances(rectangle(500.0, 2.0, 501, 3), [0]).max()))
    500
    """
    _one_a_piece(sources, connected_components(as_mesh(mesh)))  # refused before anything is factored
    return HeatMethod(mesh, step).distances(sources)


def _one_a_piece(sources: ArrayLike, pieces: IntArray) -> IntArray:
    """The sources in ascending order, at least one in each piece of the mesh."""
    sources = np.unique(as_indices("sources", sources, ("p",), len(pieces)))
    without = np.setdiff1d(pieces, pieces[sources])
    if not len(sources):
        raise ValueError("sources must name at least one vertex")
    if len(without):
        raise ValueError(f"sources must name a vertex of each component; {len(without)} have none")
    return sources


def _log(u: FloatArray) -> FloatArray:
    """Logarithm of the magnitude; minus infinity where it is zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.abs(u)))
