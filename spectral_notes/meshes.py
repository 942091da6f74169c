"""Triangle meshes and point clouds: two frozen nouns, checked once when they are made, and their elementary facts.

A mesh is the pair (V, F): `vertices` (n, 3) holds positions, `faces` (m, 3) names three vertices a row,
counter-clockwise seen from outside. Every function here is a fact of that pair; none changes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import FloatArray, IntArray, Refusal, as_count, as_floats, as_indices, as_instance

LARGEST = 1e50  # coordinate; areas, and products of areas, are finite up to there
FLAT = 1e-15  # area over squared longest side below which a face has no area


@dataclass(frozen=True, eq=False, repr=False)
class TriangleMesh:
    """Hold a triangle mesh whose arrays were checked when it was made and cannot be written to.

    Parameters
    ----------
    vertices : (n, 3), positions, in the unit of the data; finite, within 1e50 of the origin
    faces : (m, 3), vertex indices, 0 .. n - 1; three different vertices a face (`clean_mesh` drops others)
    name : what the shape is called, for titles

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], name="triangle")
    >>> triangle, float(triangle.area)
    (TriangleMesh('triangle', 3 vertices, 1 faces), 0.5)
    """

    vertices: FloatArray
    faces: IntArray
    name: str = ""

    def __post_init__(self) -> None:
        vertices = _positions("vertices", self.vertices)
        faces = as_indices("faces", self.faces, ("m", 3), stop=len(vertices))
        if not len(faces):
            raise ValueError("faces must hold at least one triangle; for points alone use PointCloud")
        if not isinstance(self.name, str):
            raise TypeError(f"name must be a string; got {type(self.name).__name__}")
        twice = np.flatnonzero(_names_a_vertex_twice(faces))
        if len(twice):
            raise ValueError(
                f"faces must name three different vertices each; {len(twice)} do not, the first is face {twice[0]}: "
                f"{faces[twice[0]].tolist()}. clean_mesh(vertices, faces) drops them"
            )
        object.__setattr__(self, "vertices", _frozen(vertices))
        object.__setattr__(self, "faces", _frozen(faces))

    def __reduce__(self) -> tuple[Any, ...]:
        return TriangleMesh, (self.vertices, self.faces, self.name)

    def __repr__(self) -> str:
        return f"TriangleMesh({self.name!r}, {self.n_vertices} vertices, {self.n_faces} faces)"

    @property
    def n_vertices(self) -> int:
        """Number of vertices, n."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Number of faces, m."""
        return len(self.faces)

    @property
    def area(self) -> float:
        """Total area of the faces, in squared units of the vertices."""
        return float(face_areas(self).sum())


@dataclass(frozen=True, eq=False, repr=False)
class PointCloud:
    """Hold a point cloud whose array was checked when it was made and cannot be written to.

    Parameters
    ----------
    points : (n, 3), positions, in the unit of the data; finite, within 1e50 of the origin, at least one
    name : what the cloud is called, for titles

    Examples
    --------
    >>> PointCloud([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]).n_points
    2
    """

    points: FloatArray
    name: str = ""

    def __post_init__(self) -> None:
        points = _positions("points", self.points)
        if not len(points):
            raise ValueError("points must hold at least one point")
        if not isinstance(self.name, str):
            raise TypeError(f"name must be a string; got {type(self.name).__name__}")
        object.__setattr__(self, "points", _frozen(points))

    def __reduce__(self) -> tuple[Any, ...]:
        return PointCloud, (self.points, self.name)

    def __repr__(self) -> str:
        return f"PointCloud({self.name!r}, {self.n_points} points)"

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)


Shape = TriangleMesh | PointCloud


def as_mesh(value: object, name: str = "mesh") -> TriangleMesh:
    """Return `value` if it is a mesh, for functions that strangers call with arrays."""
    return as_instance(name, value, TriangleMesh, "TriangleMesh(vertices, faces) makes one of two arrays")


def positions(shape: Shape) -> FloatArray:
    """Return the positions of a mesh's vertices or a cloud's points, shape (n, 3)."""
    return shape.points if isinstance(shape, PointCloud) else as_mesh(shape, "shape").vertices


