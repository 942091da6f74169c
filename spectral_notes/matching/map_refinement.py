"""Refinement of functional maps: to points and back, with the same modes (ICP) or with more each time (ZoomOut)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_count, as_indices
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.functional_maps import as_functional_map, functional_map, nearest_rows, point_map, size_ratio


def icp(basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, n_rounds: int = 10) -> FloatArray:
    """Return a map with orthogonal columns, of the size of C_12 (k2, k1), by going to points and back with these modes.

    Each of n_rounds rounds: the point map of C, its functional map, and the nearest matrix with orthonormal columns
    (rows, where there are fewer), U V^T of its singular value decomposition, times the square root of area 2 / area 1
    (Ovsjanikov et al., "Functional maps", 2012, section 6.2).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=6)
    >>> C_12 = icp(basis, basis, np.eye(6) + 0.05)
    >>> bool(np.allclose(C_12.T @ C_12, np.eye(6)))
    True
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    short_1, short_2 = basis_1.truncate(C.shape[1]), basis_2.truncate(C.shape[0])
    ratio = np.sqrt(size_ratio(basis_2, basis_1))
    for _ in range(as_count("n_rounds", n_rounds, 0)):
        left, _, right = np.linalg.svd(functional_map(short_1, short_2, point_map(short_1, short_2, C)), False)
        C = left @ right * ratio
    return C


def zoomout(
    basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, *, k: int | None = None, step: int = 10
) -> FloatArray:
    """Return a functional map (k, k), refined by going to points and back with more modes each time.

    Each round: the point map of C, then its functional map with `step` more modes. The last round keeps k (Melzi et
    al., "ZoomOut: spectral upsampling for efficient shape correspondence", 2019, algorithm 1).

    Parameters
    ----------
    basis_1, basis_2 : the modes of both shapes, at least k
    C_12 : (k2, k1), where to start; k1 and k2 grow by the same step up to k
    k : modes at the end; all that both bases have by default
    step : modes more in each round. The larger, the fewer rounds; 1 is the original method, 10 is as accurate here.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=3)), k=40)
    >>> bool(np.allclose(zoomout(basis, basis, np.eye(10), k=40), np.eye(40), atol=1e-6))
    True
    """
    C = as_functional_map(basis_1, basis_2, C_12)
    k = as_count("k", min(basis_1.k, basis_2.k) if k is None else k, max(C.shape), min(basis_1.k, basis_2.k))
    step = as_count("step", step, 1)
    while C.shape != (k, k):
        k_2, k_1 = (min(k, size + step) for size in C.shape)
        C = functional_map(basis_1.truncate(k_1), basis_2.truncate(k_2), point_map(basis_1, basis_2, C))
    return C


def bijective_zoomout(
    basis_1: Eigenbasis, basis_2: Eigenbasis, C_12: ArrayLike, C_21: ArrayLike, *, k: int | None = None, step: int = 10,
    samples: tuple[ArrayLike, ArrayLike] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return maps C_12, C_21 (k, k) of both directions, refined together as by `zoomout`, nearly each other's inverse.

    Points are compared in both ways at once: rows [Phi_1 C_12^T, Phi_1] of shape 1, rows [Phi_2, Phi_2 C_21^T] of 2
    (Ren, Melzi, Ovsjanikov and Wonka, "MapTree: recovering multiple solutions in the space of maps", 2020, section 5).

    Parameters
    ----------
    basis_1, basis_2, k, step : as for `zoomout`
    C_12, C_21 : (j, j), where to start, square
    samples : vertices of shapes 1 and 2 to work with instead of all, for speed; maps are fitted to them

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=3)), k=30)
    >>> C_12, C_21 = bijective_zoomout(basis, basis, np.eye(10), np.eye(10))
    >>> bool(np.allclose(C_12 @ C_21, np.eye(30), atol=1e-6))
    True
    """
    C, D = as_functional_map(basis_1, basis_2, C_12), as_functional_map(basis_2, basis_1, C_21)
    if C.shape != D.shape or len(C) != len(C.T):
        raise ValueError(f"C_12 and C_21 must be square and of equal size; got {C.shape} and {D.shape}")
    k = as_count("k", min(basis_1.k, basis_2.k) if k is None else k, len(C), min(basis_1.k, basis_2.k))
    step = as_count("step", step, 1)
    at_1, at_2 = samples or (None, None)
    (rows_1, analyze_1), (rows_2, analyze_2) = _known_at(basis_1, at_1, k), _known_at(basis_2, at_2, k)
    ratio = size_ratio(basis_1, basis_2)
    while len(C) < k:
        j, following = len(C), min(k, len(C) + step)
        both_1 = np.hstack([rows_1[:, :j] @ (C.T * ratio), rows_1[:, :j]])
        both_2 = np.hstack([rows_2[:, :j], rows_2[:, :j] @ (D.T / ratio)])
        C = analyze_2(rows_1[nearest_rows(both_1, both_2), :following])
        D = analyze_1(rows_2[nearest_rows(both_2, both_1), :following])
    return C, D


def _known_at(basis: Eigenbasis, at: ArrayLike | None, k: int) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
    """Rows of the modes at some vertices, or all, and what gives as many coefficients as there are functions."""
    if at is None:
        return basis.evecs, lambda f: basis.truncate(f.shape[1]).analyze(f)
    rows = basis.evecs[as_indices("samples", at, ("s",), basis.n)]
    if len(rows) < k:
        raise ValueError(f"samples must be at least as many as the {k} modes; got {len(rows)}")
    return rows, lambda f: np.asarray(np.linalg.lstsq(rows[:, : f.shape[1]], f, rcond=None)[0])
