"""Tangent vectors as one complex number a vertex: transport, the connection Laplacian, and what it solves.

At each vertex the angles of the corners are scaled to sum to a full turn, so that the edges have directions in one
plane; a tangent vector is a complex number in it. Going along an edge turns the plane by a known angle. Only lengths
enter: L phi = lambda M phi once more, with a turn on every edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats, as_indices
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.mesh_calculus import (
    PoissonSolver,
    arrows_of_rows,
    face_area_matrix,
    gradient_matrix,
    matrix_of_arrows,
    rows_of_arrows,
    turned_edges,
)
from spectral_notes.meshes import TriangleMesh, as_mesh, face_areas, face_normals, row_norms, vertex_normals

ComplexArray = NDArray[np.complex128]
Surface = TriangleMesh | tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, eq=False)
class Transport:
    """Hold the directions of the edges in the tangent planes of a surface, and how the planes turn along them.

    Every edge comes once in each direction, from `tails` to `heads`.

    >>> faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    >>> tetrahedron = edge_transport((faces, np.ones((4, 3))))
    >>> (tetrahedron.holonomy / np.pi).round(12).tolist()  # a quarter of the sphere's 4 pi each
    [1.0, 1.0, 1.0, 1.0]
    """

    faces: IntArray  # (m, 3)
    tails: IntArray  # (e,), ends of the directed edges
    heads: IntArray
    angles: FloatArray  # of the edge in the plane of its tail: radians, counter-clockwise from the vertex's first edge
    turns: FloatArray  # a vector z at the tail is exp(1j * turns) * z at the head
    weights: FloatArray  # half the sum of the cotangents of the angles opposite the edge
    holonomy: FloatArray  # (m,), by how much a vector carried once round a face turns; closed, the sum is 2 pi chi
    vertex_areas: FloatArray  # (n,), a third of the area of the faces at each vertex


def edge_transport(surface: Surface) -> Transport:
    """Return how tangent planes turn along the edges of a surface; corners are scaled to 2 pi a vertex, pi on a rim.

    The surface is an oriented manifold: a mesh, or its faces (m, 3) and lengths (m, 3), where column c holds the edges
    opposite to corner c (Knoppel, Crane, Pinkall and Schroder, "Globally optimal direction fields", 2013, section 3).

    >>> from spectral_notes.shapes import sphere
    >>> round(float(edge_transport(sphere(2)).holonomy.sum() / np.pi), 12)
    4.0
    """
    faces, lengths = _faces_and_lengths(surface)
    n = int(faces.max()) + 1
    tails, heads, thirds = faces.ravel(), np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
    there, back = tails * n + heads, heads * n + tails
    doubled = len(there) - len(np.unique(there))
    if doubled:
        say = f"{doubled} edges are walked twice in one direction: health(mesh) counts what is wrong"
        raise ValueError(f"surface must be an oriented manifold; {say}")
    rim = ~np.isin(back, there)  # the other direction of a boundary edge belongs to no face
    a, b, c = (np.roll(lengths, -k, axis=1) for k in range(3))
    corners = np.arccos(np.clip((b**2 + c**2 - a**2) / (2.0 * b * c), -1.0, 1.0))  # (m, 3), by the law of cosines
    key = np.concatenate([there, back[rim]])
    order = np.argsort(key)
    angles = _fan_angles(tails, thirds, corners.ravel(), key, order, len(there), n)
    total = np.bincount(tails, corners.ravel(), n)
    scale = np.full(n, 2.0 * np.pi)
    scale[heads[rim]] = np.pi
    scale /= total
    tails, heads = key // n, key % n
    angles = angles * scale[tails]
    opposite = order[np.searchsorted(key[order], heads * n + tails)]
    half = np.zeros(len(key))
    half[: len(there)] = 0.5 / np.tan(np.roll(corners, 1, axis=1).ravel())
    areas = 0.5 * lengths[:, 1] * lengths[:, 2] * np.sin(corners[:, 0])
    turns = angles[opposite] + np.pi - angles
    return Transport(
        faces=faces, tails=tails, heads=heads, angles=angles, turns=np.angle(np.exp(1j * turns)),
        weights=half + half[opposite], holonomy=(scale[faces] * corners).sum(axis=1) - np.pi,
        vertex_areas=np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), n).astype(np.float64),
    )


def connection_laplacian(surface: Surface, n_fold: int = 1) -> tuple[sp.csr_array, sp.csr_array]:
    """Return the pair (L, M) of tangent fields: real, symmetric, of size 2n; first all real parts, then all imaginary.

    ``x @ L @ x`` is the sum over edges of w_ij |z_j - r_ij^n z_i|^2: how much each arrow differs from its neighbours'
    after transport, with the cotangent weights. For n-fold fields, whose arrows are the same after an n-th of a turn (1
    for arrows, 2 for lines, 4 for crosses), z stands for the n-th power of an arrow. Every eigenvalue comes at least
    twice: a field, and the same a quarter turn on. On the unit sphere they are l (l + 1) - n_fold^2, each 2 (2 l + 1)
    times, for l = n_fold, n_fold + 1, ...

    >>> from spectral_notes.shapes import sphere
    >>> compute_eigenbasis(*connection_laplacian(sphere(3)), 7).evals.round(1).tolist()  # 1, six times, then 5
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 5.0]
    """
    n_fold = as_count("n_fold", n_fold, 1)
    edges = edge_transport(surface)
    n = len(edges.vertex_areas)
    off = edges.weights * np.exp(1j * n_fold * edges.turns)
    H = sp.csr_array((-off, (edges.heads, edges.tails)), shape=(n, n))
    H = H + sp.diags_array(np.bincount(edges.tails, edges.weights, n))
    L = sp.csr_array(sp.block_array([[H.real, -H.imag], [H.imag, H.real]]))
    return sp.csr_array((L + L.T) / 2.0), sp.csr_array(sp.diags_array(np.tile(edges.vertex_areas, 2)))


def smoothest_field(
    surface: Surface, n_fold: int = 1, *, fixed: ArrayLike = (), values: ArrayLike = ()
) -> ComplexArray:
    """Return the tangent field of least energy: the lowest mode, or the one that takes given values at some vertices.

    One complex number a vertex, in the frames of `edge_transport`; of norm one in M if nothing is fixed. With `n_fold`
    above 1 it and the `values` at the vertices `fixed` are powers of arrows.
    """
    L, M = connection_laplacian(surface, n_fold)
    n = L.shape[0] // 2
    fixed = as_indices("fixed", fixed, ("p",), n)
    given = np.atleast_1d(np.asarray(values, dtype=np.complex128))
    if given.shape != fixed.shape or not np.isfinite(given).all():
        raise ValueError(f"values must hold one finite number for each of the {len(fixed)} fixed vertices")
    if not len(fixed):
        x = compute_eigenbasis(L, M, 2).evecs[:, 0]
    else:
        held = np.concatenate([fixed, fixed + n])
        x = PoissonSolver(L, M, held).solve(values=np.concatenate([given.real, given.imag]))
    return x[:n] + 1j * x[n:]


def field_indices(surface: Surface, z: ArrayLike, n_fold: int = 1) -> FloatArray:
    """Return the index of a field in each face: its turns round the face, as a multiple of 1 / n_fold; mostly zero.

    On a closed surface the indices sum to the Euler characteristic, whatever the field z (n,) (Poincare and Hopf).

    >>> from spectral_notes.shapes import sphere
    >>> ball = sphere(2)
    >>> float(field_indices(ball, smoothest_field(ball)).sum())
    2.0
    """
    n_fold = as_count("n_fold", n_fold, 1)
    edges = edge_transport(surface)
    n = len(edges.vertex_areas)
    z = _field(z, n)
    if (z == 0).any():
        raise ValueError(f"z must not be zero at a vertex; it is at {int(np.argmin(np.abs(z)))}")
    step = np.angle(z[edges.heads] / (np.exp(1j * n_fold * edges.turns) * z[edges.tails]))
    round_face = step[: edges.faces.size].reshape(-1, 3).sum(axis=1)
    return np.rint((round_face + n_fold * edges.holonomy) / (2.0 * np.pi)) / n_fold


def transport_vector(surface: Surface, vertex: int, value: complex = 1.0) -> ComplexArray:
    """Return a vector carried from one vertex to all others along shortest paths, by one short heat step.

    Heat of the connection Laplacian arrives first by the shortest way and keeps the direction; the length is put back.
    The time of the step is the square of the mean edge length (Sharp, Soliman and Crane, "The vector heat method",
    2019, algorithm 1).
    """
    L, M = connection_laplacian(surface)
    n = L.shape[0] // 2
    vertex = as_count("vertex", vertex, 0, n - 1)
    step = float(_faces_and_lengths(surface)[1].mean() ** 2)  # an inner edge counts for both of its faces
    source = np.zeros(2 * n)
    source[[vertex, vertex + n]] = complex(value).real, complex(value).imag
    x = PoissonSolver(step * L, M, screening=1.0).solve(load=source)
    direction = x[:n] + 1j * x[n:]
    return np.asarray(abs(value) * direction / np.abs(direction), dtype=np.complex128)


def arrows_of_field(mesh: TriangleMesh, z: ArrayLike) -> FloatArray:
    """Return a field of complex numbers as arrows in space, (n, 3), in the planes across the vertex normals.

    The arrows are for pictures and for input: matrices know nothing of them.
    """
    edges = edge_transport(as_mesh(mesh))
    z = _field(z, mesh.n_vertices)
    first = np.flatnonzero(edges.angles == 0.0)  # the edge of each vertex from which its angles count
    along = np.zeros((mesh.n_vertices, 3))
    along[edges.tails[first]] = mesh.vertices[edges.heads[first]]
    normals = vertex_normals(mesh)
    along = _across(along - mesh.vertices, normals)
    along /= row_norms(along)[:, None]
    return z.real[:, None] * along + z.imag[:, None] * np.cross(normals, along)


def hodge_parts(mesh: TriangleMesh, field: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return three fields that sum to a field of one arrow a face: a gradient, a turned gradient, a harmonic rest.

    The first has no circulation, the second no sources, the last neither; they are orthogonal, (m, 3) each. What sticks
    out of a face's plane is left off. The potential of the first is linear with values at vertices, that of the second
    with values at the middles of edges, zero on a boundary: with both at the vertices the rest would be too large
    (Polthier and Preuss, "Identifying vector field singularities using a discrete Hodge decomposition", 2003).
    """
    mesh = as_mesh(mesh)
    return _split(mesh, as_floats("field", field, (mesh.n_faces, 3)), _hodge_problems(mesh))


