"""Functional maps: a map between two shapes as a small matrix between their eigenbases.

Direction is in every name and never changes. `C_12` (k2, k1) carries the coefficients of functions on shape 1 to those
of functions on shape 2. `p2p_21` (n2,) sends each vertex of shape 2 to a vertex of shape 1, the other way: a point map
pulls functions back, f_2 = f_1 o p2p_21. A precise map `P_21` (n2, n1), sparse, sends vertices of 2 into faces of 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_choice, as_floats, as_indices, as_signal
from spectral_notes.eigenbasis import Eigenbasis

SIDES = ("functions", "adjoint")
BLOCK = 2048  # rows compared at once: some megabytes, and the cache is kept busy


def functional_map(basis_1: Eigenbasis, basis_2: Eigenbasis, p2p_21: Any) -> FloatArray:
    """Return the matrix C_12 of a point map: column j holds the coefficients on 2 of mode j of 1, pulled back.

    C_12 = Phi_2^T M_2 Phi_1[p2p_21]. For a perfect isometry it is diagonal with entries of plus or minus one, but for
    rotations of modes that share an eigenvalue (Ovsjanikov et al., "Functional maps: a flexible representation of maps
    between shapes", 2012, section 4).

    Parameters
    ----------
    basis_1, basis_2 : the modes of shapes 1 and 2, k1 and k2 of them; `truncate` shortens them
    p2p_21 : (n2,) int, for each vertex of shape 2 a vertex of shape 1; or sparse (n2, n1), weights of such vertices

    Returns
    -------
    C_12 : (k2, k1), coefficients of functions on 1 to coefficients of functions on 2

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=4)
    >>> functional_map(basis, basis, np.arange(basis.n)).round(6).tolist() == np.eye(4).tolist()
    True
    """
    return basis_2.analyze(pull_back(p2p_21, basis_1.evecs, n_2=basis_2.n))


def pull_back(p2p_21: Any, f_1: ArrayLike, *, n_2: int | None = None) -> FloatArray:
    """Return a function f_1 (n1,) or (n1, d) of shape 1 on shape 2: each vertex of 2 takes the value of its image.

    f_2 = f_1[p2p_21], or P_21 f_1, which takes values between those of the vertices. Coordinates are three functions.

    >>> pull_back([2, 0], [10.0, 20.0, 30.0]).tolist()
    [30.0, 10.0]
    """
    values = np.asarray(f_1)
    f = as_signal("f_1", values, len(values) if values.ndim else 0)
    if sp.issparse(p2p_21):
        _refuse_other_direction(p2p_21.shape[0], len(f), n_2)
        if p2p_21.shape[1] != len(f):
            raise ValueError(f"p2p_21 must have a column for each of the {len(f)} vertices of 1; got {p2p_21.shape}")
        return np.asarray(sp.csr_array(p2p_21) @ f)
    return f[as_point_map(p2p_21, len(f), n_2)]


def pull_back_labels(p2p_21: Any, labels_1: ArrayLike) -> IntArray:
    """Return a segmentation of shape 1 as one of shape 2: each vertex of 2 takes the label of its image.

    Through a precise map it is the label with the largest total weight, so that no labels are averaged.

    >>> P_21 = sp.csr_array([[0.3, 0.3, 0.4]])
    >>> pull_back_labels(P_21, [7, 7, 2]).tolist()
    [7]
    """
    labels = np.asarray(labels_1)
    if labels.dtype.kind not in "iu":
        raise TypeError(f"labels_1 must hold integers; got dtype {labels.dtype}")
    names, number = np.unique(labels, return_inverse=True)
    votes = pull_back(p2p_21, np.eye(len(names))[number.ravel()])  # (n2, labels)
    return names[votes.argmax(axis=1)].astype(np.int64)


def transfer(basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, f_1: ArrayLike) -> FloatArray:
    """Return a function of shape 1 on shape 2 through the matrix alone: analyze, multiply, synthesize.

    f_2 = Phi_2 C_12 Phi_1^T M_1 f_1: smooth, for it holds only the first k1 modes of f_1.
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    k_2, k_1 = C.shape
    return np.asarray(basis_2.evecs[:, :k_2] @ (C @ basis_1.truncate(k_1).analyze(f_1)))


