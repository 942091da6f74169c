"""What is known without a mesh: the sphere's eigenvalues and harmonics, Weyl's count, two drums; and how to compare.

`spectral_notes.shapes.revolution` holds the references of the egg and the torus.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.special import gammaln, lpmv

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats, as_number, as_symmetric

DRUM_EIGENVALUES: FloatArray = np.array(
    [
        2.53794399980, 3.65550971352, 5.17555935622, 6.53755744376, 7.24807786256,
        9.20929499840, 10.5969856913, 11.5413953956, 12.3370055014, 13.0536540557,
        14.3138624643, 15.8713026200, 16.9417516880, 17.6651184368, 18.9810673877,
        20.8823950433, 21.2480051774, 22.2328517930, 23.7112974848, 24.4792340693,
        24.6740110027, 26.0802400997, 27.3040189211, 28.1751285815, 29.5697729132,
    ]
)
"""First 25 Dirichlet eigenvalues of both drums of `shapes.gww_drums`: Driscoll (1997), to all the digits he gives."""
DRUM_EIGENVALUES.setflags(write=False)


def sphere_eigenvalues(k: int, radius: float = 1.0) -> FloatArray:
    r"""Return the first k eigenvalues of a sphere, ascending, each as often as it occurs, in 1 / length^2.

    .. math:: \lambda = l (l + 1) / R^2, \quad 2 l + 1 \text{ times}, \quad l = 0, 1, 2, \dots

    Parameters
    ----------
    k : how many, at least 1
    radius : radius R, positive

    Examples
    --------
    >>> sphere_eigenvalues(10).tolist()
    [0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0, 12.0]
    """
    k = as_count("k", k, 1)
    radius = as_number("radius", radius, above=0.0)
    degree = np.arange(int(np.sqrt(k)) + 1)
    return np.repeat(degree * (degree + 1.0), 2 * degree + 1)[:k] / radius**2


def spherical_harmonics(points: ArrayLike, degree: int) -> FloatArray:
    r"""Return the real spherical harmonics of one degree, orthonormal on the unit sphere: 2 l + 1 columns.

    They are eigenfunctions of the sphere's Laplacian, :math:`-\Delta Y = l (l + 1) Y`, and the values on the sphere of
    homogeneous polynomials of degree l that are harmonic in space.

    .. math:: Y_{l,\pm m} = \sqrt{\tfrac{(2 - \delta_{m0}) (2l + 1)}{4 \pi} \tfrac{(l - m)!}{(l + m)!}}\;
              P_l^m(\cos\theta)\, \{\cos m\varphi, \sin m\varphi\}

    Parameters
    ----------
    points : (n, 3), points whose directions from the origin count; none at the origin
    degree : the degree l, at least 0

    Returns
    -------
    Y : (n, 2 l + 1), pointwise values; order m = -l .. l, the sines first

    Examples
    --------
    >>> spherical_harmonics([[0, 0, 2.0]], 1).round(4) + 0.0
    array([[0.    , 0.4886, 0.    ]])
    """
    points = as_floats("points", points, ("n", 3))
    l = as_count("degree", degree, 0)
    distance = np.linalg.norm(points, axis=1)
    if not distance.all():
        raise ValueError(f"points must lie off the origin; point {int(np.argmin(distance))} does not")
    height, longitude = points[:, 2] / distance, np.arctan2(points[:, 1], points[:, 0])
    columns = []
    for m in range(-l, l + 1):
        share = np.exp(gammaln(l - abs(m) + 1) - gammaln(l + abs(m) + 1))
        wave = np.sin(-m * longitude) if m < 0 else np.cos(m * longitude)
        size = np.sqrt((2 - (m == 0)) * (2 * l + 1) / (4 * np.pi) * share)
        columns.append(size * lpmv(abs(m), l, height) * wave)
    return np.column_stack(columns)


def weyl_count(values: ArrayLike, area: float, boundary: float = 0.0, *, ends: str = "neumann") -> FloatArray:
    r"""Return about how many eigenvalues of a surface lie below each value: Weyl's law with its boundary term.

    .. math:: N(\lambda) \approx \frac{A \lambda}{4 \pi} \pm \frac{\ell \sqrt\lambda}{4 \pi},
              \quad + \text{ Neumann}, - \text{ Dirichlet}

    Parameters
    ----------
    values : (p,), values of lambda, not negative, in 1 / length^2
    area : area A of the surface, positive
    boundary : length of the boundary; 0 for a closed surface
    ends : {"neumann", "dirichlet"}, the boundary condition

    Returns
    -------
    counts : (p,), not rounded; the law is an average

    Examples
    --------
    >>> float(weyl_count([100.0], area=4 * np.pi)[0])
    100.0
    """
    values = as_floats("values", values, ("p",))
    if values.min(initial=0.0) < 0:
        raise ValueError(f"values must not be negative; the smallest is {values.min():g}")
    area = as_number("area", area, above=0.0)
    boundary = as_number("boundary", boundary, low=0.0)
    sign = {"neumann": 1.0, "dirichlet": -1.0}[as_choice("ends", ends, ("neumann", "dirichlet"))]
    return np.asarray((area * values + sign * boundary * np.sqrt(values)) / (4.0 * np.pi))


def principal_angles(A: ArrayLike, B: ArrayLike, M: sp.csr_array) -> FloatArray:
    """Return the angles between two subspaces in the inner product of M, ascending: all zero where B lies in A's span.

    With :math:`Q_A, Q_B` M-orthonormal bases, the sines are the singular values of :math:`Q_B - Q_A (Q_A^T M Q_B)` in
    the norm of M. No choice of basis, sign or rotation changes them (Björck and Golub, "Numerical methods for computing
    angles between linear subspaces", 1973).

    Parameters
    ----------
    A : (n, p), columns that span one subspace; linearly independent
    B : (n, q), columns that span the other, q at most p
    M : (n, n), mass matrix

    Returns
    -------
    angles : (q,), in radians, 0 .. pi / 2

    Examples
    --------
    >>> M = sp.csr_array(sp.eye_array(3))
    >>> np.degrees(principal_angles(np.eye(3)[:, :2], [[1.0], [0.0], [1.0]], M)).round(6)
    array([45.])
    """
    A = as_floats("A", A, ("n", "p"))
    B = as_floats("B", B, (len(A), "q"))
    M = as_symmetric("M", M, len(A))
    if B.shape[1] > A.shape[1]:
        raise ValueError(f"B must have at most as many columns as A, {A.shape[1]}; got {B.shape[1]}")
    QA, QB = _orthonormal(A, M), _orthonormal(B, M)
    outside = QB - QA @ (QA.T @ (M @ QB))
    squares = scipy.linalg.eigvalsh(outside.T @ (M @ outside))
    return np.asarray(np.arcsin(np.sqrt(np.clip(squares, 0.0, 1.0))))


def _orthonormal(A: FloatArray, M: sp.csr_array) -> FloatArray:
    """An M-orthonormal basis of the span of A's columns."""
    for _ in range(2):  # the second round removes what rounding left of the first
        R = scipy.linalg.cholesky(A.T @ (M @ A))
        A = np.asarray(scipy.linalg.solve_triangular(R, A.T, trans="T").T)
    return A
