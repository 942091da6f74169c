"""Descriptors against closed forms, their scale laws, and what they must not see: motion, bending, order of vertices."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes import descriptors
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian, interval_laplacian
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import egg, gww_drums, potato, sheet, sphere

S = 2.5


def basis_of(mesh: TriangleMesh, k: int = 30) -> Eigenbasis:
    return compute_eigenbasis(*cotan_laplacian(mesh), k=k)


@pytest.fixture(scope="module")
def shape() -> TriangleMesh:
    return potato(subdivisions=3)


@pytest.fixture(scope="module")
def basis(shape: TriangleMesh) -> Eigenbasis:
    return basis_of(shape)


@pytest.fixture(scope="module")
def scaled(shape: TriangleMesh) -> Eigenbasis:
    return basis_of(TriangleMesh(S * shape.vertices, shape.faces))


TIMES = np.array([0.05, 0.3, 2.0])
ENERGIES = np.array([1.0, 2.0, 3.0])


# --- scale laws -----------------------------------------------------------------------------------------------------


def test_scale_laws(basis: Eigenbasis, scaled: Eigenbasis) -> None:
    hks = descriptors.heat_kernel_signature(basis, TIMES)
    np.testing.assert_allclose(S**2 * descriptors.heat_kernel_signature(scaled, S**2 * TIMES), hks, rtol=1e-6)
    wks = descriptors.wave_kernel_signature(basis, ENERGIES, 0.3)
    moved = descriptors.wave_kernel_signature(scaled, ENERGIES - 2 * np.log(S), 0.3)
    np.testing.assert_allclose(S**2 * moved, wks, rtol=1e-6)
    gps = [descriptors.global_point_signature(b) for b in (basis, scaled)]
    np.testing.assert_allclose(np.abs(gps[1]), np.abs(gps[0]), atol=1e-6)
    raw = descriptors.shape_dna(basis, scale="none")
    np.testing.assert_allclose(S**2 * descriptors.shape_dna(scaled, scale="none"), raw, rtol=1e-6)


@pytest.mark.parametrize("scale", ["area", "first"])
def test_normalised_dna_does_not_scale(basis: Eigenbasis, scaled: Eigenbasis, scale: str) -> None:
    np.testing.assert_allclose(
        descriptors.shape_dna(scaled, scale=scale), descriptors.shape_dna(basis, scale=scale), rtol=1e-6
    )


def test_unit_area_takes_the_scale_out(basis: Eigenbasis, scaled: Eigenbasis) -> None:
    one, two = descriptors.unit_area(basis), descriptors.unit_area(scaled)
    assert one.M.sum() == pytest.approx(1.0)
    assert one.orthonormality_error() < 1e-9
    np.testing.assert_allclose(two.evals[1:], one.evals[1:], rtol=1e-6)
    times = descriptors.signature_times(one)
    np.testing.assert_allclose(
        descriptors.heat_kernel_signature(two, times), descriptors.heat_kernel_signature(one, times), rtol=1e-6
    )
    np.testing.assert_allclose(
        descriptors.wave_kernel_signature(two, *descriptors.signature_energies(one)),
        descriptors.wave_kernel_signature(one, *descriptors.signature_energies(one)),
        rtol=1e-6,
    )


# --- closed forms and laws ------------------------------------------------------------------------------------------


def test_on_the_sphere_all_points_are_alike() -> None:
    ball = basis_of(sphere(4), k=36)  # whole eigenspaces, l = 0 .. 5
    l = np.arange(6)
    exact = ((2 * l + 1) * np.exp(-l * (l + 1) * 0.1)).sum() / (4 * np.pi)
    np.testing.assert_allclose(descriptors.heat_kernel_signature(ball, [0.1])[:, 0], exact, rtol=1e-2)
    np.testing.assert_allclose(descriptors.wave_kernel_signature(ball, ENERGIES, 0.5), 1 / (4 * np.pi), rtol=2e-2)
    gps = (descriptors.global_point_signature(ball) ** 2).sum(axis=1)
    exact = ((2 * l[1:] + 1) / (l[1:] * (l[1:] + 1))).sum() / (4 * np.pi)
    np.testing.assert_allclose(gps, exact, rtol=1e-2)


def test_hks_integrates_to_the_heat_trace(basis: Eigenbasis) -> None:
    trace = basis.M.diagonal() @ descriptors.heat_kernel_signature(basis, TIMES)
    np.testing.assert_allclose(trace, np.exp(-np.outer(TIMES, basis.evals)).sum(axis=1))


def test_wks_columns_are_probabilities_even_far_from_the_spectrum(basis: Eigenbasis) -> None:
    wks = descriptors.wave_kernel_signature(basis, [-500.0, 1.0, 500.0], 0.1)
    np.testing.assert_allclose(basis.M.diagonal() @ wks, 1.0)
    np.testing.assert_allclose(wks[:, 0], basis.evecs[:, 1] ** 2, atol=1e-10)  # only the nearest mode is left


def test_gps_dot_product_is_the_inverse_laplacian() -> None:
    L, M = interval_laplacian(15)
    gps = descriptors.global_point_signature(compute_eigenbasis(L, M, k=15))
    f = np.cos(np.pi * np.linspace(0, 1, 15))  # mean zero
    u = gps @ (gps.T @ (M @ f))
    np.testing.assert_allclose(L @ u, M @ f, atol=1e-10)


def test_times_and_energies(basis: Eigenbasis) -> None:
    times = descriptors.signature_times(basis, 5)
    assert np.exp(-basis.evals[-1] * times[0]) == pytest.approx(1e-4)
    assert np.exp(-basis.evals[1] * times[-1]) == pytest.approx(1e-4)
    np.testing.assert_allclose(np.diff(np.log(times)), np.log(times[-1] / times[0]) / 4)
    energies, width = descriptors.signature_energies(basis, 50)
    assert len(energies) == 50 and width == pytest.approx(7 * (energies[1] - energies[0]))
    assert energies[0] - 2 * width == pytest.approx(np.log(basis.evals[1]))
    assert energies[-1] + 2 * width == pytest.approx(np.log(basis.evals[-1]))


# --- what a descriptor must not see ---------------------------------------------------------------------------------


def test_blind_to_motion_and_to_the_order_of_vertices(shape: TriangleMesh, basis: Eigenbasis) -> None:
    rng = np.random.default_rng(0)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    order = rng.permutation(shape.n_vertices)
    rank = np.argsort(order)
    other = basis_of(TriangleMesh(shape.vertices[order] @ q.T + 3.0, rank[shape.faces]))
    np.testing.assert_allclose(descriptors.shape_dna(other), descriptors.shape_dna(basis), rtol=1e-6)
    np.testing.assert_allclose(
        descriptors.heat_kernel_signature(other, TIMES),
        descriptors.heat_kernel_signature(basis, TIMES)[order],
        rtol=1e-5,
    )


def test_blind_to_bending_and_fooled_by_drums() -> None:
    flat, rolled = (descriptors.shape_dna(basis_of(sheet(bend=b, n_long=21, n_wide=13))) for b in (0.0, 6.0))
    one, two = (descriptors.shape_dna(basis_of(drum)) for drum in gww_drums(6))
    gaps = descriptors.spectral_distances([flat, rolled, one, two])
    assert gaps[0, 1] < 1e-7 and gaps[2, 3] < 1e-7 and gaps[0, 2] > 0.05


def test_distances_are_relative_and_a_metric() -> None:
    rng = np.random.default_rng(1)
    spectra = np.exp(rng.normal(size=(5, 8)))
    D = descriptors.spectral_distances(spectra)
    assert (np.diag(D) == 0.0).all() and (D == D.T).all()
    assert (D[:, None] <= D[:, :, None] + D[None] + 1e-12).all()  # triangle inequality
    np.testing.assert_allclose(descriptors.spectral_distances([[1, 2], [3, 6]])[0, 1], np.log(3))


# --- errors ---------------------------------------------------------------------------------------------------------


def test_errors(basis: Eigenbasis) -> None:
    with pytest.raises(ValueError, match="times must be positive; found 0"):
        descriptors.heat_kernel_signature(basis, [1.0, 0.0])
    with pytest.raises(ValueError, match=r"times must have shape \(p,\)"):
        descriptors.heat_kernel_signature(basis, 1.0)
    with pytest.raises(ValueError, match="energies must increase strictly"):
        descriptors.wave_kernel_signature(basis, [2.0, 1.0], 0.1)
    with pytest.raises(ValueError, match="width must be greater than 0"):
        descriptors.wave_kernel_signature(basis, ENERGIES, 0.0)
    with pytest.raises(ValueError, match="n_times must be at least 2"):
        descriptors.signature_times(basis, 1)
    with pytest.raises(ValueError, match="n_energies must be at least 2"):
        descriptors.signature_energies(basis, 1)
    with pytest.raises(ValueError, match="scale must be one of 'area', 'first', 'none'"):
        descriptors.shape_dna(basis, scale="volume")
    with pytest.raises(ValueError, match="spectra must be positive, without the zero modes"):
        descriptors.spectral_distances([[0.0, 1.0]])


@pytest.mark.parametrize(
    ("call", "wanted"),
    [
        (descriptors.shape_dna, 1),
        (descriptors.global_point_signature, 1),
        (descriptors.signature_times, 2),
        (descriptors.signature_energies, 2),
        (lambda b: descriptors.wave_kernel_signature(b, ENERGIES, 0.1), 2),
    ],
)
def test_a_basis_of_constants_is_refused(call: object, wanted: int) -> None:
    constant = basis_of(egg(2), k=1)
    with pytest.raises(ValueError, match=f"basis must hold at least {wanted} modes beyond the constants; it holds 0"):
        call(constant)  # type: ignore[operator]
