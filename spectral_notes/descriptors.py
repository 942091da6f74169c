"""Descriptors: numbers read off an eigenbasis that do not change when the shape moves or bends.

One door to the signatures of points (HKS and WKS from `signatures`, GPS) and of whole shapes (ShapeDNA). Most of them
know the size of the shape: `unit_area` measures a basis in units of its own area first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_choice, as_floats
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.signatures import (
    first_nonzero,
    heat_kernel_signature,
    signature_energies,
    signature_times,
    wave_kernel_signature,
)

__all__ = [
    "unit_area",
    "heat_kernel_signature",
    "signature_times",
    "wave_kernel_signature",
    "signature_energies",
    "global_point_signature",
    "shape_dna",
    "spectral_distances",
]


def unit_area(basis: Eigenbasis) -> Eigenbasis:
    """Return the basis of the same shape scaled to area one: every descriptor of it is free of scale.

    With A = 1^T M 1: lambda -> A lambda, phi -> sqrt(A) phi, M -> M / A.

    Parameters
    ----------
    basis : Eigenbasis
        The modes of a surface.

    Returns
    -------
    Eigenbasis
        As if computed from the scaled surface, without computing.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=4)
    >>> round(float(unit_area(basis).M.sum()), 12)
    1.0
    """
    area = float(basis.M.sum())
    residuals = None if basis.residuals is None else area * basis.residuals
    return replace(basis, evals=area * basis.evals, evecs=np.sqrt(area) * basis.evecs, M=basis.M / area,
                   residuals=residuals)  # fmt: skip


def global_point_signature(basis: Eigenbasis) -> FloatArray:
    """Return coordinates of every vertex that know neither pose nor scale: the modes over their frequency.

    GPS(x)_k = phi_k(x) / sqrt(lambda_k), without the zero modes. It is defined up to a sign of each column, and a
    rotation of columns that share an eigenvalue; distances between rows are defined up to nothing.

    Parameters
    ----------
    basis : Eigenbasis
        The modes of a surface.

    Returns
    -------
    ndarray, shape (n, k - number of zero modes)
        Without unit.

    Raises
    ------
    ValueError
        If no eigenvalue differs from zero.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=9)
    >>> global_point_signature(basis).shape
    (642, 8)

    References
    ----------
    Rustamov, "Laplace-Beltrami eigenfunctions for deformation invariant shape representation" (2007), section 4.
    """
    first = first_nonzero(basis, 1)
    return np.asarray(basis.evecs[:, first:] / np.sqrt(basis.evals[first:]))


def shape_dna(basis: Eigenbasis, *, scale: str = "area") -> FloatArray:
    """Return the spectrum of a shape without its zeros, ascending and positive: a fingerprint of the whole shape.

    lambda_k times the area, or over the first of them, or as it is, which falls by 1 / s^2 when the shape grows by s.

    Parameters
    ----------
    basis : Eigenbasis
        The modes of a surface.
    scale : {"area", "first", "none"}
        What takes the scale out.

    Returns
    -------
    ndarray, shape (k - number of zero modes,)
        Without unit; for "none" in 1 / squared units of the vertices.

    Raises
    ------
    ValueError
        If the scale is none of these, or no eigenvalue differs from zero.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=5)
    >>> shape_dna(basis, scale="first").round(1).tolist()
    [1.0, 1.0, 1.0, 3.0]

    References
    ----------
    Reuter, Wolter and Peinecke, "Laplace-Beltrami spectra as Shape-DNA of surfaces and solids" (2006).
    """
    scale = as_choice("scale", scale, ("area", "first", "none"))
    evals = basis.evals[first_nonzero(basis, 1) :]
    return np.array(evals * {"area": float(basis.M.sum()), "first": 1.0 / evals[0], "none": 1.0}[scale])


def spectral_distances(spectra: ArrayLike) -> FloatArray:
    """Return the distance between every two spectra: the root mean square of ln(lambda_k / mu_k).

    The logarithm compares each mode in percent. The plain difference would be ruled by the last ones: eigenvalues of a
    surface grow like k.

    Parameters
    ----------
    spectra : array_like, shape (s, p)
        One spectrum a row, positive; see `shape_dna`.

    Returns
    -------
    ndarray, shape (s, s)
        Symmetric, zero on the diagonal, without unit: 0.01 means eigenvalues that differ by one percent.

    Raises
    ------
    TypeError, ValueError
        If a number is not positive.

    Examples
    --------
    >>> spectral_distances([[1.0, 4.0], [1.01, 4.04]]).round(4).tolist()
    [[0.0, 0.01], [0.01, 0.0]]
    """
    spectra = as_floats("spectra", spectra, ("s", "p"))
    if (spectra <= 0.0).any():
        raise ValueError(f"spectra must be positive, without the zero modes; found {spectra.min():g}")
    logarithms = np.log(spectra)
    return np.sqrt(((logarithms[:, None] - logarithms[None]) ** 2).mean(axis=2))
