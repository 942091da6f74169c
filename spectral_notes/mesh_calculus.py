"""Gradient and divergence of a mesh as sparse matrices, boundary conditions, and the Poisson equation.

A scalar field has one number a vertex, a tangent field one arrow a face. With A the area of each face, taken once for
each of the three components, G^T A G is the cotangent Laplacian: gradient, then its adjoint.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_floats, as_indices, as_number, as_signal, as_symmetric
from spectral_notes.meshes import TriangleMesh, edges_with_counts, face_areas, face_normals, farthest_points, need_areas
from spectral_notes.solver.factorization import Solve, factorize

UNSEEN = 1e-10  # share of a matrix's entries that constants feel, below which it does not see them
BALANCED = 1e-9  # share of a source that no drain balances, below which it is rounding


def gradient_matrix(mesh: TriangleMesh) -> sp.csr_array:
    """Return the matrix G from values at the vertices to the gradient of their linear interpolant, one arrow a face.

    On a face with unit normal N, area A and edges e_c opposite its corners c, grad f = sum_c f_c (N x e_c) / (2 A)
    (Botsch, Kobbelt, Pauly, Alliez and Levy, *Polygon Mesh Processing*, 2010, eq. 3.9).

    Parameters
    ----------
    mesh : m faces, all with an area, and n vertices

    Returns
    -------
    G : (3 m, n) csr_array, in 1 / unit of the vertices
        First the x components of all faces, then y, then z, as in libigl; ``arrows_of_rows(G @ f)`` has shape (m, 3).

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> arrows_of_rows(gradient_matrix(triangle) @ [0.0, 6.0, 0.0]).tolist()
    [[3.0, 0.0, 0.0]]
    """
    arrows = turned_edges(mesh) / (2.0 * face_areas(mesh)[:, None, None])  # (m, corner, xyz)
    return matrix_of_arrows(arrows, mesh.faces, mesh.n_vertices)


def matrix_of_arrows(arrows: FloatArray, columns: IntArray, n: int) -> sp.csr_array:
    """Return the matrix (3 m, n) that weighs the arrows (m, corner, xyz) of each face with values at its columns."""
    m = len(columns)
    rows, columns = np.broadcast_arrays(np.arange(m)[:, None, None] + m * np.arange(3), columns[:, :, None])
    return sp.csr_array((arrows.ravel(), (rows.ravel(), columns.ravel())), (3 * m, n))


def turned_edges(mesh: TriangleMesh) -> FloatArray:
    """Return N x e_c of each face and corner, shape (m, corner, xyz): the gradient of its hat, times twice the area."""
    need_areas(mesh)
    corners = mesh.vertices[mesh.faces]  # (m, 3, 3)
    opposite = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)  # edge from the next corner to the last
    return np.cross(face_normals(mesh)[:, None, :], opposite)


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

    Each face is the one whose centre lies farthest, in space, from those chosen before, beginning with face 0; so the
    first half of them is spread evenly, too.

    >>> strip = TriangleMesh([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], [[0, 2, 1], [1, 2, 3], [2, 4, 3]])
    >>> spread_faces(strip, 2).tolist()
    [0, 2]
    """
    return farthest_points(mesh.vertices[mesh.faces].mean(axis=1), n)


def divergence_matrix(mesh: TriangleMesh) -> sp.csr_array:
    """Return the matrix D = -G^T A that turns a stacked tangent field into its weak divergence at the vertices.

    For every scalar f and field X, f^T D X is minus the integral of <grad f, X>: integration by parts, exactly.

    Parameters
    ----------
    mesh : m faces, all with an area, and n vertices

    Returns
    -------
    D : (n, 3 m) csr_array, integrated over each vertex's patch
        Divide by the lumped mass for the pointwise divergence.

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
    pairs, counts = edges_with_counts(mesh)
    return np.unique(pairs[counts == 1])


def restrict_to(L: sp.csr_array, M: sp.csr_array, keep: ArrayLike) -> tuple[sp.csr_array, sp.csr_array]:
    """Return (L, M) of the functions that vanish outside the vertices `keep`: the Dirichlet condition.

    Leaving the pair whole is the Neumann condition. To come back from the restricted vector u, write ``f[keep] = u``.

    Parameters
    ----------
    L, M : (n, n) sparse, Laplacian and mass matrix
    keep : (p,) int, the free vertices, one at least and each once; for a mesh, those not in `boundary_vertices`

    Returns
    -------
    L, M : (p, p) csr_array, rows and columns of the free vertices

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


