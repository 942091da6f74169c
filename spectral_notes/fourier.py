"""The Fourier basis of N samples round a circle: the transform three ways, its scalings, and truncation.

The waves are psi[k, n] = cos(2 pi k n / N) and chi[k, n] = sin(2 pi k n / N). The coefficients of the course are the
plain averages a[k] = <f, psi[k]> / N and b[k] = <f, chi[k]> / N, so that f = sum_k a[k] psi[k] + b[k] chi[k] over all
k = 0 .. N - 1, and `numpy.fft.fft(f)` is N (a - i b): cosines in the real part, *minus* the sines in the imaginary one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes import _checks
from spectral_notes._checks import FloatArray, IntArray


def fourier_matrices(n: int) -> tuple[FloatArray, FloatArray]:
    """Build the cosine and the sine waves on `n` samples, one wave a row, both symmetric (n, n) matrices.

    psi[k, j] = cos(2 pi k j / n) and chi[k, j] = sin(2 pi k j / n). Rows k and n - k hold the same pair of waves:
    psi[n - k] = psi[k] and chi[n - k] = -chi[k]. The squared length of psi[k] is n for k = 0 and k = n / 2 and
    n / 2 otherwise; that of chi[k] is 0 for k = 0 and k = n / 2 and n / 2 otherwise.

    >>> psi, chi = fourier_matrices(4)
    >>> psi.round().astype(int).tolist()
    [[1, 1, 1, 1], [1, 0, -1, 0], [1, -1, 1, -1], [1, 0, -1, 0]]
    """
    n = _checks.as_count("n", n, 1)
    samples = np.arange(n)
    # k j and k j mod n are the same angle; the smaller one loses fewer digits.
    angles = 2 * np.pi * (np.outer(samples, samples) % n) / n  # (k, j)
    return np.cos(angles), np.sin(angles)


def fourier_basis(n: int) -> tuple[FloatArray, IntArray]:
    """Build the orthonormal real Fourier basis Q (n, n), one wave a column, by frequency: Q.T @ Q is the identity.

    Columns: 1 / sqrt(n); sqrt(2 / n) psi[k] and sqrt(2 / n) chi[k] for 0 < k < n / 2; for even n, psi[n / 2] / sqrt(n).
    The second array (n,) holds the oscillations round the circle of each column. Analyze with c = Q.T @ f, synthesize
    with f = Q @ c.

    >>> fourier_basis(6)[1].tolist()
    [0, 1, 1, 2, 2, 3]
    """
    psi, chi = fourier_matrices(n)
    frequencies = (np.arange(n) + 1) // 2
    is_sine = (np.arange(n) % 2 == 0) & (frequencies > 0)
    waves = np.where(is_sine[:, None], chi[frequencies], psi[frequencies])  # (columns of Q, samples)
    alone = (frequencies == 0) | (2 * frequencies == n)
    return (waves * np.sqrt(np.where(alone, 1.0, 2.0) / n)[:, None]).T, frequencies


def dft_by_definition(f: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Average a signal (n,) against each wave in turn: the cosine coefficients `a` and the sine ones `b`, (n,) each.

    a[k] = (1 / n) sum_j f[j] cos(2 pi k j / n) and b[k] = (1 / n) sum_j f[j] sin(2 pi k j / n), for k = 0 .. n - 1:
    a[0] is the mean, and b[0] is 0. For real f, a[n - k] = a[k] and b[n - k] = -b[k] (Brunton and Kutz, Data-Driven
    Science and Engineering, 2019, section 2.2, split into its two real parts).

    >>> t = 2 * np.pi * np.arange(20) / 20
    >>> a, b = dft_by_definition(3 * np.cos(5 * t) + 2 * np.sin(7 * t))
    >>> print(f"{2 * a[5]:.6f} {2 * b[7]:.6f}")
    3.000000 2.000000
    """
    f = _as_samples("f", f)
    n = f.size
    a, b = np.empty(n), np.empty(n)
    for k in range(n):
        angles = 2 * np.pi * (k * np.arange(n) % n) / n
        a[k] = np.sum(f * np.cos(angles)) / n
        b[k] = np.sum(f * np.sin(angles)) / n
    return a, b


