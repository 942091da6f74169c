"""Functions sampled on a line: grids, the weighted inner product, hat functions, bases.

A function sampled at n points is a vector f of shape (n,). Its inner product is <f, g> = f^T M g with a mass matrix M:
diagonal with the trapezoid weights, or the tridiagonal Gram matrix of the hat functions.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, as_count, as_floats, as_increasing, as_number, as_symmetric


def interval_grid(n: int, start: float = 0.0, stop: float = 1.0) -> FloatArray:
    """Return n equally spaced points from `start` to `stop`, both ends included: x_i = start + i h.

    Parameters
    ----------
    n : number of points, at least 2
    start, stop : ends of the interval, start < stop

    Returns
    -------
    x : (n,) increasing, spacing h = (stop - start) / (n - 1)

    Raises
    ------
    TypeError, ValueError : n is no integer or below 2; start or stop is no number; stop is not above start.

    Examples
    --------
    >>> interval_grid(5).tolist()
    [0.0, 0.25, 0.5, 0.75, 1.0]
    """
    n = as_count("n", n, 2)
    start = as_number("start", start)
    return np.linspace(start, as_number("stop", stop, above=start), n)


def circle_grid(n: int, length: float = 2 * np.pi) -> FloatArray:
    """Return n equally spaced points of a circle; the end is left out, as it is the start again: x_i = i length / n.

    Parameters
    ----------
    n : number of points, at least 1
    length : circumference, positive

    Returns
    -------
    x : (n,) in [0, length)

    Raises
    ------
    TypeError, ValueError : n is no integer or below 1; length is no number or not positive.

    Examples
    --------
    >>> circle_grid(4, length=1.0).tolist()
    [0.0, 0.25, 0.5, 0.75]
    """
    n = as_count("n", n, 1)
    return np.arange(n, dtype=np.float64) * (as_number("length", length, above=0) / n)


def gaussian(x: ArrayLike, centre: float, width: float) -> FloatArray:
    """Return a bump of unit area: exp(-(x - centre)^2 / 2 width^2) / (width sqrt(2 pi)).

    Parameters
    ----------
    x : (n,) points
    centre : place of the top
    width : standard deviation, positive, in the unit of x

    Returns
    -------
    values : (n,) pointwise, positive

    Raises
    ------
    TypeError, ValueError : x is no array of numbers; centre or width is no number; width is not positive.

    Examples
    --------
    >>> gaussian([0.0, 1.0], centre=0.0, width=1.0).round(4).tolist()
    [0.3989, 0.242]
    """
    x = as_floats("x", x, ("n",))
    width = as_number("width", width, above=0)
    values: FloatArray = np.exp(-0.5 * ((x - as_number("centre", centre)) / width) ** 2) / (width * np.sqrt(2 * np.pi))
    return values


def trapezoid_weights(x: ArrayLike) -> FloatArray:
    """Return weights w with w @ f = integral of the piecewise-linear f: half of the two cells beside each point.

    w_i = (x_{i+1} - x_{i-1}) / 2, and half a cell at either end; so sum(w) = x_{n-1} - x_0. The diagonal matrix of
    these weights is a mass matrix: <f, g> = sum_i w_i f_i g_i.

    Parameters
    ----------
    x : (n,) strictly increasing points, n >= 2, not necessarily equally spaced

    Returns
    -------
    w : (n,) positive, in the unit of x

    Raises
    ------
    TypeError, ValueError : x is no array of numbers, has fewer than two points, or does not increase strictly.

    Examples
    --------
    >>> trapezoid_weights([0.0, 1.0, 3.0]).tolist()
    [0.5, 1.5, 1.0]
    """
    half: FloatArray = np.diff(as_increasing("x", x)) / 2  # (n - 1,)
    weights: FloatArray = np.append(half, 0.0) + np.append(0.0, half)
    return weights


def hat_functions(x: ArrayLike, t: ArrayLike) -> FloatArray:
    """Return the hats of the grid x at the points t: column i is 1 at x_i, 0 at every other x_j, linear between.

    Parameters
    ----------
    x : (n,) strictly increasing grid points, n >= 2
    t : (m,) where to evaluate; every hat is zero outside [x_0, x_{n-1}]

    Returns
    -------
    B : (m, n) between 0 and 1; rows sum to one inside the grid, and B @ f is the piecewise-linear function through f

    Raises
    ------
    TypeError, ValueError : as `trapezoid_weights`, and t is no array of numbers.

    Examples
    --------
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

    Parameters
    ----------
    x : (n,) strictly increasing grid points, n >= 2

    Returns
    -------
    M : (n, n) csr_array, integrated

    Raises
    ------
    TypeError, ValueError : as `trapezoid_weights`.

    Examples
    --------
    >>> (6 * hat_mass([0.0, 1.0, 2.0]).toarray()).round(12).tolist()
    [[2.0, 1.0, 0.0], [1.0, 4.0, 1.0], [0.0, 1.0, 2.0]]
    """
    beside = np.diff(as_increasing("x", x)) / 6  # (n - 1,)
    diagonal = 2 * (np.append(beside, 0.0) + np.append(0.0, beside))
    return sp.diags_array([beside, diagonal, beside], offsets=[-1, 0, 1]).tocsr()


def inner_product(f: ArrayLike, g: ArrayLike, M: object) -> float:
    """Return <f, g> = f^T M g: symmetric, linear in either argument, an integral when M holds the sample spacing.

    Parameters
    ----------
    f, g : (n,) values at the samples
    M : (n, n) symmetric mass matrix, sparse or dense

    Returns
    -------
    product : integrated, in the unit of f times that of g times that of x

    Raises
    ------
    TypeError, ValueError : M is no real symmetric matrix; f or g does not have shape (n,).

    Examples
    --------
    >>> inner_product([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], np.diag([0.5, 1.0, 0.5]))
    4.0
    """
    mass = as_symmetric("M", M)
    n = mass.shape[0]
    return float(as_floats("f", f, (n,)) @ (mass @ as_floats("g", g, (n,))))


def norm(f: ArrayLike, M: object) -> float:
    """Return the length of f, ||f|| = sqrt(f^T M f), zero only for f = 0.

    Parameters
    ----------
    f : (n,) values at the samples
    M : (n, n) symmetric positive definite mass matrix, sparse or dense

    Returns
    -------
    length : root of an integral; the root-mean-square of f times the root of the domain's length

    Raises
    ------
    TypeError, ValueError : as `inner_product`.

    Examples
    --------
    >>> norm([3.0, 4.0], np.eye(2))
    5.0
    """
    return float(np.sqrt(inner_product(f, f, M)))


def best_coefficients(f: ArrayLike, B: ArrayLike, M: object) -> FloatArray:
    """Return the coefficients c for which B @ c is nearest to f: the residual is M-orthogonal to every column of B.

    They solve the normal equations (B^T M B) c = B^T M f, whose matrix is the Gram matrix of the columns.

    Parameters
    ----------
    f : (n,) values at the samples
    B : (n, k) one basis function a column, linearly independent
    M : (n, n) symmetric positive definite mass matrix

    Returns
    -------
    c : (k,) coefficients; B @ c is the best approximation of f in the norm of M

    Raises
    ------
    TypeError, ValueError : M is no real symmetric matrix; f or B has another number of rows; dependent columns.

    Examples
    --------
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

    Parameters
    ----------
    B : (n, k) one basis function a column, linearly independent
    M : (n, n) symmetric positive definite mass matrix

    Returns
    -------
    Q : (n, k) M-orthonormal columns, each with a positive M-product with its column of B

    Raises
    ------
    TypeError, ValueError : M is no real symmetric matrix; B has another number of rows; dependent columns.

    Examples
    --------
    >>> orthonormalize([[1.0, 0.0], [1.0, 2.0]], np.diag([0.5, 0.5])).tolist()
    [[1.0, -1.0], [1.0, 1.0]]

    Notes
    -----
    Twice is enough: one pass loses orthogonality with the condition of B, the second restores it (Giraud,
    Langou, Rozloznik, van den Eshof, Numerische Mathematik 101 (2005) 87-100).
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
