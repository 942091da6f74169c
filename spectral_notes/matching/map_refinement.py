"""Refinement of functional maps: to points and back, with the same modes (ICP) or with more each time (ZoomOut)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_count, as_indices
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.functional_maps import as_functional_map, functional_map, nearest_rows, point_map, size_ratio
from spectral_notes.meshes import TriangleMesh, farthest_points


def icp(basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, n_rounds: int = 10) -> FloatArray:
    """Return a functional map with orthogonal columns, refined by going to points and back with the same modes.

    Each round: the point map of C_12, its functional map, and the nearest matrix with orthonormal columns (or rows,
    where there are fewer), U V^T of its singular value decomposition, times the ratio of the shapes' sizes.

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, at least k1 and k2
    C_12 : (k2, k1), where to start
    n_rounds : how many rounds

    Returns
    -------
    (k2, k1): c_12 with C_12^T C_12 = I (or C_12 C_12^T = I) times area 2 / area 1. Raises TypeError or ValueError if
    the matrix does not fit the bases.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=6)
    >>> C_12 = icp(basis, basis, np.eye(6) + 0.05)
    >>> bool(np.allclose(C_12.T @ C_12, np.eye(6)))
    True

    References
    ----------
    Ovsjanikov et al., "Functional maps" (2012), section 6.2.
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    short_1, short_2 = basis_1.truncate(C.shape[1]), basis_2.truncate(C.shape[0])
    ratio = np.sqrt(size_ratio(basis_2, basis_1))
    for _ in range(as_count("n_rounds", n_rounds, 0)):
        left, _, right = np.linalg.svd(functional_map(short_1, short_2, point_map(short_1, short_2, C)), False)
        C = left @ right * ratio
    return C


def zoomout(
    basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, k: int | None = None, step: int = 10,
    samples: tuple[ArrayLike, ArrayLike] | None = None,
) -> FloatArray:
    """Return a functional map with k modes on each side, refined by going to points and back with more modes each time.

    Each round: the point map of C_12, then its functional map with `step` more modes. The last round keeps k.

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, at least k
    C_12 : (k2, k1), where to start; k1 and k2 grow by the same step up to k
    k : modes at the end; all that both bases have by default
    step : modes more in each round. The larger, the fewer rounds; 1 is the original method, 10 is as accurate here.
    samples : (array_like of int, array_like of int), vertices of shapes 1 and 2 to work with instead of all, for speed;
        see `sample_vertices`. C_12 is then fitted to them by least squares.

    Returns
    -------
    (k, k): c_12. Raises TypeError or ValueError if the matrix does not fit the bases, k is below its size, or there are
    fewer samples than modes.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=3)), k=40)
    >>> C_12 = zoomout(basis, basis, np.eye(10), k=40)
    >>> bool(np.allclose(C_12, np.eye(40), atol=1e-6))
    True

    References
    ----------
    Melzi et al., "ZoomOut: spectral upsampling for efficient shape correspondence" (2019), algorithm 1.
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    k = as_count("k", min(basis_1.k, basis_2.k) if k is None else k, max(C.shape), min(basis_1.k, basis_2.k))
    step = as_count("step", step, 1)
    rows_1, rows_2, analyze = _working_set(basis_1, basis_2, samples, k)
    ratio = size_ratio(basis_1, basis_2)
    while C.shape != (k, k):
        nearest = nearest_rows(rows_1[:, : C.shape[1]] @ (C.T * ratio), rows_2[:, : C.shape[0]])
        k_2, k_1 = (min(k, size + step) for size in C.shape)
        C = analyze(rows_1[nearest, :k_1], k_2)
    return C


def bijective_zoomout(
    basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, C_21: ArrayLike, *, k: int | None = None, step: int = 10,
    samples: tuple[ArrayLike, ArrayLike] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return functional maps of both directions, refined together as by `zoomout`, each the other's inverse nearly.

    Points are compared in both ways at once: rows [Phi_1 C_12^T, Phi_1] of shape 1, rows [Phi_2, Phi_2 C_21^T] of 2.

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, at least k
    C_12, C_21 : (j, j), where to start, square
    k, step, samples : as for `zoomout`

    Returns
    -------
    C_12, C_21 (k, k): functional maps from 1 to 2 and from 2 to 1. Raises TypeError or ValueError if the matrices are
    not square and of equal size, or do not fit the bases.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=3)), k=30)
    >>> C_12, C_21 = bijective_zoomout(basis, basis, np.eye(10), np.eye(10))
    >>> bool(np.allclose(C_12 @ C_21, np.eye(30), atol=1e-6))
    True

    References
    ----------
    Ren, Melzi, Ovsjanikov and Wonka, "MapTree: recovering multiple solutions in the space of maps" (2020), section 5.
    """
    C, D = as_functional_map(basis_1, basis_2, C_12), as_functional_map(basis_2, basis_1, C_21)
    if C.shape != D.shape or len(C) != len(C.T):
        raise ValueError(f"C_12 and C_21 must be square and of equal size; got {C.shape} and {D.shape}")
    k = as_count("k", min(basis_1.k, basis_2.k) if k is None else k, len(C), min(basis_1.k, basis_2.k))
    step = as_count("step", step, 1)
    rows_1, rows_2, analyze_2 = _working_set(basis_1, basis_2, samples, k)
    analyze_1 = _working_set(basis_2, basis_1, None if samples is None else samples[::-1], k)[2]
    ratio = size_ratio(basis_1, basis_2)
    while len(C) < k:
        j, following = len(C), min(k, len(C) + step)
        both_1 = np.hstack([rows_1[:, :j] @ (C.T * ratio), rows_1[:, :j]])
        both_2 = np.hstack([rows_2[:, :j], rows_2[:, :j] @ (D.T / ratio)])
        C = analyze_2(rows_1[nearest_rows(both_1, both_2), :following], following)
        D = analyze_1(rows_2[nearest_rows(both_2, both_1), :following], following)
    return C, D


