"""Discrete curvatures of a mesh: Gaussian from angles, mean from the Laplacian of the position."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray, as_choice
from spectral_notes.laplacians import cotan_laplacian, mass_matrix
from spectral_notes.mesh_calculus import boundary_vertices
from spectral_notes.meshes import TriangleMesh, as_mesh, corner_angles, vertex_normals

POINTWISE = ("voronoi", "lumped")  # masses that can be divided by


def angle_defects(mesh: TriangleMesh) -> FloatArray:
    """Return the integrated Gaussian curvature at each vertex, (n,), in radians: 2 pi minus the angles round it.

    Positive on caps, negative on saddles, zero at vertices without a face; on the boundary it is pi minus the angles.
    Over all vertices they sum to 2 pi times the Euler characteristic, exactly: the theorem of Gauss and Bonnet (Meyer,
    Desbrun, Schroeder and Barr, "Discrete differential-geometry operators", 2003, section 4).

    Examples
    --------
    >>> tetrahedron = TriangleMesh(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    ... )
    >>> (angle_defects(tetrahedron) / np.pi).round(12).tolist()  # three angles of 60 degrees at each vertex
    [1.0, 1.0, 1.0, 1.0]
    """
    mesh = as_mesh(mesh)
    flat = np.full(mesh.n_vertices, 2.0 * np.pi)
    flat[boundary_vertices(mesh)] = np.pi
    flat[np.bincount(mesh.faces.ravel(), minlength=mesh.n_vertices) == 0] = 0.0
    return flat - np.bincount(mesh.faces.ravel(), corner_angles(mesh).ravel(), minlength=mesh.n_vertices)


def gaussian_curvature(mesh: TriangleMesh, *, mass: str = "voronoi") -> FloatArray:
    """Return the pointwise Gaussian curvature at each vertex: the angle defect over the vertex's share of area.

    On the boundary the number mixes the turning of the boundary with the curvature and means little.

    Parameters
    ----------
    mesh : every vertex has a face with an area
    mass : {"voronoi", "lumped"}, how the area is shared out among the vertices; see `mass_matrix`
        With thirds (lumped) the values where five triangles meet stay 15 % off on ever finer spheres.

    Returns
    -------
    K : (n,), in 1 / squared unit of the vertices; 1 / r^2 on a sphere

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> bool(np.allclose(gaussian_curvature(sphere(4)), 1.0, atol=2e-3))  # at every vertex
    True
    """
    return angle_defects(mesh) / mass_matrix(mesh, kind=as_choice("mass", mass, POINTWISE)).diagonal()


def mean_curvature(mesh: TriangleMesh, *, mass: str = "voronoi") -> FloatArray:
    """Return the pointwise mean curvature at each vertex, positive where the surface bulges along its normals.

    The position obeys -Delta x = 2 H N: the weak Laplacian of x, over the mass, is the normal stretched by 2 H.

    Parameters
    ----------
    mesh : oriented; every vertex has a face and every face an area
    mass : {"voronoi", "lumped"}, as in `gaussian_curvature`

    Returns
    -------
    H : (n,), half the sum of the principal curvatures, in 1 / unit of the vertices; 1 / r on a sphere
        On the boundary it means little.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> bool(np.allclose(mean_curvature(sphere(4)), 1.0, atol=2e-3))  # at every vertex
    True
    """
    L, M = cotan_laplacian(mesh, mass=as_choice("mass", mass, POINTWISE))
    laplacian_of_position = (L @ mesh.vertices) / M.diagonal()[:, None]  # (n, 3)
    return 0.5 * np.einsum("ij,ij->i", laplacian_of_position, vertex_normals(mesh))