def clean_mesh(vertices: ArrayLike, faces: ArrayLike, name: str = "") -> TriangleMesh:
    """Return a mesh without exactly repeated vertices, broken or repeated faces, and vertices that no face uses.

    Vertices at the same position become one, which also sews the triangle soup of an STL file together. Then faces that
    name a vertex twice are dropped, of faces on the same three vertices the first is kept, and vertices without a face
    go; the order of what stays is kept.

    Parameters
    ----------
    vertices : (n, 3), positions
    faces : (m, 3), vertex indices, 0 .. n - 1; one at least must be left
    name : what the shape is called

    Examples
    --------
    >>> soup = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> clean_mesh(soup, [[0, 1, 2], [3, 4, 5], [3, 1, 2]])
    TriangleMesh('', 4 vertices, 2 faces)
    """
    vertices = as_floats("vertices", vertices, ("n", 3))
    faces = as_indices("faces", faces, ("m", 3), stop=len(vertices))
    _, first, same = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    faces = first[same.ravel()][faces]
    faces = faces[~_names_a_vertex_twice(faces)]
    _, kept = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = faces[np.sort(kept)]
    used, faces_in_used = np.unique(faces, return_inverse=True)
    return TriangleMesh(vertices[used], faces_in_used.reshape(-1, 3), name)


def edges(mesh: TriangleMesh) -> IntArray:
    """Return each edge once, shape (e, 2), as a row (i, j) with i < j, in lexicographic order.

    >>> edges(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).tolist()
    [[0, 1], [0, 2], [1, 2]]
    """
    return edges_with_counts(mesh)[0]


def edges_with_counts(mesh: TriangleMesh) -> tuple[IntArray, IntArray]:
    """Return `edges`, and (e,) the number of faces on each: 1 on the boundary, 2 inside, more where not a manifold.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> edges_with_counts(square)[1].tolist()
    [1, 2, 1, 1, 1]
    """
    faces = as_mesh(mesh).faces
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    code, counts = np.unique(pairs[:, 0] * mesh.n_vertices + pairs[:, 1], return_counts=True)
    return np.stack(np.divmod(code, mesh.n_vertices), axis=1), counts.astype(np.int64)


def edge_lengths(mesh: TriangleMesh) -> FloatArray:
    """Return the length of each edge of `edges(mesh)`, shape (e,), in units of the vertices."""
    i, j = edges(mesh).T
    return row_norms(mesh.vertices[j] - mesh.vertices[i])


def face_areas(mesh: TriangleMesh) -> FloatArray:
    """Return the area of each face, shape (m,), in squared units of the vertices: half the cross product's length.

    >>> face_areas(TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 1, 2]])).tolist()
    [3.0]
    """
    return row_norms(_area_vectors(mesh)) / 2.0


def face_normals(mesh: TriangleMesh) -> FloatArray:
    """Return the unit normal of each face, shape (m, 3), by the right-hand rule; zero for a face without area."""
    return _unit_rows(_area_vectors(mesh))


def vertex_normals(mesh: TriangleMesh) -> FloatArray:
    """Return the unit normal of each vertex, shape (n, 3): the mean of its faces' normals weighted by area."""
    return _unit_rows(faces_at_vertices(mesh) @ _area_vectors(mesh))


def faces_at_vertices(mesh: TriangleMesh) -> sp.csr_array:
    """Return the sparse 0-1 matrix, shape (n, m), whose row i marks the faces that have vertex i as a corner."""
    columns = np.repeat(np.arange(mesh.n_faces), 3)
    return sp.csr_array((np.ones(3 * mesh.n_faces), (mesh.faces.ravel(), columns)), (mesh.n_vertices, mesh.n_faces))


def corner_angles(mesh: TriangleMesh) -> FloatArray:
    """Return the angle at each corner of each face in radians, shape (m, 3); entry (f, c) is at vertex faces[f, c].

    >>> np.degrees(corner_angles(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))).round(6).tolist()
    [[90.0, 45.0, 45.0]]
    """
    p = mesh.vertices[mesh.faces]  # (m, 3, 3)
    towards_next, towards_last = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    cross = np.linalg.norm(np.cross(towards_next, towards_last), axis=2)
    return np.arctan2(cross, np.einsum("fcd,fcd->fc", towards_next, towards_last))


