"""Gradient and divergence of a mesh as sparse matrices, boundary conditions, and the Poisson equation.

A scalar field has one number a vertex, a tangent field one arrow a face. With A the area of each face, taken once for
each of the three components, G^T A G is the cotangent Laplacian: gradient, then its adjoint.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats, as_indices, as_signal, as_symmetric
from spectral_notes.meshes import TriangleMesh, as_mesh, edges_with_counts, face_areas, face_normals, flat_faces


def gradient_matrix(mesh: TriangleMesh) -> sp.csr_array:
    """Return the matrix G from values at the vertices to the gradient of their linear interpolant, one arrow a face.

    On a face with unit normal N, area A and edges e_c opposite its corners c, grad f = sum_c f_c (N x e_c) / (2 A).

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh, with m faces and n vertices.

    Returns
    -------
    csr_array, shape (3 m, n)
        In 1 / unit of the vertices. Rows 0 .. m - 1 hold the x components of all faces, then come m rows of y, then m
        of z, as in libigl: ``arrows_of_rows(G @ f)`` is the (m, 3) array of arrows.

    Raises
    ------
    ValueError
        If a face has no area.

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> arrows_of_rows(gradient_matrix(triangle) @ [0.0, 6.0, 0.0]).tolist()
    [[3.0, 0.0, 0.0]]

    References
    ----------
    Botsch, Kobbelt, Pauly, Alliez and Levy, *Polygon Mesh Processing* (2010), eq. 3.9.
    """
    _refuse_flat_faces(as_mesh(mesh))
    corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
    opposite = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)  # edge from the next corner to the last
    turned = np.cross(face_normals(mesh)[:, None, :], opposite)  # (m, corner, xyz)
    arrows = turned / (2.0 * face_areas(mesh)[:, None, None])
    m = mesh.n_faces
    rows = np.arange(m)[:, None, None] + m * np.arange(3)  # (m, 1, xyz)
    columns = mesh.faces[:, :, None]  # (m, corner, 1)
    rows, columns = np.broadcast_arrays(rows, columns)
    return sp.csr_array((arrows.ravel(), (rows.ravel(), columns.ravel())), (3 * m, mesh.n_vertices))


def arrows_of_rows(stacked: ArrayLike) -> FloatArray:
    """Return the (m, 3) arrows of a stacked field of shape (3 m,): all x, then all y, then all z.

    Examples
    --------
    >>> arrows_of_rows([1, 2, 3, 4, 5, 6]).tolist()
    [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]
    """
    field = as_floats("stacked", stacked, ("3 m",))
    if len(field) % 3:
        raise ValueError(f"stacked must have a length that three divides; got {len(field)}")
    return field.reshape(3, -1).T


def rows_of_arrows(arrows: ArrayLike) -> FloatArray:
    """Return the stacked field of shape (3 m,) of (m, 3) arrows; the inverse of `arrows_of_rows`.

    Examples
    --------
    >>> rows_of_arrows([[1, 3, 5], [2, 4, 6]]).tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    """
    return as_floats("arrows", arrows, ("m", 3)).T.ravel()


def spread_faces(mesh: TriangleMesh, n: int) -> IntArray:
    """Return n faces spread evenly over a mesh, by farthest-point sampling: where to draw the arrows of a field.

    Each face is the one whose centre lies farthest, in space, from the centres chosen before; the first is face 0.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh, with m faces.
    n : int
        Number of faces, 1 .. m.

    Returns
    -------
    ndarray of int64, shape (n,)
        Faces in the order of choice, so that the first half of them is spread evenly too.

    Raises
    ------
    TypeError, ValueError
        If n is out of range.

    Examples
    --------
    >>> strip = TriangleMesh([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], [[0, 2, 1], [1, 2, 3], [2, 4, 3]])
    >>> spread_faces(strip, 2).tolist()
    [0, 2]

    References
    ----------
    Gonzalez, "Clustering to minimize the maximum intercluster distance" (1985).
    """
    n = as_count("n", n, 1, mesh.n_faces)
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    chosen = [0]
    nearest = np.full(mesh.n_faces, np.inf)  # squared distance to the chosen
    while len(chosen) < n:
        gaps = centers - centers[chosen[-1]]
        nearest = np.minimum(nearest, np.einsum("ij,ij->i", gaps, gaps))
        nearest[chosen[-1]] = -1.0  # never twice, even where centres coincide
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen, dtype=np.int64)


def divergence_matrix(mesh: TriangleMesh) -> sp.csr_array:
    """Return the matrix D = -G^T A that turns a stacked tangent field into its weak divergence at the vertices.

    For every scalar f and field X, f^T D X is minus the integral of <grad f, X>: integration by parts, exactly.

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh, with m faces and n vertices.

    Returns
    -------
    csr_array, shape (n, 3 m)
        Its values are integrated over each vertex's patch; divide by the lumped mass for the pointwise divergence.

    Raises
    ------
    ValueError
        If a face has no area.

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> L = -divergence_matrix(square) @ gradient_matrix(square)
    >>> L.toarray()[0].round(12).tolist()
    [1.0, -0.5, 0.0, -0.5]
    """
    return sp.csr_array(-gradient_matrix(mesh).T @ face_area_matrix(mesh))


def face_area_matrix(mesh: TriangleMesh) -> sp.csr_array:
    """Return the diagonal (3 m, 3 m) matrix of the inner product of stacked fields: each face's area, three times."""
    return sp.csr_array(sp.diags_array(np.tile(face_areas(mesh), 3)))