def harmonic_fields(mesh: TriangleMesh) -> FloatArray:
    """Return an orthonormal basis of the fields without sources and circulation: two for each handle of a closed mesh.

    Shape (2 genus, m, 3), with unit integral of |X|^2; a mesh with h boundary loops has h - 1 more. The harmonic parts
    of seeded random fields span the space.

    >>> from spectral_notes.shapes import sphere, torus
    >>> len(harmonic_fields(sphere(2))), len(harmonic_fields(torus(n_major=24, n_minor=12)))
    (0, 2)
    """
    problems, rng, areas = _hodge_problems(as_mesh(mesh)), np.random.default_rng(0), face_areas(mesh)
    found = np.zeros((0, mesh.n_faces, 3))
    while True:
        drawn = rng.normal(size=(mesh.n_faces, 3))
        size = np.sqrt((areas[:, None] * drawn**2).sum())
        rest = _split(mesh, drawn, problems)[2]
        for _ in range(2):
            rest = rest - np.einsum("k,kmc->mc", np.einsum("kmc,mc,m->k", found, rest, areas), found)
        length = np.sqrt((areas[:, None] * rest**2).sum())
        if length < 1e-6 * size:
            return found
        found = np.concatenate([found, [rest / length]])


def _across(X: FloatArray, normals: FloatArray) -> FloatArray:
    """Return arrows without the part along the normals."""
    return X - (X * normals).sum(axis=1)[:, None] * normals


