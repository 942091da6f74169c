"""Laplacians of intervals, graphs, meshes, point clouds and solids, each as the pair (L, M) of one eigenproblem.

    L phi = lambda M phi

`L` is weak (integrated over each vertex's patch), symmetric and positive semidefinite: f^T L f is the Dirichlet energy.
`M` is the mass matrix: f^T M g is the inner product. The pointwise Laplacian is M^-1 L; the sign is that of -d^2/dx^2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from spectral_notes._checks import (
    FloatArray,
    IntArray,
    Refusal,
    as_choice,
    as_count,
    as_floats,
    as_indices,
    as_instance,
    as_number,
    as_symmetric,
)
from spectral_notes.finite_differences import ENDS, second_difference
from spectral_notes.meshes import FLAT, PointCloud, TriangleMesh, as_mesh, need_areas, row_norms

Pair = tuple[sp.csr_array, sp.csr_array]

MASSES = ("lumped", "voronoi", "full")
BLOCK = 20_000  # points whose neighbourhoods are held at once
FLAT_ANGLE = 1e-9  # sine of the angle at the point, below which a triangle of its star is a line
TIE = 1e-7  # of the squared gap to the nearest point: by how much a point's own number parts four on one circle
COPY = 10.0  # weight between copies of a point of a cloud; an edge of even triangles has 0.6


def interval_laplacian(n: int, length: float = 1.0, *, ends: str = "neumann") -> Pair:
    """Return the positive semidefinite Laplacian of an interval or a circle from n equally spaced samples.

    With spacing h, ``f @ L @ f`` is the sum of (f[i+1] - f[i])^2 / h, and `M` holds the trapezoid weights.

    Parameters
    ----------
    n : number of samples, at least 3
    length : length of the interval, or of the circle, positive
    ends : {"neumann", "dirichlet", "periodic"}
        Free ends: samples include both, h = length / (n - 1). Fixed ends: samples are inside, h = length / (n + 1). A
        circle: h = length / n.

    Returns
    -------
    L : (n, n) csr_array, weak, in 1 / length
    M : (n, n) csr_array, diagonal, in length; it sums to the length when the ends are free or joined

    Examples
    --------
    >>> L, M = interval_laplacian(3, 2.0)
    >>> L.toarray().tolist(), M.diagonal().tolist()
    ([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]], [0.5, 1.0, 0.5])
    """
    n = as_count("n", n, 3)
    length = as_number("length", length, above=0.0)
    ends = as_choice("ends", ends, ENDS)
    h = length / {"neumann": n - 1, "dirichlet": n + 1, "periodic": n}[ends]
    mass = np.full(n, h)
    if ends == "neumann":
        mass[[0, -1]] /= 2.0
    return second_difference(n, ends=ends).sorted_indices() / h, _diagonal(mass)


def graph_laplacian(W: Any, *, mass: str = "identity") -> Pair:
    """Return the positive semidefinite graph Laplacian L = D - W, where D holds the row sums of the weights W.

    ``f @ L @ f`` is the sum of W[i, j] (f[i] - f[j])^2 over the edges (Chung, *Spectral Graph Theory*, 1997, ch. 1).

    Parameters
    ----------
    W : (n, n) sparse or dense, symmetric edge weights, not negative
        W[i, j] > 0 where i and j are joined. Its diagonal cancels.
    mass : {"identity", "degree"}
        "identity" counts each vertex once. "degree" sets M = D, for normalised cuts; every vertex then needs an edge.

    Returns
    -------
    L : (n, n) csr_array, in units of the weights
    M : (n, n) csr_array, diagonal

    Examples
    --------
    >>> L, M = graph_laplacian([[0, 1, 0], [1, 0, 2], [0, 2, 0]])
    >>> L.toarray().tolist()
    [[1.0, -1.0, 0.0], [-1.0, 3.0, -2.0], [0.0, -2.0, 2.0]]
    """
    W = as_symmetric("W", W)
    mass = as_choice("mass", mass, ("identity", "degree"))
    if W.nnz and W.data.min() < 0:
        raise ValueError(f"W must hold no negative weight; the smallest is {W.data.min():g}")
    degree = W.sum(axis=1)
    if mass == "degree" and not degree.all():
        lone = int(np.flatnonzero(degree == 0)[0])
        raise ValueError(f"W must give every vertex an edge when mass='degree'; vertex {lone} has none")
    L = sp.csr_array(sp.diags_array(degree) - W)
    L.eliminate_zeros()
    return L, _diagonal(np.ones(len(degree)) if mass == "identity" else degree)


def cotan_laplacian(mesh: TriangleMesh, *, mass: str = "lumped") -> Pair:
    """Return the positive semidefinite cotangent Laplacian of a mesh: linear finite elements on its triangles.

    The entry of edge ij is L[i, j] = -(cot alpha + cot beta) / 2, with the angles opposite that edge; rows sum to zero
    (Pinkall and Polthier, "Computing discrete minimal surfaces and their conjugates", 1993, eq. 8 and 9).

    Parameters
    ----------
    mesh : every face with an area (else `robust_mesh_laplacian`), every vertex with a face (`clean_mesh` drops others)
        A boundary has Neumann's condition: nothing flows out.
    mass : {"lumped", "voronoi", "full"}, see `mass_matrix`

    Returns
    -------
    L : (n, n) csr_array, weak, without unit: scaling the mesh leaves it unchanged
    M : (n, n) csr_array, in squared units of the vertices; its entries sum to the area

    Examples
    --------
    >>> L, M = cotan_laplacian(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> L.toarray().round(12).tolist()
    [[1.0, -0.5, -0.5], [-0.5, 0.5, 0.0], [-0.5, 0.0, 0.5]]
    """
    kind = as_choice("mass", mass, MASSES)
    _refuse_lone_vertices(mesh)
    areas, squared, dots = _corners(mesh)
    need_areas(mesh, areas <= FLAT * squared.max(axis=0), "$robust works on such meshes")
    cotangents = (dots / (2.0 * areas)).ravel()  # (3 m,), at corners i, then j, then k
    i, j, k = mesh.faces.T.astype(np.int32)
    n = mesh.n_vertices
    W = sp.csr_array((cotangents / 2.0, (np.concatenate([j, k, i]), np.concatenate([k, i, j]))), (n, n))
    W = W + W.T  # W[i, j] = (cot alpha + cot beta) / 2, each cotangent given to the edge opposite its corner
    return sp.csr_array(sp.diags_array(W.sum(axis=1), format="csr") - W), _mass(mesh, areas, squared, dots, kind)


def mass_matrix(mesh: TriangleMesh, *, kind: str = "lumped") -> sp.csr_array:
    """Return the mass matrix of a mesh: f^T M g is the integral of f g, and 1^T M 1 the area.

    Parameters
    ----------
    mesh : every vertex with a face that has an area
    kind : {"lumped", "voronoi", "full"}
        "full" integrates the products of hat functions exactly: area / 6 on the diagonal and area / 12 off it, for each
        triangle; for eigenvalues that bound those of the surface from above. "lumped" gives each corner a third of its
        triangles' areas, the sum of the full one's row; for everything that is integrated. "voronoi" gives each corner
        what lies nearest to it, in an obtuse triangle half the area to the obtuse corner and a quarter to the others;
        for pointwise values such as curvatures (Meyer, Desbrun, Schroeder and Barr, "Discrete differential-geometry
        operators", 2003, section 3.3).

    Returns
    -------
    M : (n, n) csr_array, symmetric positive definite, in squared units of the vertices

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> mass_matrix(triangle, kind="full").toarray()[0] * 24
    array([2., 1., 1.])
    >>> mass_matrix(triangle, kind="voronoi").diagonal().tolist()
    [0.25, 0.125, 0.125]
    """
    kind = as_choice("kind", kind, MASSES)
    _refuse_lone_vertices(mesh)
    M = _mass(mesh, *_corners(mesh), kind)
    if not M.diagonal().all():
        vertex = int(np.argmin(M.diagonal()))
        raise ValueError(f"mesh must have a face with an area at every vertex; those of vertex {vertex} have none")
    return M


def robust_mesh_laplacian(mesh: TriangleMesh) -> Pair:
    """Return the positive semidefinite robust Laplacian of a mesh, whatever the quality of its triangles.

    It is the cotangent Laplacian of the intrinsic Delaunay triangulation of the mesh's double cover: its off-diagonal
    entries are never positive, slivers do no harm, and non-manifold edges are allowed (Sharp and Crane, "A Laplacian
    for Nonmanifold Triangle Meshes", 2020).

    Parameters
    ----------
    mesh : neither manifold nor oriented need it be; every vertex has a face (`clean_mesh` drops others)

    Returns
    -------
    L, M : (n, n) csr_array, weak Laplacian and lumped mass, in the units of `cotan_laplacian`

    Examples
    --------
    >>> L, M = robust_mesh_laplacian(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> round(float(M.diagonal().sum()), 3)
    0.5
    """
    _refuse_lone_vertices(mesh)
    L, M = robust_laplacian.mesh_laplacian(mesh.vertices, mesh.faces)
    if not np.isfinite(L.data).all():
        raise ValueError("mesh must not be a point, nor so small that its areas vanish")
    return sp.csr_array(L), sp.csr_array(M)


def robust_cloud_laplacian(cloud: PointCloud, *, n_neighbors: int = 30) -> Pair:
    """Return the positive semidefinite robust Laplacian of a point cloud, from triangles of each point's neighbours.

    It is the mean of three `robust_mesh_laplacian`: of the triangles that lie in the star of at least one, two and all
    three of their corners (Sharp and Crane, 2020, section 5.7). Off-diagonal entries are never positive. Copies of a
    point share its mass, joined by edges.

    Parameters
    ----------
    cloud : points on a surface, no neighbourhood on a line; in any unit, wherever they lie
    n_neighbors : neighbours that give each point its tangent plane and its star, 3 .. n_points - 1
        Where farther ones could belong to the star, twice as many are asked.

    Returns
    -------
    L, M : (n, n) csr_array, weak Laplacian and lumped mass, in the units of `cotan_laplacian`

    Examples
    --------
    >>> points = np.random.default_rng(0).standard_normal((400, 3))
    >>> sphere = PointCloud(points / np.linalg.norm(points, axis=1)[:, None])
    >>> L, M = robust_cloud_laplacian(sphere)
    >>> round(float(M.sum() / (4 * np.pi)), 2)  # the area, near that of the sphere
    0.99
    """
    cloud = as_instance("cloud", cloud, PointCloud, "PointCloud(points) makes one; for a mesh, robust_mesh_laplacian")
    n_neighbors = as_count("n_neighbors", n_neighbors, 3, cloud.n_points - 1)
    _, first, copy_of = np.unique(cloud.points + 0.0, axis=0, return_index=True, return_inverse=True)
    if len(first) < 3:
        raise ValueError(f"cloud must lie on a surface; it holds {len(first)} different points, and three make one")
    size = float(np.ptp(cloud.points, axis=0).max())
    points = (cloud.points[first] - cloud.points[first].mean(axis=0)) / size
    own = np.random.default_rng(0).random(cloud.n_points)[first]
    faces, seen = _star_triangles(points, own, min(n_neighbors, len(first) - 1))
    lone = np.flatnonzero(np.bincount(faces.ravel(), minlength=len(first)) == 0)
    if len(lone):
        raise ValueError(
            f"cloud must lie on a surface; no triangle was found at {len(lone)} points, the first is point "
            f"{first[lone].min()}: their neighbours lie on a line. A larger n_neighbors reaches others"
        )
    L = M = sp.csr_array((len(first), len(first)))
    for least in (1, 2, 3):
        L_here, M_here = _layer(points, faces[seen >= least])
        L, M = L + L_here / 3.0, M + M_here / 3.0
    M = M * size * size
    if not 0.0 < M.diagonal().min() <= M.diagonal().max() < np.inf:
        raise ValueError(f"cloud must have areas that numbers can hold; its largest side is {size:g}: change its unit")
    return _with_copies(L, M, first, copy_of.ravel())


def tetrahedral_laplacian(vertices: ArrayLike, tets: ArrayLike, *, mass: str = "lumped") -> Pair:
    """Return the positive semidefinite Laplacian of a solid: linear finite elements on its tetrahedra.

    ``f @ L @ f`` is the integral of the squared slope of f over the solid. Its surface is free: nothing flows out
    (Strang and Fix, *An Analysis of the Finite Element Method*, 2008, ch. 1).

    Parameters
    ----------
    vertices : (n, 3), places of the vertices; each belongs to a tetrahedron
    tets : (m, 4), the corners of each tetrahedron, which has a volume, as places in `vertices`, in any order
    mass : {"lumped", "full"}
        "lumped" gives each corner a quarter of its tetrahedra's volumes; "full" integrates products exactly, and its
        eigenvalues bound those of the solid that the tetrahedra fill from above.

    Returns
    -------
    L : (n, n) csr_array, weak, in units of the vertices
    M : (n, n) csr_array, in cubed units; its entries sum to the volume

    Examples
    --------
    >>> L, M = tetrahedral_laplacian([[0, 0, 0], [6, 0, 0], [0, 6, 0], [0, 0, 6]], [[0, 1, 2, 3]])
    >>> L.toarray().round(12).tolist()[0], round(float(M.sum()), 9)
    ([3.0, -1.0, -1.0, -1.0], 36.0)
    """
    vertices = as_floats("vertices", vertices, ("n", 3))
    n = len(vertices)
    tets = as_indices("tets", tets, ("m", 4), n)
    mass = as_choice("mass", mass, ("lumped", "full"))
    lone = np.flatnonzero(np.bincount(tets.ravel(), minlength=n) == 0)
    if len(lone):
        raise ValueError(f"tets must use every vertex; {len(lone)} have none, the first is vertex {lone[0]}: drop them")
    sides = vertices[tets[:, 1:]] - vertices[tets[:, :1]]  # (m, 3, 3)
    volumes = abs(np.linalg.det(sides)) / 6.0
    flat = np.flatnonzero(volumes <= FLAT * np.abs(sides).max(axis=(1, 2)) ** 3)
    if len(flat):
        raise ValueError(
            f"tets must have a volume; {len(flat)} have none, the first is tetrahedron {flat[0]}: drop them"
        )
    slopes = np.linalg.inv(sides).swapaxes(1, 2)  # (m, 3, 3), of the barycentric coordinates of corners 1, 2, 3
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)  # (m, 4, 3), with corner 0
    stiffness = volumes[:, None, None] * (slopes @ slopes.swapaxes(1, 2))
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, (1, 4)).ravel()
    L = sp.csr_array((stiffness.ravel(), (rows, columns)), (n, n))
    if mass == "lumped":
        return L, _diagonal(np.bincount(tets.ravel(), np.repeat(volumes / 4.0, 4)).astype(np.float64))
    entries = volumes[:, None, None] * (1.0 + np.eye(4)) / 20.0
    return L, sp.csr_array((entries.ravel(), (rows, columns)), (n, n))


def _star_triangles(points: FloatArray, own: FloatArray, n_neighbors: int) -> tuple[IntArray, IntArray]:
    """The triangles of all stars of different points, each once, and how many of its corners see it, 1 to 3.

    A star is a point's triangles in the Delaunay triangulation of its neighbours; where farther points could belong to
    it, twice as many are asked. `own` holds a number 0 .. 1 a point, which decides among four points on one circle.
    """
    tree = cKDTree(points)
    lifts = TIE * tree.query(points, 2)[0][:, 1] ** 2 * own  # smaller than any squared gap
    found = []
    for begin in range(0, len(points), BLOCK):
        here = np.arange(begin, min(begin + BLOCK, len(points)))
        gaps, near = tree.query(points[here], n_neighbors + 1)
        around = points[near] - points[near[:, :1]]
        around -= around.mean(axis=1, keepdims=True)
        axes = np.linalg.eigh(around.transpose(0, 2, 1) @ around)[1][:, :, 1:]  # (b, 3, 2), of their plane
        corners, sure = _stars(points, lifts, axes, gaps, near)
        found.append(corners[sure[corners[:, 0] - begin]])
        if not sure.all():
            wider = tree.query(points[here[~sure]], min(2 * n_neighbors, len(points) - 1) + 1)
            found.append(_stars(points, lifts, axes[~sure], *wider)[0])
    triangles, seen = np.unique(np.sort(np.concatenate(found), axis=1), axis=0, return_counts=True)
    return triangles.astype(np.int64), seen


def _stars(
    points: FloatArray, lifts: FloatArray, axes: FloatArray, gaps: FloatArray, near: IntArray
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Triangles of each point's star among its neighbours, and whether no farther point can belong to it.

    Distances are taken in space: what lies on one circle there does so for each of its points, whatever their planes.
    """
    around = points[near[:, 1:]] - points[near[:, :1]]  # (b, k, 3)
    powers = (around**2).sum(axis=2) + lifts[near[:, :1]] - lifts[near[:, 1:]]
    q = around @ axes / powers[..., None]
    row, one, two, sure = _walk_round(q)
    a, b = q[row, one], q[row, two]
    diameters = np.linalg.norm(b - a, axis=1) / abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])  # of circumscribed circles
    sure[row[diameters > gaps[row, -1]]] = False
    return np.column_stack([near[row, 0], near[row, one + 1], near[row, two + 1]]), sure


def _walk_round(q: FloatArray) -> tuple[IntArray, IntArray, IntArray, NDArray[np.bool_]]:
    """The Delaunay star of the origin among points p, from q = p / |p|^2: rows, and two neighbours that follow there.

    A circle through the origin becomes a line, and an empty one a line with all points on one side. So the triangles at
    the origin are the edges of the convex hull of all q and the origin that do not end there: a walk round the hull
    (Jarvis, "On the identification of the convex hull of a finite set of points in the plane", 1973). Last comes
    whether the walk closed; where a boundary stops it, it goes on the other way round from its start.
    """
    lengths = np.linalg.norm(q, axis=2)
    start = lengths.argmax(axis=1)  # the nearest point, surely on the hull
    closed = np.ones(len(q), dtype=bool)
    rows = np.arange(len(q))
    found = []
    for turn in (1.0, -1.0):
        at = start[rows]
        for _ in range(q.shape[1]):
            here = q[rows, at]
            across = turn * (here[:, None, 0] * q[rows, :, 1] - here[:, None, 1] * q[rows, :, 0])
            along = (q[rows] @ here[:, :, None])[..., 0] - (here**2).sum(axis=1)[:, None]
            ahead = across > FLAT_ANGLE * lengths[rows, at][:, None] * lengths[rows]
            following = np.where(ahead, along / np.where(ahead, across, 1.0), -np.inf).argmax(axis=1)
            goes = ahead.any(axis=1)
            closed[rows[~goes]] = False
            found.append((rows[goes], at[goes], following[goes]))
            goes &= following != start[rows]
            rows, at = rows[goes], following[goes]
        rows = np.flatnonzero(~closed)
    row, one, two = (np.concatenate(column) for column in zip(*found, strict=True))
    return row, one, two, closed


def _layer(points: FloatArray, faces: IntArray) -> Pair:
    """L and M of some triangles, with empty rows at points that have none."""
    n = len(points)
    if not len(faces):
        return sp.csr_array((n, n)), sp.csr_array((n, n))
    used, corners = np.unique(faces, return_inverse=True)
    into = sp.csr_array((np.ones(len(used)), (used, np.arange(len(used)))), (n, len(used)))
    L, M = robust_laplacian.mesh_laplacian(points[used], corners.reshape(-1, 3))
    return sp.csr_array(into @ L @ into.T), sp.csr_array(into @ M @ into.T)


def _with_copies(L: sp.csr_array, M: sp.csr_array, first: IntArray, copy_of: IntArray) -> Pair:
    """L and M of the different points, given to the first of their copies, and the copies joined to it."""
    n = len(copy_of)
    into = sp.csr_array((np.ones(len(first)), (first, np.arange(len(first)))), (n, len(first)))
    mass = (M.diagonal() / np.bincount(copy_of))[copy_of]
    copies = np.flatnonzero(first[copy_of] != np.arange(n))
    W = sp.csr_array((np.full(len(copies), COPY), (copies, first[copy_of[copies]])), (n, n))
    W = W + W.T
    joined = sp.diags_array(W.sum(axis=1)) - W
    return sp.csr_array(into @ L @ into.T + joined), sp.csr_array(sp.diags_array(mass))


def _diagonal(entries: FloatArray) -> sp.csr_array:
    """A diagonal matrix."""
    return sp.csr_array(sp.diags_array(entries))


def _corners(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Areas (m,); and for each corner the squared side opposite, and the dot product of its two sides, (3, m) each."""
    i, j, k = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    a, b, c = j - i, k - j, i - k
    areas = row_norms(np.cross(a, b)) / 2.0
    return areas, np.array([_dot(b, b), _dot(c, c), _dot(a, a)]), -np.array([_dot(c, a), _dot(a, b), _dot(b, c)])


def _mass(mesh: TriangleMesh, areas: FloatArray, squared: FloatArray, dots: FloatArray, kind: str) -> sp.csr_array:
    """Mass matrix from what `_corners` gives."""
    n = mesh.n_vertices
    if kind == "full":
        rows, columns = np.repeat(mesh.faces, 3, axis=1), np.tile(mesh.faces, (1, 3))  # (m, 9)
        entries = areas[:, None] * (1.0 + (rows == columns)) / 12.0
        return sp.csr_array((entries.ravel(), (rows.ravel(), columns.ravel())), (n, n))
    shares = np.tile(areas / 3.0, (3, 1))
    if kind == "voronoi":
        obtuse = dots < 0.0
        blunt = obtuse.any(axis=0) | (areas == 0.0)
        products = squared * dots / np.where(blunt, 1.0, 2.0 * areas)  # cotangent times the squared side opposite
        shares = np.where(blunt, areas * (1.0 + obtuse) / 4.0, (products.sum(axis=0) - products) / 8.0)
    return _diagonal(np.bincount(mesh.faces.T.ravel(), shares.ravel(), minlength=n).astype(np.float64))


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    """Dot product of each row of u with that of v."""
    return np.einsum("ij,ij->i", u, v)


def _refuse_lone_vertices(mesh: TriangleMesh) -> None:
    """Refuse vertices without a face: their mass would be zero."""
    lone = np.flatnonzero(np.bincount(as_mesh(mesh).faces.ravel(), minlength=mesh.n_vertices) == 0)
    if len(lone):
        raise Refusal(
            f"mesh must have no vertex without a face; {len(lone)} have none, the first is vertex {lone[0]}. "
            "$clean drops them"
        )
