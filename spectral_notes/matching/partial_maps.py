"""Maps of a part: a cut body onto a whole one, with the overlap found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from spectral_notes._checks import FloatArray, IntArray, as_count
from spectral_notes.matching.shape_matching import landmark_pairs, match_shapes
from spectral_notes.meshes import TriangleMesh, connected_components, edge_lengths, edges

REACH = 1.5  # edges of the part, as large as it lies on the whole, from an image within which the whole counts as hit


@dataclass(frozen=True, eq=False)
class PartMatch:
    """Hold a map of a part onto a whole, and what of the whole it covers.

    Parameters
    ----------
    p2p_21 : (n2,) int, a vertex of the whole, shape 1, for each vertex of the part, shape 2
    overlap : (n1,) bool, which vertices of the whole the part covers; the rest is left unmapped
    doubt : from 0 to 1, of the last round, between the part and what was left of the whole, as of `match_shapes`
    reason : why the map may be wrong; empty where doubt is below one half
    """

    p2p_21: IntArray
    overlap: NDArray[np.bool_]
    doubt: float
    reason: str


def match_part(
    whole: TriangleMesh, part: TriangleMesh, landmarks: ArrayLike = (), *, k: int = 100, n_rounds: int = 3
) -> PartMatch:
    """Return a map from a part of a shape onto a whole one, in another pose perhaps, and the overlap.

    Both are matched as if they were whole; what of the whole no image comes near is cut off, and what is left is
    matched again. A cut changes the low modes, so give three landmarks: without, a tenth of the area less may be
    enough to mistake one side for the other.

    Parameters
    ----------
    whole, part : shapes 1 and 2, connected, consistently oriented
    landmarks : (q, 2) int, pairs (vertex of the whole, vertex of the part) of the same point
    k, n_rounds : modes of the map, and how often the overlap is matched, at least 1

    Returns
    -------
    The map, the overlap, and the doubt of the last round.

    Examples
    --------
    >>> from spectral_notes.shapes import coarse_copy, goat
    >>> whole = coarse_copy(goat(), 600)[0]
    >>> part, kept = cut_mesh(whole, whole.vertices[:, 0] < 0.7)  # without its head
    >>> landmarks = [[np.flatnonzero(kept)[i], i] for i in (0, 150, 300)]
    >>> found = match_part(whole, part, landmarks, k=40, n_rounds=2)
    >>> bool((found.overlap == kept).mean() > 0.95)
    True

    References
    ----------
    Rodolà et al., "Partial functional correspondence" (2017), for the problem; they find map and overlap together.
    """
    pairs = landmark_pairs(whole, part, landmarks)
    k, kept = as_count("k", k, 8, part.n_vertices), np.ones(whole.n_vertices, dtype=bool)
    for _ in range(as_count("n_rounds", n_rounds, 1)):
        region, kept = cut_mesh(whole, kept)
        old = np.flatnonzero(kept)
        inside = kept[pairs[:, 0]]
        marks = np.column_stack([np.searchsorted(old, pairs[inside, 0]), pairs[inside, 1]])
        match = match_shapes(region, part, marks, k=min(k, region.n_vertices))
        p2p_21 = old[match.p2p_21]
        kept = _near(whole, p2p_21, REACH * float(edge_lengths(part).mean()) * np.sqrt(region.area / part.area))
    return PartMatch(p2p_21, kept, match.doubt, match.reason)


def cut_mesh(mesh: TriangleMesh, keep: ArrayLike) -> tuple[TriangleMesh, NDArray[np.bool_]]:
    """Return the largest connected piece of the faces whose corners are all kept, and which vertices it holds.

    Parameters
    ----------
    mesh, keep : the shape, and (n,) bool: which of its vertices may stay

    Returns
    -------
    part: the piece with most faces, its vertices in their old order; kept (n,) bool: which vertices of the mesh it has.

    Examples
    --------
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


def _near(mesh: TriangleMesh, sources: IntArray, reach: float) -> NDArray[np.bool_]:
    """Which vertices lie within reach of a source, along edges."""
    ends, lengths = edges(mesh), edge_lengths(mesh)
    graph = csr_array((lengths, (ends[:, 0], ends[:, 1])), shape=(mesh.n_vertices, mesh.n_vertices))
    distances: FloatArray = dijkstra(graph, directed=False, indices=np.unique(sources), min_only=True, limit=reach)
    return np.isfinite(distances)
