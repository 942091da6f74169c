"""First and second differences: closed forms, orders of convergence, invariants, and every error message."""

import numpy as np
import pytest
import scipy.fft
import scipy.sparse as sp

from spectral_notes.finite_differences import (
    ENDS,
    central_difference,
    difference_grid,
    forward_difference,
    second_difference,
    second_difference_modes,
    spectral_derivative,
)

SIZES = (2, 3, 8, 13)


def order_of_convergence(error_of_n, sizes=(40, 80, 160, 320)):
    """The slope of log(error) against log(h), by least squares."""
    errors = [error_of_n(n) for n in sizes]
    return np.polyfit(-np.log(sizes), np.log(errors), 1)[0]


# --- where the samples lie


def test_grids_by_hand():
    x, h = difference_grid(4, 2.0, ends="periodic")
    np.testing.assert_allclose((*x, h), (0, 0.5, 1, 1.5, 0.5))
    x, h = difference_grid(3, 2.0, ends="dirichlet")
    np.testing.assert_allclose((*x, h), (0.5, 1, 1.5, 0.5))
    x, h = difference_grid(4, 2.0, ends="neumann")
    np.testing.assert_allclose((*x, h), (0.25, 0.75, 1.25, 1.75, 0.5))


# --- first differences


def test_forward_difference_by_hand():
    np.testing.assert_array_equal(forward_difference(2, 0.5, ends="neumann").toarray(), [[-2, 2]])
    np.testing.assert_array_equal(forward_difference(2, 0.5, ends="dirichlet").toarray(), [[2, 0], [-2, 2], [0, -2]])
    np.testing.assert_array_equal(
        forward_difference(3, 0.5, ends="periodic").toarray(), [[-2, 2, 0], [0, -2, 2], [2, 0, -2]]
    )


@pytest.mark.parametrize(
    ("ends", "f", "slope", "shift"),
    [
        ("periodic", lambda x: np.sin(2 * np.pi * x), lambda x: 2 * np.pi * np.cos(2 * np.pi * x), 0.5),
        ("dirichlet", lambda x: np.sin(np.pi * x), lambda x: np.pi * np.cos(np.pi * x), -0.5),
        ("neumann", lambda x: np.exp(x), lambda x: np.exp(x), 0.5),
    ],
)
def test_forward_difference_is_second_order_at_the_middle_of_a_gap_and_first_order_at_a_sample(ends, f, slope, shift):
    def error(n, shift):
        x, h = difference_grid(n, ends=ends)
        D = forward_difference(n, h, ends=ends)
        places = x[0] + h * (np.arange(D.shape[0]) + shift)
        return np.abs(D @ f(x) - slope(places)).max()

    assert order_of_convergence(lambda n: error(n, shift)) == pytest.approx(2, abs=0.1)
    assert order_of_convergence(lambda n: error(n, shift - 0.5)) == pytest.approx(1, abs=0.1)


def test_central_difference_with_one_sided_ends_is_exact_on_parabolas_and_not_on_cubics():
    x = np.linspace(-1, 2, 9)
    D = central_difference(9, x[1] - x[0], ends="one-sided")
    np.testing.assert_allclose(D @ (3 * x**2 - x + 5), 6 * x - 1, atol=1e-12)
    assert np.abs(D @ x**3 - 3 * x**2).min() > 0.1


def test_central_difference_is_second_order_up_to_the_ends():
    def one_sided(n):
        x = np.linspace(0, 2 * np.pi, n)
        return np.abs(central_difference(n, x[1], ends="one-sided") @ (np.cos(x) + 2) + np.sin(x)).max()

    def end_rows(n):
        x = np.linspace(0, 1, n)
        return np.abs(central_difference(n, x[1], ends="one-sided") @ np.exp(x) - np.exp(x))[[0, -1]].max()

    def periodic(n):
        x, h = difference_grid(n, ends="periodic")
        wave = 2 * np.pi * x
        return np.abs(central_difference(n, h, ends="periodic") @ np.sin(wave) - 2 * np.pi * np.cos(wave)).max()

    assert order_of_convergence(one_sided) == pytest.approx(2, abs=0.05)
    assert order_of_convergence(end_rows) == pytest.approx(2, abs=0.05)
    assert order_of_convergence(periodic) == pytest.approx(2, abs=0.05)


def test_periodic_central_difference_is_antisymmetric_and_annihilates_the_alternating_vector():
    D = central_difference(8, 0.5, ends="periodic")
    assert abs(D + D.T).max() == 0
    alternating = (-1.0) ** np.arange(8)
    assert np.abs(D @ alternating).max() == 0
    np.testing.assert_allclose(second_difference(8, 0.5, ends="periodic") @ alternating, 4 / 0.5**2 * alternating)


