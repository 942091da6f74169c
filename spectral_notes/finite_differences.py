"""First and second differences of samples on a line or a circle, as sparse matrices, with their closed-form modes.

A function sampled at n points is a vector, and a derivative is a matrix. What happens at the two ends of the interval
is part of the matrix, and decides its eigenvectors:

=============  =================================  ====================  =======================
`ends`         what lies beyond the samples       sample points         eigenvectors
=============  =================================  ====================  =======================
"periodic"     the other end                      i h                   Fourier (DFT)
"dirichlet"    zeros                              (i + 1) h             sines (DST-I)
"neumann"      the mirror image (zero slope)      (i + 1/2) h           cosines (DCT-II)
=============  =================================  ====================  =======================
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes import _checks
from spectral_notes._checks import FloatArray

ENDS = ("periodic", "dirichlet", "neumann")


def difference_grid(n: int, length: float = 1.0, *, ends: str) -> tuple[FloatArray, float]:
    """Return the n >= 2 sample points, and their spacing h, on which the second differences with these ends live.

    Periodic: x_i = i h with h = length / n. Dirichlet: x_i = (i + 1) h with h = length / (n + 1), so both end points,
    where the function is zero, are left out. Neumann: x_i = (i + 1/2) h with h = length / n, the centres of n cells.

    >>> x, h = difference_grid(4, length=8.0, ends="neumann")
    >>> x.tolist(), h
    ([1.0, 3.0, 5.0, 7.0], 2.0)
    """
    n = _checks.as_count("n", n, 2)
    length = _checks.as_number("length", length, above=0)
    ends = _checks.as_choice("ends", ends, ENDS)
    h = length / (n + 1) if ends == "dirichlet" else length / n
    first = {"periodic": 0.0, "dirichlet": 1.0, "neumann": 0.5}[ends]
    return h * (np.arange(n, dtype=np.float64) + first), h


def forward_difference(n: int, h: float = 1.0, *, ends: str) -> sp.csr_array:
    """Return the matrix D, in 1/h, that sends n samples to the slopes across the gaps between them.

    (D f)_j = (f_{j+1} - f_j) / h. One row is one gap, so the shape says what the ends are: the circle has n gaps, the
    interval between two zeros n + 1, the free interval n - 1. A slope belongs to the middle of its gap; there it is a
    central difference and second-order accurate, while read at a sample it is first-order.

    >>> forward_difference(3, ends="neumann").toarray().tolist()
    [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]]
    """
    n = _checks.as_count("n", n, 2)
    h = _checks.as_number("h", h, above=0)
    ends = _checks.as_choice("ends", ends, ENDS)
    if ends == "periodic":
        return sp.diags_array([-1 / h, 1 / h, 1 / h], offsets=[0, 1, 1 - n], shape=(n, n), format="csr")
    if ends == "dirichlet":
        return sp.diags_array([-1 / h, 1 / h], offsets=[-1, 0], shape=(n + 1, n), format="csr")
    return sp.diags_array([-1 / h, 1 / h], offsets=[0, 1], shape=(n - 1, n), format="csr")


def central_difference(n: int, h: float = 1.0, *, ends: str) -> sp.csr_array:
    """Return the second-order accurate matrix (n, n) of d/dx, in 1/h, at the n >= 3 samples themselves.

    (D f)_i = (f_{i+1} - f_{i-1}) / 2h; antisymmetric for "periodic" ends. With "one-sided" ones the first row is [-3,
    4, -1] / 2h and the last [1, -4, 3] / 2h: the slope at the end of the parabola through three samples, so no value is
    assumed beyond the ends.

    >>> D = central_difference(4, ends="one-sided")
    >>> (D @ np.array([0.0, 1.0, 4.0, 9.0])).tolist()
    [0.0, 2.0, 4.0, 6.0]
    """
    n = _checks.as_count("n", n, 3)
    h = _checks.as_number("h", h, above=0)
    ends = _checks.as_choice("ends", ends, ("one-sided", "periodic"))
    if ends == "periodic":
        weights, offsets = np.array([-1, 1, 1, -1]) / (2 * h), [-1, 1, 1 - n, n - 1]
        return sp.diags_array(list(weights), offsets=offsets, shape=(n, n), format="csr")
    D = sp.diags_array([-1 / (2 * h), 1 / (2 * h)], offsets=[-1, 1], shape=(n, n), format="lil")
    D[0, :3] = np.array([-3, 4, -1]) / (2 * h)
    D[-1, -3:] = np.array([1, -4, 3]) / (2 * h)
    return D.tocsr()


def second_difference(n: int, h: float = 1.0, *, ends: str) -> sp.csr_array:
    """Return L = D^T D, in 1/h^2, symmetric and positive semidefinite: MINUS the second derivative, pointwise.

    (L f)_i = (2 f_i - f_{i-1} - f_{i+1}) / h^2 inside, with D the forward differences of the same ends. The energy
    f^T L f = |D f|^2 is the sum of the squared slopes. The weak form is h L, with mass matrix h I.

    >>> second_difference(3, ends="neumann").toarray().tolist()
    [[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]
    """
    D = forward_difference(n, h, ends=ends)
    return (D.T @ D).tocsr()


def second_difference_modes(n: int, h: float = 1.0, *, ends: str) -> tuple[FloatArray, FloatArray]:
    """Return all eigenvalues, ascending, and orthonormal eigenvectors of `second_difference` from their closed forms.

    Periodic: 1, cos 2 pi i k/n, sin 2 pi i k/n with lambda = (4/h^2) sin^2(pi k/n), the cosine first. Dirichlet: sin pi
    (i+1) k/(n+1), k = 1..n, with lambda = (4/h^2) sin^2(pi k/(2n+2)). Neumann: cos pi (i+1/2) k/n, k = 0..n-1, with
    lambda = (4/h^2) sin^2(pi k/2n). (G. Strang, "The discrete cosine transform", SIAM Review 41 (1999) 135-147.)

    >>> evals, evecs = second_difference_modes(6, ends="periodic")
    >>> evals.round(12).tolist()
    [0.0, 1.0, 1.0, 3.0, 3.0, 4.0]
    """
    x, spacing = difference_grid(n, 1.0, ends=ends)
    h = _checks.as_number("h", h, above=0)
    column = np.arange(n)
    if ends == "periodic":
        wavenumber = 2 * np.pi * ((column + 1) // 2)
        is_cosine = (column % 2 == 1) | (column == 0)
    else:
        wavenumber = np.pi * (column + 1 if ends == "dirichlet" else column)
        is_cosine = np.full(n, ends == "neumann")
    phase = np.outer(x, wavenumber)  # (n, n): one row a sample, one column a mode
    waves = np.where(is_cosine, np.cos(phase), np.sin(phase))
    evals = (2 / h * np.sin(wavenumber * spacing / 2)) ** 2
    return evals, waves / np.linalg.norm(waves, axis=0)


def spectral_derivative(f: ArrayLike, length: float, *, order: int = 1) -> FloatArray:
    """Return the derivative of a periodic signal by scaling its Fourier coefficients.

    The samples f (n,) stand at x_i = i length / n. The coefficient of exp(2 pi i k x / length) is multiplied by (2 pi i
    k / length)^order. It is exact for waves below the Nyquist frequency. When n is even, the alternating vector samples
    a cosine at its extrema, so its odd derivatives are zero (L. N. Trefethen, "Spectral Methods in MATLAB", 2000,
    chapter 3).
    """
    f = _checks.as_floats("f", f, ("n",))
    length = _checks.as_number("length", length, above=0)
    order = _checks.as_count("order", order, 0)
    n = len(f)
    factor = (2j * np.pi / length * np.arange(n // 2 + 1)) ** order
    return np.fft.irfft(factor * np.fft.rfft(f), n)  # irfft drops an imaginary Nyquist coefficient
