"""Moving on a surface: geodesic distances, paths of faces, and parallel transport of an arrow from face to face."""

from __future__ import annotations

import pickle
import subprocess
import sys
from itertools import pairwise
from typing import Any

import igl
import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csgraph, csr_array

from spectral_notes._checks import FloatArray, IntArray, as_floats, as_indices
from spectral_notes.meshes import (
    TriangleMesh,
    as_mesh,
    connected_components,
    edge_lengths,
    edges,
    face_normals,
    flat_faces,
    pieces_of_graph,
    row_norms,
)

SHORT = 1e-6  # of the size of its piece: an edge taken for a point
LARGE = 8_000  # faces, from which on libigl takes seconds


def geodesic_distances(mesh: TriangleMesh, sources: ArrayLike) -> FloatArray:
    """Return the length of the shortest path on the mesh from each vertex to the nearest source, across faces, exactly.

    Where fans of faces meet in one vertex, paths lead through it. Vertices joined by an edge shorter than a millionth
    of their piece of the mesh count as one. Seconds for ten thousand vertices become minutes for forty thousand; large
    work is done in a process of its own, which an interrupt ends. `heat_distances` is fast, and errs by a percent.
    (Mitchell, Mount and Papadimitriou, "The discrete geodesic problem", 1987, by libigl.)

    Parameters
    ----------
    mesh : with at most two faces on an edge
    sources : (p,), vertices where the distance is zero, at least one

    Returns
    -------
    d : (n,), in units of the vertices; infinite where no path leads

    Raises
    ------
    ValueError
        If an edge has more than two faces, or short edges form chains.
    RuntimeError
        If the process of its own is ended from outside.

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> geodesic_distances(square, [1]).round(6).tolist()  # the way from 1 to 3 crosses the diagonal
    [1.0, 0.0, 1.0, 1.414214]
    """
    mesh = as_mesh(mesh)
    sources = as_indices("sources", sources, ("p",), mesh.n_vertices)
    if not len(sources):
        raise ValueError("sources must name at least one vertex")
    _refuse_crowded_edges(mesh.faces, "have more: see health(mesh)")
    point = _points_of_short_edges(mesh)
    corners = point[mesh.faces]
    faces = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    _refuse_crowded_edges(faces, f"have more, when those below {SHORT:g} of the size are points: try heat_distances")
    fans, owner = _fans(faces)
    reached = np.full(len(owner), np.inf)
    distances = np.full(mesh.n_vertices, np.inf)
    distances[point[sources]] = 0.0
    waiting = np.bincount(owner, minlength=mesh.n_vertices) > 1  # Dijkstra's order: sources, then where fans meet
    waiting[point[sources]] = True
    while (waiting & (distances < np.inf)).any():
        nearest = distances[waiting].min()
        now = waiting & (distances == nearest)
        waiting &= ~now
        late = np.flatnonzero(now[owner] & (reached > nearest * (1.0 + 1e-12)))
        if len(late):
            reached = np.minimum(reached, nearest + _distances_in_pieces(mesh.vertices[owner], fans, late))
            np.minimum.at(distances, owner, reached)
    return distances[point]


def path_lengths(
    mesh: TriangleMesh, sources: IntArray, *, reach: float = np.inf, from_nearest: bool = False
) -> FloatArray:
    """The lengths (s, n) of shortest ways along edges, infinite beyond reach; or (n,), from the nearest source."""
    ends, lengths = edges(mesh), edge_lengths(mesh)
    graph = csr_array((lengths, (ends[:, 0], ends[:, 1])), shape=(mesh.n_vertices, mesh.n_vertices))
    return np.asarray(csgraph.dijkstra(graph, directed=False, indices=sources, min_only=from_nearest, limit=reach))


def _refuse_crowded_edges(faces: IntArray, say: str) -> None:
    """Refuse edges with more than two faces, on which libigl ends the interpreter."""
    pairs = np.sort(np.concatenate([faces, np.roll(faces, -1, axis=1)]).reshape(2, -1).T, axis=1)
    crowded = int((np.unique(pairs, axis=0, return_counts=True)[1] > 2).sum())
    if crowded:
        raise ValueError(f"mesh must have at most two faces on each edge; {crowded} edges {say}")