def flat_faces(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return True for each face without area, shape (m,): at most `FLAT` times its longest side squared."""
    corners = as_mesh(mesh).vertices[mesh.faces]
    longest_squared = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    return face_areas(mesh) <= FLAT * longest_squared


def need_areas(mesh: TriangleMesh, flat: NDArray[np.bool_] | None = None, remedy: str = "") -> None:
    """Raise unless every face has an area; `flat`, what `flat_faces` returns, may be known already."""
    flat = flat_faces(mesh) if flat is None else flat
    if flat.any():
        say = f"{flat.sum()} of its faces have none, the first is face {flat.argmax()}"
        raise Refusal(f"mesh must have no face without area; {say}" + (f". {remedy}" if remedy else ""))


def row_norms(rows: FloatArray) -> FloatArray:
    """Return the Euclidean length of each row of an (n, d) array, shape (n,)."""
    return np.sqrt(np.einsum("ij,ij->i", rows, rows))


def euler_characteristic(mesh: TriangleMesh) -> int:
    """Return chi = vertices - edges + faces; 2 for a sphere, 0 for a torus, 2 - 2 g for a closed surface of genus g.

    Vertices that no face uses are not counted.

    >>> tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> euler_characteristic(TriangleMesh(np.eye(4)[:, :3], tetrahedron))
    2
    """
    return len(np.unique(mesh.faces)) - len(edges(mesh)) + mesh.n_faces


def is_closed(mesh: TriangleMesh) -> bool:
    """Return True when every edge lies on at least two faces, so that the surface has no boundary."""
    return bool((edges_with_counts(mesh)[1] > 1).all())


def boundary_loops(mesh: TriangleMesh) -> list[IntArray]:
    """Return the boundary as closed loops of vertices in order, the longest first; none for a closed mesh.

    The faces need not be consistently oriented; loops that touch at a vertex are refused, as no walk is defined there.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> [loop.tolist() for loop in boundary_loops(square)]
    [[0, 1, 2, 3]]
    """
    pairs, counts = edges_with_counts(mesh)
    neighbours: dict[int, list[int]] = {}
    for i, j in pairs[counts == 1].tolist():
        neighbours.setdefault(i, []).append(j)
        neighbours.setdefault(j, []).append(i)
    for vertex, ends in neighbours.items():
        if len(ends) != 2:
            meet = f"{len(ends)} boundary edges meet at vertex {vertex}"
            raise ValueError(f"mesh must have separate boundary loops; {meet}")
    loops = []
    while neighbours:
        vertex = min(neighbours)
        loop = [vertex]
        step = min(neighbours.pop(vertex))
        while step in neighbours:
            loop.append(step)
            one, other = neighbours.pop(step)
            step = other if one == vertex or one not in neighbours else one
            vertex = loop[-1]
        loops.append(np.array(loop, dtype=np.int64))
    return sorted(loops, key=len, reverse=True)


def signed_volume(mesh: TriangleMesh) -> float:
    """Return the volume that the faces enclose, positive where they point outward, in cubed units of the vertices.

    A sum of tetrahedra from the mean of the vertices: of an open mesh it depends on that point.
    """
    a, b, c = (mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("fd,fd->", a, np.cross(b, c)) / 6.0)


def connected_components(mesh: TriangleMesh) -> IntArray:
    """Return the component number of each vertex, shape (n,), counted from 0; a vertex without a face stands alone.

    >>> two = TriangleMesh(np.arange(18.0).reshape(6, 3), [[0, 2, 4], [1, 3, 5]])
    >>> connected_components(two).tolist()
    [0, 1, 0, 1, 0, 1]
    """
    return pieces_of_graph(edges(mesh), mesh.n_vertices)


def pieces_of_graph(pairs: IntArray, n: int) -> IntArray:
    """Return the number of the piece that each of n nodes belongs to, shape (n,), where pairs (e, 2) join them."""
    graph = sp.coo_array((np.ones(len(pairs)), pairs.T), (n, n))
    return sp.csgraph.connected_components(graph, directed=False)[1].astype(np.int64)


def farthest_points(points: FloatArray, n: int, first: int = 0) -> IntArray:
    """Numbers of n points from coarse to fine: each lies farthest, in space, from those before it; none comes twice.

    Gonzalez, "Clustering to minimize the maximum intercluster distance" (1985): the first m of them cover all points
    within twice the radius of the best m.
    """
    chosen = np.full(as_count("n", n, 1, len(points)), first, dtype=np.int64)
    apart = np.full(len(points), np.inf)  # squared distance to the chosen
    for number in range(1, n):
        gaps = points - points[chosen[number - 1]]
        apart = np.minimum(apart, np.einsum("ij,ij->i", gaps, gaps))
        apart[chosen[number - 1]] = -1.0  # also where points coincide
        chosen[number] = apart.argmax()
    return chosen


def _positions(name: str, value: ArrayLike) -> FloatArray:
    """Finite positions (n, 3) whose areas are finite too."""
    positions = as_floats(name, value, ("n", 3))
    largest = float(np.abs(positions).max(initial=0.0))
    if largest > LARGEST:
        raise ValueError(f"{name} must lie within {LARGEST:g} of the origin; found {largest:g}: choose another unit")
    return positions


def _area_vectors(mesh: TriangleMesh) -> FloatArray:
    """Normal of each face, as long as twice its area."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _names_a_vertex_twice(faces: IntArray) -> NDArray[np.bool_]:
    """True for each face with fewer than three different vertices."""
    return (faces == np.roll(faces, 1, axis=1)).any(axis=1)


def _unit_rows(rows: FloatArray) -> FloatArray:
    """Each row divided by its length; zero rows stay zero."""
    lengths = row_norms(rows)
    return rows / np.where(lengths > 0, lengths, 1.0)[:, None]


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The array, made read-only."""
    array.flags.writeable = False
    return array
