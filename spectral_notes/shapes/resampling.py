"""Lighter copies of a surface, whose vertices stay on it in every pose."""

from __future__ import annotations

import igl
import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_count
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import TriangleMesh


def coarse_copy(mesh: TriangleMesh, n: int) -> tuple[TriangleMesh, sp.csr_array]:
    """Return a copy of about n vertices, and the matrix P that carries functions and poses of the mesh over to it.

    The shortest edges collapse first, which keeps triangles even. Each new vertex is then a point of a face of the
    mesh, with barycentric coordinates in one row of P: the copy of another pose has the vertices `P @ pose.vertices`.
    A mesh that is small enough is its own copy.

    Parameters
    ----------
    mesh : a manifold, under whose name the copy goes
    n : vertices wanted, at least 4

    Returns
    -------
    coarse : the copy
    P : (n_coarse, n_mesh) csr_array, whose rows sum to one

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> coarse, P = coarse_copy(sphere(3), 200)
    >>> coarse.n_vertices, bool(np.allclose(P @ sphere(3).vertices, coarse.vertices))
    (200, True)
    """
    n = as_count("n", n, 4)
    if mesh.n_vertices <= n:
        return mesh, sp.eye_array(mesh.n_vertices, format="csr")
    wanted = max(4, mesh.n_faces - 2 * (mesh.n_vertices - n))  # a collapse takes one vertex and two faces
    points, faces, _, _ = igl.decimate(mesh.vertices, np.asfortranarray(mesh.faces.astype(np.int32)), wanted)
    if len(points) > n + 0.1 * mesh.n_vertices or not len(faces):
        raise ValueError(
            f"mesh must be manifold to be simplified from {mesh.n_vertices} to {n} vertices; see health(mesh)"
        )
    P = surface_weights(points, mesh)
    return TriangleMesh(P @ mesh.vertices, faces.astype(np.int64), mesh.name), P
