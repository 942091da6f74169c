"""Heat, waves and quantum motion on any domain, and every filter: each scales the coefficients of an eigenbasis.

Analyze, multiply coefficient k by a function of its eigenvalue, synthesize. The functions here take the basis and a
signal; what the basis does not hold is lost, unless a filter says what becomes of it.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import FloatArray, as_count, as_floats, as_number, as_signal, as_symmetric
from spectral_notes.eigenbasis import Eigenbasis

ComplexArray = NDArray[np.complex128]


def filter_signal(basis: Eigenbasis, f: ArrayLike, gains: ArrayLike, *, beyond: float = 0.0) -> FloatArray:
    """Return the signal whose k-th coefficient has been multiplied by the k-th gain.

    Phi g(Lambda) Phi^T M f + beyond (f - Phi Phi^T M f).

    Parameters
    ----------
    basis : Eigenbasis
        The modes.
    f : array_like, shape (n,) or (n, d)
        The signal, pointwise; the three coordinates of a mesh's vertices are one with d = 3.
    gains : array_like, shape (k,)
        One factor a mode, mostly a function of `basis.evals`.
    beyond : float
        Gain of what the basis does not hold: 0 drops it, 1 keeps it.

    Returns
    -------
    ndarray, shape of f
        The filtered signal, pointwise.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit or numbers are not finite.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(21), k=21)
    >>> ramp = np.linspace(0.0, 1.0, 21)
    >>> filter_signal(basis, ramp, basis.evals < 1.0)[:2].round(12).tolist()  # only the constant passes: the mean
    [0.5, 0.5]

    References
    ----------
    Vallet and Levy, "Spectral geometry processing with manifold harmonics" (2008), section 4.
    """
    signal = as_signal("f", f, basis.n)
    gains = as_floats("gains", gains, (basis.k,))
    beyond = as_number("beyond", beyond)
    return beyond * signal + basis.synthesize(_scale(gains - beyond, basis.analyze(signal)))


def point_source(M: sp.csr_array, vertex: int) -> FloatArray:
    """Return one unit of heat, gathered at one vertex: a density that is zero elsewhere and integrates to one.

    Parameters
    ----------
    M : sparse array, shape (n, n)
        Mass matrix, lumped or full.
    vertex : int
        Where, 0 .. n - 1.

    Returns
    -------
    ndarray, shape (n,)
        Pointwise, in 1 / squared units of the vertices.

    Raises
    ------
    TypeError, ValueError
        If M is not symmetric or there is no such vertex.

    Examples
    --------
    >>> from spectral_notes import interval_laplacian
    >>> point_source(interval_laplacian(5)[1], 2).tolist()  # a vertex stands for a length of 1/4
    [0.0, 0.0, 4.0, 0.0, 0.0]
    """
    M = as_symmetric("M", M)
    f = np.zeros(M.shape[0])
    vertex = as_count("vertex", vertex, 0, len(f) - 1)
    f[vertex] = 1.0 / M.sum(axis=0)[vertex]
    return f


def heat(basis: Eigenbasis, f: ArrayLike, t: float) -> FloatArray:
    """Return the temperature at time t of a domain that starts at temperature f: every coefficient decays.

    u(t) = Phi exp(-Lambda t) Phi^T M f solves du/dt = Laplacian u with conductivity one; nothing leaves the domain.

    Parameters
    ----------
    basis : Eigenbasis
        The modes. With k of them the answer misses what is smaller than exp(-lambda_k t) of f.
    f : array_like, shape (n,) or (n, d)
        Temperature at time zero, pointwise.
    t : float
        Time, at least 0, in squared units of the vertices.

    Returns
    -------
    ndarray, shape of f
        Temperature at time t, pointwise.

    Raises
    ------
    TypeError, ValueError
        If f does not fit the basis or t is negative.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(51), k=51)
    >>> u = heat(basis, np.arange(51) < 10, 5.0)
    >>> bool(np.allclose(u, 9.5 / 50))  # in the end everything has the mean temperature
    True
    """
    return filter_signal(basis, f, np.exp(-as_number("t", t, low=0.0) * _nonnegative(basis)))


def wave(basis: Eigenbasis, f: ArrayLike, t: float, velocity: ArrayLike | None = None) -> FloatArray:
    """Return the height at time t of a wave that starts at height f: every coefficient swings, none decays.

    u(t) = Phi (cos(w t) a + sin(w t) / w b) with w = sqrt(lambda), a and b the coefficients of f and of the velocity;
    it solves d2u/dt2 = Laplacian u, whose fronts move at speed one. For w = 0 the second term is t b.

    Parameters
    ----------
    basis : Eigenbasis
        The modes.
    f : array_like, shape (n,) or (n, d)
        Height at time zero, pointwise.
    t : float
        Time, of either sign, in units of the vertices.
    velocity : array_like, shape of f, optional
        Velocity at time zero; at rest by default.

    Returns
    -------
    ndarray, shape of f
        Height at time t, pointwise.

    Raises
    ------
    TypeError, ValueError
        If f or the velocity does not fit the basis, or t is not a finite number.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(51), k=51)
    >>> u = wave(basis, np.zeros(51), 0.25, velocity=np.ones(51))
    >>> bool(np.allclose(u, 0.25))  # a push that is the same everywhere drives the whole string along
    True
    """
    signal, t = as_signal("f", f, basis.n), as_number("t", t)
    frequencies = np.sqrt(_nonnegative(basis))
    u = filter_signal(basis, signal, np.cos(frequencies * t))
    if velocity is None:
        return u
    push = as_floats("velocity", velocity, signal.shape)
    return u + filter_signal(basis, push, t * np.sinc(frequencies * t / np.pi))  # sin(w t) / w, and t where w = 0


def schroedinger(basis: Eigenbasis, f: ArrayLike, t: float) -> ComplexArray:
    """Return the complex state at time t of a free quantum particle in the state f: every coefficient turns.

    psi(t) = Phi exp(-i Lambda t / 2) Phi^T M f solves i dpsi/dt = -1/2 Laplacian psi; the probability psi* M psi stays.

    Parameters
    ----------
    basis : Eigenbasis
        The modes.
    f : array_like of real or complex numbers, shape (n,) or (n, d)
        State at time zero, pointwise.
    t : float
        Time, of either sign, in squared units of the vertices.

    Returns
    -------
    ndarray of complex128, shape of f
        State at time t, pointwise; `abs(psi) ** 2` is a probability density.

    Raises
    ------
    TypeError, ValueError
        If f does not fit the basis or t is not a finite number.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(51), k=51)
    >>> psi = schroedinger(basis, basis.evecs[:, 1], 0.3)
    >>> bool(np.allclose(abs(psi), abs(basis.evecs[:, 1])))  # a mode only turns its phase
    True
    """
    t, state = as_number("t", t), np.asarray(f)
    c = basis.analyze(state.real) + 1j * basis.analyze(state.imag)
    c = _scale(np.exp(-0.5j * t * basis.evals), c)
    return np.asarray(basis.synthesize(c.real) + 1j * basis.synthesize(c.imag))


def _scale(gains: NDArray[np.inexact], c: NDArray[np.inexact]) -> NDArray[np.inexact]:
    """Multiply row k of the coefficients by gain k."""
    return (gains * c.T).T


def _nonnegative(basis: Eigenbasis) -> FloatArray:
    """The eigenvalues, those below zero by rounding set to zero."""
    return np.maximum(basis.evals, 0.0)
