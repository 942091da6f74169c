"""Maps between the vertices of two meshes: precise ones, which side up they land, and how far from the truth."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_indices
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.functional_maps import as_point_map, embeddings, nearest_rows
from spectral_notes.geometry.geodesics import geodesic_distances
from spectral_notes.meshes import TriangleMesh, face_areas, faces_at_vertices, vertex_normals

BLOCK = 20_000  # pairs of a row and a face that are compared at once


def precise_map(mesh_1: TriangleMesh, basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike) -> sp.csr_array:
    """Return the map of a functional map that sends vertices of 2 into faces of 1, not only to vertices.

    A sparse P_21 (n2, n1): weights from 0 to 1, at most three in a row, that sum to one; `P_21 @ f_1` is f_1 on 2. The
    rows of Phi_1 C_12^T span a surface of triangles in k2 dimensions. Each row of Phi_2 goes to the nearest point of
    the triangles around its nearest vertex; the point's barycentric coordinates are the weights (Ezuz and Ben-Chen,
    "Deblurring and denoising of maps between shapes", 2017, section 4). The bases must have the k1 and k2 modes of
    C_12 (k2, k1), or more.

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> mesh = shapes.egg(3)
    >>> basis = compute_eigenbasis(*cotan_laplacian(mesh), k=20)
    >>> bool(np.allclose(precise_map(mesh, basis, basis, np.eye(20)) @ mesh.vertices, mesh.vertices))
    True
    """
    if basis_1.n != mesh_1.n_vertices:
        raise ValueError(f"basis_1 must have a row for each of the {mesh_1.n_vertices} vertices; it has {basis_1.n}")
    rows_1, rows_2 = embeddings(basis_1, basis_2, C_12)
    around = faces_at_vertices(mesh_1)[nearest_rows(rows_1, rows_2)]  # (n2, m)
    rows = np.repeat(np.arange(len(rows_2)), np.diff(around.indptr))
    corners = mesh_1.faces[around.indices]  # (pairs, 3)
    weights, gaps = np.empty((len(rows), 3)), np.empty(len(rows))
    for start in range(0, len(rows), BLOCK):
        part = slice(start, start + BLOCK)
        weights[part], gaps[part] = _nearest_points(rows_1[corners[part]], rows_2[rows[part]])
    best = np.lexsort((gaps, rows))[around.indptr[:-1]]  # the first of each row
    P = sp.csr_array(
        (weights[best].ravel(), (np.repeat(np.arange(len(rows_2)), 3), corners[best].ravel())),
        shape=(len(rows_2), mesh_1.n_vertices),
    )
    P.eliminate_zeros()
    return P


def orientation_score(mesh_1: TriangleMesh, mesh_2: TriangleMesh, p2p_21: ArrayLike) -> float:
    """Return the share of shape 2's area that lands on shape 1 with its right side up: near 1 good, near 0 mirrored.

    A face of 2 lands right side up when the triangle of its images under p2p_21 (n2,) has a normal on the side of shape
    1's normals there; the faces of both are counter-clockwise seen from outside. Faces whose images fall on a line do
    not count; 0 if all do. In between, a part of the map is mirrored. What is turned half round counts as right: the
    score finds mirror images, not every mistake.

    >>> from spectral_notes.shapes import sphere
    >>> ball = sphere(3)
    >>> mirrored = nearest_rows(ball.vertices, ball.vertices * [-1.0, 1.0, 1.0])
    >>> orientation_score(ball, ball, np.arange(642)), orientation_score(ball, ball, mirrored)
    (1.0, 0.0)
    """
    images = as_point_map(p2p_21, mesh_1.n_vertices, mesh_2.n_vertices)[mesh_2.faces]  # (m2, 3)
    a, b, c = mesh_1.vertices[images].transpose(1, 0, 2)
    normals = vertex_normals(mesh_1)[images].sum(axis=1)
    sides = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals)
    distinct = (images != np.roll(images, 1, axis=1)).all(axis=1)
    areas = face_areas(mesh_2) * distinct
    total = areas.sum()
    return float(areas[sides > 0].sum() / total) if total > 0 else 0.0


def geodesic_errors(mesh_1: TriangleMesh, p2p_21: ArrayLike, true_21: ArrayLike) -> FloatArray:
    """Return how far along shape 1 each image lies from the true one, in units of the square root of its area.

    p2p_21 (p,), or (q, p) for q maps, holds the images of p vertices of shape 2, true_21 (p,) their true images; the
    distances have the shape of p2p_21, infinite on another component (Kim, Lipman and Funkhouser, "Blended intrinsic
    maps", 2011, section 8). One exact geodesic problem is solved for each true image that a map misses: hand over a
    sample where there are many.

    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> geodesic_errors(square, [0, 3], [0, 1]).round(6).tolist()  # area 1; the way from 3 to 1 is a diagonal
    [0.0, 1.414214]
    """
    true = as_indices("true_21", true_21, ("p",), mesh_1.n_vertices)
    maps = np.asarray(p2p_21)
    images = as_indices("p2p_21", maps, (len(true),) if maps.ndim < 2 else ("q", len(true)), mesh_1.n_vertices)
    errors = np.zeros(np.atleast_2d(images).shape)
    missed = (np.atleast_2d(images) != true).any(axis=0)
    for source in np.unique(true[missed]):
        here = true == source
        errors[:, here] = geodesic_distances(mesh_1, [source])[np.atleast_2d(images)[:, here]]
    return (errors / np.sqrt(mesh_1.area)).reshape(images.shape)


def _nearest_points(triangles: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Barycentric coordinates (p, 3) of the point of each triangle (p, 3, d) nearest to a point, and squared gaps."""
    start = triangles[:, 0]
    u, v, w = triangles[:, 1] - start, triangles[:, 2] - start, points - start
    uu, uv, vv, uw, vw, ww = (np.einsum("ij,ij->i", x, y) for x, y in
                              ((u, u), (u, v), (v, v), (u, w), (v, w), (w, w)))
    tiny = np.finfo(np.float64).tiny
    determinant = np.maximum(uu * vv - uv * uv, tiny)
    along_u = np.clip(uw / np.maximum(uu, tiny), 0.0, 1.0)
    along_v = np.clip(vw / np.maximum(vv, tiny), 0.0, 1.0)
    across = np.clip((vw - uw + uu - uv) / np.maximum(uu - 2.0 * uv + vv, tiny), 0.0, 1.0)
    zero = np.zeros_like(uu)
    s = np.stack([(vv * uw - uv * vw) / determinant, along_u, zero, 1.0 - across])  # (4, p): inside, and three sides
    t = np.stack([(uu * vw - uv * uw) / determinant, zero, along_v, across])
    gaps = ww - 2.0 * (s * uw + t * vw) + s * s * uu + 2.0 * s * t * uv + t * t * vv
    gaps[0, (s[0] < 0.0) | (t[0] < 0.0) | (s[0] + t[0] > 1.0)] = np.inf
    best, column = gaps.argmin(axis=0), np.arange(len(uu))
    s, t = s[best, column], t[best, column]
    return np.maximum(np.column_stack([1.0 - s - t, s, t]), 0.0), gaps[best, column]
