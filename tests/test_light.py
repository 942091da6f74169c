"""Light: the laws of spectra, published tables, colour as a linear map, and the wording of every error."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy import constants

from spectral_notes import signals
from spectral_notes import signals as sg

VISIBLE = np.arange(380.0, 781.0)

# The CIE 1931 2-degree observer as tabulated in CIE 15, every 40 nm: wavelength, x, y, z.
CIE_TABLE = np.array(
    [
        [380, 0.001368, 0.000039, 0.006450],
        [420, 0.134380, 0.004000, 0.645600],
        [460, 0.290800, 0.060000, 1.669200],
        [500, 0.004900, 0.323000, 0.272000],
        [540, 0.290400, 0.954000, 0.020300],
        [580, 0.916300, 0.870000, 0.001650],
        [620, 0.854450, 0.381000, 0.000190],
        [660, 0.164900, 0.061000, 0.000000],
        [700, 0.011359, 0.004102, 0.000000],
    ]
)


def trapezoid_mass(x):
    """The diagonal matrix of the trapezoid weights."""
    return sp.diags_array(sg.trapezoid_weights(x))


def test_balmer_lines_agree_with_the_measured_ones_in_vacuum():
    # Measured in air (656.279, 486.135, 434.047, 410.173 nm), times its refractive index; fine structure is 1e-5.
    np.testing.assert_allclose(signals.balmer_lines(4), 1.00028 * np.array([656.279, 486.135, 434.047, 410.173]), rtol=2e-5)
    assert (np.diff(signals.balmer_lines(10)) < 0).all()
    assert signals.balmer_lines(1000)[-1] == pytest.approx(364.705, abs=0.005)


def test_line_spectrum_has_the_given_powers():
    s = signals.line_spectrum(VISIBLE, [450.0, 600.0], [2.0, 3.0], width=4.0)
    assert sg.trapezoid_weights(VISIBLE) @ s == pytest.approx(5, rel=1e-12)
    assert sg.trapezoid_weights(VISIBLE[:150]) @ s[:150] == pytest.approx(2, rel=1e-12)
    assert not signals.line_spectrum(VISIBLE, [], []).any()


@pytest.mark.parametrize("temperature", [3000.0, 5772.0])
def test_blackbody_obeys_the_laws_of_stefan_and_boltzmann_and_of_wien(temperature):
    nm = np.geomspace(1.0, 1e7, 40001)
    B = signals.blackbody_spectrum(nm, temperature)
    assert (B >= 0).all() and np.isfinite(B).all()
    emitted = np.pi * (sg.trapezoid_weights(nm) @ B)
    assert emitted == pytest.approx(constants.sigma * temperature**4, rel=1e-6)
    assert nm[B.argmax()] == pytest.approx(constants.Wien * 1e9 / temperature, rel=1e-3)


def test_blackbody_at_long_wavelengths_is_rayleigh_and_jeans():
    nm = np.array([1e9])
    expected = 1e-9 * 2 * constants.c * constants.k * 5000.0 / (nm * 1e-9) ** 4
    np.testing.assert_allclose(signals.blackbody_spectrum(nm, 5000.0), expected, rtol=1e-5)


def test_colour_matching_stays_close_to_the_published_table():
    assert np.abs(signals.colour_matching(CIE_TABLE[:, 0]) - CIE_TABLE[:, 1:].T).max() < 0.015


def test_colour_matching_curves_are_positive_independent_and_of_equal_area():
    C = signals.colour_matching(VISIBLE)
    areas = C @ sg.trapezoid_weights(VISIBLE)
    assert C.shape == (3, 401) and (C > 0).all()
    assert np.linalg.matrix_rank(C) == 3
    np.testing.assert_allclose(areas, areas.mean(), rtol=2e-3)


def test_spectrum_to_xyz_is_linear_and_does_not_depend_on_the_sampling():
    fine = np.arange(380.0, 780.25, 0.25)
    for temperature in (2700.0, 6500.0):
        coarse_xyz = signals.spectrum_to_xyz(signals.blackbody_spectrum(VISIBLE, temperature), VISIBLE)
        fine_xyz = signals.spectrum_to_xyz(signals.blackbody_spectrum(fine, temperature), fine)
        np.testing.assert_allclose(coarse_xyz, fine_xyz, rtol=1e-5)
    a, b = sg.gaussian(VISIBLE, 450.0, 9.0), sg.gaussian(VISIBLE, 600.0, 9.0)
    both = signals.spectrum_to_xyz(2 * a + b, VISIBLE)
    np.testing.assert_allclose(both, 2 * signals.spectrum_to_xyz(a, VISIBLE) + signals.spectrum_to_xyz(b, VISIBLE), rtol=1e-13)


def test_blackbody_chromaticity_matches_illuminant_a():
    # CIE illuminant A is Planck's law at 2856 K (2848 K with the constant of 1931); its xy is (0.44757, 0.40745).
    xyz = signals.spectrum_to_xyz(signals.blackbody_spectrum(VISIBLE, 2856.0), VISIBLE)
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [0.44757, 0.40745], atol=0.002)


def test_xyz_to_srgb_of_the_primaries_white_black_and_the_bend():
    np.testing.assert_allclose(signals.xyz_to_srgb([0.9505, 1.0, 1.089]), 1, atol=1e-12)
    np.testing.assert_allclose(signals.xyz_to_srgb([0.0, 0.0, 0.0]), 0, atol=0)
    np.testing.assert_allclose(signals.xyz_to_srgb([0.4124, 0.2126, 0.0193]), [1, 0, 0], atol=1e-12)
    grey = np.array([0.9505, 1.0, 1.089])
    np.testing.assert_allclose(signals.xyz_to_srgb(0.214041 * grey), 0.5, atol=1e-5)
    np.testing.assert_allclose(signals.xyz_to_srgb(0.001 * grey), 0.01292, rtol=1e-10)


def test_xyz_to_srgb_clips_what_a_screen_cannot_show():
    np.testing.assert_allclose(signals.xyz_to_srgb([5.0, 5.0, 5.0]), 1, rtol=1e-15)
    cyan = signals.xyz_to_srgb(signals.colour_matching([500.0])[:, 0])
    assert cyan[0] == 0 and cyan.max() <= 1


@pytest.mark.parametrize("period", [25.0, 80.0, 300.0])
def test_metamer_has_the_same_colour_and_is_another_light(period):
    s = signals.blackbody_spectrum(VISIBLE, 5000.0)
    s = s / signals.spectrum_to_xyz(s, VISIBLE)[1]
    other = signals.metamer(s, VISIBLE, s * np.cos(2 * np.pi * VISIBLE / period))
    np.testing.assert_allclose(signals.spectrum_to_xyz(other, VISIBLE), signals.spectrum_to_xyz(s, VISIBLE), rtol=0, atol=1e-12)
    assert other.min() == pytest.approx(0, abs=1e-15) and (other >= 0).all()
    M = trapezoid_mass(VISIBLE)
    assert sg.norm(other - s, M) > 0.1 * sg.norm(s, M)


def test_metamer_does_not_depend_on_the_visible_part_or_the_size_of_the_direction():
    s = np.ones(401)
    direction = np.sin(VISIBLE / 13)
    shifted = 7 * direction + signals.colour_matching(VISIBLE).T @ [1.0, -2.0, 3.0]
    np.testing.assert_allclose(signals.metamer(s, VISIBLE, direction), signals.metamer(s, VISIBLE, shifted), atol=1e-11)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: signals.balmer_lines(0), ValueError, "count must be at least 1; got 0"),
        (lambda: signals.balmer_lines(1.0), TypeError, "count must be an integer; got float"),
        (lambda: signals.line_spectrum(500.0, [1.0], [1.0]), ValueError, r"wavelengths must have shape \(n,\)"),
        (lambda: signals.line_spectrum([500.0], 1.0, [1.0]), ValueError, r"lines must have shape \(k,\)"),
        (
            lambda: signals.line_spectrum([500.0], [1.0], [1.0, 2.0]),
            ValueError,
            r"powers must have shape \(1,\); got \(2,\)",
        ),
        (lambda: signals.line_spectrum([500.0], [1.0], [1.0], width=-1), ValueError, "width must be greater than 0; got -1"),
        (lambda: signals.blackbody_spectrum([0.0], 5000.0), ValueError, "wavelengths must be positive; found 0"),
        (lambda: signals.blackbody_spectrum([500.0], 0.0), ValueError, "temperature must be greater than 0; got 0"),
        (lambda: signals.blackbody_spectrum(["a"], 1.0), TypeError, "wavelengths must be an array of real numbers"),
        (lambda: signals.colour_matching(500.0), ValueError, r"wavelengths must have shape \(n,\); got \(\)"),
        (lambda: signals.spectrum_to_xyz([1.0], [1.0, 2.0]), ValueError, r"spectrum must have shape \(2,\); got \(1,\)"),
        (lambda: signals.spectrum_to_xyz([1.0, 1.0], [2.0, 1.0]), ValueError, "wavelengths must increase strictly"),
        (lambda: signals.xyz_to_srgb([1.0, 2.0]), ValueError, r"xyz must have shape \(3,\); got \(2,\)"),
        (lambda: signals.metamer([1.0], [1.0, 2.0], [1.0, 1.0]), ValueError, r"spectrum must have shape \(2,\)"),
        (lambda: signals.metamer([1.0, 1.0], [1.0, 2.0], [1.0]), ValueError, r"direction must have shape \(2,\)"),
        (lambda: signals.metamer([1.0, 1.0], [2.0, 1.0], [1.0, 1.0]), ValueError, "wavelengths must increase strictly"),
        (
            lambda: signals.metamer(np.zeros(401), VISIBLE, np.ones(401)),
            ValueError,
            "spectrum must be positive; found 0",
        ),
        (
            lambda: signals.metamer(np.ones(401), VISIBLE, signals.colour_matching(VISIBLE)[1]),
            ValueError,
            "direction must not be a combination of the matching functions; every part of it is seen",
        ),
        (
            lambda: signals.metamer(np.ones(401), VISIBLE, np.zeros(401)),
            ValueError,
            "direction must not be a combination of the matching functions",
        ),
    ],
)
def test_light_refuses(call, error, message):
    with pytest.raises(error, match=message):
        call()
