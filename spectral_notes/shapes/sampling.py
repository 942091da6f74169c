"""Shapes from data: the terrain, points sampled from any mesh, and lighter copies, which stay on it in every pose."""

from __future__ import annotations

import igl
import matplotlib.cbook
import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_count
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import PointCloud, TriangleMesh, face_areas
from spectral_notes.shapes.triangulations import grid_faces

EARTH_RADIUS = 6_371_008.8  # mean radius in metres (IUGG)


def terrain(step: int = 4) -> TriangleMesh:
    """Return the hills along the Jacksboro fault, Tennessee, as a height field in metres: real data with a boundary.

    The elevations, in whole metres, are sample data that Matplotlib ships, one value every three arc seconds, laid on a
    plane that touches the Earth in the middle of the map. x points east, y north, z up; heights are not exaggerated.
    The south-west corner is at x = y = 0; vertex ``i * n_y + j`` is the i-th from the west and the j-th from the south.

    Parameters
    ----------
    step : take each step-th sample in both directions, 1 to 100; 4 gives 8,686 vertices about 300 m apart

    Examples
    --------
    >>> terrain()
    TriangleMesh('terrain', 8686 vertices, 17000 faces)
    """
    step = as_count("step", step, 1, 100)
    with np.load(matplotlib.cbook.get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as data:
        heights = data["elevation"][::-step, ::step].T.astype(np.float64)  # west to east, south to north
        d_longitude, d_latitude = float(data["dx"]), float(data["dy"])
        latitude = 0.5 * float(data["ymin"] + data["ymax"])
    n_x, n_y = heights.shape
    x = np.radians(d_longitude) * step * EARTH_RADIUS * np.cos(np.radians(latitude)) * np.arange(n_x)
    y = np.radians(d_latitude) * step * EARTH_RADIUS * np.arange(n_y)
    vertices = np.column_stack([np.repeat(x, n_y), np.tile(y, n_x), heights.ravel()])
    return TriangleMesh(vertices, grid_faces(n_x, n_y), "terrain")


def sample_points(mesh: TriangleMesh, n: int, seed: int = 0) -> PointCloud:
    """Return n random points of a mesh, independent and uniform by area, on the faces to rounding.

    A face is drawn with probability proportional to its area, then a point of it (Osada et al., Shape Distributions,
    2002).

    Parameters
    ----------
    mesh : the surface, after which the cloud is named
    n : number of points, at least 1
    seed : each seed is another cloud

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> sample_points(sphere(3), 100)
    PointCloud('sphere_points', 100 points)
    """
    n = as_count("n", n, 1)
    rng = np.random.default_rng(as_count("seed", seed, 0))
    areas = face_areas(mesh)
    face = rng.choice(mesh.n_faces, size=n, p=areas / areas.sum())
    root, t = np.sqrt(rng.random(n)), rng.random(n)
    weights = np.column_stack([1.0 - root, root * (1.0 - t), root * t])
    points = np.einsum("nc,ncd->nd", weights, mesh.vertices[mesh.faces[face]])
    return PointCloud(points, f"{mesh.name}_points" if mesh.name else "points")


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
