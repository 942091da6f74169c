"""Mend what scans and exports bring: cracks, floating pieces, faces that disagree about which side is out; and cut."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csgraph, csr_array
from scipy.spatial import cKDTree

from spectral_notes._checks import IntArray, as_number
from spectral_notes.meshes import (
    TriangleMesh,
    as_mesh,
    clean_mesh,
    connected_components,
    edges_with_counts,
    face_areas,
    pieces_of_graph,
    signed_volume,
)

MOSTLY_HOLE = 0.2  # holes, as circles of their length, of this share of the area leave a shape without an inside


def weld_vertices(mesh: TriangleMesh, tolerance: float) -> TriangleMesh:
    """Return the mesh with vertices that lie within a tolerance of each other made one, which sews up cracks.

    Each group, joined by steps of at most the tolerance, keeps the position of its first vertex; then broken and
    repeated faces and unused vertices go, as in `clean_mesh`; a face must be left.

    Parameters
    ----------
    mesh : the mesh
    tolerance : largest distance, in units of the vertices, at least 0 and less than an eighth of the mesh's diagonal

    Examples
    --------
    >>> cracked = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1e-6, 0], [1, 1, 0], [1e-6, 1, 0]],
    ...                        [[0, 1, 2], [3, 4, 5]])
    >>> weld_vertices(cracked, 1e-5)
    TriangleMesh('', 4 vertices, 2 faces)
    """
    mesh = as_mesh(mesh)
    tolerance = as_number("tolerance", tolerance, low=0.0)
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    if tolerance and tolerance >= diagonal / 8:
        raise ValueError(f"tolerance must be well below the size of the mesh, {diagonal:.3g}; got {tolerance:g}")
    vertices = mesh.vertices - mesh.vertices.mean(axis=0)
    group = pieces_of_graph(cKDTree(vertices).query_pairs(tolerance, output_type="ndarray"), mesh.n_vertices)
    _, first = np.unique(group, return_index=True)
    return clean_mesh(mesh.vertices, first[group][mesh.faces], mesh.name)


def keep_pieces(mesh: TriangleMesh, *, smallest: float = 0.0, largest_only: bool = False) -> TriangleMesh:
    """Return the mesh without its small pieces, as scans have them floating about; unused vertices go as well.

    Parameters
    ----------
    mesh : the mesh, whose order of vertices and faces stays
    smallest : a piece stays if its area is at least this share of the largest piece's, 0 .. 1
    largest_only : keep the piece of the largest area alone, of equal ones the first

    Examples
    --------
    >>> two = TriangleMesh(np.arange(6)[:, None] * [[1, 0, 0]] + np.tile([[0, 0, 0], [0, 3, 0], [1, 0, 0]], (2, 1)),
    ...                    [[0, 1, 2], [3, 4, 5]])
    >>> keep_pieces(two, largest_only=True).n_faces
    1
    """
    smallest = as_number("smallest", smallest, low=0.0)
    if smallest > 1.0:
        raise ValueError(f"smallest must be a share of the largest piece, at most 1; got {smallest:g}")
    piece = connected_components(mesh)[mesh.faces[:, 0]]
    areas = np.bincount(piece, face_areas(mesh))
    kept = np.arange(len(areas)) == np.argmax(areas) if largest_only else areas >= smallest * areas.max()
    used, faces = np.unique(mesh.faces[kept[piece]], return_inverse=True)
    return TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3), mesh.name)


def cut_mesh(mesh: TriangleMesh, keep: ArrayLike) -> tuple[TriangleMesh, NDArray[np.bool_]]:
    """Return the largest connected piece of the faces whose corners are all kept, and which vertices (n,) it holds.

    `keep` (n,) bool says which vertices may stay. They stay in their old order.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> part, kept = cut_mesh(square, [True, True, True, False])
    >>> part.n_faces, kept.tolist()
    (1, [True, True, True, False])
    """
    wanted = np.asarray(keep)
    if wanted.dtype != bool or wanted.shape != (mesh.n_vertices,):
        told = f"got dtype {wanted.dtype} and shape {wanted.shape}"
        raise ValueError(f"keep must hold True or False for each of the {mesh.n_vertices} vertices; {told}")
    faces = mesh.faces[wanted[mesh.faces].all(axis=1)]
    if not len(faces):
        raise ValueError("keep must leave a face of the mesh; it leaves none. Keep all three corners of some face")
    pieces = connected_components(TriangleMesh(mesh.vertices, faces))
    largest = faces[pieces[faces[:, 0]] == np.bincount(pieces[faces[:, 0]]).argmax()]
    kept = np.isin(np.arange(mesh.n_vertices), largest)
    return TriangleMesh(mesh.vertices[kept], (np.cumsum(kept) - 1)[largest], mesh.name), kept


def orient_faces(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with faces that agree with their neighbours; closed pieces point outward, others as most did.

    A closed piece inside another, the wall of a hollow, points into the hollow. Across edges of three faces and more
    nothing can agree, and a Möbius strip keeps a seam: `health` still counts those edges.

    Examples
    --------
    >>> from spectral_notes.meshes import signed_volume
    >>> tetrahedron = TriangleMesh(np.eye(4)[:, :3], [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> round(6 * signed_volume(orient_faces(tetrahedron)), 12)
    1.0
    """
    mesh = as_mesh(mesh)
    faces, patch = (np.asarray(array) for array in igl.bfs_orient(mesh.faces))
    turned = ~np.any([(np.roll(faces, k, axis=1) == mesh.faces).all(axis=1) for k in range(3)], axis=0)
    most = np.bincount(patch, np.where(turned, -1.0, 1.0) * face_areas(mesh)) < 0
    agreed = TriangleMesh(mesh.vertices, _flipped(faces, most[patch]), mesh.name)
    return TriangleMesh(mesh.vertices, _flipped(agreed.faces, wrong_side_out(agreed)), mesh.name)