def _points_of_short_edges(mesh: TriangleMesh) -> IntArray:
    """For each vertex the first of those that short edges join it to; libigl does not come back from shorter ones."""
    piece = connected_components(mesh)
    low, high = np.full((2, piece.max(initial=0) + 1, 3), np.inf)
    np.minimum.at(low, piece, mesh.vertices)
    np.minimum.at(high, piece, -mesh.vertices)
    size = (-high - low).max(axis=1)[piece]
    pairs = edges(mesh)
    label = pieces_of_graph(pairs[edge_lengths(mesh) <= SHORT * size[pairs[:, 0]]], mesh.n_vertices)
    point = np.unique(label, return_index=True)[1][label]
    strays = row_norms(mesh.vertices - mesh.vertices[point]) > 10.0 * SHORT * size
    if strays.any():
        raise ValueError(
            f"mesh must have no chain of edges shorter than {SHORT:g} of its size that leads further than ten of them; "
            f"{strays.sum()} vertices lie on such, the first is {strays.argmax()}: heat_distances takes them"
        )
    return point


def _fans(faces: IntArray) -> tuple[IntArray, IntArray]:
    """The faces on a vertex of its own for each fan, a set of faces round a vertex joined by edges, and its vertex."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    here = np.arange(len(start))
    there = np.roll(here.reshape(-1, 3), -1, axis=1).ravel()
    order = np.lexsort((np.maximum(start, end), np.minimum(start, end)))
    low, high = np.where(start < end, (here, there), (there, here))[:, order]  # corners at the ends of each half edge
    flat = faces.ravel()
    twins = (flat[low[1:]] == flat[low[:-1]]) & (flat[high[1:]] == flat[high[:-1]])
    pairs = np.concatenate([np.c_[ends[1:], ends[:-1]][twins] for ends in (low, high)])
    label = pieces_of_graph(pairs, len(flat))
    return label.reshape(-1, 3), flat[np.unique(label, return_index=True)[1]]


def _distances_in_pieces(vertices: FloatArray, faces: IntArray, starts: IntArray) -> FloatArray:
    """Distances to the nearest start by libigl, each piece by itself in units of its size."""
    distances = np.full(len(vertices), np.inf)
    piece = connected_components(TriangleMesh(vertices, faces))
    for number in np.unique(piece[starts]):
        here = np.flatnonzero(piece == number)
        local = np.cumsum(piece == number) - 1
        at = vertices[here] - vertices[here[0]]
        size = float(np.ptp(at, axis=0).max())  # igl compares lengths with numbers of its own
        none = np.zeros(0, dtype=np.int64)
        corners = local[faces[piece[faces[:, 0]] == number]]
        call = (at / size, corners, local[starts[piece[starts] == number]], none, np.arange(len(here)), none)
        found = igl.exact_geodesic(*call) if len(corners) < LARGE else _elsewhere(call)
        distances[here] = size * np.asarray(found).ravel()
    return distances


def _elsewhere(call: tuple[Any, ...]) -> FloatArray:
    """What `igl.exact_geodesic` returns, from another process: compiled code hears no interrupt."""
    code = "import igl, pickle, sys; pickle.dump(igl.exact_geodesic(*pickle.load(sys.stdin.buffer)), sys.stdout.buffer)"
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(call), capture_output=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the process for geodesic distances ended with {done.returncode}: {done.stderr.decode()}")
    return np.asarray(pickle.loads(done.stdout))


def parallel_transport(mesh: TriangleMesh, path: ArrayLike, arrow: ArrayLike) -> FloatArray:
    """Return an arrow carried along a path of faces without turning in the surface, one arrow a face of the path.

    At each step the next face is unfolded about the shared edge into the plane of the last; the arrow keeps its length
    and its angle to that edge. Round a closed path it comes back turned by the enclosed Gaussian curvature.

    Parameters
    ----------
    mesh : oriented it need not be
    path : (p,), faces with an area, each sharing an edge with the next
    arrow : (3,), the arrow in the first face; what sticks out of the face's plane is left off

    Returns
    -------
    arrows : (p, 3), the arrow in each face's plane

    Examples
    --------
    >>> roof = TriangleMesh([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, -1]], [[0, 2, 1], [0, 1, 3]])
    >>> parallel_transport(roof, [0, 1], [-1.0, 0.0, 0.0]).round(12).tolist()  # over the edge and down
    [[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    """
    mesh = as_mesh(mesh)
    path = as_indices("path", path, ("p",), mesh.n_faces)
    if not len(path) or flat_faces(mesh)[path].any():
        raise ValueError("path must name at least one face, and only faces with an area")
    normals = face_normals(mesh)
    start = as_floats("arrow", arrow, (3,))
    arrows = [start - (start @ normals[path[0]]) * normals[path[0]]]
    for here, there in pairwise(path):
        shared = np.intersect1d(mesh.faces[here], mesh.faces[there])
        if len(shared) != 2:
            raise ValueError(f"path must go from face to neighbouring face; {here} and {there} share no single edge")
        along = mesh.vertices[shared[1]] - mesh.vertices[shared[0]]
        along = along / np.linalg.norm(along)
        across_here, across_there = np.cross(normals[here], along), np.cross(normals[there], along)
        if _follows(mesh.faces[here], shared) == _follows(mesh.faces[there], shared):
            across_there = -across_there  # the two are turned differently: one normal points to the other side
        arrows.append((arrows[-1] @ along) * along + (arrows[-1] @ across_here) * across_there)
    return np.array(arrows)


def _follows(face: IntArray, edge: IntArray) -> bool:
    """Whether a face walks from the first end of an edge to the second."""
    return bool(((face == edge[0]) & (np.roll(face, -1) == edge[1])).any())


def faces_under_arcs(mesh: TriangleMesh, corners: ArrayLike) -> IntArray:
    """Return the faces that a chain of great arcs crosses, in order: a path for `parallel_transport`.

    Arcs and faces are compared as the origin sees them. A face is left through the edge that leads from the right of
    the arc to its left, and neighbours in the path always share that edge.

    Parameters
    ----------
    mesh : surrounds the origin and turns its outside to every ray from there, such as a sphere
    corners : (p, 3), two points at least that the chain joins, each over the inside of a face
        No two that follow each other lie on one line through the origin, their distance from which does not matter.
        End with the first one to close the chain.

    Examples
    --------
    >>> tetrahedron = TriangleMesh(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> faces_under_arcs(tetrahedron, [[1, 1, -1], [-1, -1, -1], [-1, 1, 1]]).tolist()
    [0, 3, 1]
    """
    corners = as_floats("corners", corners, ("p", 3))
    if len(corners) < 2:
        raise ValueError(f"corners must hold at least two points; got {len(corners)}")
    homes = _faces_under(mesh, corners).tolist()
    path = [homes[0]]
    for number in range(len(corners) - 1):
        left = np.cross(corners[number], corners[number + 1])
        if np.linalg.norm(left) <= 1e-12 * np.linalg.norm(corners[number]) * np.linalg.norm(corners[number + 1]):
            raise ValueError(f"corners must be joined by arcs; {number} and {number + 1} lie on a line with the origin")
        following = _faces_along_circle(mesh, left)
        for _ in range(len(following)):
            if path[-1] == homes[number + 1] or path[-1] not in following:
                break
            path.append(following[path[-1]])
        if path[-1] != homes[number + 1]:
            raise ValueError(f"mesh must surround the origin; no way leads from corner {number} to {number + 1}")
    return np.array(path, dtype=np.int64)


def _faces_under(mesh: TriangleMesh, points: FloatArray) -> IntArray:
    """The faces through whose inside the rays from the origin to the points go."""
    ends = np.roll(mesh.faces, -1, axis=1)
    sides = np.cross(mesh.vertices[mesh.faces], mesh.vertices[ends])  # (m, 3, 3), planes through the origin
    inside = (sides @ points.T).min(axis=1)  # (m, p)
    outside = np.flatnonzero(inside.max(axis=0) <= 1e-12 * np.linalg.norm(points, axis=1))
    if len(outside):
        point = points[outside[0]].tolist()
        raise ValueError(f"corners must lie over the inside of faces; {point} does not: move it a little")
    return np.argmax(inside, axis=0).astype(np.int64)


def _faces_along_circle(mesh: TriangleMesh, left: FloatArray) -> dict[int, int]:
    """The face that follows each face crossed by the great circle whose left side is given."""
    is_left = mesh.vertices @ left >= 0.0
    starts, ends = mesh.faces, np.roll(mesh.faces, -1, axis=1)
    leaving, entering = ~is_left[starts] & is_left[ends], is_left[starts] & ~is_left[ends]
    after = dict(zip(zip(ends[entering], starts[entering], strict=True), np.nonzero(entering)[0], strict=True))
    edges = zip(starts[leaving], ends[leaving], strict=True)
    faces = np.nonzero(leaving)[0]
    return {int(face): int(after[edge]) for face, edge in zip(faces, edges, strict=True) if edge in after}
