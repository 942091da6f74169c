"""From descriptors to a functional map: functions that correspond on two shapes, and one linear system for C_12."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_count, as_floats, as_indices, as_number
from spectral_notes.descriptors import signature_energies, unit_area, wave_kernel_gains
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.functional_maps import size_ratio
from spectral_notes.mesh_calculus import arrows_of_rows, gradient_matrix
from spectral_notes.meshes import TriangleMesh, face_areas, face_normals

Pairs = Sequence[tuple[FloatArray, FloatArray]]

HANDED_SIZE = 100  # modes of functions that tell left from right


def point_descriptors(basis: Eigenbasis, landmarks: ArrayLike = (), *, n_each: int = 100) -> FloatArray:
    """Return functions (n, (1 + q) n_each) of a shape to be matched, which do not know the scale, from its modes.

    First the wave kernel signature; then the wave kernel of each of q landmarks, vertices l whose images are known:
    K(x, l, e) = sum_k g_k(e) phi_k(x) phi_k(l) / sum_k g_k(e), with the gains of `wave_kernel_signature`, its diagonal
    x = l. It tells of either sign where l is, in n_each bands of frequency (Ovsjanikov et al., "Functional maps", 2012,
    section 5.1). Each column has norm one on the shape scaled to area one, so that all count alike.

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=40)
    >>> f = point_descriptors(basis, [0, 7], n_each=10)
    >>> f.shape, bool(np.allclose((f * (basis.M @ f)).sum(axis=0) / basis.M.sum(), 1.0))
    ((642, 30), True)
    """
    basis = unit_area(basis)
    energies, width = signature_energies(basis, as_count("n_each", n_each, 2))
    marks = as_indices("landmarks", landmarks, ("q",), basis.n)
    evecs, gains = wave_kernel_gains(basis, energies, width)
    columns = np.hstack([evecs**2 @ gains, *(evecs @ (evecs[mark, :, None] * gains) for mark in marks)])
    return _of_norm_one(basis, columns)


def multiplications(basis: Eigenbasis, functions: ArrayLike) -> list[FloatArray]:
    """Return for each function f of `functions` (n, p) the matrix (k, k) of g -> f g among the modes, symmetric.

    Phi^T M diag(f) Phi, with a lumped M. A map of points carries products to products, so C_12 commutes with these
    (Nogneng and Ovsjanikov, "Informative descriptor preservation via commutativity", 2017, eq. 4).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=4)
    >>> multiplications(basis, np.ones((642, 1)))[0].round(6).tolist() == np.eye(4).tolist()
    True
    """
    f = as_floats("functions", functions, (basis.n, "p"))
    weighted = basis.M @ basis.evecs
    return [weighted.T @ (column[:, None] * basis.evecs) for column in f.T]


def rotations(mesh: TriangleMesh, basis: Eigenbasis, functions: ArrayLike) -> list[FloatArray]:
    """Return for each function f of `functions` (n, p) the matrix (k, k) of g -> normal . (grad f x grad g).

    Antisymmetric on a closed surface. It changes its sign under a mirror image, so a C_12 that commutes with these
    keeps the right side up, even where every f is symmetric. Times the area, so that it does not know the scale. The
    faces of the mesh must be counter-clockwise seen from outside (Ren, Poulenard, Wonka, Ovsjanikov, "Continuous and
    orientation-preserving correspondences", 2018, section 4).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> mesh = shapes.egg(3)
    >>> turn = rotations(mesh, compute_eigenbasis(*cotan_laplacian(mesh), k=6), mesh.vertices[:, 2:])[0]
    >>> bool(np.allclose(turn, -turn.T))
    True
    """
    f = as_floats("functions", functions, (mesh.n_vertices, "p"))
    G, normals = gradient_matrix(mesh), face_normals(mesh)
    tested = face_areas(mesh)[:, None] * basis.evecs[mesh.faces].mean(axis=1)  # (m, k), integrated over each face
    slopes = np.stack([arrows_of_rows(G @ mode) for mode in basis.evecs.T], axis=2)  # (m, 3, k)
    across = [np.cross(normals, arrows_of_rows(G @ column)) for column in f.T]  # normal x grad f
    return [mesh.area * tested.T @ np.einsum("md,mdk->mk", arrows, slopes) for arrows in across]


def handed_functions(mesh: TriangleMesh, basis: Eigenbasis, functions: FloatArray, gap: int) -> FloatArray:
    """Functions (n, p - gap) that a mirror image negates: normal . (grad f_i x grad f_(i + gap)), as sums of modes."""
    short = basis.truncate(min(basis.k, HANDED_SIZE))
    turned = zip(rotations(mesh, short, functions[:, :-gap]), short.analyze(functions[:, gap:]).T, strict=True)
    return _of_norm_one(basis, short.evecs @ np.column_stack([rotation @ c for rotation, c in turned]))


def _of_norm_one(basis: Eigenbasis, columns: FloatArray) -> FloatArray:
    """The columns over their norms; one that is zero stays."""
    return columns / np.sqrt((columns * (basis.M @ columns)).sum(axis=0) + np.finfo(np.float64).tiny)


def fit_functional_map(
    basis_1: Eigenbasis, basis_2: Eigenbasis, descriptors_1: ArrayLike, descriptors_2: ArrayLike, *,
    operators: Pairs = (), w_laplacian: float = 0.1, w_operators: float = 1.0,
) -> FloatArray:
    """Return the functional map C_12 (k2, k1) that fits descriptors and commutes with operators, by least squares.

    With A and B the coefficients of the descriptors, it minimises |C A - B|^2 / |B|^2 + w_laplacian |Delta C|^2
    + w_operators mean |C X_1 - X_2 C|^2 / |X_2|^2, where Delta C is C L_1 - L_2 C with entries in units of their root
    mean square times sqrt(k). Without operators each row of C is a small system of its own; with them it is one of
    k1 k2 unknowns (Ovsjanikov et al., 2012, section 6; Nogneng and Ovsjanikov, 2017, section 5).

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, k1 and k2 of them; some 20 to 40 with operators
    descriptors_1, descriptors_2 : (n1, p) and (n2, p), functions that correspond, column by column
    operators : pairs of arrays (k1, k1), (k2, k2), X_1 and X_2, that correspond: of `multiplications` or `rotations`
    w_laplacian, w_operators : weights of commutativity with the Laplacian and the operators, beside the descriptors

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=3)), k=40)
    >>> f, few = point_descriptors(basis, [0, 7, 100]), basis.truncate(8)
    >>> bool(np.allclose(fit_functional_map(few, few, f, f), np.eye(8), atol=1e-4))
    True
    """
    f_1 = as_floats("descriptors_1", descriptors_1, (basis_1.n, "p"))
    f_2 = as_floats("descriptors_2", descriptors_2, (basis_2.n, f_1.shape[1]))
    w_laplacian = as_number("w_laplacian", w_laplacian, low=0.0)
    w_operators = as_number("w_operators", w_operators, low=0.0)
    one, two = unit_area(basis_1), unit_area(basis_2)
    A, B = one.analyze(f_1), two.analyze(f_2)
    scale = (B**2).sum()
    gram, target = A @ A.T / scale, B @ A.T / scale  # (k1, k1), (k2, k1)
    squares = (one.evals - two.evals[:, None]) ** 2  # (k2, k1)
    penalty = w_laplacian * squares / (squares.mean() * np.sqrt(squares.size)) + 1e-10
    if len(operators) and w_operators > 0.0:
        C = _solve_coupled(gram, target, penalty, operators, w_operators)
    else:
        C = np.array([np.linalg.solve(gram + np.diag(own), row) for own, row in zip(penalty, target, strict=True)])
    return np.asarray(C * np.sqrt(size_ratio(basis_2, basis_1)))


def _solve_coupled(
    gram: FloatArray, target: FloatArray, penalty: FloatArray, operators: Pairs, weight: float
) -> FloatArray:
    """Solve C gram + penalty * C + weight (normal equations of commutation) = target for C, as rows of one vector."""
    k_2, k_1 = target.shape
    sizes = [np.sqrt(len(operators) / weight) * np.linalg.norm(X_2) for _, X_2 in operators]
    X_1, X_2 = (np.stack([pair[i] / size for pair, size in zip(operators, sizes, strict=True)]) for i in (0, 1))
    own_1 = gram + np.einsum("pij,pkj->ik", X_1, X_1)
    own_2 = np.einsum("pji,pjk->ik", X_2, X_2)
    system = np.kron(np.eye(k_2), own_1) + np.kron(own_2, np.eye(k_1)) + np.diag(penalty.ravel())
    both = np.tensordot(X_2, X_1, (0, 0)).transpose(1, 3, 0, 2).reshape(target.size, target.size)
    C = np.linalg.solve(system - both - both.T, target.ravel())  # both is C -> sum X_2^T C X_1
    return np.asarray(C.reshape(k_2, k_1))
