"""The Fourier basis: closed forms, three ways that agree, conversions that invert, and every error message."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spectral_notes import fourier

Transform = Callable[..., tuple[NDArray[np.float64], NDArray[np.float64]]]
TRANSFORMS: list[Transform] = [fourier.dft_by_definition, fourier.dft_by_matrices, fourier.dft_by_fft]
SIZES = [1, 2, 3, 4, 7, 8, 31, 32, 403]


def random_signal(n: int, seed: int = 0) -> NDArray[np.float64]:
    return np.random.default_rng(seed).normal(size=n)


def second_difference_matrix(n: int, spacing: float) -> NDArray[np.float64]:
    """The positive second difference on a circle; rolls add up, so that n = 1 and n = 2 are right too."""
    identity = np.eye(n)
    return (2 * identity - np.roll(identity, 1, axis=1) - np.roll(identity, -1, axis=1)) / spacing**2


# The waves


@pytest.mark.parametrize("n", SIZES)
def test_waves_have_the_stated_norms(n: int) -> None:
    psi, chi = fourier.fourier_matrices(n)
    k = np.arange(n)
    alone = (k == 0) | (2 * k == n)
    np.testing.assert_allclose((psi**2).sum(axis=1), np.where(alone, n, n / 2), atol=1e-12 * n)
    np.testing.assert_allclose((chi**2).sum(axis=1), np.where(alone, 0, n / 2), atol=1e-12 * n)


@pytest.mark.parametrize("n", SIZES)
def test_gram_matrices_are_a_diagonal_and_an_antidiagonal(n: int) -> None:
    psi, chi = fourier.fourier_matrices(n)
    k = np.arange(n)
    same = (k[:, None] == k).astype(float)
    partner = ((k[:, None] + k) % n == 0).astype(float)
    np.testing.assert_allclose(psi @ psi.T, n / 2 * (same + partner), atol=1e-12 * n)
    np.testing.assert_allclose(chi @ chi.T, n / 2 * (same - partner), atol=1e-12 * n)
    np.testing.assert_allclose(psi @ chi.T, 0, atol=1e-12 * n)


@pytest.mark.parametrize("n", SIZES)
def test_rows_k_and_n_minus_k_hold_the_same_pair(n: int) -> None:
    psi, chi = fourier.fourier_matrices(n)
    k = np.arange(1, n)
    np.testing.assert_allclose(psi[n - k], psi[k], atol=1e-13)
    np.testing.assert_allclose(chi[n - k], -chi[k], atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_matrices_are_the_parts_of_numpys_transform_of_the_impulses(n: int) -> None:
    psi, chi = fourier.fourier_matrices(n)
    np.testing.assert_allclose(psi - 1j * chi, np.fft.fft(np.eye(n)), atol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_basis_is_orthonormal_and_sorted_by_frequency(n: int) -> None:
    Q, frequencies = fourier.fourier_basis(n)
    assert Q.shape == (n, n)
    np.testing.assert_allclose(Q.T @ Q, np.eye(n), atol=1e-12)
    assert frequencies.tolist() == sorted([k // 2 + k % 2 for k in range(n)])
    assert frequencies[-1] == n // 2


@pytest.mark.parametrize("n", SIZES)
def test_basis_columns_are_the_cosines_and_sines_of_their_frequency(n: int) -> None:
    Q, frequencies = fourier.fourier_basis(n)
    t = 2 * np.pi * np.arange(n) / n
    for column, k in enumerate(frequencies):
        wave = np.sin(k * t) if column % 2 == 0 and k > 0 else np.cos(k * t)
        np.testing.assert_allclose(Q[:, column], wave / np.linalg.norm(wave), atol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_waves_are_the_eigenvectors_of_the_circles_second_difference(n: int) -> None:
    spacing = 2 * np.pi / n
    L = second_difference_matrix(n, spacing)
    Q, frequencies = fourier.fourier_basis(n)
    evals = (2 - 2 * np.cos(2 * np.pi * frequencies / n)) / spacing**2
    np.testing.assert_allclose(L @ Q, Q * evals, atol=1e-10 * max(1.0, evals[-1]))
    np.testing.assert_allclose(np.linalg.eigvalsh(L), evals, atol=1e-10 * max(1.0, evals[-1]))
    assert (np.diff(evals) >= -1e-10).all()


# The transform three ways


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("n", SIZES)
def test_the_three_ways_agree_with_numpys_sums(transform: Transform, n: int) -> None:
    f = random_signal(n)
    a, b = transform(f)
    F = np.fft.fft(f)
    np.testing.assert_allclose(a, F.real / n, atol=1e-13)
    np.testing.assert_allclose(b, -F.imag / n, atol=1e-13)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_real_part_holds_cosines_and_imaginary_part_minus_the_sines(transform: Transform) -> None:
    n = 32
    t = 2 * np.pi * np.arange(n) / n
    f = 3 * np.cos(5 * t) + 2 * np.sin(7 * t)
    a, b = transform(f)
    expected_a, expected_b = np.zeros(n), np.zeros(n)
    expected_a[[5, n - 5]] = 1.5
    expected_b[[7, n - 7]] = 1.0, -1.0
    np.testing.assert_allclose(a, expected_a, atol=1e-13)
    np.testing.assert_allclose(b, expected_b, atol=1e-13)
    F = n * (a - 1j * b)
    assert 2 * F[5] / n == pytest.approx(3)
    assert 2 * F[7] / n == pytest.approx(-2j)


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("n", [1, 2, 5, 6])
def test_transform_of_an_impulse_is_flat(transform: Transform, n: int) -> None:
    a, b = transform(np.eye(n)[0])
    np.testing.assert_allclose(a, 1 / n)
    np.testing.assert_allclose(b, 0, atol=1e-15)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_constant_and_alternating_signals_keep_their_height(transform: Transform) -> None:
    a, b = transform(4 + 3 * (-1.0) ** np.arange(8))
    np.testing.assert_allclose(a, [4, 0, 0, 0, 3, 0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(b, 0, atol=1e-14)


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("n", SIZES)
def test_synthesis_undoes_analysis(transform: Transform, n: int) -> None:
    f = random_signal(n, seed=1)
    (a, b), (psi, chi) = transform(f), fourier.fourier_matrices(n)
    np.testing.assert_allclose(psi.T @ a + chi.T @ b, f, atol=1e-12)


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40))
def test_parseval_in_every_scaling(samples: list[float]) -> None:
    f = np.array(samples)
    n, energy = f.size, float(f @ f)
    a, b = fourier.dft_by_fft(f)
    A, B = fourier.half_coefficients(a, b)
    F = np.fft.fft(f)
    c = fourier.fourier_basis(n)[0].T @ f
    weights = np.where((np.arange(A.size) == 0) | (2 * np.arange(A.size) == n), n, n / 2)
    for total in (n * (a @ a + b @ b), weights @ (A**2 + B**2), np.sum(np.abs(F) ** 2) / n, c @ c):
        assert total == pytest.approx(energy, rel=1e-10, abs=1e-200)


# Conversions


@pytest.mark.parametrize("n", SIZES)
def test_half_sum_rebuilds_the_signal(n: int) -> None:
    f = random_signal(n, seed=3)
    a, b = fourier.dft_by_fft(f)
    A, B = fourier.half_coefficients(a, b)
    assert A.shape == B.shape == (n // 2 + 1,)
    k = np.arange(n // 2 + 1)
    angles = 2 * np.pi * np.outer(np.arange(n), k) / n
    np.testing.assert_allclose(np.cos(angles) @ A + np.sin(angles) @ B, f, atol=1e-11)


def test_amplitudes_are_the_factors_in_front_of_the_waves() -> None:
    t = 2 * np.pi * np.arange(8) / 8
    A, B = fourier.half_coefficients(*fourier.dft_by_fft(7 + 3 * np.cos(2 * t) - 5 * np.sin(3 * t) + np.cos(4 * t)))
    np.testing.assert_allclose(A, [7, 0, 3, 0, 1], atol=1e-14)
    np.testing.assert_allclose(B, [0, 0, 0, -5, 0], atol=1e-14)


# Truncation


def test_keep_first_keeps_the_lowest_frequencies() -> None:
    c = np.array([5.0, 1.0, -3.0, 2.0])
    assert fourier.keep_first(c, 0).tolist() == [0, 0, 0, 0]
    assert fourier.keep_first(c, 3).tolist() == [5, 1, -3, 0]
    assert fourier.keep_first(c, 4).tolist() == c.tolist()
    assert c.tolist() == [5, 1, -3, 2]


def test_keep_largest_compares_sizes_and_keeps_the_earlier_of_equals() -> None:
    c = np.array([-2.0, 1.0, 2.0, -7.0, 2.0])
    assert fourier.keep_largest(c, 0).tolist() == [0, 0, 0, 0, 0]
    assert fourier.keep_largest(c, 1).tolist() == [0, 0, 0, -7, 0]
    assert fourier.keep_largest(c, 3).tolist() == [-2, 0, 2, -7, 0]
    assert c.tolist() == [-2, 1, 2, -7, 2]


@pytest.mark.parametrize("keep", [fourier.keep_first, fourier.keep_largest])
def test_truncation_error_is_the_energy_left_out(keep: Callable[..., NDArray[np.float64]]) -> None:
    f = random_signal(40, seed=4)
    Q, _ = fourier.fourier_basis(40)
    c = Q.T @ f
    for k in range(41):
        kept = keep(c, k)
        assert np.count_nonzero(kept) == k
        assert np.sum((f - Q @ kept) ** 2) == pytest.approx(np.sum(c[kept == 0] ** 2), abs=1e-12)


def test_no_choice_of_coefficients_beats_the_largest() -> None:
    rng = np.random.default_rng(5)
    c = rng.normal(size=12)
    best = np.sum((c - fourier.keep_largest(c, 5)) ** 2)
    for _ in range(200):
        dropped = rng.permutation(12)[5:]
        assert np.sum(c[dropped] ** 2) >= best


# Errors


@pytest.mark.parametrize("build", [fourier.fourier_matrices, fourier.fourier_basis])
def test_sizes_must_be_positive_integers(build: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="n must be at least 1; got 0"):
        build(0)
    with pytest.raises(TypeError, match="n must be an integer; got float"):
        build(4.0)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_signals_must_be_finite_real_vectors(transform: Transform) -> None:
    with pytest.raises(ValueError, match=r"f must have shape \(n,\); got \(2, 2\)"):
        transform(np.eye(2))
    with pytest.raises(ValueError, match="the length of f must be at least 1; got 0"):
        transform([])
    with pytest.raises(ValueError, match=r"f must hold finite numbers; found nan at index \(1,\)"):
        transform([1.0, np.nan])
    with pytest.raises(TypeError, match="f must be an array of real numbers; got dtype complex128"):
        transform([1.0, 1j])


def test_pairs_of_coefficients_must_belong_to_a_real_signal() -> None:
    with pytest.raises(ValueError, match="the length of a must be at least 1; got 0"):
        fourier.half_coefficients([], [])
    with pytest.raises(ValueError, match=r"b must have shape \(3,\); got \(2,\)"):
        fourier.half_coefficients([1.0, 0.0, 0.0], [0.0, 0.0])
    with pytest.raises(ValueError, match=r"a must satisfy a\[n - k\] = a\[k\], .* it is off by 2"):
        fourier.half_coefficients([1.0, 2.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"b must satisfy b\[n - k\] = -b\[k\], .* it is off by 4"):
        fourier.half_coefficients([1.0, 0.0, 0.0], [0.0, 2.0, 2.0])


@pytest.mark.parametrize("keep", [fourier.keep_first, fourier.keep_largest])
def test_numbers_of_kept_coefficients_lie_between_none_and_all(keep: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="k must be between 0 and 2; got 3"):
        keep([1.0, 2.0], 3)
    with pytest.raises(ValueError, match="k must be between 0 and 2; got -1"):
        keep([1.0, 2.0], -1)
    with pytest.raises(TypeError, match="k must be an integer; got float"):
        keep([1.0, 2.0], 1.0)
    with pytest.raises(ValueError, match="the length of c must be at least 1; got 0"):
        keep([], 0)
