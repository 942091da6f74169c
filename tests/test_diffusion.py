"""Heat, waves and quantum motion against closed forms, conservation laws and each other."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes import diffusion
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian, interval_laplacian
from spectral_notes.shapes import sphere
from spectral_notes.shapes.references import spherical_harmonics


@pytest.fixture(scope="module")
def full() -> Eigenbasis:
    """All modes of an interval of 41 samples."""
    return compute_eigenbasis(*interval_laplacian(41), k=41)


@pytest.fixture
def f(full: Eigenbasis) -> np.ndarray:
    return np.random.default_rng(0).normal(size=full.n)


def test_filter_is_the_matrix_function(full: Eigenbasis, f: np.ndarray) -> None:
    L, M = interval_laplacian(41)
    pointwise = L.toarray() / M.diagonal()[:, None]
    np.testing.assert_allclose(diffusion.filter_signal(full, f, full.evals), pointwise @ f, atol=1e-8)


@pytest.mark.parametrize("beyond", [0.0, 1.0, 0.3])
def test_filter_scales_what_the_basis_does_not_hold(full: Eigenbasis, f: np.ndarray, beyond: float) -> None:
    few = full.truncate(7)
    outside = f - few.synthesize(few.analyze(f))
    g = diffusion.filter_signal(few, f, np.full(7, 2.0), beyond=beyond)
    np.testing.assert_allclose(g, 2.0 * (f - outside) + beyond * outside, atol=1e-10)


def test_filter_takes_several_signals(full: Eigenbasis, f: np.ndarray) -> None:
    gains = 1.0 / (1.0 + full.evals)
    both = diffusion.filter_signal(full, np.column_stack([f, 2.0 * f]), gains)
    np.testing.assert_allclose(both[:, 1], 2.0 * diffusion.filter_signal(full, f, gains), atol=1e-10)


def test_heat_of_a_cosine_is_exact(full: Eigenbasis) -> None:
    x, h = np.linspace(0, 1, 41), 1 / 40
    rate = 4 / h**2 * np.sin(3 * np.pi * h / 2) ** 2  # closed form of the discrete eigenvalue
    u = diffusion.heat(full, np.cos(3 * np.pi * x), 0.02)
    np.testing.assert_allclose(u, np.exp(-rate * 0.02) * np.cos(3 * np.pi * x), atol=1e-12)


def test_heat_laws(full: Eigenbasis, f: np.ndarray) -> None:
    mass = full.M.diagonal()
    u = diffusion.heat(full, f, 0.01)
    assert mass @ u == pytest.approx(mass @ f, abs=1e-12)
    assert f.min() < u.min() < u.max() < f.max()
    np.testing.assert_allclose(diffusion.heat(full, u, 0.02), diffusion.heat(full, f, 0.03), atol=1e-10)
    np.testing.assert_allclose(diffusion.heat(full, f, 0.0), f, atol=1e-10)


def test_heat_on_the_sphere_converges_at_order_two() -> None:
    errors = []
    for subdivisions in (2, 3, 4):
        ball = sphere(subdivisions)
        basis = compute_eigenbasis(*cotan_laplacian(ball), k=49)
        harmonic = spherical_harmonics(ball.vertices, 3)[:, 1]
        u = diffusion.heat(basis, harmonic, 0.1)
        errors.append(np.abs(u - np.exp(-12 * 0.1) * harmonic).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 2.0) < 0.3).all()


def test_wave_solves_its_equation(full: Eigenbasis, f: np.ndarray) -> None:
    smooth, push = diffusion.heat(full, f, 0.01), diffusion.heat(full, f[::-1], 0.01)
    h, t = 1e-4, 0.37
    before, now, after = (diffusion.wave(full, smooth, t + s, velocity=push) for s in (-h, 0, h))
    force = -diffusion.filter_signal(full, now, full.evals)
    np.testing.assert_allclose((before - 2 * now + after) / h**2, force, atol=1e-3 * np.abs(force).max())
    np.testing.assert_allclose(diffusion.wave(full, smooth, 0.0, velocity=push), smooth, atol=1e-10)
    start = (diffusion.wave(full, smooth, h, velocity=push) - diffusion.wave(full, smooth, -h, velocity=push)) / (2 * h)
    np.testing.assert_allclose(start, push, atol=1e-3 * np.abs(push).max())


def test_wave_runs_backwards(full: Eigenbasis, f: np.ndarray) -> None:
    np.testing.assert_allclose(diffusion.wave(full, f, -0.3), diffusion.wave(full, f, 0.3), atol=1e-10)


def test_schroedinger_keeps_probability_and_returns(full: Eigenbasis, f: np.ndarray) -> None:
    psi = diffusion.schroedinger(full, f + 0.5j * f[::-1], 0.7)
    start = f + 0.5j * f[::-1]
    assert np.vdot(psi, full.M @ psi).real == pytest.approx(np.vdot(start, full.M @ start).real)
    np.testing.assert_allclose(diffusion.schroedinger(full, psi, -0.7), start, atol=1e-10)


def test_schroedinger_turns_a_mode(full: Eigenbasis) -> None:
    mode = full.evecs[:, 4]
    np.testing.assert_allclose(
        diffusion.schroedinger(full, mode, 0.3), np.exp(-0.15j * full.evals[4]) * mode, atol=1e-10
    )


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_point_source_integrates_to_one(mass: str) -> None:
    M = cotan_laplacian(sphere(2), mass=mass)[1]
    drop = diffusion.point_source(M, 5)
    assert (M @ drop).sum() == pytest.approx(1.0)
    assert np.flatnonzero(drop).tolist() == [5]


def test_errors(full: Eigenbasis, f: np.ndarray) -> None:
    with pytest.raises(ValueError, match="f must have shape"):
        diffusion.heat(full, f[:-1], 1.0)
    with pytest.raises(ValueError, match=r"t must be at least 0; got -1"):
        diffusion.heat(full, f, -1.0)
    with pytest.raises(TypeError, match="t must be a real number"):
        diffusion.wave(full, f, "later")
    with pytest.raises(ValueError, match="velocity must have shape"):
        diffusion.wave(full, f, 1.0, velocity=f[:3])
    with pytest.raises(ValueError, match="t must be finite"):
        diffusion.schroedinger(full, f, np.inf)
    with pytest.raises(ValueError, match="gains must have shape"):
        diffusion.filter_signal(full, f, [1.0])
    with pytest.raises(TypeError, match="beyond must be a real number"):
        diffusion.filter_signal(full, f, full.evals, beyond=None)
    with pytest.raises(ValueError, match="vertex must be between 0 and 40"):
        diffusion.point_source(full.M, 41)
    with pytest.raises(ValueError, match="M must be symmetric"):
        diffusion.point_source(np.triu(np.ones((3, 3))), 0)
