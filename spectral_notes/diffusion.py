"""Heat, waves and quantum motion on any domain, and every filter: each scales the coefficients of an eigenbasis.

Analyze, multiply coefficient k by a function of its eigenvalue, synthesize. What the basis does not hold is lost,
unless a filter says what becomes of it. Smoothing by steps needs no eigenbasis: explicit, implicit, and Taubin's
two-step that does not shrink are filters as well; their response is the formula in each docstring. Any other smooth
response is a Chebyshev polynomial of L, one product with L a degree.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import FloatArray, as_count, as_floats, as_number, as_signal, as_symmetric
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.mesh_calculus import PoissonSolver
from spectral_notes.meshes import TriangleMesh, is_closed, signed_volume

ComplexArray = NDArray[np.complex128]


def filter_signal(basis: Eigenbasis, f: ArrayLike, gains: ArrayLike, *, beyond: float = 0.0) -> FloatArray:
    """Return the signal (n,) or (n, d) whose k-th coefficient has been multiplied by the k-th gain.

    Phi g(Lambda) Phi^T M f + beyond (f - Phi Phi^T M f): `beyond` is the gain of what the basis does not hold, 0 drops
    it, 1 keeps it (Vallet and Levy, "Spectral geometry processing with manifold harmonics", 2008, section 4).

    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> basis = compute_eigenbasis(*interval_laplacian(21), k=21)
    >>> ramp = np.linspace(0.0, 1.0, 21)
    >>> filter_signal(basis, ramp, basis.evals < 1.0)[:2].round(12).tolist()  # only the constant passes: the mean
    [0.5, 0.5]
    """
    signal = as_signal("f", f, basis.n)
    gains = as_floats("gains", gains, (basis.k,))
    beyond = as_number("beyond", beyond)
    return beyond * signal + basis.synthesize(_scale(gains - beyond, basis.analyze(signal)))


def point_source(M: sp.csr_array, vertex: int) -> FloatArray:
    """Return one unit of heat at one vertex: a density, in 1 / units of M, zero elsewhere, that integrates to one.

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
    """Return the temperature at time t >= 0 of a domain that starts at temperature f: every coefficient decays.

    u(t) = Phi exp(-Lambda t) Phi^T M f solves du/dt = Laplacian u with conductivity one; nothing leaves the domain.
    Time is in squared units of the vertices. With k modes the answer misses what is smaller than exp(-lambda_k t) of f.
    """
    return filter_signal(basis, f, np.exp(-as_number("t", t, low=0.0) * np.maximum(basis.evals, 0.0)))


def wave(basis: Eigenbasis, f: ArrayLike, t: float, velocity: ArrayLike | None = None) -> FloatArray:
    """Return the height at time t of a wave that starts at height f, at rest by default: every coefficient swings.

    u(t) = Phi (cos(w t) a + sin(w t) / w b) with w = sqrt(lambda), a and b the coefficients of f and of the velocity;
    it solves d2u/dt2 = Laplacian u, whose fronts move at speed one. For w = 0 the second term is t b.
    """
    signal, t = as_signal("f", f, basis.n), as_number("t", t)
    frequencies = np.sqrt(np.maximum(basis.evals, 0.0))  # of a zero mode rounding may have made a negative one
    u = filter_signal(basis, signal, np.cos(frequencies * t))
    if velocity is None:
        return u
    push = as_floats("velocity", velocity, signal.shape)
    return u + filter_signal(basis, push, t * np.sinc(frequencies * t / np.pi))  # sin(w t) / w, and t where w = 0


def schroedinger(basis: Eigenbasis, f: ArrayLike, t: float) -> ComplexArray:
    """Return the complex state at time t of a free quantum particle in the state f: every coefficient turns.

    psi(t) = Phi exp(-i Lambda t / 2) Phi^T M f solves i dpsi/dt = -1/2 Laplacian psi; the probability psi* M psi stays.
    """
    t, state = as_number("t", t), np.asarray(f)
    c = basis.analyze(state.real) + 1j * basis.analyze(state.imag)
    c = _scale(np.exp(-0.5j * t * basis.evals), c)
    return np.asarray(basis.synthesize(c.real) + 1j * basis.synthesize(c.imag))