def dft_by_matrices(f: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Apply the cosine and the sine matrix to a signal: the same `a` and `b` as `dft_by_definition`.

    a = psi f / n and b = chi f / n; about 2 n^2 multiplications, and two (n, n) matrices in memory.

    >>> a, b = dft_by_matrices([1.0, 0.0, 0.0, 0.0])
    >>> a.tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    f = _as_samples("f", f)
    psi, chi = fourier_matrices(f.size)
    return psi @ f / f.size, chi @ f / f.size


def dft_by_fft(f: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Read `a` and `b` off `numpy.fft.fft`, in about n log n operations; the imaginary part changes sign.

    F[k] = sum_j f[j] exp(-2 pi i k j / n) = n (a[k] - i b[k]), so a = Re F / n and b = -Im F / n.

    >>> t = 2 * np.pi * np.arange(8) / 8
    >>> a, b = dft_by_fft(np.sin(t))
    >>> print(f"{b[1]:.3f} {b[7]:.3f}")
    0.500 -0.500
    """
    F = np.fft.fft(_as_samples("f", f))
    return F.real / F.size, -F.imag / F.size


def half_coefficients(a: ArrayLike, b: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Fold the pair k, n - k into one wave: the amplitudes A, B of the sum over k = 0 .. n // 2 only.

    f = sum_{k <= n / 2} A[k] psi[k] + B[k] chi[k], with A = 2 a and B = 2 b, except that k = 0 and, for even n,
    k = n / 2 have no partner and stay as they are: 3 cos(5 t) has A[5] = 3. As of every real signal, a[n - k] = a[k]
    and b[n - k] = -b[k].

    >>> A, B = half_coefficients([7.0, 1.5, 1.0, 1.5], [0.0, 2.0, 0.0, -2.0])
    >>> A.tolist(), B.tolist()
    ([7.0, 3.0, 1.0], [0.0, 4.0, 0.0])
    """
    a = _as_samples("a", a)
    b = _checks.as_floats("b", b, a.shape)
    partners = -np.arange(a.size) % a.size  # n - k, and 0 for k = 0
    largest = float(max(np.abs(a).max(), np.abs(b).max()))
    for name, law, gap in (("a", "a[k]", a - a[partners]), ("b", "-b[k]", b + b[partners])):
        off = float(np.abs(gap).max())
        if off > 1e-10 * largest:
            raise ValueError(
                f"{name} must satisfy {name}[n - k] = {law}, as a real signal's coefficients do; it is off by {off:.2g}"
            )
    k = np.arange(a.size // 2 + 1)
    weights = np.where((k == 0) | (2 * k == a.size), 1.0, 2.0)  # how many frequencies share the wave k
    return weights * a[: weights.size], weights * b[: weights.size]


def keep_first(c: ArrayLike, k: int) -> FloatArray:
    """Keep the first `k` coefficients and set the others to zero: a low-pass, as the basis is sorted by frequency.

    In an orthonormal basis the squared error of the synthesis is the sum of the dropped squares; in the Fourier basis
    an odd `k` keeps cosines and sines in whole pairs.

    >>> keep_first([5.0, 1.0, -3.0, 2.0], 2).tolist()
    [5.0, 1.0, 0.0, 0.0]
    """
    c = _as_samples("c", c)
    k = _checks.as_count("k", k, 0, c.size)
    return np.where(np.arange(c.size) < k, c, 0.0)


def keep_largest(c: ArrayLike, k: int) -> FloatArray:
    """Keep the `k` coefficients of largest size and set the others to zero; of equals, the earlier one stays.

    In an orthonormal basis no other choice of `k` coefficients has a smaller squared error (Parseval).

    >>> keep_largest([5.0, 1.0, -3.0, 2.0], 2).tolist()
    [5.0, 0.0, -3.0, 0.0]
    """
    c = _as_samples("c", c)
    k = _checks.as_count("k", k, 0, c.size)
    kept = np.zeros_like(c)
    largest = np.argsort(-np.abs(c), kind="stable")[:k]
    kept[largest] = c[largest]
    return kept


def _as_samples(name: str, value: ArrayLike) -> FloatArray:
    """A non-empty vector of finite floats."""
    vector = _checks.as_floats(name, value, ("n",))
    _checks.as_count(f"the length of {name}", vector.size, 1)
    return vector