def point_map(basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, side: str = "functions") -> IntArray:
    """Return the point map of a functional map: each vertex of 2 goes to the vertex of 1 with the nearest row.

    C_12 says that Phi_1[p2p_21] C_12^T = Phi_2, nearly: for each row of Phi_2 the nearest row of Phi_1 C_12^T is
    found. The adjoint side, for each row of Phi_2 C_12 the nearest row of Phi_1, is the same thing for an orthogonal
    matrix only: where C_12 shrinks high frequencies, the searching rows shrink and land inside the cloud they search
    (Ovsjanikov et al., 2012, section 6.1; Melzi et al., "ZoomOut", 2019, section 4).

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, at least k1 and k2
    C_12 : (k2, k1), the functional map
    side : {"functions", "adjoint"}, which rows are compared

    Returns
    -------
    p2p_21 : (n2,) int, a vertex of 1 for each vertex of 2

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=10)
    >>> bool((point_map(basis, basis, np.eye(10)) == np.arange(basis.n)).all())
    True
    """
    return nearest_rows(*embeddings(basis_1, basis_2, C_12, side=side))


def embeddings(
    basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, side: str = "functions"
) -> tuple[FloatArray, FloatArray]:
    """Return rows (n1, d), (n2, d) that a functional map makes comparable: equal rows are the same point.

    Phi_1 C_12^T area_1 / area_2 and Phi_2; or, on the adjoint side, Phi_1 and Phi_2 C_12.
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    k_2, k_1 = C.shape
    rows_1, rows_2 = basis_1.evecs[:, :k_1], basis_2.evecs[:, :k_2]
    if as_choice("side", side, SIDES) == "functions":
        return rows_1 @ (C.T * size_ratio(basis_1, basis_2)), rows_2
    return rows_1, rows_2 @ C


def size_ratio(basis_1: Eigenbasis, basis_2: Eigenbasis) -> float:
    """Return area 1 / area 2: times C_12^T it is the inverse of C_12 where shape 2 is a scaled copy of shape 1."""
    return float(basis_1.M.sum() / basis_2.M.sum())


def nearest_rows(rows_1: ArrayLike, rows_2: ArrayLike) -> IntArray:
    """Return for each row of the second array the nearest row of the first: the largest x . y - |x|^2 / 2.

    By blocks of one matrix product in single precision: above some ten dimensions no search tree is faster.

    >>> nearest_rows([[0.0, 0.0], [1.0, 1.0]], [[0.9, 0.8], [0.1, 0.0], [2.0, 2.0]]).tolist()
    [1, 0, 1]
    """
    first = as_floats("rows_1", rows_1, ("n1", "d"))
    second = as_floats("rows_2", rows_2, ("n2", first.shape[1])).astype(np.float32)
    half_squares = (0.5 * (first**2).sum(axis=1)).astype(np.float32)
    columns = np.ascontiguousarray(first.T, dtype=np.float32)
    nearest = np.empty(len(second), dtype=np.int64)
    for start in range(0, len(second), BLOCK):
        closeness = second[start : start + BLOCK] @ columns
        closeness -= half_squares
        nearest[start : start + BLOCK] = closeness.argmax(axis=1)
    return nearest


def as_point_map(p2p_21: ArrayLike, n_1: int, n_2: int | None = None) -> IntArray:
    """Return a point map checked: one vertex of shape 1, 0 .. n1 - 1, for each of the n2 vertices of shape 2.

    >>> as_point_map([0, 1, 2, 1], n_1=4, n_2=3)
    Traceback (most recent call last):
    ValueError: p2p_21 must hold a vertex of 1 for each of the 3 vertices of 2; got 4, the number of vertices of 1: it
    looks like a map from 1 to 2. Swap the shapes, or use the map of the other direction
    """
    vertices = np.asarray(p2p_21)
    if vertices.ndim == 1:
        _refuse_other_direction(len(vertices), n_1, n_2)
    return as_indices("p2p_21", vertices, ("n2" if n_2 is None else n_2,), stop=n_1)


def as_functional_map(basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike) -> FloatArray:
    """Return a functional map checked: a matrix (k2, k1) with no more rows and columns than the bases have modes."""
    C = as_floats("C_12", C_12, ("k2", "k1"))
    if C.shape[0] > basis_2.k or C.shape[1] > basis_1.k or not C.size:
        told = f"C_12 must have shape (k2, k1), at most ({basis_2.k}, {basis_1.k}); got {C.shape}"
        if 0 < C.shape[0] <= basis_1.k and 0 < C.shape[1] <= basis_2.k:
            raise ValueError(f"{told}: it looks like C_21. Swap the shapes, or use the map of the other direction")
        raise ValueError(f"{told}. Compute more modes, or cut the matrix")
    return C


def _refuse_other_direction(length: int, n_1: int, n_2: int | None) -> None:
    """Refuse a map whose length says that it goes from 1 to 2."""
    if n_2 is not None and length == n_1 != n_2:
        raise ValueError(
            f"p2p_21 must hold a vertex of 1 for each of the {n_2} vertices of 2; got {length}, the number of vertices "
            "of 1: it looks like a map from 1 to 2. Swap the shapes, or use the map of the other direction"
        )