def boundary_mass_matrix(mesh: TriangleMesh, *, vertices: ArrayLike | None = None) -> sp.csr_array:
    """Return the mass matrix B of the boundary: f^T B g is the integral of f g along it, and 1^T B 1 its length.

    The products of the hat functions are integrated exactly: length / 3 on the diagonal and length / 6 off it, for each
    boundary edge. ``B @ q`` is the load of a flux q that flows in (Neumann); ``L + a * B`` that of the law that the
    flux out is a times u (Robin).

    Parameters
    ----------
    mesh : the mesh, with n vertices and a boundary
    vertices : (p,) int, take only the boundary edges with both ends among these; by default all

    Returns
    -------
    B : (n, n) csr_array, symmetric positive semidefinite, in units of the vertices

    Examples
    --------
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> boundary_mass_matrix(square, vertices=[0, 1]).toarray()[0].round(3).tolist()
    [0.333, 0.167, 0.0, 0.0]
    """
    pairs, counts = edges_with_counts(mesh)
    n = mesh.n_vertices
    chosen = np.arange(n) if vertices is None else as_indices("vertices", vertices, ("p",), n)
    rim = pairs[(counts == 1) & np.isin(pairs, chosen).all(axis=1)]
    if not len(rim):
        raise ValueError("mesh must have a boundary edge, with both ends among the vertices; it has none")
    lengths = np.linalg.norm(mesh.vertices[rim[:, 0]] - mesh.vertices[rim[:, 1]], axis=1)
    i, j = rim.T
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    return sp.csr_array((np.repeat([1 / 3, 1 / 6], 2 * len(rim)) * np.tile(lengths, 4), (rows, columns)), (n, n))


@dataclass(frozen=True, eq=False, repr=False)
class PoissonSolver:
    """Hold a boundary value problem, factored once for many right-hand sides: -Delta u + c u = f, u given at `fixed`.

    Weakly, (L + c M) u = M f + load away from the fixed vertices. With c = 0 it is the Poisson equation; one implicit
    heat step is ``PoissonSolver(step * L, M, screening=1)``.

    Parameters
    ----------
    L, M : (n, n) sparse, Laplacian (positive semidefinite) and mass matrix, of any kind
        ``L + a * boundary_mass_matrix(mesh)`` sets the Robin condition du/dn + a u = load; L alone Neumann's.
    fixed : (p,) int, vertices where u is prescribed: the Dirichlet condition
        Without any, and with c = 0 and no Robin condition, u is unique up to a constant and its mean is zero; a domain
        in several components then needs one in each.
    screening : the number c, at least 0, in the units of M^-1 L

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> ends_held = PoissonSolver(*interval_laplacian(5), fixed=[0, 4])
    >>> ends_held.solve(np.full(5, 2.0)).round(12).tolist()  # -u'' = 2: u = x (1 - x)
    [0.0, 0.1875, 0.25, 0.1875, 0.0]
    >>> ends_held.solve(values=[1.0, 3.0]).round(12).tolist()  # no source: a straight line
    [1.0, 1.5, 2.0, 2.5, 3.0]
    """

    L: sp.csr_array
    M: sp.csr_array
    fixed: ArrayLike = ()
    screening: float = 0.0
    _held: IntArray = field(init=False)
    _free: IntArray = field(init=False)
    _floats: bool = field(init=False)  # nothing ties the constant down
    _A: sp.csr_array = field(init=False)  # rows of the free vertices, (f, n)
    _solve: Solve | None = field(init=False)

    def __post_init__(self) -> None:
        L = as_symmetric("L", self.L)
        n = L.shape[0]
        M = as_symmetric("M", self.M, n)
        held = as_indices("fixed", self.fixed, ("p",), n)
        if len(np.unique(held)) < len(held):
            raise ValueError("fixed must name each vertex once")
        screening = as_number("screening", self.screening, low=0.0)
        floats = screening == 0.0 and _sees_no_constant(L, held)
        free = np.setdiff1d(np.arange(n), [0] if floats else held)  # a floating u is pinned, then its mean is taken off
        A = sp.csr_array(L + screening * M)[free]
        solve = factorize(sp.csr_array(A[:, free])) if len(free) else None
        given = {"L": L, "M": M, "fixed": held, "screening": screening}
        made = {"_held": held, "_free": free, "_floats": floats, "_A": A, "_solve": solve}
        for name, value in (given | made).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"PoissonSolver({self.M.shape[0]} vertices, {len(self._held)} fixed, screening={self.screening:g})"

    def solve(
        self, f: ArrayLike | None = None, *, load: ArrayLike | None = None, values: ArrayLike | None = None,
        remove_mean: bool = False,
    ) -> FloatArray:
        """Return u, pointwise, for one right-hand side, or for one a column.

        Parameters
        ----------
        f : (n,) or (n, d), source, pointwise
        load : (n,) or (n, d), source, weak, added to M f; a divergence or a flux through the boundary is one
        values : (p,) or (p, d), the solution at the fixed vertices; zero by default
        remove_mean : take away the part of the source that no drain balances, which is else refused
        """
        n = self.M.shape[0]
        total: FloatArray | None = None if f is None else self.M @ as_signal("f", f, n)
        if load is not None:
            total = as_signal("load", load, n) if total is None else total + as_floats("load", load, total.shape)
        ends = None if values is None else as_signal("values", values, len(self._held))
        if total is None:
            total = np.zeros(n) if ends is None else np.zeros((n, *ends.shape[1:]))
        u = np.zeros(total.shape)
        if ends is not None:
            u[self._held] = as_floats("values", ends, (len(self._held), *total.shape[1:]))
        if self._floats:
            total = self._balanced(total, remove_mean)
        if self._solve is not None:
            right = total[self._free] - self._A @ u
            u[self._free] = self._solve(right.reshape(len(right), -1)).reshape(right.shape)
        mass = self.M.sum(axis=1)
        return u - mass @ u / mass.sum() if self._floats else u

    def _balanced(self, total: FloatArray, remove_mean: bool) -> FloatArray:
        """A load that sums to zero, or a refusal."""
        mass = self.M.sum(axis=1)
        mean = total.sum(axis=0) / mass.sum()
        if not remove_mean and (np.abs(total.sum(axis=0)) > BALANCED * np.abs(total).sum(axis=0)).any():
            raise ValueError(
                f"the source must integrate to zero where nothing ties u down; its mean is {np.ravel(mean)[0]:.3g}. "
                "remove_mean=True takes it away, fixed=[...] gives it a drain"
            )
        return total - np.multiply.outer(mass, mean)