# --- second differences


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", SIZES)
def test_second_difference_is_the_gradient_and_then_its_adjoint(n, ends):
    D, L = forward_difference(n, 0.3, ends=ends), second_difference(n, 0.3, ends=ends)
    f, g = np.random.default_rng(n).normal(size=(2, n))
    assert L.format == "csr" and L.dtype == np.float64
    assert abs(L - L.T).max() == 0
    assert g @ (L @ f) == pytest.approx((D @ g) @ (D @ f))


@pytest.mark.parametrize("ends", ENDS)
def test_second_difference_rows_by_hand(ends):
    corner, end = {"periodic": (-1, 2), "dirichlet": (0, 2), "neumann": (0, 1)}[ends]
    expected = np.array([[end, -1, 0, corner], [-1, 2, -1, 0], [0, -1, 2, -1], [corner, 0, -1, end]])
    np.testing.assert_allclose(second_difference(4, 0.5, ends=ends).toarray(), expected / 0.25)


@pytest.mark.parametrize(("ends", "nullity"), [("periodic", 1), ("dirichlet", 0), ("neumann", 1)])
def test_second_difference_kernel_is_the_constants_unless_the_ends_are_held(ends, nullity):
    L = second_difference(9, ends=ends)
    assert 9 - np.linalg.matrix_rank(L.toarray()) == nullity
    assert (np.abs(L @ np.ones(9)).max() == 0) == (nullity == 1)


@pytest.mark.parametrize(
    ("ends", "f"),
    [
        ("periodic", lambda x: np.exp(np.sin(2 * np.pi * x))),
        ("dirichlet", lambda x: np.sin(np.pi * x) * np.exp(np.cos(np.pi * x))),
        ("neumann", lambda x: np.exp(np.cos(np.pi * x))),
    ],
)
def test_second_difference_tends_to_minus_the_second_derivative_at_order_two(ends, f):
    def error(n):
        x, h = difference_grid(n, ends=ends)
        step = 1e-3
        second = (-f(x - 2 * step) + 16 * f(x - step) - 30 * f(x) + 16 * f(x + step) - f(x + 2 * step)) / (12 * step**2)
        return np.abs(second_difference(n, h, ends=ends) @ f(x) + second).max()

    assert order_of_convergence(error) == pytest.approx(2, abs=0.1)


# --- modes


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("n", SIZES)
def test_modes_diagonalize_the_second_difference(n, ends):
    h = 0.37
    evals, evecs = second_difference_modes(n, h, ends=ends)
    L = second_difference(n, h, ends=ends)
    np.testing.assert_allclose(L @ evecs, evecs * evals, atol=1e-10)
    np.testing.assert_allclose(evecs.T @ evecs, np.eye(n), atol=1e-12)
    np.testing.assert_allclose(evals, np.linalg.eigvalsh(L.toarray()), atol=1e-10)
    assert (np.diff(evals) >= -1e-12).all()


@pytest.mark.parametrize(
    ("ends", "exact"), [("periodic", (2 * np.pi) ** 2), ("dirichlet", np.pi**2), ("neumann", np.pi**2)]
)
def test_first_nonzero_eigenvalue_tends_to_that_of_the_interval_at_order_two(ends, exact):
    def error(n):
        _, h = difference_grid(n, ends=ends)
        evals, _ = second_difference_modes(n, h, ends=ends)
        return exact - evals[evals > 1][0]

    assert order_of_convergence(error) == pytest.approx(2, abs=0.1)


def test_modes_are_the_bases_of_the_fast_transforms():
    f = np.random.default_rng(0).normal(size=12)
    _, sines = second_difference_modes(12, ends="dirichlet")
    _, cosines = second_difference_modes(12, ends="neumann")
    _, waves = second_difference_modes(12, ends="periodic")
    np.testing.assert_allclose(sines.T @ f, scipy.fft.dst(f, type=1, norm="ortho"), atol=1e-12)
    np.testing.assert_allclose(cosines.T @ f, scipy.fft.dct(f, type=2, norm="ortho"), atol=1e-12)
    fourier = np.fft.rfft(f, norm="ortho")
    np.testing.assert_allclose(waves.T[1:-1:2] @ f, np.sqrt(2) * fourier.real[1:-1], atol=1e-12)
    np.testing.assert_allclose(waves.T[2::2] @ f, -np.sqrt(2) * fourier.imag[1:-1], atol=1e-12)
    np.testing.assert_allclose(waves.T[[0, -1]] @ f, fourier.real[[0, -1]], atol=1e-12)


# --- spectral differentiation