def _hodge_problems(mesh: TriangleMesh) -> list[tuple[sp.csr_array, PoissonSolver]]:
    """Return gradients of functions at vertices and, turned, at middles of edges, each with its Poisson problem."""
    edges = edge_transport(mesh)
    n, m = mesh.n_vertices, mesh.n_faces
    low, high = np.minimum(edges.tails, edges.heads), np.maximum(edges.tails, edges.heads)
    number = np.unique(low * n + high, return_inverse=True)[1][: 3 * m]  # of half edge 3 f + c, from corner c
    inner = np.bincount(number) == 2
    hats = -turned_edges(mesh) / face_areas(mesh)[:, None, None]  # of the edge opposite to each corner: 1 - 2 lambda
    turned = np.cross(face_normals(mesh)[:, None, :], hats)
    T = matrix_of_arrows(turned, number.reshape(m, 3)[:, [1, 2, 0]], len(inner))
    problems = []
    for D, fixed in ((gradient_matrix(mesh), []), (T, np.flatnonzero(~inner))):
        L = sp.csr_array(D.T @ face_area_matrix(mesh) @ D)
        eye = sp.eye_array(L.shape[0], format="csr")
        problems.append((D, PoissonSolver(sp.csr_array((L + L.T) / 2.0), eye, fixed)))
    return problems