def solve_poisson(
    L: sp.csr_array, M: sp.csr_array, f: ArrayLike | None = None, *, load: ArrayLike | None = None,
    fixed: ArrayLike = (), values: ArrayLike | None = None, screening: float = 0.0, remove_mean: bool = False,
) -> FloatArray:
    """Return the u (n,) or (n, d) of one right-hand side: what `PoissonSolver` solves, for those who ask once.

    Parameters
    ----------
    L, M, fixed, screening : see `PoissonSolver`
    f, load, values, remove_mean : see `PoissonSolver.solve`

    Examples
    --------
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> u = solve_poisson(L, M, load=[-1.0, 0, 0, 0, 1])  # drawn off on the left, let in on the right
    >>> (u.round(12) + 0.0).tolist()
    [-0.5, -0.25, 0.0, 0.25, 0.5]
    """
    solver = PoissonSolver(L, M, fixed, screening)
    return solver.solve(f, load=load, values=values, remove_mean=remove_mean)


def _sees_no_constant(L: sp.csr_array, held: IntArray) -> bool:
    """Whether u is unique up to a constant only; a domain in pieces of which one floats is refused."""
    pieces, labels = sp.csgraph.connected_components(L, directed=False)
    felt = np.abs(np.bincount(labels, L.sum(axis=1)))
    floating = felt <= UNSEEN * np.bincount(labels, np.abs(L).sum(axis=1))
    floating[labels[held]] = False
    if floating.any() and pieces > 1:
        raise ValueError(f"fixed must name a vertex of each component; {floating.sum()} of {pieces} have none")
    return bool(floating.any())


def surface_weights(points: FloatArray, mesh: TriangleMesh) -> sp.csr_array:
    """Return the matrix P (p, n) of barycentric coordinates of the points of a surface nearest to given points.

    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> surface_weights(np.array([[0.25, 0.5, 7.0]]), triangle).toarray().tolist()
    [[0.25, 0.25, 0.5]]
    """
    import igl  # only where it is needed: a bare import of the library stays light

    _, nearest, foot = igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)
    corners = mesh.faces[nearest]
    weights = igl.barycentric_coordinates(foot, *(mesh.vertices[corners[:, c]] for c in range(3)))
    weights = np.clip(np.where(np.isfinite(weights), weights, 1 / 3), 0.0, 1.0)  # a face without area: no better point
    weights /= weights.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(points)), 3)
    return sp.csr_array((weights.ravel(), (rows, corners.ravel())), shape=(len(points), mesh.n_vertices))