def _scale(gains: NDArray[np.inexact], c: NDArray[np.inexact]) -> NDArray[np.inexact]:
    """Multiply row k of the coefficients by gain k."""
    return (gains * c.T).T


def explicit_steps(L: sp.csr_array, M: sp.csr_array, f: ArrayLike, step: float, n_steps: int = 1) -> FloatArray:
    """Return f after explicit heat steps: cheap, and unstable when step is above 2 / largest eigenvalue.

    u <- u - step M^-1 L u, with a lumped M, multiplies mode lambda by (1 - step lambda)^n_steps; `stable_step` is safe.

    >>> from spectral_notes import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> explicit_steps(L, M, [0.0, 0, 1, 0, 0], step=0.02).round(12).tolist()
    [0.0, 0.32, 0.36, 0.32, 0.0]
    """
    return _apply_factors(L, M, f, [as_number("step", step, above=0.0)], n_steps)


def taubin_steps(
    L: sp.csr_array, M: sp.csr_array, f: ArrayLike, step: float, n_steps: int = 1, *, pass_band: float
) -> FloatArray:
    """Return f after pairs of a shrinking and a slightly larger inflating step: a low-pass of gain one at pass_band.

    u <- (I + inflate M^-1 L) (I - step M^-1 L) u with 1 / step - 1 / inflate = pass_band, and a lumped M, multiplies
    mode lambda by ((1 - step lambda) (1 + inflate lambda))^n_steps: one at 0 and at pass_band, a little more between,
    less above. `stable_step` is about the most that stays stable (Taubin, "A signal processing approach to fair surface
    design", 1995, section 3).

    >>> from spectral_notes import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> taubin_steps(L, M, [1.0, 1, 1, 1, 1], step=0.02, n_steps=9, pass_band=5.0).round(12).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0]
    """
    step = as_number("step", step, above=0.0)
    pass_band = as_number("pass_band", pass_band, above=0.0)
    if step * pass_band >= 1.0:
        raise ValueError(f"step must be below 1 / pass_band = {1.0 / pass_band:.3g}; got {step:.3g}")
    inflate = step / (1.0 - step * pass_band)
    return _apply_factors(L, M, f, [step, -inflate], n_steps)


def implicit_steps(L: sp.csr_array, M: sp.csr_array, f: ArrayLike, step: float, n_steps: int = 1) -> FloatArray:
    """Return f after implicit (backward Euler) heat steps: one factorization, and stable for every step.

    (M + step L) u_new = M u multiplies mode lambda by (1 + step lambda)^-n_steps (Desbrun, Meyer, Schroeder and Barr,
    "Implicit fairing of irregular meshes using diffusion and curvature flow", 1999).

    >>> from spectral_notes import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> u = implicit_steps(L, M, [0.0, 0, 1, 0, 0], step=100.0)
    >>> u.round(2).tolist()  # one long step: nearly the mean, and nothing explodes
    [0.25, 0.25, 0.25, 0.25, 0.25]
    """
    L = as_symmetric("L", L)
    u = as_signal("f", f, L.shape[0])
    n_steps = as_count("n_steps", n_steps, 1)
    solver = PoissonSolver(as_number("step", step, above=0.0) * L, M, screening=1.0)
    for _ in range(n_steps):
        u = solver.solve(u)
    return u


def stable_step(L: sp.csr_array, M: sp.csr_array) -> float:
    """Return a time step at which no mode changes sign in an explicit step: 1 / a bound of the largest eigenvalue.

    The bound is Gershgorin's, the largest sum of |entries| in a row of M^-1 L. It is at most about twice too large.

    >>> from spectral_notes import interval_laplacian
    >>> stable_step(*interval_laplacian(5))  # h^2 / 4 with h = 1/4
    0.015625
    """
    largest = _largest_row(*_lumped(L, M))
    return 1.0 / largest if largest else np.inf


