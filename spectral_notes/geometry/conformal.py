"""Flattening an open patch so that angles survive: spectral conformal parameterization, and how to measure it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import LinearOperator, eigsh

from spectral_notes._checks import FloatArray, as_floats
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.mesh_calculus import arrows_of_rows, boundary_vertices, gradient_matrix
from spectral_notes.meshes import TriangleMesh, boundary_loops, euler_characteristic, face_areas, face_normals
from spectral_notes.solver.factorization import factorize

SHIFT = 1e-8  # K has the constants in its kernel, K + SHIFT B has nothing


def conformal_map(mesh: TriangleMesh) -> FloatArray:
    """Return plane coordinates of an open patch that keep angles as well as any linear method can, free at the rim.

    With z = u + i v, the conformal energy z* K z = 1/2 z* L z - area(z) is zero exactly for angle-preserving maps. z
    minimises it among maps with z* B z = 1 and mean zero over the rim, B being one on the rim and zero inside: the
    eigenvector of K z = lambda B z after the constant. It is found by shift and invert: one factor of K + shift B, in
    real numbers, and some twenty substitutions (Mullen, Tong, Alliez and Desbrun, "Spectral conformal
    parameterization", 2008, section 3).

    Parameters
    ----------
    mesh : a disk: connected, with one boundary loop and Euler characteristic 1, every face with an area

    Returns
    -------
    uv : (n, 2), scaled so that the patch keeps its area
        Turned so that rim vertex 0 (the lowest number) lies to the right of the centre. Triangles are positively
        oriented, but a strongly curved patch may overlap.

    Examples
    --------
    >>> from spectral_notes.shapes import sheet
    >>> rolled = sheet(bend=1.0)
    >>> bool(np.allclose(conformal_distortion(rolled, conformal_map(rolled)), 1.0))  # it was flat paper
    True
    """
    _refuse_non_disks(mesh)
    n, rim = mesh.n_vertices, boundary_vertices(mesh)
    half, area_form = 0.5 * cotan_laplacian(mesh)[0], _area_form(mesh)
    turn = sp.csr_array(area_form.imag)  # K = half - i turn, acting on (u, v) as a real matrix twice as long
    on_rim = np.concatenate([rim, n + rim])
    B = sp.csr_array((np.ones(len(on_rim)), (on_rim, on_rim)), (2 * n, 2 * n))
    solve = factorize(sp.csr_array(sp.block_array([[half, turn], [-turn, half]]) + SHIFT * B))

    def spread(c: FloatArray) -> FloatArray:
        """Solve (K + shift B) w = B c, for a c that lives on the rim."""
        w = np.zeros((2 * n, 1))
        w[on_rim, 0] = c
        return solve(w)[:, 0]

    def invert(c: FloatArray) -> FloatArray:
        """Apply the inverse on the rim, to what has mean zero there."""
        return _centred(spread(_centred(c))[on_rim])

    start = np.sin(np.arange(1.0, len(on_rim) + 1))
    on_the_rim = LinearOperator((len(on_rim), len(on_rim)), matvec=invert, dtype=np.float64)
    c = eigsh(on_the_rim, k=1, which="LA", v0=start)[1][:, 0]
    u, v = spread(c).reshape(2, n)
    z = u + 1j * v
    z -= z[rim].mean()
    z *= np.abs(z[rim[0]]) / z[rim[0]]
    area = float(np.real(z.conj() @ (area_form @ z)))
    z *= np.sqrt(face_areas(mesh).sum() / area)
    return np.column_stack([z.real, z.imag])


def conformal_distortion(mesh: TriangleMesh, uv: ArrayLike) -> FloatArray:
    """Return, for each face, the ratio of longest to shortest stretch under a map to the plane: 1 where angles survive.

    The ratio of singular values of the map's derivative; minus the ratio where the face is turned over, infinite where
    it is crushed to a line.

    Parameters
    ----------
    mesh : the patch, with m faces, all with an area, and n vertices
    uv : (n, 2), plane coordinates

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> conformal_distortion(square, [[0, 0], [3, 0], [3, 1], [0, 1]]).round(12).tolist()
    [3.0, 3.0]
    """
    uv = as_floats("uv", uv, (mesh.n_vertices, 2))
    G = gradient_matrix(mesh)
    grad_u, grad_v = (arrows_of_rows(G @ coordinate) for coordinate in uv.T)  # (m, 3) each
    turn = np.einsum("fd,fd->f", np.cross(grad_u, grad_v), face_normals(mesh))  # determinant of the derivative
    size = (grad_u**2).sum(axis=1) + (grad_v**2).sum(axis=1)  # sum of squared singular values
    spread = np.sqrt(np.maximum(size**2 - 4.0 * turn**2, 0.0))
    with np.errstate(divide="ignore"):
        return np.where(turn < 0.0, -1.0, 1.0) * (size + spread) / (2.0 * np.abs(turn))


def _centred(c: FloatArray) -> FloatArray:
    """Take the mean off the u and off the v of a vector (u, v)."""
    return (c.reshape(2, -1) - c.reshape(2, -1).mean(axis=1, keepdims=True)).ravel()


def _area_form(mesh: TriangleMesh) -> sp.csr_array:
    """Hermitian A with z* A z = signed area of the flattened patch: half the integral of u dv - v du round its faces.

    The oriented edge ij adds Im(conj(z_i) z_j) / 2, that is (conj(z_i) z_j - z_i conj(z_j)) / 4i. Inner edges are
    walked once in each direction and cancel: what is left is the integral round the rim.
    """
    i = mesh.faces.ravel()
    j = np.roll(mesh.faces, -1, axis=1).ravel()
    quarter = np.full(len(i), -0.25j)
    entries, rows, columns = np.concatenate([quarter, -quarter]), np.concatenate([i, j]), np.concatenate([j, i])
    return sp.csr_array((entries, (rows, columns)), (mesh.n_vertices, mesh.n_vertices))


def _refuse_non_disks(mesh: TriangleMesh) -> None:
    """Refuse a mesh that is not a disk: there is no rim to walk round, or more than one."""
    loops, chi = len(boundary_loops(mesh)), euler_characteristic(mesh)
    if loops != 1 or chi != 1:
        raise ValueError(f"mesh must be a disk (one boundary loop, chi = 1); it has {loops} loops and chi = {chi}")
    ways = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    if len(np.unique(ways, axis=0)) < len(ways):
        raise ValueError("mesh must have its faces turned alike; two of them walk an edge in the same direction")
