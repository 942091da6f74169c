"""How far two meshes with the same faces are apart: as vertices, as surfaces, in their normals.

All lengths are in percent of the diagonal of the first mesh's bounding box, so that they compare across shapes.
"""

from __future__ import annotations

import igl
import numpy as np

from spectral_notes._checks import FloatArray
from spectral_notes.meshes import TriangleMesh, face_areas, face_normals


def vertex_error(mesh: TriangleMesh, other: TriangleMesh) -> float:
    """Return 100 sqrt(mean |v_i - w_i|^2) / diagonal: the distance between vertices of equal number, in percent.

    Parameters
    ----------
    mesh, other : meshes of the same number of vertices

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> lifted = TriangleMesh(square.vertices + [0, 0, 0.05], square.faces)
    >>> round(vertex_error(square, lifted), 12), round(surface_error(square, lifted), 12)
    (1.0, 1.0)
    """
    if mesh.n_vertices != other.n_vertices:
        raise ValueError(f"meshes must have equally many vertices; got {mesh.n_vertices} and {other.n_vertices}")
    gap = mesh.vertices - other.vertices
    return 100 * float(np.sqrt((gap * gap).sum(axis=1).mean())) / _diagonal(mesh)


def surface_error(mesh: TriangleMesh, other: TriangleMesh) -> float:
    """Return the root mean square distance from one surface to the other, in percent, the larger of both directions.

    Distances are taken at vertices and face centres, to the nearest point of the other surface. Sliding a vertex along
    a flat surface costs nothing (Cignoni, Rocchini and Scopigno, "Metro: measuring error on simplified surfaces",
    1998).

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> round(surface_error(square, TriangleMesh(square.vertices + [0, 0, 0.05], square.faces)), 12)
    1.0
    """
    both = [_squared_distances(mesh, other), _squared_distances(other, mesh)]
    return 100 * float(np.sqrt(max(d.mean() for d in both))) / _diagonal(mesh)


def hausdorff_error(mesh: TriangleMesh, other: TriangleMesh) -> float:
    """Return the largest distance from one surface to the other, in percent, at vertices and face centres of both.

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> bent = TriangleMesh(square.vertices + [[0, 0, 0], [0, 0, 0], [0, 0, 0.05]], square.faces)
    >>> 0.9 < hausdorff_error(square, bent) <= 1.0
    True
    """
    both = [_squared_distances(mesh, other), _squared_distances(other, mesh)]
    return 100 * float(np.sqrt(max(d.max() for d in both))) / _diagonal(mesh)


def normal_deviation(mesh: TriangleMesh, other: TriangleMesh) -> float:
    """Return the mean angle between normals of equal faces, weighted by the first mesh's areas, in degrees.

    Parameters
    ----------
    mesh, other : meshes with the same faces

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> steep = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 1, 2]])
    >>> round(normal_deviation(square, steep), 9)
    45.0
    """
    if mesh.faces.shape != other.faces.shape or (mesh.faces != other.faces).any():
        raise ValueError("normal_deviation needs two meshes with the same faces")
    cosine = np.clip((face_normals(mesh) * face_normals(other)).sum(axis=1), -1.0, 1.0)
    weight = face_areas(mesh)
    return float(np.degrees((np.arccos(cosine) * weight).sum() / weight.sum()))


def _squared_distances(start: TriangleMesh, end: TriangleMesh) -> FloatArray:
    """Squared distances to a surface from the corners and centres of another's faces; a vertex alone is no surface."""
    points = np.r_[start.vertices[np.unique(start.faces)], start.vertices[start.faces].mean(axis=1)]
    return np.maximum(igl.point_mesh_squared_distance(points, end.vertices, end.faces)[0], 0.0)


def _diagonal(mesh: TriangleMesh) -> float:
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