def sample_vertices(mesh: TriangleMesh, n: int) -> IntArray:
    """Return vertices spread evenly: each is the one farthest, as the crow flies, from those before it.

    Parameters
    ----------
    mesh : the mesh
    n : how many, at most the number of vertices

    Returns
    -------
    (n,) ndarray of int64: vertices, from coarse to fine: the first m of them are the answer for m. Vertex 0 is the
    first. Raises TypeError or ValueError if there are not so many vertices.

    Examples
    --------
    >>> from spectral_notes.shapes import sheet
    >>> len(np.unique(sample_vertices(sheet(), 100)))
    100
    """
    return farthest_points(mesh.vertices, as_count("n", n, 1, mesh.n_vertices))


def _working_set(
    basis_1: Eigenbasis, basis_2: Eigenbasis, samples: tuple[ArrayLike, ArrayLike] | None, k: int
) -> tuple[FloatArray, FloatArray, Callable[[FloatArray, int], FloatArray]]:
    """The rows to compare, and what gives the first coefficients on 2 of functions known at its rows."""
    if samples is None:
        weighted = basis_2.M @ basis_2.evecs[:, :k]
        return basis_1.evecs, basis_2.evecs, lambda f, k_2: np.asarray(weighted[:, :k_2].T @ f)
    at_1 = as_indices("samples", samples[0], ("s1",), basis_1.n)
    at_2 = as_indices("samples", samples[1], ("s2",), basis_2.n)
    if min(len(at_1), len(at_2)) < k:
        raise ValueError(f"samples must be at least as many as the {k} modes; got {len(at_1)} and {len(at_2)}")
    rows_2 = basis_2.evecs[at_2]
    return basis_1.evecs[at_1], rows_2, lambda f, k_2: np.asarray(np.linalg.lstsq(rows_2[:, :k_2], f, rcond=None)[0])
