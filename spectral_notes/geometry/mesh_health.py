"""The health of a mesh: what real files bring, counted, and what each fault does to which Laplacian."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import igl
import numpy as np

from spectral_notes._checks import REMEDIES, as_number, named
from spectral_notes.geometry.crossings import crossing_faces, near_duplicates, t_junctions
from spectral_notes.geometry.mending import misoriented_edges, wrong_side_out
from spectral_notes.meshes import (
    TriangleMesh,
    connected_components,
    corner_angles,
    edges_with_counts,
    euler_characteristic,
    flat_faces,
    is_closed,
    pieces_of_graph,
    signed_volume,
)

CONSEQUENCES = {  # what each fault does, and its remedy
    "duplicate_vertices": "The surface is cut open along them: functions do not flow across. $clean sews it up.",
    "near_duplicate_vertices": "The surface is cut open at a crack: functions do not flow across. $weld sews it up.",
    "unreferenced_vertices": "Without mass, M is singular; every Laplacian refuses them. $clean drops them.",
    "duplicate_faces": "Their area counts twice, in L and in M. $clean keeps one of each.",
    "degenerate_faces": "Their cotangents are infinite: cotan refuses them; the robust Laplacian works.",
    "sliver_faces": "Where one has an angle near 180 degrees cotan loses accuracy; the robust Laplacian does not.",
    "nonmanifold_edges": "More than two sheets meet: cotan sums over them and stays right; robust is made for it.",
    "nonmanifold_vertices": "Sheets meet in a point: functions on them share that value; the modes barely notice.",
    "misoriented_edges": "Neighbours disagree which side is out: no Laplacian minds, but normals and signs of area do.",
    "inside_out_faces": "They point into the body: no Laplacian minds, but a map comes out mirrored. $orient mends it.",
    "crossing_faces": "The surface passes through itself: a matter of space, which no Laplacian sees; volumes do.",
    "t_junctions": "A vertex lies on a neighbour's edge, which passes it: functions do not flow across there.",
    "nonplanar_polygons": "A polygon of the file is bent: how it was cut into triangles decides the surface there.",
    "boundary_edges": "The surface has a boundary, whose condition is Neumann's unless you fix values there.",
}


@dataclass(frozen=True)
class MeshHealth:
    """Hold the counts of a mesh's faults and its topology; printed, it is a report.

    Parameters
    ----------
    vertices, edges, faces : size of the mesh
    components : connected pieces, vertices without a face not counted
    boundary_loops : pieces that the boundary edges form
    euler_characteristic : vertices in use - edges + faces
    genus : number of handles, summed over the pieces, holes taken as filled; None unless manifold and oriented
    faults : number of each fault of `CONSEQUENCES`, zeros included
    volume : signed volume, positive where the faces point outward; None of a mesh with a boundary
    crack : largest distance of the near duplicate vertices, 0 without any: what a weld must bridge
    """

    vertices: int
    edges: int
    faces: int
    components: int
    boundary_loops: int
    euler_characteristic: int
    genus: int | None
    faults: dict[str, int]
    volume: float | None = None
    crack: float = 0.0

    @property
    def is_closed(self) -> bool:
        """Whether no edge lies on a single face."""
        return self.faults["boundary_edges"] == 0

    @property
    def is_manifold(self) -> bool:
        """Whether the neighbourhood of every point is a disk or, on the boundary, a half disk."""
        return self.faults["nonmanifold_edges"] == 0 and self.faults["nonmanifold_vertices"] == 0

    def __str__(self) -> str:
        return self.report()

    def report(self, remedies: Mapping[str, str] = REMEDIES) -> str:
        """Return the counts as a report with what each fault does, and its remedy under the name given."""
        genus = "not defined" if self.genus is None else self.genus
        lines = [
            f"{self.vertices} vertices, {self.edges} edges, {self.faces} faces; Euler characteristic "
            f"{self.euler_characteristic}, genus {genus}",
            f"components: {self.components}; boundary loops: {self.boundary_loops}",
        ]
        found = {fault: count for fault, count in self.faults.items() if count}
        for fault, count in found.items():
            width = f", up to {self.crack:.2g} apart" if fault == "near_duplicate_vertices" else ""
            lines += [f"{fault.replace('_', ' ')}: {count}{width}", f"    {named(CONSEQUENCES[fault], remedies)}"]
        return "\n".join(lines if found else [*lines, "no fault found"])


def health(
    mesh: TriangleMesh, *, sliver_angle: float = 1.0, crossings: bool = True, nonplanar_polygons: int = 0
) -> MeshHealth:
    """Count what may be wrong with a mesh, and its components, boundary loops and handles.

    ``print(health(mesh))`` reads as a report with what each fault does.

    Parameters
    ----------
    mesh : the mesh
    sliver_angle : a face is a sliver when it has an area but an angle below this, in degrees, positive
    crossings : look for faces that cross and for pieces inside out, which takes the longest
    nonplanar_polygons : how many polygons of the file were bent, where somebody counted; a mesh does not remember

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> print(health(square))
    4 vertices, 5 edges, 2 faces; Euler characteristic 1, genus 0
    components: 1; boundary loops: 1
    boundary edges: 4
        The surface has a boundary, whose condition is Neumann's unless you fix values there.
    """
    sliver_angle = as_number("sliver_angle", sliver_angle, above=0.0)
    pairs, counts = edges_with_counts(mesh)
    used = np.unique(mesh.faces)
    flat = flat_faces(mesh)
    thin = np.degrees(corner_angles(mesh).min(axis=1)) < sliver_angle
    cracks, width = near_duplicates(mesh)
    faults = {
        "duplicate_vertices": mesh.n_vertices - len(np.unique(mesh.vertices + 0.0, axis=0)),
        "near_duplicate_vertices": cracks,
        "unreferenced_vertices": mesh.n_vertices - len(used),
        "duplicate_faces": mesh.n_faces - len(np.unique(np.sort(mesh.faces, axis=1), axis=0)),
        "degenerate_faces": int(flat.sum()),
        "sliver_faces": int((thin & ~flat).sum()),
        "nonmanifold_edges": int((counts > 2).sum()),
        "nonmanifold_vertices": int((~np.asarray(igl.is_vertex_manifold(mesh.faces))[used]).sum()),
        "misoriented_edges": int(misoriented_edges(mesh).sum()),
        "inside_out_faces": int(wrong_side_out(mesh).sum()) if crossings else 0,
        "crossing_faces": len(crossing_faces(mesh)) if crossings else 0,
        "t_junctions": t_junctions(mesh),
        "nonplanar_polygons": nonplanar_polygons,
        "boundary_edges": int((counts == 1).sum()),
    }
    components = len(np.unique(connected_components(mesh)[used]))
    rim = pairs[counts == 1]
    loops = len(np.unique(pieces_of_graph(rim, mesh.n_vertices)[rim]))
    chi = euler_characteristic(mesh)
    whole = not any(faults[name] for name in ("nonmanifold_edges", "nonmanifold_vertices", "misoriented_edges"))
    genus = (2 * components - loops - chi) // 2 if whole else None
    volume = signed_volume(mesh) if is_closed(mesh) and not faults["misoriented_edges"] else None
    return MeshHealth(mesh.n_vertices, len(pairs), mesh.n_faces, components, loops, chi, genus, faults, volume, width)
