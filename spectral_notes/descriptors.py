"""Descriptors: numbers read off an eigenbasis that do not change when the shape moves or bends.

Signatures of points (HKS, WKS, GPS) and of whole shapes (ShapeDNA). Most of them know the size of the shape:
`unit_area` measures a basis in units of its own area first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats, as_increasing, as_number
from spectral_notes.eigenbasis import Eigenbasis


def unit_area(basis: Eigenbasis) -> Eigenbasis:
    """Return the basis of the same shape scaled to area one: every descriptor of it is free of scale.

    With A = 1^T M 1: lambda -> A lambda, phi -> sqrt(A) phi, M -> M / A; nothing is computed again.
    """
    area = float(basis.M.sum())
    residuals = None if basis.residuals is None else area * basis.residuals
    return replace(basis, evals=area * basis.evals, evecs=np.sqrt(area) * basis.evecs, M=basis.M / area,
                   residuals=residuals)


def global_point_signature(basis: Eigenbasis) -> FloatArray:
    """Return coordinates of every vertex that know neither pose nor scale: the modes over their frequency.

    GPS(x)_k = phi_k(x) / sqrt(lambda_k), without the zero modes, so (n, k - zero modes). It is defined up to a sign of
    each column, and a rotation of columns that share an eigenvalue; distances between rows are defined up to nothing
    (Rustamov, "Laplace-Beltrami eigenfunctions for deformation invariant shape representation", 2007, section 4).
    """
    first = first_nonzero(basis, 1)
    return np.asarray(basis.evecs[:, first:] / np.sqrt(basis.evals[first:]))


def shape_dna(basis: Eigenbasis, *, scale: str = "area") -> FloatArray:
    """Return the spectrum of a shape without its zeros, ascending and positive: a fingerprint of the whole shape.

    lambda_k times the area, or over the first of them, or as it is ("none"), in 1 / squared units of the vertices,
    which falls by 1 / s^2 when the shape grows by s (Reuter, Wolter and Peinecke, "Laplace-Beltrami spectra as
    Shape-DNA of surfaces and solids", 2006).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.sphere(3)), k=5)
    >>> shape_dna(basis, scale="first").round(1).tolist()
    [1.0, 1.0, 1.0, 3.0]
    """
    scale = as_choice("scale", scale, ("area", "first", "none"))
    evals = basis.evals[first_nonzero(basis, 1) :]
    return np.array(evals * {"area": float(basis.M.sum()), "first": 1.0 / evals[0], "none": 1.0}[scale])


def spectral_distances(spectra: ArrayLike) -> FloatArray:
    """Return the distance (s, s) between every two of s spectra: the root mean square of ln(lambda_k / mu_k).

    The logarithm compares each mode in percent: 0.01 means eigenvalues that differ by one percent. The plain difference
    would be ruled by the last ones, as eigenvalues of a surface grow like k.

    >>> spectral_distances([[1.0, 4.0], [1.01, 4.04]]).round(4).tolist()
    [[0.0, 0.01], [0.01, 0.0]]
    """
    spectra = as_floats("spectra", spectra, ("s", "p"))
    if (spectra <= 0.0).any():
        raise ValueError(f"spectra must be positive, without the zero modes; found {spectra.min():g}")
    logarithms = np.log(spectra)
    return np.sqrt(((logarithms[:, None] - logarithms[None]) ** 2).mean(axis=2))


def heat_kernel_signature(basis: Eigenbasis, times: ArrayLike) -> FloatArray:
    """Return how much heat of a drop is still where it fell, (n, p) for p times: positive, falling with time.

    HKS(x, t) = sum_k exp(-lambda_k t) phi_k(x)^2, in 1 / squared units of the vertices, t in squared units; it tends to
    1 / area. Scaled by s: HKS_s(x, s^2 t) = HKS(x, t) / s^2. `signature_times` chooses times (Sun, Ovsjanikov and
    Guibas, "A concise and provably informative multi-scale signature based on heat diffusion", 2009, eq. 4).
    """
    times = as_floats("times", times, ("p",), positive=True)
    return np.asarray(basis.evecs**2 @ np.exp(-np.outer(np.maximum(basis.evals, 0.0), times)))


def signature_times(basis: Eigenbasis, n_times: int = 16) -> FloatArray:
    """Return times for `heat_kernel_signature`, ascending and evenly spaced in their logarithm.

    From 4 ln 10 / lambda_max, when the last mode counts 1e-4, to 4 ln 10 / lambda_1, when the first does (Sun,
    Ovsjanikov and Guibas, 2009, section 5).

    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(101), k=11)
    >>> times = signature_times(basis, 3)
    >>> (times[2] / times[0]).round(1).item()  # lambda_10 / lambda_1, nearly 10^2
    99.2
    """
    n_times, evals = as_count("n_times", n_times, 2), basis.evals[first_nonzero(basis, 2) :]
    span = 4.0 * np.log(10.0)
    return np.geomspace(span / evals[-1], span / evals[0], n_times)


def wave_kernel_signature(basis: Eigenbasis, energies: ArrayLike, width: float) -> FloatArray:
    """Return how likely a quantum particle of about a given energy is found at each vertex, (n, p) for p energies.

    WKS(x, e) = sum_k g_k(e) phi_k(x)^2 / sum_k g_k(e), g_k(e) = exp(-(e - ln lambda_k)^2 / (2 width^2)), without the
    zero modes; each column integrates to one. Scaled by s: WKS_s(x, e - 2 ln s) = WKS(x, e) / s^2. `signature_energies`
    chooses energies and width (Aubry, Schlickewei and Cremers, "The wave kernel signature", 2011, section 3).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.egg(3)), k=40)
    >>> wks = wave_kernel_signature(basis, *signature_energies(basis, 8))
    >>> (basis.M @ wks).sum(axis=0).round(12).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    evecs, gains = wave_kernel_gains(basis, as_increasing("energies", energies), as_number("width", width, above=0.0))
    return np.asarray(evecs**2 @ gains)


def wave_kernel_gains(basis: Eigenbasis, energies: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
    """Return the modes beyond the constants (n, modes), and their weights (modes, p) at p energies, each sum one."""
    first = first_nonzero(basis, 2)
    distance = (energies - np.log(basis.evals[first:, None])) / width  # (modes, p)
    nearest = (distance**2).min(axis=0)  # taken off, so that no column underflows
    gains = np.exp(-0.5 * (distance**2 - nearest))
    return basis.evecs[:, first:], gains / gains.sum(axis=0)


def signature_energies(basis: Eigenbasis, n_energies: int = 100) -> tuple[FloatArray, float]:
    """Return energies, logarithms of eigenvalues, and a width for `wave_kernel_signature`.

    The energies are evenly spaced, two widths inside the spectrum's ends; a width is seven steps between them.
    """
    n_energies = as_count("n_energies", n_energies, 2)
    low, high = np.log(basis.evals[[first_nonzero(basis, 2), -1]])
    width = 7.0 * (high - low) / (n_energies - 1 + 28.0)
    return np.linspace(low + 2.0 * width, high - 2.0 * width, n_energies), float(width)


def first_nonzero(basis: Eigenbasis, n_wanted: int) -> int:
    """Return how many zero modes a basis has, and refuse one without `n_wanted` modes beyond them.

    The basis knows: one zero mode a connected component. A weak link between parts makes a small eigenvalue, no zero.
    """
    first = basis.n_zero
    assert first is not None
    if basis.k - first < n_wanted:
        raise ValueError(f"basis must hold at least {n_wanted} modes beyond the constants; it holds {basis.k - first}")
    return first