@pytest.mark.parametrize("n", [31, 32])
@pytest.mark.parametrize("order", [0, 1, 2, 3, 4])
def test_spectral_derivative_is_exact_on_band_limited_signals(n, order):
    length = 3.0
    phase = 2 * np.pi / length * (np.arange(n) * length / n)
    derivative = (2 * np.pi / length * 5) ** order * np.cos(5 * phase + order * np.pi / 2)
    scale = (2 * np.pi / length * 5) ** order
    np.testing.assert_allclose(
        spectral_derivative(np.cos(5 * phase), length, order=order), derivative, atol=1e-9 * scale
    )


def test_spectral_derivative_converges_faster_than_any_power():
    def error(n):
        x = 2 * np.pi * np.arange(n) / n
        f = np.exp(np.sin(x))
        return np.abs(spectral_derivative(f, 2 * np.pi) - np.cos(x) * f).max()

    slopes = [np.log2(error(n) / error(2 * n)) for n in (4, 8, 12)]
    assert slopes[0] > 2 and slopes[1] > slopes[0] + 3 and slopes[2] > slopes[1] + 5
    assert error(40) < 1e-12


def test_spectral_derivative_treats_the_alternating_vector_by_the_parity_of_the_order():
    alternating = (-1.0) ** np.arange(8)
    assert np.abs(spectral_derivative(alternating, 8.0)).max() == 0
    np.testing.assert_allclose(spectral_derivative(alternating, 8.0, order=2), -(np.pi**2) * alternating)


def test_spectral_derivative_of_real_samples_is_the_limit_of_the_central_difference():
    n = 400
    x = np.arange(n) / n
    f = np.exp(np.cos(2 * np.pi * x))
    central = central_difference(n, 1 / n, ends="periodic") @ f
    np.testing.assert_allclose(spectral_derivative(f, 1.0), central, atol=2e-3)


# --- errors


@pytest.mark.parametrize("make", [difference_grid, forward_difference, second_difference, second_difference_modes])
def test_second_difference_family_names_the_wrong_argument(make):
    with pytest.raises(ValueError, match="n must be at least 2; got 1"):
        make(1, ends="periodic")
    with pytest.raises(TypeError, match="n must be an integer; got float"):
        make(8.0, ends="periodic")
    with pytest.raises(ValueError, match="ends must be one of 'periodic', 'dirichlet', 'neumann'; got 'one-sided'"):
        make(8, ends="one-sided")
    step = "length" if make is difference_grid else "h"
    with pytest.raises(ValueError, match=f"^{step} must be greater than 0; got 0"):
        make(8, 0.0, ends="periodic")
    with pytest.raises(TypeError, match=f"^{step} must be a real number; got str"):
        make(8, "wide", ends="periodic")


def test_central_difference_names_the_wrong_argument():
    with pytest.raises(ValueError, match="n must be at least 3; got 2"):
        central_difference(2, ends="one-sided")
    with pytest.raises(TypeError, match="n must be an integer; got str"):
        central_difference("8", ends="one-sided")
    with pytest.raises(ValueError, match="ends must be one of 'one-sided', 'periodic'; got 'dirichlet'"):
        central_difference(8, ends="dirichlet")
    with pytest.raises(ValueError, match="h must be greater than 0; got -1"):
        central_difference(8, -1.0, ends="periodic")
    with pytest.raises(TypeError, match="h must be a real number; got list"):
        central_difference(8, [1.0], ends="periodic")


def test_spectral_derivative_names_the_wrong_argument():
    with pytest.raises(ValueError, match=r"f must have shape \(n,\); got \(2, 4\)"):
        spectral_derivative(np.zeros((2, 4)), 1.0)
    with pytest.raises(ValueError, match="f must hold finite numbers; found nan at index"):
        spectral_derivative([0.0, np.nan, 1.0], 1.0)
    with pytest.raises(TypeError, match="f must be an array of real numbers"):
        spectral_derivative(np.zeros(4, dtype=complex), 1.0)
    with pytest.raises(ValueError, match="length must be greater than 0; got 0"):
        spectral_derivative(np.zeros(4), 0)
    with pytest.raises(TypeError, match="length must be a real number; got NoneType"):
        spectral_derivative(np.zeros(4), None)
    with pytest.raises(ValueError, match="order must be at least 0; got -1"):
        spectral_derivative(np.zeros(4), 1.0, order=-1)
    with pytest.raises(TypeError, match="order must be an integer; got float"):
        spectral_derivative(np.zeros(4), 1.0, order=1.0)


def test_all_matrices_are_sparse_float_csr():
    for ends in ENDS:
        for make in (forward_difference, second_difference):
            matrix = make(6, ends=ends)
            assert isinstance(matrix, sp.csr_array) and matrix.dtype == np.float64
    for ends in ("one-sided", "periodic"):
        matrix = central_difference(6, ends=ends)
        assert isinstance(matrix, sp.csr_array) and matrix.dtype == np.float64
