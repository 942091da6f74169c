"""Signals on a line: closed forms, orders of convergence, invariants, and the wording of every error."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from spectral_notes import signals as sg

UNEVEN = np.array([0.0, 0.15, 0.3, 0.5, 0.6, 0.8, 1.0])


def observed_order(steps, errors):
    """Slope of log error against log step."""
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def trapezoid_mass(x):
    """The diagonal matrix of the trapezoid weights."""
    return sp.diags_array(sg.trapezoid_weights(x))


increasing = st.lists(st.floats(0.01, 10), min_size=1, max_size=20).map(lambda gaps: np.append(0.0, np.cumsum(gaps)))


# --- grids ------------------------------------------------------------------------------------------------------------


def test_interval_grid_holds_both_ends_and_even_steps():
    x = sg.interval_grid(7, -1.0, 2.0)
    assert x[0] == -1.0 and x[-1] == 2.0
    np.testing.assert_allclose(np.diff(x), 0.5, rtol=1e-15)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sg.interval_grid(1), ValueError, "n must be at least 2; got 1"),
        (lambda: sg.interval_grid(2.5), TypeError, "n must be an integer; got float"),
        (lambda: sg.interval_grid(3, "a"), TypeError, "start must be a real number; got str"),
        (lambda: sg.interval_grid(3, 0.0, None), TypeError, "stop must be a real number; got NoneType"),
        (lambda: sg.interval_grid(3, 1.0, 1.0), ValueError, "stop must be greater than 1; got 1"),
    ],
)
def test_grids_refuse(call, error, message):
    with pytest.raises(error, match=message):
        call()


# --- bumps ------------------------------------------------------------------------------------------------------------


def test_gaussian_has_unit_area_and_the_given_centre_and_width():
    x = sg.interval_grid(2001, -10.0, 10.0)
    moments = [sg.trapezoid_weights(x) @ (sg.gaussian(x, 1.0, 0.7) * x**k) for k in range(3)]
    np.testing.assert_allclose(moments, [1.0, 1.0, 1.0 + 0.7**2], rtol=1e-12)


def test_narrow_gaussians_read_off_a_value_at_order_two():
    x = sg.interval_grid(8001)
    widths = np.array([0.04, 0.02, 0.01])
    f = np.exp(x)
    errors = [sg.inner_product(sg.gaussian(x, 0.5, w), f, trapezoid_mass(x)) - np.exp(0.5) for w in widths]
    assert observed_order(widths, errors) == pytest.approx(2, abs=0.01)
    np.testing.assert_allclose(errors, np.exp(0.5) * (np.exp(widths**2 / 2) - 1), rtol=1e-6)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sg.gaussian([[1.0]], 0.0, 1.0), ValueError, r"x must have shape \(n,\); got \(1, 1\)"),
        (lambda: sg.gaussian(["a"], 0.0, 1.0), TypeError, "x must be an array of real numbers"),
        (lambda: sg.gaussian([1.0], "a", 1.0), TypeError, "centre must be a real number; got str"),
        (lambda: sg.gaussian([1.0], 0.0, 0.0), ValueError, "width must be greater than 0; got 0"),
    ],
)
def test_gaussian_refuses(call, error, message):
    with pytest.raises(error, match=message):
        call()


# --- mass matrices ----------------------------------------------------------------------------------------------------


@given(increasing)
def test_trapezoid_weights_integrate_lines_exactly(x):
    w = sg.trapezoid_weights(x)
    length = x[-1] - x[0]
    assert (w > 0).all()
    np.testing.assert_allclose(w.sum(), length, rtol=1e-13)
    np.testing.assert_allclose(w @ x, (x[-1] ** 2 - x[0] ** 2) / 2, rtol=1e-12)


def test_trapezoid_rule_has_order_two_with_euler_and_maclaurins_constant():
    sizes = np.array([11, 21, 41, 81])
    h = 1 / (sizes - 1)
    errors = [sg.trapezoid_weights(x) @ np.exp(x) - (np.e - 1) for x in map(sg.interval_grid, sizes)]
    assert observed_order(h, errors) == pytest.approx(2, abs=1e-3)
    assert errors[-1] == pytest.approx(h[-1] ** 2 / 12 * (np.e - 1), rel=1e-4)


@given(increasing)
def test_lumping_the_hats_gives_the_trapezoid_weights(x):
    M = sg.hat_mass(x)
    np.testing.assert_allclose(M.sum(axis=1), sg.trapezoid_weights(x), rtol=1e-13)
    assert abs(M - M.T).max() == 0
    assert np.linalg.eigvalsh(M.toarray())[0] > 0


def test_hat_mass_is_a_sparse_tridiagonal_matrix_of_the_known_integrals():
    M = sg.hat_mass(sg.interval_grid(6, 0.0, 5.0))
    assert isinstance(M, sp.csr_array) and M.dtype == np.float64
    assert M.nnz == 3 * 6 - 2
    np.testing.assert_allclose(M.diagonal(), [1 / 3, *[2 / 3] * 4, 1 / 3], rtol=1e-15)
    np.testing.assert_allclose(M.diagonal(1), 1 / 6, rtol=1e-15)


def test_hat_mass_is_the_gram_matrix_of_the_hats_by_simpsons_rule():
    half = np.sort(np.append(UNEVEN, (UNEVEN[1:] + UNEVEN[:-1]) / 2))
    cells = np.diff(UNEVEN)
    weights = np.zeros(len(half))
    weights[1::2] = 4 * cells / 6
    weights[:-1:2] += cells / 6
    weights[2::2] += cells / 6
    B = sg.hat_functions(UNEVEN, half)
    np.testing.assert_allclose(B.T @ (weights[:, None] * B), sg.hat_mass(UNEVEN).toarray(), rtol=0, atol=1e-16)


def test_hat_mass_is_exact_for_products_of_piecewise_linear_functions():
    assert sg.inner_product(UNEVEN, UNEVEN, sg.hat_mass(UNEVEN)) == pytest.approx(1 / 3, rel=1e-14)
    assert sg.inner_product(UNEVEN, 1 - UNEVEN, sg.hat_mass(UNEVEN)) == pytest.approx(1 / 6, rel=1e-14)


def test_lumping_overestimates_lengths_by_the_squared_differences():
    f = np.cos(5 * UNEVEN)
    excess = sg.inner_product(f, f, trapezoid_mass(UNEVEN)) - sg.inner_product(f, f, sg.hat_mass(UNEVEN))
    assert excess == pytest.approx(np.sum(np.diff(UNEVEN) * np.diff(f) ** 2) / 6, rel=1e-12)


def test_hat_functions_interpolate_and_sum_to_one_inside_and_vanish_outside():
    f = np.sin(3 * UNEVEN)
    t = np.linspace(0, 1, 101)
    B = sg.hat_functions(UNEVEN, t)
    np.testing.assert_allclose(B @ f, np.interp(t, UNEVEN, f), rtol=0, atol=1e-15)
    np.testing.assert_allclose(B.sum(axis=1), 1, rtol=1e-15)
    np.testing.assert_array_equal(sg.hat_functions(UNEVEN, UNEVEN), np.eye(7))
    assert not sg.hat_functions(UNEVEN, [-0.1, 1.1]).any()


GRID_FAULTS = [
    ([1.0], "x must have at least two points; got 1"),
    ([0.0, 2.0, 1.0], "x must increase strictly; 1 at 2 follows 2"),
    ([0.0, 0.0], "x must increase strictly; 0 at 1 follows 0"),
    ([0.0, np.nan], "x must hold finite numbers; found nan"),
    ([[0.0, 1.0]], r"x must have shape \(n,\); got \(1, 2\)"),
]


@pytest.mark.parametrize("function", [sg.trapezoid_weights, sg.hat_mass, lambda x: sg.hat_functions(x, [0.5])])
@pytest.mark.parametrize(("x", "message"), GRID_FAULTS)
def test_grid_functions_refuse(function, x, message):
    with pytest.raises(ValueError, match=message):
        function(x)


def test_hat_functions_refuse_bad_places():
    with pytest.raises(ValueError, match=r"t must have shape \(m,\); got \(\)"):
        sg.hat_functions(UNEVEN, 0.5)


# --- inner products and bases -----------------------------------------------------------------------------------------


def test_inner_product_is_symmetric_and_linear_and_norm_its_root():
    rng = np.random.default_rng(1)
    f, g, k = rng.standard_normal((3, 7))
    M = sg.hat_mass(UNEVEN)
    assert sg.inner_product(f, g, M) == pytest.approx(sg.inner_product(g, f, M), rel=1e-14)
    assert sg.inner_product(2 * f + k, g, M) == pytest.approx(
        2 * sg.inner_product(f, g, M) + sg.inner_product(k, g, M), rel=1e-12
    )
    assert sg.norm(f, M) ** 2 == pytest.approx(sg.inner_product(f, f, M), rel=1e-14)
    assert abs(sg.inner_product(f, g, M)) <= sg.norm(f, M) * sg.norm(g, M)


def test_one_and_x_meet_at_thirty_degrees():
    M = sg.hat_mass(UNEVEN)
    cosine = sg.inner_product(np.ones(7), UNEVEN, M) / (sg.norm(np.ones(7), M) * sg.norm(UNEVEN, M))
    assert np.degrees(np.arccos(cosine)) == pytest.approx(30, rel=1e-13)


def test_best_line_to_the_exponential_converges_at_order_two():
    sizes = np.array([11, 21, 41, 81])
    errors = []
    for x in map(sg.interval_grid, sizes):
        c = sg.best_coefficients(np.exp(x), np.stack([np.ones_like(x), x], axis=1), trapezoid_mass(x))
        errors.append(np.abs(c - [4 * np.e - 10, 18 - 6 * np.e]).max())
    assert observed_order(1 / (sizes - 1), errors) == pytest.approx(2, abs=0.02)


@pytest.mark.parametrize("mass", [trapezoid_mass, sg.hat_mass])
def test_best_approximation_leaves_an_orthogonal_residual_and_no_other_is_nearer(mass):
    M, f, B = mass(UNEVEN), np.exp(UNEVEN), np.stack([UNEVEN**j for j in range(3)], axis=1)
    c = sg.best_coefficients(f, B, M)
    residual = f - B @ c
    np.testing.assert_allclose(B.T @ (M @ residual), 0, atol=1e-14)
    for step in np.eye(3):
        nearer = sg.norm(residual, M) - sg.norm(f - B @ (c + 1e-3 * step), M)
        assert nearer < 0


def test_orthonormalize_finds_the_legendre_polynomials_at_order_two():
    sizes, errors = np.array([101, 201, 401]), []
    for x in map(sg.interval_grid, sizes):
        Q = sg.orthonormalize(np.stack([x**j for j in range(5)], axis=1), trapezoid_mass(x))
        exact = np.stack([np.sqrt(2 * j + 1) * np.polynomial.Legendre.basis(j)(2 * x - 1) for j in range(5)], axis=1)
        errors.append(np.abs(Q - exact).max())
    assert observed_order(1 / (sizes - 1), errors) == pytest.approx(2, abs=0.05)


def test_orthonormalize_stays_orthonormal_for_an_ill_conditioned_basis():
    x = sg.interval_grid(201)
    M, B = trapezoid_mass(x), np.stack([x**j for j in range(12)], axis=1)
    Q = sg.orthonormalize(B, M)
    assert np.linalg.cond(B) > 1e8
    np.testing.assert_allclose(Q.T @ (M @ Q), np.eye(12), rtol=0, atol=1e-13)


def test_orthonormalize_is_the_inverse_cholesky_factor_and_parseval_holds():
    M = sg.hat_mass(UNEVEN)
    Q = sg.orthonormalize(np.eye(7), M)
    np.testing.assert_allclose(Q, np.linalg.inv(np.linalg.cholesky(M.toarray()).T), rtol=0, atol=1e-13)
    f = np.cos(4 * UNEVEN)
    c = Q.T @ (M @ f)
    assert c @ c == pytest.approx(sg.inner_product(f, f, M), rel=1e-13)


def test_orthonormalize_leaves_its_argument_alone():
    B = np.array([[2.0, 1.0], [0.0, 3.0]])
    before = B.copy()
    sg.orthonormalize(B, np.eye(2))
    np.testing.assert_array_equal(B, before)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sg.inner_product([1.0], [1.0, 2.0], np.eye(2)), r"f must have shape \(2,\); got \(1,\)"),
        (lambda: sg.inner_product([1.0, 2.0], [1.0], np.eye(2)), r"g must have shape \(2,\); got \(1,\)"),
        (lambda: sg.inner_product([1.0], [1.0], np.ones((1, 2))), r"M must be square; got shape \(1, 2\)"),
        (lambda: sg.inner_product([1.0, 2.0], [1.0, 2.0], [[1.0, 2.0], [0.0, 1.0]]), "M must be symmetric"),
        (lambda: sg.norm([1.0], np.eye(2)), r"f must have shape \(2,\); got \(1,\)"),
        (lambda: sg.best_coefficients([1.0], np.eye(2), np.eye(2)), r"f must have shape \(2,\); got \(1,\)"),
        (lambda: sg.best_coefficients([1.0, 2.0], [1.0, 2.0], np.eye(2)), r"B must have shape \(2, k\); got \(2,\)"),
        (
            lambda: sg.best_coefficients([1.0, 2.0], np.ones((2, 2)), np.eye(2)),
            "columns of B must be linearly independent to working precision; try `orthonormalize`",
        ),
        (lambda: sg.orthonormalize(np.eye(3), np.eye(2)), r"B must have shape \(2, k\); got \(3, 3\)"),
        (
            lambda: sg.orthonormalize(np.ones((2, 2)), np.eye(2)),
            "columns of B must be linearly independent; column 1 is spanned by those before it",
        ),
        (lambda: sg.orthonormalize(np.zeros((2, 1)), np.eye(2)), "column 0 is spanned by those before it"),
    ],
)
def test_inner_products_and_bases_refuse(call, message):
    with pytest.raises(ValueError, match=message):
        call()
