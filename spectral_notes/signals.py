"""Functions sampled on a line: grids, the weighted inner product, hat functions, bases; light and its colour.

A function sampled at n points is a vector f of shape (n,). Its inner product is <f, g> = f^T M g with a mass matrix M:
diagonal with the trapezoid weights, or the tridiagonal Gram matrix of the hat functions. A spectrum of light is a
function of the wavelength in nanometres, and its colour the image under a linear map of rank three.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy import constants

from spectral_notes._checks import FloatArray, as_count, as_floats, as_increasing, as_number, as_symmetric


def interval_grid(n: int, start: float = 0.0, stop: float = 1.0) -> FloatArray:
    """Return n >= 2 equally spaced points, shape (n,), from `start` to `stop`, both ends included: x_i = start + i h.

    >>> interval_grid(5).tolist()
    [0.0, 0.25, 0.5, 0.75, 1.0]
    """
    n = as_count("n", n, 2)
    start = as_number("start", start)
    return np.linspace(start, as_number("stop", stop, above=start), n)


def gaussian(x: ArrayLike, centre: float, width: float) -> FloatArray:
    """Return a bump of unit area: exp(-(x - centre)^2 / 2 width^2) / (width sqrt(2 pi)), at the points x (n,).

    >>> gaussian([0.0, 1.0], centre=0.0, width=1.0).round(4).tolist()
    [0.3989, 0.242]
    """
    x = as_floats("x", x, ("n",))
    width = as_number("width", width, above=0)
    return np.exp(-0.5 * ((x - as_number("centre", centre)) / width) ** 2) / (width * np.sqrt(2 * np.pi))


def trapezoid_weights(x: ArrayLike) -> FloatArray:
    """Return weights w (n,) with w @ f = integral of the piecewise-linear f: half of the two cells beside each point.

    w_i = (x_{i+1} - x_{i-1}) / 2, and half a cell at either end, so sum(w) = x_{n-1} - x_0; x increases strictly. The
    diagonal matrix of these weights is a mass matrix: <f, g> = sum_i w_i f_i g_i.

    >>> trapezoid_weights([0.0, 1.0, 3.0]).tolist()
    [0.5, 1.5, 1.0]
    """
    half = np.diff(as_increasing("x", x)) / 2  # (n - 1,)
    return np.append(half, 0.0) + np.append(0.0, half)


def hat_functions(x: ArrayLike, t: ArrayLike) -> FloatArray:
    """Return the hats of the grid x (n,) at points t (m,): column i is 1 at x_i, 0 at every other x_j, linear between.

    The matrix B (m, n) has rows that sum to one inside the grid, and B @ f is the piecewise-linear function through f.

    >>> hat_functions([0.0, 1.0, 2.0], [0.25, 1.0]).tolist()
    [[0.75, 0.25, 0.0], [0.0, 1.0, 0.0]]
    """
    x = as_increasing("x", x)
    t = as_floats("t", t, ("m",))
    return np.stack([np.interp(t, x, impulse, left=0, right=0) for impulse in np.eye(len(x))], axis=1)


def hat_mass(x: ArrayLike) -> sp.csr_array:
    """Return the Gram matrix of the hats, M_ij = integral of hat_i hat_j: tridiagonal, symmetric, positive definite.

    With h_i = x_{i+1} - x_i: M_ii = (h_{i-1} + h_i) / 3 and M_{i,i+1} = h_i / 6. The row sums are the trapezoid
    weights ("lumping"). f^T M g is the exact integral of the product of the two piecewise-linear functions.

    >>> (6 * hat_mass([0.0, 1.0, 2.0]).toarray()).round(12).tolist()
    [[2.0, 1.0, 0.0], [1.0, 4.0, 1.0], [0.0, 1.0, 2.0]]
    """
    beside = np.diff(as_increasing("x", x)) / 6  # (n - 1,)
    diagonal = 2 * (np.append(beside, 0.0) + np.append(0.0, beside))
    return sp.diags_array([beside, diagonal, beside], offsets=[-1, 0, 1]).tocsr()


def inner_product(f: ArrayLike, g: ArrayLike, M: object) -> float:
    """Return <f, g> = f^T M g: symmetric, linear in either argument, an integral when M holds the sample spacing.

    >>> inner_product([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], np.diag([0.5, 1.0, 0.5]))
    4.0
    """
    mass = as_symmetric("M", M)
    n = mass.shape[0]
    return float(as_floats("f", f, (n,)) @ (mass @ as_floats("g", g, (n,))))


def norm(f: ArrayLike, M: object) -> float:
    """Return the length of f, ||f|| = sqrt(f^T M f), zero only for f = 0 where M is positive definite.

    >>> norm([3.0, 4.0], np.eye(2))
    5.0
    """
    return float(np.sqrt(inner_product(f, f, M)))


def best_coefficients(f: ArrayLike, B: ArrayLike, M: object) -> FloatArray:
    """Return the c (k,) for which B @ c is nearest to f (n,): the residual is M-orthogonal to every column of B (n, k).

    They solve the normal equations (B^T M B) c = B^T M f, whose matrix is the Gram matrix of the columns.

    >>> best_coefficients([0.0, 1.0, 5.0], np.ones((3, 1)), np.eye(3)).round(12).tolist()
    [2.0]
    """
    mass = as_symmetric("M", M)
    n = mass.shape[0]
    B = as_floats("B", B, (n, "k"))
    gram = B.T @ (mass @ B)  # (k, k)
    if np.linalg.matrix_rank(gram, hermitian=True) < B.shape[1]:
        raise ValueError("the columns of B must be linearly independent to working precision; try `orthonormalize`")
    return np.linalg.solve(gram, B.T @ (mass @ as_floats("f", f, (n,))))


def orthonormalize(B: ArrayLike, M: object) -> FloatArray:
    """Return Q with Q^T M Q = I whose first j columns span those of B, for each j: Gram-Schmidt, run twice.

    One pass loses orthogonality with the condition of B, the second restores it (Giraud, Langou, Rozloznik, van den
    Eshof, Numerische Mathematik 101 (2005) 87-100). Each column has a positive M-product with its column of B.

    >>> orthonormalize([[1.0, 0.0], [1.0, 2.0]], np.diag([0.5, 0.5])).tolist()
    [[1.0, -1.0], [1.0, 1.0]]
    """
    mass = as_symmetric("M", M)
    Q = as_floats("B", B, (mass.shape[0], "k"))
    for j in range(Q.shape[1]):
        column = Q[:, j]
        size = np.sqrt(column @ (mass @ column))
        for _ in range(2):
            column = column - Q[:, :j] @ (Q[:, :j].T @ (mass @ column))
        rest = np.sqrt(column @ (mass @ column))
        if rest <= 1e-12 * size:
            raise ValueError(f"the columns of B must be linearly independent; column {j} is spanned by those before it")
        Q[:, j] = column / rest
    return Q


# Wyman, Sloan, Shirley (2013), eq. 4: row, height, centre (nm), 1/width left and right of it (1/nm).
_LOBES = (
    (0, 0.362, 442.0, 0.0624, 0.0374),
    (0, 1.056, 599.8, 0.0264, 0.0323),
    (0, -0.065, 501.1, 0.0490, 0.0382),
    (1, 0.821, 568.8, 0.0213, 0.0247),
    (1, 0.286, 530.9, 0.0613, 0.0322),
    (2, 1.217, 437.0, 0.0845, 0.0278),
    (2, 0.681, 459.0, 0.0385, 0.0725),
)

# IEC 61966-2-1:1999: XYZ of the three primaries of a screen, white at (0.9505, 1, 1.089).
_SRGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def balmer_lines(count: int = 4) -> FloatArray:
    """Return the wavelengths in nm of hydrogen's visible series: 1 / lambda = R (1/2^2 - 1/m^2), m = 3, 4, ...

    R is the Rydberg constant of hydrogen, R_inf / (1 + m_e / m_p); in vacuum. Fine structure is left out (it moves and
    splits the lines by about 0.01 nm).

    >>> balmer_lines(4).round(1).tolist()
    [656.5, 486.3, 434.2, 410.3]
    """
    m = np.arange(3, 3 + as_count("count", count, 1))
    rydberg = constants.Rydberg / (1 + constants.m_e / constants.m_p)  # 1/m
    return 1e9 / (rydberg * (0.25 - 1 / m**2))


def line_spectrum(wavelengths: ArrayLike, lines: ArrayLike, powers: ArrayLike, width: float = 2.0) -> FloatArray:
    """Return the spectrum, in W/nm, of a lamp that shines in a few lines (nm): bumps whose areas are the `powers` (W).

    s(lambda) = sum_j powers_j gaussian(lambda, lines_j, width); the width, in nm, is the resolution of a spectrometer.

    >>> line_spectrum([588.0, 589.0, 590.0], lines=[589.0], powers=[1.0], width=1.0).round(3).tolist()
    [0.242, 0.399, 0.242]
    """
    wavelengths = as_floats("wavelengths", wavelengths, ("n",))
    lines = as_floats("lines", lines, ("k",))
    powers = as_floats("powers", powers, (len(lines),))
    bumps = [power * gaussian(wavelengths, line, width) for line, power in zip(lines, powers, strict=True)]
    return np.sum(bumps, axis=0) if bumps else np.zeros(len(wavelengths))


def blackbody_spectrum(wavelengths: ArrayLike, temperature: float) -> FloatArray:
    """Return the positive spectral radiance, in W / (m^2 sr nm), of a black body of a temperature in K: Planck's law.

    B(lambda) = (2 h c^2 / lambda^5) / (exp(h c / (lambda k T)) - 1), for wavelengths in nm; its top lies at
    2.8978e6 nm K / T (Wien). 2700 K is a warm bulb, 5772 K the surface of the sun.

    >>> blackbody_spectrum([400.0, 500.0, 600.0], 5772.0).round(-2).tolist()
    [22900.0, 26200.0, 24400.0]
    """
    metres = as_floats("wavelengths", wavelengths, ("n",), positive=True) * 1e-9
    temperature = as_number("temperature", temperature, above=0)
    u = constants.h * constants.c / (metres * constants.k * temperature)
    photons = np.exp(-u) / -np.expm1(-u)  # 1 / (exp(u) - 1) without overflow
    return 1e-9 * 2 * constants.h * constants.c**2 / metres**5 * photons


def colour_matching(wavelengths: ArrayLike) -> FloatArray:
    """Return the matching functions x, y, z, (3, n), of the CIE 1931 2-degree observer, approximated by seven lobes.

    An invertible mix of the sensitivities of the eye's three kinds of cones, at wavelengths in nm. The fit stays within
    0.015 of the CIE table at every 10 nm of 380 .. 780 (tops: 1.06, 1.00, 1.78), and is positive like the table (Wyman,
    Sloan, Shirley, "Simple analytic approximations to the CIE XYZ color matching functions", 2013, eq. 4).

    >>> colour_matching([450.0, 555.0, 600.0]).round(2).tolist()
    [[0.34, 0.52, 1.06], [0.03, 1.0, 0.63], [1.78, 0.01, 0.0]]
    """
    wavelengths = as_floats("wavelengths", wavelengths, ("n",))
    C = np.zeros((3, len(wavelengths)))
    for row, height, centre, left, right in _LOBES:
        offset = wavelengths - centre
        C[row] += height * np.exp(-0.5 * (offset * np.where(offset < 0, left, right)) ** 2)
    return C


def spectrum_to_xyz(spectrum: ArrayLike, wavelengths: ArrayLike) -> FloatArray:
    """Return the colour (X, Y, Z) of a light, linear in the light: three inner products with the matching functions.

    The integrals take the trapezoid weights of the wavelengths, in nm; Y is the luminance up to a unit.

    >>> grid = np.linspace(380.0, 780.0, 401)
    >>> spectrum_to_xyz(np.ones(401), grid).round(1).tolist()
    [106.7, 106.9, 106.8]
    """
    wavelengths = as_increasing("wavelengths", wavelengths)
    spectrum = as_floats("spectrum", spectrum, (len(wavelengths),))
    return colour_matching(wavelengths) @ (trapezoid_weights(wavelengths) * spectrum)


def xyz_to_srgb(xyz: ArrayLike) -> FloatArray:
    """Return the screen colour, three numbers in [0, 1], of (X, Y, Z), white at Y = 1: not linear, it clips and bends.

    Linear red, green, blue solve the matrix of the primaries; what a screen cannot show is clipped to [0, 1]; then
    v -> 12.92 v below 0.0031308 and 1.055 v^(1/2.4) - 0.055 above (IEC 61966-2-1:1999).

    >>> xyz_to_srgb([0.9505, 1.0, 1.089]).round(6).tolist()
    [1.0, 1.0, 1.0]
    """
    linear = np.clip(np.linalg.solve(_SRGB_TO_XYZ, as_floats("xyz", xyz, (3,))), 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def metamer(spectrum: ArrayLike, wavelengths: ArrayLike, direction: ArrayLike) -> FloatArray:
    """Return another light of exactly the same colour: spectrum + t black, non-negative, zero in at least one place.

    `black` is the part of `direction` that no cone sees: what is left of it after its best approximation by the three
    matching functions. t > 0 is as large as a non-negative light allows.

    >>> grid = np.linspace(380.0, 780.0, 401)
    >>> other = metamer(np.ones(401), grid, np.cos(grid / 20))
    >>> float(other.min()), bool(np.allclose(spectrum_to_xyz(other - 1, grid), 0, atol=1e-10))
    (0.0, True)
    """
    wavelengths = as_increasing("wavelengths", wavelengths)
    spectrum = as_floats("spectrum", spectrum, (len(wavelengths),), positive=True)
    direction = as_floats("direction", direction, (len(wavelengths),))
    seen = colour_matching(wavelengths).T  # (n, 3)
    black = direction - seen @ best_coefficients(direction, seen, sp.diags_array(trapezoid_weights(wavelengths)))
    if np.abs(black).max() <= 1e-10 * np.abs(direction).max():
        raise ValueError("direction must not be a combination of the matching functions; every part of it is seen")
    t = 1 / (-black / spectrum).max()
    return np.maximum(spectrum + t * black, 0.0)