def outward(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh, its faces turned over where it is a body inside out; what is mostly hole, a field, stays."""
    pairs, n_faces = edges_with_counts(mesh)
    i, j = rim = pairs[n_faces == 1].T
    holes = csgraph.connected_components(csr_array((np.ones(len(i)), rim), shape=2 * (mesh.n_vertices,)))[1]
    lengths = np.bincount(holes[i], np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1))
    if signed_volume(mesh) >= 0.0 or (lengths**2).sum() > 4.0 * np.pi * MOSTLY_HOLE * mesh.area:  # circles hold most
        return mesh
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1], mesh.name)


def _flipped(faces: IntArray, which: NDArray[np.bool_]) -> IntArray:
    """Faces, some of them turned around."""
    return np.where(which[:, None], faces[:, [0, 2, 1]], faces)


def wrong_side_out(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return which faces belong to a closed piece whose faces agree and point to the wrong side, shape (m,).

    The right side is outward; of a piece inside an odd number of others, the wall of a hollow, it is inward.
    """
    piece = connected_components(mesh)
    pairs, counts = edges_with_counts(mesh)
    sound = np.zeros(piece.max() + 1, dtype=bool)
    sound[piece[mesh.faces]] = True
    sound[piece[pairs[:, 0]][(counts != 2) | misoriented_edges(mesh)]] = False
    owner = piece[mesh.faces[:, 0]]
    a, b, c = (mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)).transpose(1, 0, 2)
    volume = np.bincount(owner, np.einsum("fd,fd->f", a, np.cross(b, c)), len(sound))
    closed = np.flatnonzero(sound)
    corner_of = dict(zip(owner.tolist(), mesh.faces[:, 0].tolist(), strict=True))
    low, high = np.full((len(sound), 3), np.inf), np.full((len(sound), 3), -np.inf)
    np.minimum.at(low, piece, mesh.vertices)
    np.maximum.at(high, piece, mesh.vertices)
    depth = np.zeros(len(sound), dtype=np.int64)
    for number in closed.tolist():
        around = closed[((low[closed] < low[number]) & (high[number] < high[closed])).all(axis=1)]
        for other in around:
            turns = igl.winding_number(mesh.vertices, mesh.faces[owner == other], mesh.vertices[[corner_of[number]]])
            depth[number] += round(abs(float(np.asarray(turns).ravel()[0])))
    wrong = sound & (volume != 0) & ((volume > 0) == (depth % 2 == 1))
    return wrong[owner]


def misoriented_edges(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return which edges of `edges(mesh)` have two faces that run along them in one direction, shape (e,)."""
    a, b = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    code = np.minimum(a, b) * mesh.n_vertices + np.maximum(a, b)
    _, place, counts = np.unique(code, return_inverse=True, return_counts=True)
    balance = np.bincount(place.ravel(), np.where(a < b, 1, -1))
    return (counts == 2) & (balance != 0)
