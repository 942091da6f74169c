"""The health of a mesh: what real files bring, counted, and what each fault does to which Laplacian."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import IntArray, as_number
from spectral_notes.meshes import (
    TriangleMesh,
    as_mesh,
    connected_components,
    corner_angles,
    edges_with_counts,
    euler_characteristic,
    flat_faces,
)

CONSEQUENCES = {
    "duplicate_vertices": "The surface is cut open along them: functions do not flow across. clean_mesh sews it up.",
    "unreferenced_vertices": "Without mass, M is singular; every Laplacian refuses them. clean_mesh drops them.",
    "duplicate_faces": "Their area counts twice, in L and in M. clean_mesh keeps one of each.",
    "degenerate_faces": "Their cotangents are infinite: cotan refuses them; the robust Laplacian works.",
    "sliver_faces": "Their cotangents are huge and of both signs: cotan loses accuracy; the robust Laplacian does not.",
    "nonmanifold_edges": "More than two sheets meet: cotan sums over them and stays right; robust is made for it.",
    "nonmanifold_vertices": "Sheets meet in a point: functions on them share that value; the modes barely notice.",
    "misoriented_edges": "Neighbours disagree which side is out: no Laplacian minds, but normals and signs of area do.",
    "boundary_edges": "The surface has a boundary, whose condition is Neumann's unless you fix values there.",
}


@dataclass(frozen=True)
class MeshHealth:
    """Hold the counts of a mesh's faults and its topology; printed, it is a report.

    Parameters
    ----------
    vertices, edges, faces : int
        Size of the mesh.
    components : int
        Connected pieces, vertices without a face not counted.
    boundary_loops : int
        Pieces that the boundary edges form.
    euler_characteristic : int
        Vertices in use - edges + faces.
    genus : int or None
        Number of handles, summed over the pieces, holes taken as filled; None unless the mesh is manifold and oriented.
    faults : dict of str to int
        Number of each fault of `CONSEQUENCES`, zeros included.
    """

    vertices: int
    edges: int
    faces: int
    components: int
    boundary_loops: int
    euler_characteristic: int
    genus: int | None
    faults: dict[str, int]

    @property
    def is_closed(self) -> bool:
        """Whether no edge lies on a single face."""
        return self.faults["boundary_edges"] == 0

    @property
    def is_manifold(self) -> bool:
        """Whether the neighbourhood of every point is a disk or, on the boundary, a half disk."""
        return self.faults["nonmanifold_edges"] == 0 and self.faults["nonmanifold_vertices"] == 0

    def __str__(self) -> str:
        genus = "not defined" if self.genus is None else self.genus
        lines = [
            f"{self.vertices} vertices, {self.edges} edges, {self.faces} faces; Euler characteristic "
            f"{self.euler_characteristic}, genus {genus}",
            f"components: {self.components}; boundary loops: {self.boundary_loops}",
        ]
        found = {fault: count for fault, count in self.faults.items() if count}
        for fault, count in found.items():
            lines += [f"{fault.replace('_', ' ')}: {count}", f"    {CONSEQUENCES[fault]}"]
        return "\n".join(lines if found else [*lines, "no fault found"])


def health(mesh: TriangleMesh, *, sliver_angle: float = 1.0) -> MeshHealth:
    """Count what may be wrong with a mesh, and its components, boundary loops and handles.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh.
    sliver_angle : float
        A face is a sliver when it has an area but an angle below this, in degrees, 0 < angle.

    Returns
    -------
    MeshHealth
        The counts; ``print(health(mesh))`` reads as a report with what each fault does.

    Raises
    ------
    TypeError, ValueError
        If it is no mesh, or the angle is not positive.

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> print(health(square))
    4 vertices, 5 edges, 2 faces; Euler characteristic 1, genus 0
    components: 1; boundary loops: 1
    boundary edges: 4
        The surface has a boundary, whose condition is Neumann's unless you fix values there.
    """
    mesh = as_mesh(mesh)
    sliver_angle = as_number("sliver_angle", sliver_angle, above=0.0)
    pairs, counts = edges_with_counts(mesh)
    used = np.unique(mesh.faces)
    flat = flat_faces(mesh)
    thin = np.degrees(corner_angles(mesh).min(axis=1)) < sliver_angle
    faults = {
        "duplicate_vertices": mesh.n_vertices - len(np.unique(mesh.vertices + 0.0, axis=0)),
        "unreferenced_vertices": mesh.n_vertices - len(used),
        "duplicate_faces": mesh.n_faces - len(np.unique(np.sort(mesh.faces, axis=1), axis=0)),
        "degenerate_faces": int(flat.sum()),
        "sliver_faces": int((thin & ~flat).sum()),
        "nonmanifold_edges": int((counts > 2).sum()),
        "nonmanifold_vertices": int((~np.asarray(igl.is_vertex_manifold(mesh.faces))[used]).sum()),
        "misoriented_edges": _misoriented(mesh),
        "boundary_edges": int((counts == 1).sum()),
    }
    components = len(np.unique(connected_components(mesh)[used]))
    loops = _loops(pairs[counts == 1], mesh.n_vertices)
    chi = euler_characteristic(mesh)
    whole = not any(faults[name] for name in ("nonmanifold_edges", "nonmanifold_vertices", "misoriented_edges"))
    genus = (2 * components - loops - chi) // 2 if whole else None
    return MeshHealth(mesh.n_vertices, len(pairs), mesh.n_faces, components, loops, chi, genus, faults)


def _misoriented(mesh: TriangleMesh) -> int:
    """Edges with two faces that run along them in the same direction."""
    a, b = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    code = np.minimum(a, b) * mesh.n_vertices + np.maximum(a, b)
    _, place, counts = np.unique(code, return_inverse=True, return_counts=True)
    balance = np.bincount(place.ravel(), np.where(a < b, 1, -1))
    return int(((counts == 2) & (balance != 0)).sum())


def _loops(boundary: IntArray, n: int) -> int:
    """Pieces of the graph of boundary edges."""
    graph = sp.csr_array((np.ones(len(boundary)), (boundary[:, 0], boundary[:, 1])), (n, n))
    labels = sp.csgraph.connected_components(graph, directed=False)[1]
    return len(np.unique(labels[np.unique(boundary)]))
