"""Each smoother multiplies each mode by the response that its docstring states; what shrinks, and what does not."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from spectral_notes import diffusion
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian, interval_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, sphere, spherical_cap

L, M = interval_laplacian(21)
MODES = compute_eigenbasis(L, M, k=21)
STEP = diffusion.stable_step(L, M)


def test_explicit_response() -> None:
    u = diffusion.explicit_steps(L, M, MODES.evecs, STEP, 7)
    np.testing.assert_allclose(u, MODES.evecs * (1 - STEP * MODES.evals) ** 7, atol=1e-10)


@pytest.mark.parametrize("step", [1e-3, 10.0])
def test_implicit_response(step: float) -> None:
    u = diffusion.implicit_steps(L, M, MODES.evecs, step, 3)
    np.testing.assert_allclose(u, MODES.evecs * (1 + step * MODES.evals) ** -3, atol=1e-10)


def test_implicit_takes_a_full_mass() -> None:
    ball = sphere(2)
    K, full = cotan_laplacian(ball, mass="full")
    basis = compute_eigenbasis(K, full, k=9)
    u = diffusion.implicit_steps(K, full, basis.evecs, 0.1)
    np.testing.assert_allclose(u, basis.evecs / (1 + 0.1 * basis.evals), atol=1e-7)


def test_taubin_response_is_one_at_the_pass_band() -> None:
    pass_band = MODES.evals[3]
    u = diffusion.taubin_steps(L, M, MODES.evecs, STEP, 5, pass_band=pass_band)
    inflate = 1 / (1 / STEP - pass_band)
    gain = ((1 - STEP * MODES.evals) * (1 + inflate * MODES.evals)) ** 5
    np.testing.assert_allclose(u, MODES.evecs * gain, atol=1e-9)
    assert gain[3] == pytest.approx(1.0)
    assert (gain[1:3] > 1.0).all() and (np.abs(gain[4:]) < 1.0).all()


def test_stable_step_bounds_the_largest_eigenvalue() -> None:
    assert 0.5 / MODES.evals[-1] <= STEP <= (1 + 1e-12) / MODES.evals[-1]


def test_the_sphere_shrinks_as_its_coordinates_do() -> None:
    ball = sphere(4)
    K, mass = cotan_laplacian(ball)
    radius = np.linalg.norm(diffusion.implicit_steps(K, mass, ball.vertices, 0.2), axis=1)
    np.testing.assert_allclose(radius, 1 / (1 + 2 * 0.2), rtol=2e-3)


def test_volume_of_the_sphere_converges() -> None:
    errors = [4 / 3 * np.pi - diffusion.enclosed_volume(sphere(s)) for s in (2, 3, 4)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 2.0) < 0.1).all()


def test_volume_laws(tetrahedron: TriangleMesh) -> None:
    assert diffusion.enclosed_volume(tetrahedron) == pytest.approx(8.0 / 3.0)  # a cube of side 2, over three
    moved = TriangleMesh(3.0 * tetrahedron.vertices + 100.0, tetrahedron.faces)
    assert diffusion.enclosed_volume(moved) == pytest.approx(27.0 * 8.0 / 3.0)
    inside_out = TriangleMesh(tetrahedron.vertices, tetrahedron.faces[:, ::-1])
    assert diffusion.enclosed_volume(inside_out) == pytest.approx(-8.0 / 3.0)


def test_restored_volume() -> None:
    shape = egg(3)
    restored = diffusion.restore_volume(shape, 7.0)
    assert diffusion.enclosed_volume(restored) == pytest.approx(7.0)
    np.testing.assert_allclose(restored.vertices.mean(axis=0), shape.vertices.mean(axis=0), atol=1e-12)
    assert restored.name == shape.name


def test_errors(tetrahedron: TriangleMesh) -> None:
    f = np.ones(21)
    with pytest.raises(ValueError, match="step must be greater than 0"):
        diffusion.explicit_steps(L, M, f, 0.0)
    with pytest.raises(ValueError, match="step must be greater than 0"):
        diffusion.implicit_steps(L, M, f, -1.0)
    with pytest.raises(ValueError, match="n_steps must be at least 1"):
        diffusion.implicit_steps(L, M, f, 1.0, 0)
    with pytest.raises(ValueError, match="n_steps must be at least 1"):
        diffusion.explicit_steps(L, M, f, 1.0, 0)
    with pytest.raises(ValueError, match="f must have shape"):
        diffusion.implicit_steps(L, M, f[:3], 1.0)
    with pytest.raises(ValueError, match=r"step must be below 1 / pass_band = 0.5; got 0.5"):
        diffusion.taubin_steps(L, M, f, 0.5, pass_band=2.0)
    with pytest.raises(ValueError, match="pass_band must be greater than 0"):
        diffusion.taubin_steps(L, M, f, 0.5, pass_band=0.0)
    full = sp.csr_array(M + sp.diags_array([1e-3 * np.ones(20)] * 2, offsets=[-1, 1]))
    with pytest.raises(ValueError, match="M must be diagonal and positive"):
        diffusion.explicit_steps(L, full, f, 1.0)
    with pytest.raises(ValueError, match="M must be diagonal and positive"):
        diffusion.stable_step(L, 0.0 * M)
    with pytest.raises(ValueError, match="mesh must be closed to enclose a volume"):
        diffusion.enclosed_volume(spherical_cap(1.0, 3))
    with pytest.raises(ValueError, match="volume must be greater than 0"):
        diffusion.restore_volume(tetrahedron, 0.0)
    with pytest.raises(ValueError, match="turn the faces around"):
        diffusion.restore_volume(TriangleMesh(tetrahedron.vertices, tetrahedron.faces[:, ::-1]), 1.0)
