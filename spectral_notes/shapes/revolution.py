"""Eigenvalues of surfaces of revolution by one-dimensional solvers: ten and more digits where no formula is known.

A surface about the z axis has a circle of radius r(t) at each point t of its profile; w(t) is the profile's speed, the
length of its curve per unit of t. A mode is u(t) cos(m phi) or u(t) sin(m phi), and u solves

    -(r / w u')' + m^2 (w / r) u = lambda r w u.

So each order m > 0 brings pairs of equal eigenvalues, and m = 0 single ones.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
from scipy.special import eval_jacobi

from spectral_notes._checks import FloatArray, IntArray, as_choice, as_count
from spectral_notes.shapes.surfaces import torus_radii

Profile = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def revolution_eigenvalues(profile: Profile, k: int, *, kind: str, n: int = 64) -> tuple[FloatArray, IntArray]:
    """Return the first k eigenvalues of a smooth closed surface of revolution, ascending, and the order m of each.

    Polynomials of degree n, or waves of frequency up to n, solve each order; for an analytic profile the error falls
    exponentially with n, so that a second run with a larger n shows how many digits are right.

    Parameters
    ----------
    profile : takes t (p,), returns the radius r and the speed w, both (p,) and positive inside
    k : how many eigenvalues, 1 .. n^2 / 16
    kind : {"poles", "ring"}
        "poles": t runs from 0 to pi and the profile meets the axis smoothly at both ends, r / sin t being smooth, as on
        a sphere. "ring": t runs round a closed profile, from 0 to 2 pi, as on a torus.
    n : resolution, at least 8

    Returns
    -------
    evals : (k,), in 1 / length^2
    orders : (k,), the order m of each; m > 0 comes twice

    Examples
    --------
    >>> evals, orders = revolution_eigenvalues(lambda t: (np.sin(t), np.ones_like(t)), 9, kind="poles")  # the sphere
    >>> evals.round(9) + 0.0
    array([0., 2., 2., 2., 6., 6., 6., 6., 6.])
    """
    n = as_count("n", n, 8)
    k = as_count("k", k, 1, n * n // 16)
    solve = {"poles": _solve_poles, "ring": _solve_ring}[as_choice("kind", kind, ("poles", "ring"))]
    evals, orders, m = np.empty(0), np.empty(0, dtype=np.int64), 0
    while True:
        found = np.repeat(solve(profile, m, n), 1 if m == 0 else 2)
        found[0] *= m > 0  # the constants
        if len(evals) >= k and found[0] > evals[k - 1]:
            return evals[:k], orders[:k]
        evals, orders = np.concatenate([evals, found]), np.concatenate([orders, np.full(len(found), m)])
        rank = np.argsort(evals, kind="stable")
        evals, orders, m = evals[rank], orders[rank], m + 1


def egg_eigenvalues(k: int, *, n: int = 64) -> tuple[FloatArray, IntArray]:
    """Return the first k eigenvalues of the smooth surface that `shapes.egg` samples, and their orders m.

    Parameters
    ----------
    k, n : as in `revolution_eigenvalues`

    Examples
    --------
    >>> evals, orders = egg_eigenvalues(4)
    >>> orders.tolist()
    [0, 0, 1, 1]
    """
    height, slope = 1.3, 0.18 * 1.3

    def profile(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        swell = np.exp(-slope * np.cos(t))
        return np.sin(t) * swell, np.hypot((np.cos(t) + slope * np.sin(t) ** 2) * swell, height * np.sin(t))

    return revolution_eigenvalues(profile, k, kind="poles", n=n)


def torus_eigenvalues(k: int, R: float = 1.0, r: float = 0.4, *, n: int = 64) -> tuple[FloatArray, IntArray]:
    """Return the first k eigenvalues of the smooth torus that `shapes.torus` samples, and their orders m.

    Parameters
    ----------
    k, n : as in `revolution_eigenvalues`
    R, r : radius of the tube's centre circle and of the tube, 0 < r < R

    Examples
    --------
    >>> evals, orders = torus_eigenvalues(4)
    >>> orders.tolist()
    [0, 1, 1, 2]
    """
    R, r = torus_radii(R, r)
    return revolution_eigenvalues(lambda t: (R + r * np.cos(t), np.full_like(t, r)), k, kind="ring", n=n)


def _solve_poles(profile: Profile, m: int, n: int) -> FloatArray:
    """Eigenvalues of order m from u = sin^m(t) p(cos t): Jacobi polynomials, Gauss quadrature; the lower half."""
    x, weight = np.polynomial.legendre.leggauss(3 * n)
    t, sine, j = np.arccos(x), np.sqrt(1.0 - x * x), np.arange(n)[:, None]
    p = eval_jacobi(j, m, m, x)  # (n, q)
    slope = (j + 2 * m + 1) / 2.0 * eval_jacobi(np.maximum(j - 1, 0), m + 1, m + 1, x) * (j > 0)
    u = sine**m * p
    du = m * sine ** (m - 1.0) * x * p - sine ** (m + 1.0) * slope
    r, w = profile(t)
    weight = weight / sine  # dt = dx / sin t
    A = (du * (weight * r / w)) @ du.T + m**2 * (u * (weight * w / r)) @ u.T
    B = (u * (weight * r * w)) @ u.T
    size = np.sqrt(np.diag(B))
    return np.asarray(scipy.linalg.eigvalsh(A / np.outer(size, size), B / np.outer(size, size))[: n // 2])


def _solve_ring(profile: Profile, m: int, n: int) -> FloatArray:
    """Eigenvalues of order m on an odd number of equal steps, differentiated by waves; the lower half."""
    size = 2 * n + 1
    t = 2.0 * np.pi * np.arange(size) / size
    step = t[:, None] - t
    with np.errstate(divide="ignore", invalid="ignore"):
        sign = (-1.0) ** (np.arange(size)[:, None] - np.arange(size))
        D = np.where(step == 0.0, 0.0, sign / (2.0 * np.sin(step / 2.0)))
    r, w = profile(t)
    A = D.T @ (D * (r / w)[:, None]) + np.diag(m**2 * w / r)
    scale = 1.0 / np.sqrt(r * w)
    return np.asarray(scipy.linalg.eigvalsh(A * np.outer(scale, scale))[:n])
