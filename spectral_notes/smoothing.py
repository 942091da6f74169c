"""Smoothing by steps that need no eigenbasis: explicit, implicit, and Taubin's two-step that does not shrink.

On the modes of (L, M) each step multiplies the coefficient of eigenvalue lambda by a number, so all three are filters;
their response is the formula in each docstring. A mesh is smoothed by filtering its vertices, a signal with d = 3.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from spectral_notes._checks import FloatArray, as_count, as_number, as_signal, as_symmetric
from spectral_notes.meshes import TriangleMesh, is_closed


def explicit_steps(L: sp.csr_array, M: sp.csr_array, f: ArrayLike, step: float, n_steps: int = 1) -> FloatArray:
    """Return f after explicit heat steps: cheap, and unstable when step is above 2 / largest eigenvalue.

    u <- u - step M^-1 L u, which multiplies mode lambda by (1 - step lambda)^n_steps.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian (positive semidefinite) and lumped mass matrix.
    f : array_like, shape (n,) or (n, d)
        The signal, pointwise.
    step : float
        Time step, above 0; `stable_step` is always safe.
    n_steps : int
        How many, at least 1.

    Returns
    -------
    ndarray, shape of f
        The smoothed signal, pointwise.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit, M is not diagonal, or the step is not positive.

    Examples
    --------
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

    u <- (I + inflate M^-1 L) (I - step M^-1 L) u with 1 / step - 1 / inflate = pass_band, which multiplies mode lambda
    by ((1 - step lambda) (1 + inflate lambda))^n_steps: one at 0 and at pass_band, a little more between.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian (positive semidefinite) and lumped mass matrix.
    f : array_like, shape (n,) or (n, d)
        The signal, pointwise.
    step : float
        The shrinking time step, above 0 and below 1 / pass_band; `stable_step` is about the most that stays stable.
    n_steps : int
        How many pairs, at least 1.
    pass_band : float
        The eigenvalue above which modes are damped, greater than 0.

    Returns
    -------
    ndarray, shape of f
        The smoothed signal, pointwise.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit, M is not diagonal, or step and pass_band do not allow a positive inflating step.

    Examples
    --------
    >>> from spectral_notes import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> taubin_steps(L, M, [1.0, 1, 1, 1, 1], step=0.02, n_steps=9, pass_band=5.0).round(12).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0]

    References
    ----------
    Taubin, "A signal processing approach to fair surface design" (1995), section 3.
    """
    step = as_number("step", step, above=0.0)
    pass_band = as_number("pass_band", pass_band, above=0.0)
    if step * pass_band >= 1.0:
        raise ValueError(f"step must be below 1 / pass_band = {1.0 / pass_band:.3g}; got {step:.3g}")
    inflate = step / (1.0 - step * pass_band)
    return _apply_factors(L, M, f, [step, -inflate], n_steps)


def implicit_steps(L: sp.csr_array, M: sp.csr_array, f: ArrayLike, step: float, n_steps: int = 1) -> FloatArray:
    """Return f after implicit (backward Euler) heat steps: one factorization, and stable for every step.

    (M + step L) u_new = M u, which multiplies mode lambda by (1 + step lambda)^-n_steps.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian (positive semidefinite) and mass matrix, lumped or full.
    f : array_like, shape (n,) or (n, d)
        The signal, pointwise.
    step : float
        Time step, above 0.
    n_steps : int
        How many, at least 1.

    Returns
    -------
    ndarray, shape of f
        The smoothed signal, pointwise.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit or the step is not positive.

    Examples
    --------
    >>> from spectral_notes import interval_laplacian
    >>> L, M = interval_laplacian(5)
    >>> u = implicit_steps(L, M, [0.0, 0, 1, 0, 0], step=100.0)
    >>> u.round(2).tolist()  # one long step: nearly the mean, and nothing explodes
    [0.25, 0.25, 0.25, 0.25, 0.25]

    References
    ----------
    Desbrun, Meyer, Schroeder and Barr, "Implicit fairing of irregular meshes using diffusion and curvature flow"
    (1999).
    """
    L = as_symmetric("L", L)
    M = as_symmetric("M", M, L.shape[0])
    u = as_signal("f", f, L.shape[0])
    step = as_number("step", step, above=0.0)
    solver = splu(sp.csc_array(M + step * L), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    for _ in range(as_count("n_steps", n_steps, 1)):
        u = solver.solve(M @ u)
    return np.asarray(u)


def stable_step(L: sp.csr_array, M: sp.csr_array) -> float:
    """Return a time step at which no mode changes sign in an explicit step: 1 / a bound of the largest eigenvalue.

    The bound is Gershgorin's, the largest sum of |entries| in a row of M^-1 L. It is at most about twice too large.

    Parameters
    ----------
    L, M : sparse array, shape (n, n)
        Laplacian and lumped mass matrix.

    Returns
    -------
    float
        In units of time; an explicit step may be up to twice as long.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit or M is not diagonal.

    Examples
    --------
    >>> from spectral_notes import interval_laplacian
    >>> stable_step(*interval_laplacian(5))  # h^2 / 4 with h = 1/4
    0.015625
    """
    L = as_symmetric("L", L)
    return float(1.0 / (np.abs(L).sum(axis=1) / _lumped(M, L.shape[0])).max())


def enclosed_volume(mesh: TriangleMesh) -> float:
    """Return the volume inside a closed mesh, positive when its normals point outwards.

    The sum over the faces of det(p, q, r) / 6: tetrahedra with the origin as their fourth corner.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed mesh, oriented.

    Returns
    -------
    float
        In cubic units of the vertices.

    Raises
    ------
    ValueError
        If the mesh has a boundary.

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> round(enclosed_volume(TriangleMesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])), 12)  # 1/6
    0.166666666667
    """
    if not is_closed(mesh):
        raise ValueError("mesh must be closed to enclose a volume; it has a boundary")
    centred = mesh.vertices - mesh.vertices.mean(axis=0)
    return float(np.linalg.det(centred[mesh.faces]).sum() / 6.0)


def restore_volume(mesh: TriangleMesh, volume: float) -> TriangleMesh:
    """Return the mesh scaled about the mean of its vertices until it encloses the given volume: the cure for shrinkage.

    Parameters
    ----------
    mesh : TriangleMesh
        A closed mesh with normals outwards.
    volume : float
        The volume wanted, above 0.

    Returns
    -------
    TriangleMesh
        The same faces and name, vertices scaled.

    Raises
    ------
    TypeError, ValueError
        If the mesh has a boundary or encloses no positive volume, or `volume` is not positive.

    Examples
    --------
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


def _apply_factors(
    L: sp.csr_array, M: sp.csr_array, f: ArrayLike, steps: list[float], n_steps: int
) -> FloatArray:  # fmt: skip
    """Apply I - s M^-1 L for each s of `steps`, `n_steps` times over."""
    L = as_symmetric("L", L)
    u = as_signal("f", f, L.shape[0])
    pointwise = sp.csr_array(sp.diags_array(1.0 / _lumped(M, L.shape[0])) @ L)
    for _ in range(as_count("n_steps", n_steps, 1)):
        for step in steps:
            u = u - step * (pointwise @ u)
    return u


def _lumped(M: sp.csr_array, n: int) -> FloatArray:
    """The diagonal of a lumped mass matrix; a full one is refused, its inverse is not sparse."""
    M = as_symmetric("M", M, n)
    diagonal = M.diagonal()
    if np.abs(M - sp.diags_array(diagonal)).sum() > 0.0 or (diagonal <= 0.0).any():
        raise ValueError("M must be diagonal and positive (mass='lumped'); for a full one use implicit_steps")
    return np.asarray(diagonal)