def _split(
    mesh: TriangleMesh, field: FloatArray, problems: list[tuple[sp.csr_array, PoissonSolver]]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the two projections of the tangential part of a field, and what is left of it."""
    field = _across(field, face_normals(mesh))
    x = face_area_matrix(mesh) @ rows_of_arrows(field)
    gradient, turned = (arrows_of_rows(D @ u.solve(load=D.T @ x, remove_mean=True)) for D, u in problems)
    return gradient, turned, field - gradient - turned


def _faces_and_lengths(surface: Surface) -> tuple[IntArray, FloatArray]:
    """Return the faces and, for each corner, the length of the edge opposite to it."""
    if isinstance(surface, tuple):
        faces, lengths = surface
        lengths = as_floats("lengths", lengths, ("m", 3))
        faces = as_indices("faces", faces, (len(lengths), 3), np.iinfo(np.int32).max)
    else:
        faces, corners = as_mesh(surface, "surface").faces, surface.vertices[surface.faces]
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    n = int(faces.max()) + 1 if isinstance(surface, tuple) else surface.n_vertices
    lonely = n - len(np.unique(faces))
    if lonely:
        raise ValueError(f"surface must have a face at every vertex; {lonely} have none: clean_mesh drops them")
    longest = 2.0 * lengths.max(axis=1) - lengths.sum(axis=1)
    if lengths.min() <= 0 or longest.max() >= -1e-12 * lengths.max():
        raise ValueError(f"surface must have no face without area; face {int(longest.argmax())} has none")
    return faces, lengths


def _fan_angles(
    tails: IntArray, thirds: IntArray, corners: FloatArray, key: IntArray, order: IntArray, n_half: int, n: int
) -> FloatArray:
    """Return the sum of the corners between the first edge of each vertex and each of its edges, going round once."""
    following = order[np.searchsorted(key[order], tails * n + thirds)]  # edge to the third corner, next in the fan
    starts = np.setdiff1d(np.arange(n_half), following)  # on a rim: no face lies before them
    started = np.zeros(n, dtype=bool)
    started[tails[starts]] = True
    inner = np.unique(tails, return_index=True)[1]
    here = np.concatenate([starts, inner[~started[tails[inner]]]])
    angles = np.full(len(key), np.nan)
    angles[here] = 0.0
    while len(here):
        there = following[here]
        fresh = np.isnan(angles[there])
        angles[there[fresh]] = (angles[here] + corners[here])[fresh]
        here = there[fresh & (there < n_half)]
    if len(starts) > started.sum() or np.isnan(angles).any():
        raise ValueError("surface must have one fan of faces at each vertex; health(mesh) counts those with several")
    return angles


def _field(z: ArrayLike, n: int) -> ComplexArray:
    """Return a field of one finite complex number a vertex."""
    z = np.asarray(z, dtype=np.complex128)
    if z.shape != (n,) or not np.isfinite(z).all():
        raise ValueError(f"z must hold one finite number for each of the {n} vertices; got shape {z.shape}")
    return z
