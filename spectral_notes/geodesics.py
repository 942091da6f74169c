"""Moving on a surface: geodesic distances, and parallel transport of an arrow from face to face."""

from __future__ import annotations

from itertools import pairwise

import igl
import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_floats, as_indices
from spectral_notes.meshes import TriangleMesh, face_normals


def geodesic_distances(mesh: TriangleMesh, sources: ArrayLike) -> FloatArray:
    """Return the length of the shortest path on the mesh from each vertex to the nearest source, across faces, exactly.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh, manifold.
    sources : array_like of int, shape (p,)
        Vertices where the distance is zero.

    Returns
    -------
    ndarray, shape (n,)
        In units of the vertices; infinite where no path leads.

    Raises
    ------
    TypeError, ValueError
        If no source is given, or one is out of range.

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> geodesic_distances(square, [1]).round(6).tolist()  # the way from 1 to 3 crosses the diagonal
    [1.0, 0.0, 1.0, 1.414214]

    References
    ----------
    Mitchell, Mount and Papadimitriou, "The discrete geodesic problem" (1987), by libigl.
    """
    sources = as_indices("sources", sources, ("p",), mesh.n_vertices)
    if not len(sources):
        raise ValueError("sources must name at least one vertex")
    none, targets = np.zeros(0, dtype=np.int64), np.arange(mesh.n_vertices)
    distances = igl.exact_geodesic(mesh.vertices, mesh.faces, sources, none, targets, none)
    return np.asarray(distances, dtype=np.float64).ravel()


def parallel_transport(mesh: TriangleMesh, path: ArrayLike, arrow: ArrayLike) -> FloatArray:
    """Return an arrow carried along a path of faces without turning in the surface, one arrow a face of the path.

    At each step the next face is unfolded about the shared edge into the plane of the last; the arrow keeps its length
    and its angle to that edge. Round a closed path it comes back turned by the enclosed Gaussian curvature.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh, oriented.
    path : array_like of int, shape (p,)
        Faces, each sharing an edge with the next.
    arrow : array_like, shape (3,)
        The arrow in the first face; what sticks out of the face's plane is left off.

    Returns
    -------
    ndarray, shape (p, 3)
        The arrow in each face's plane.

    Raises
    ------
    TypeError, ValueError
        If the path is empty, an index is out of range, or two faces that follow each other share no edge.

    Examples
    --------
    >>> roof = TriangleMesh([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, -1]], [[0, 2, 1], [0, 1, 3]])
    >>> parallel_transport(roof, [0, 1], [-1.0, 0.0, 0.0]).round(12).tolist()  # over the edge and down
    [[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    """
    path = as_indices("path", path, ("p",), mesh.n_faces)
    if not len(path):
        raise ValueError("path must name at least one face")
    normals = face_normals(mesh)
    start = as_floats("arrow", arrow, (3,))
    arrows = [start - (start @ normals[path[0]]) * normals[path[0]]]
    for here, there in pairwise(path):
        shared = np.intersect1d(mesh.faces[here], mesh.faces[there])
        if len(shared) != 2:
            raise ValueError(f"path must go from face to neighbouring face; {here} and {there} share no single edge")
        along = mesh.vertices[shared[1]] - mesh.vertices[shared[0]]
        along = along / np.linalg.norm(along)
        across_here, across_there = np.cross(normals[here], along), np.cross(normals[there], along)
        arrows.append((arrows[-1] @ along) * along + (arrows[-1] @ across_here) * across_there)
    return np.array(arrows)
