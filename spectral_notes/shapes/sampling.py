"""Shapes from data: the terrain, and points sampled from any mesh."""

from __future__ import annotations

import matplotlib.cbook
import numpy as np

from spectral_notes._checks import as_count
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
