"""A shape that came from a file: its Laplacian, chosen openly, and what is worth saying about it before its modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from spectral_notes._checks import as_choice
from spectral_notes.descriptors import first_nonzero
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.files.foreign import FREESURFER
from spectral_notes.geometry.mesh_health import CONSEQUENCES, health
from spectral_notes.laplacians import MASSES, Pair, cotan_laplacian, robust_cloud_laplacian, robust_mesh_laplacian
from spectral_notes.meshes import PointCloud, Shape, positions
from spectral_notes.plotting.cameras import guess_up

LAPLACIANS = ("cotan", "robust")
NEIGHBORS = 30  # that each local triangulation of a cloud uses; all others in a smaller one
HARMLESS = ("boundary_edges", "nonplanar_polygons")  # counted by the health report, and no fault of the surface
CUT_OR_DOUBLED = ("duplicate_vertices", "near_duplicate_vertices", "t_junctions", "duplicate_faces")
WORTH_A_NOTE = {  # what spoils modes without an error, by Laplacian
    "cotan": (*CUT_OR_DOUBLED, "sliver_faces", "nonmanifold_edges"), "robust": CUT_OR_DOUBLED,
}
UP_OF_FORMAT = {".gltf": "y", ".glb": "y", ".3mf": "z", ".gii": "z", **dict.fromkeys(FREESURFER, "z")}  # as they say
SHOWN = (0, 1, 4, 9, 49, 99)  # modes of a picture, counted from the first that is not constant


def laplacian_of(shape: Shape, kind: str = "", mass: str = "lumped") -> Pair:
    """Return the pair (L, M) of a mesh or a cloud; robust, the one kind for clouds, has its own lumped mass alone."""
    kind = chosen(shape, kind)
    if as_choice("mass", mass, MASSES) != "lumped" and kind == "robust":
        raise ValueError(f"mass must be 'lumped' with the robust Laplacian; got {mass!r}")
    if isinstance(shape, PointCloud):
        return robust_cloud_laplacian(shape, n_neighbors=min(NEIGHBORS, shape.n_points - 1))
    return cotan_laplacian(shape, mass=mass) if kind == "cotan" else robust_mesh_laplacian(shape)


def chosen(shape: Shape, kind: str = "") -> str:
    """Return which Laplacian is taken, "cotan" or "robust"; raise where it cannot be."""
    is_cloud = isinstance(shape, PointCloud)
    kind = as_choice("laplacian", kind or ("robust" if is_cloud else "cotan"), LAPLACIANS)
    if is_cloud and kind == "cotan":
        raise ValueError("laplacian must be 'robust' for a point cloud, which has no triangles; got 'cotan'")
    return kind


def upward(shape: Shape, ending: str, up: str = "") -> tuple[str, str]:
    """Return which axis points upward, and why: as told, as the format says, or as the shape looks.

    >>> upward(PointCloud([[0, 0, 0]]), ".glb")
    ('y', 'the format says so')
    """
    if up:
        return as_choice("up", up, ("x", "y", "z")), "you say so"
    ending = next((known for known in UP_OF_FORMAT if ending.startswith(known)), ending)
    return (UP_OF_FORMAT[ending], "the format says so") if ending in UP_OF_FORMAT else guess_up(shape)


def size_of(shape: Shape) -> dict[str, Any]:
    """Return what a shape is, how large, and its name.

    >>> size_of(PointCloud([[0, 0, 0], [3, 4, 0]], "two"))
    {'name': 'two', 'kind': 'point cloud', 'points': 2, 'diagonal': 5.0}
    """
    diagonal = float(np.linalg.norm(np.ptp(positions(shape), axis=0)))
    if isinstance(shape, PointCloud):
        return {"name": shape.name, "kind": "point cloud", "points": shape.n_points, "diagonal": diagonal}
    size = {"vertices": shape.n_vertices, "faces": shape.n_faces, "area": shape.area, "diagonal": diagonal}
    return {"name": shape.name, "kind": "triangle mesh", **size}


def warnings_of(shape: Shape, kind: str = "") -> list[str]:
    """Return a line for each fault of a mesh that spoils its modes without an error."""
    if isinstance(shape, PointCloud):
        return []
    found = health(shape, crossings=False).faults
    names = [name for name in WORTH_A_NOTE[chosen(shape, kind)] if found[name]]
    return [f"{name.replace('_', ' ')}: {found[name]}. {CONSEQUENCES[name]}" for name in names]


def modes_to_show(basis: Eigenbasis) -> list[int]:
    """Return up to six modes for a picture: the first that are not constant, and some faster ones."""
    first = first_nonzero(basis, 0)
    return [first + i for i in SHOWN if first + i < basis.k] or [basis.k - 1]