def chebyshev_filter(
    L: sp.csr_array, M: sp.csr_array, f: ArrayLike, response: Callable[[FloatArray], ArrayLike], degree: int
) -> FloatArray:
    """Return g(M^-1 L) f without any mode: the response g as a Chebyshev polynomial, one product with L a degree.

    u = sum_k a_k T_k(2 M^-1 L / b - I) f, with b Gershgorin's bound of the eigenvalues, M lumped, and a_k the
    coefficients of the polynomial that equals g at the degree + 1 Chebyshev points of [0, b]. The error is at most the
    largest distance of the two on [0, b], times the norm of f. It falls faster than any power for a smooth g, and
    hardly for a jump. The degree says how many edges far a value is felt; for heat take some 3 sqrt(t b) (Hammond,
    Vandergheynst and Gribonval, "Wavelets on graphs via spectral graph theory", 2011, section 6).

    >>> from spectral_notes import graph_laplacian, path_graph
    >>> L, M = graph_laplacian(path_graph(5))
    >>> u = chebyshev_filter(L, M, [0.0, 0, 1, 0, 0], lambda evals: 1 - evals / 4, degree=1)
    >>> u.round(12).tolist()  # one step of heat
    [0.0, 0.25, 0.5, 0.25, 0.0]
    """
    L, masses = _lumped(L, M)
    u = as_signal("f", f, L.shape[0])
    degree = as_count("degree", degree, 0)
    if not callable(response):
        raise TypeError(f"response must be a function of an array of eigenvalues; got {type(response).__name__}")
    half = (_largest_row(L, masses) or 1.0) / 2.0  # without an edge all eigenvalues are zero
    nodes = chebyshev.chebpts1(degree + 1)
    gains = as_floats("response(evals)", response(half * (nodes + 1.0)), nodes.shape)
    a = 2.0 / (degree + 1) * (chebyshev.chebvander(nodes, degree).T @ gains)
    a[0] /= 2.0
    scaled = sp.csr_array(sp.diags_array(1.0 / (half * masses)) @ L)  # X + I
    before, now, total = u, scaled @ u - u, a[0] * u
    for factor in a[1:]:
        total = total + factor * now
        before, now = now, 2.0 * (scaled @ now - now) - before
    return total


def enclosed_volume(mesh: TriangleMesh) -> float:
    """Return the volume inside a closed mesh, positive when its normals point outwards: the sum of det(p, q, r) / 6.

    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> round(enclosed_volume(TriangleMesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])), 12)  # 1/6
    0.166666666667
    """
    if not is_closed(mesh):
        raise ValueError("mesh must be closed to enclose a volume; it has a boundary")
    return signed_volume(mesh)


def restore_volume(mesh: TriangleMesh, volume: float) -> TriangleMesh:
    """Return the mesh scaled about the mean of its vertices until it encloses the given volume: the cure for shrinkage.

    >>> from spectral_notes.shapes import sphere
    >>> round(enclosed_volume(restore_volume(sphere(2), 5.0)), 12)
    5.0
    """
    volume, present = as_number("volume", volume, above=0.0), enclosed_volume(mesh)
    if present <= 0.0:
        raise ValueError(f"mesh must enclose a positive volume; it is {present:.3g}: turn the faces around")
    center = mesh.vertices.mean(axis=0)
    grown = center + np.cbrt(volume / present) * (mesh.vertices - center)
    return TriangleMesh(grown, mesh.faces, mesh.name)


def _apply_factors(L: sp.csr_array, M: sp.csr_array, f: ArrayLike, steps: list[float], n_steps: int) -> FloatArray:
    """Apply I - s M^-1 L for each s of `steps`, `n_steps` times over."""
    L, masses = _lumped(L, M)
    u = as_signal("f", f, L.shape[0])
    pointwise = sp.csr_array(sp.diags_array(1.0 / masses) @ L)
    for _ in range(as_count("n_steps", n_steps, 1)):
        for step in steps:
            u = u - step * (pointwise @ u)
    return u


def _largest_row(L: sp.csr_array, masses: FloatArray) -> float:
    """Gershgorin's bound of the eigenvalues of (L, M): the largest sum of |entries| in a row of M^-1 L."""
    return float((np.abs(L).sum(axis=1) / masses).max())


def _lumped(L: sp.csr_array, M: sp.csr_array) -> tuple[sp.csr_array, FloatArray]:
    """L, and the diagonal of a lumped mass matrix; a full one is refused, its inverse is not sparse."""
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    diagonal = M.diagonal()
    if np.abs(M - sp.diags_array(diagonal)).sum() > 0.0 or (diagonal <= 0.0).any():
        raise ValueError("M must be diagonal and positive (mass='lumped'); for a full one use implicit_steps")
    return L, diagonal