def boundary_vertices(mesh: TriangleMesh) -> IntArray:
    """Return the vertices on an edge that has a single face, in ascending order; none for a closed mesh.

    Examples
    --------
    >>> boundary_vertices(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).tolist()
    [0, 1, 2]
    """
    pairs, counts = edges_with_counts(as_mesh(mesh))
    return np.unique(pairs[counts == 1])


def restrict_to(L: sp.csr_array, M: sp.csr_array, keep: ArrayLike) -> tuple[sp.csr_array, sp.csr_array]:
    """Return (L, M) of the functions that vanish outside the vertices `keep`: the Dirichlet condition.

    Leaving the pair whole is the Neumann condition. To come back from the restricted vector u, write ``f[keep] = u``.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian and mass matrix.
    keep : array_like of int, shape (p,)
        Vertices that stay free, without repetition; for a mesh, those not in `boundary_vertices`.

    Returns
    -------
    L, M : csr_array, shape (p, p)
        Rows and columns of the free vertices.

    Raises
    ------
    TypeError, ValueError
        If an index is out of range or repeated, or none is given.

    Examples
    --------
    >>> L = sp.csr_array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    >>> restrict_to(L, sp.csr_array(np.eye(3)), [1])[0].toarray().tolist()
    [[2.0]]
    """
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    keep = as_indices("keep", keep, ("p",), L.shape[0])
    if not len(keep) or len(np.unique(keep)) < len(keep):
        raise ValueError("keep must name at least one vertex, and each one once")
    return sp.csr_array(L[keep][:, keep]), sp.csr_array(M[keep][:, keep])


def solve_poisson(
    L: sp.csr_array, M: sp.csr_array, f: ArrayLike, *, fixed: ArrayLike = (), values: ArrayLike | None = None
) -> FloatArray:
    """Return u with L u = M f away from the fixed vertices, where u takes the given values.

    Without fixed vertices a solution exists only when f integrates to zero, and is unique up to a constant: f's mean is
    then taken off, and u is returned with mean zero. Only connected domains are accepted in this case.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian (positive semidefinite) and mass matrix.
    f : array_like, shape (n,)
        Right-hand side, pointwise; -Delta u = f.
    fixed : array_like of int, shape (p,), optional
        Vertices where u is prescribed.
    values : array_like, shape (p,), optional
        Values there; zero by default.

    Returns
    -------
    ndarray, shape (n,)
        The solution, pointwise.

    Raises
    ------
    TypeError, ValueError
        If shapes or indices do not fit, or the domain has several components and one has no fixed vertex.

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> solve_poisson(L, M, np.full(5, 2.0), fixed=[0, 4]).round(12).tolist()  # -u'' = 2: u = x (1 - x)
    [0.0, 0.1875, 0.25, 0.1875, 0.0]
    """
    L = as_symmetric("L", L)
    n = L.shape[0]
    M = as_symmetric("M", M, n)
    f = as_signal("f", f, n)
    fixed = as_indices("fixed", fixed, ("p",), n)
    if len(np.unique(fixed)) < len(fixed):
        raise ValueError("fixed must name each vertex once")
    _refuse_free_components(L, fixed)
    u = np.zeros(f.shape)
    u[fixed] = 0.0 if values is None else as_floats("values", values, (len(fixed), *f.shape[1:]))
    if not len(fixed):
        mass = M.sum(axis=1)
        f = f - mass @ f / mass.sum()
        free = np.arange(1, n)  # vertex 0 is pinned, then the mean is taken off
    else:
        free = np.setdiff1d(np.arange(n), fixed)
    if len(free):
        load = (M @ f - L @ u)[free]
        u[free] = splu(sp.csc_array(L[free][:, free])).solve(load)
    return u if len(fixed) else u - mass @ u / mass.sum()


def _refuse_free_components(L: sp.csr_array, fixed: IntArray) -> None:
    """Refuse a domain in pieces of which one is free: each piece needs a value of its own."""
    pieces, labels = sp.csgraph.connected_components(L, directed=False)
    held = len(np.unique(labels[fixed]))
    if pieces > 1 and held < pieces:
        raise ValueError(f"fixed must name a vertex of each component; {pieces - held} of {pieces} have none")


def _refuse_flat_faces(mesh: TriangleMesh) -> None:
    """Refuse faces without area: a gradient is not defined there."""
    flat = np.flatnonzero(flat_faces(mesh))
    if len(flat):
        raise ValueError(f"mesh must have no face without area; {len(flat)} have none, the first is face {flat[0]}")
