"""Argument checks: what passes comes back in one form, what does not is named."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from spectral_notes import _checks


def test_values_come_back_in_the_package_form():
    floats = _checks.as_floats("f", [1, 2, 3], ("n",))
    assert floats.dtype == np.float64
    assert _checks.as_signal("f", np.ones((4, 2)), 4).shape == (4, 2)
    assert _checks.as_signal("f", np.ones(4, dtype=np.float32), 4).dtype == np.float64
    assert _checks.as_indices("i", np.array([2, 0], dtype=np.uint8), ("n",), 3).dtype == np.int64
    assert _checks.as_count("k", np.int32(4), 1) == 4
    assert _checks.as_number("x", np.float32(0.5), above=0) == 0.5
    assert _checks.as_choice("ends", "free", ("free", "fixed")) == "free"
    matrix = _checks.as_symmetric("A", sp.coo_matrix(np.eye(3, dtype=int)))
    assert isinstance(matrix, sp.csr_array)
    assert matrix.dtype == np.float64


def test_arrays_are_copied():
    values = np.zeros(3)
    _checks.as_floats("f", values, (3,))[0] = 1.0
    assert values[0] == 0.0


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: _checks.as_floats("f", [1, np.inf], ("n",)), ValueError, r"f must hold finite numbers; found inf at index \(1,\)"),
        (lambda: _checks.as_floats("f", [[1]], ("n",)), ValueError, r"f must have shape \(n,\); got \(1, 1\)"),
        (lambda: _checks.as_floats("f", [1, 2], (3,)), ValueError, r"f must have shape \(3,\); got \(2,\)"),
        (lambda: _checks.as_floats("f", ["a"], ("n",)), TypeError, "f must be an array of real numbers; got dtype <U1"),
        (lambda: _checks.as_floats("f", None, ("n",)), TypeError, "f must be an array of real numbers; got dtype object"),
        (lambda: _checks.as_floats("f", [[1], [1, 2]], ("n",)), TypeError, "f must be an array of numbers; got rows of"),
        (lambda: _checks.as_signal("f", np.ones((3, 2)), 4), ValueError, r"f must have shape \(4, d\); got \(3, 2\)"),
        (lambda: _checks.as_signal("f", 1.0, 4), ValueError, r"f must have shape \(4,\); got \(\)"),
        (lambda: _checks.as_increasing("x", [1.0]), ValueError, "x must have at least two points; got 1"),
        (lambda: _checks.as_increasing("x", [0.0, 2.0, 1.0]), ValueError, "x must increase strictly; 1 at 2 follows 2"),
        (lambda: _checks.as_indices("i", [0.5], ("n",), 3), TypeError, "i must hold integers; got dtype float64"),
        (lambda: _checks.as_indices("i", [3], ("n",), 3), ValueError, "i must lie in 0 .. 2; found 3"),
        (lambda: _checks.as_indices("i", [-1, 5], ("n",), 3), ValueError, "i must lie in 0 .. 2; found -1"),
        (lambda: _checks.as_count("k", 0, 1), ValueError, "k must be at least 1; got 0"),
        (lambda: _checks.as_count("k", 9, 1, 5), ValueError, "k must be between 1 and 5; got 9"),
        (lambda: _checks.as_count("k", "9", 1), TypeError, "k must be an integer; got str"),
        (lambda: _checks.as_count("k", np.True_, 1), TypeError, "k must be an integer; got a boolean"),
        (lambda: _checks.as_number("t", None), TypeError, "t must be a real number; got NoneType"),
        (lambda: _checks.as_number("t", np.inf), ValueError, "t must be finite; got inf"),
        (lambda: _checks.as_number("t", -1.0, low=0.0), ValueError, "t must be at least 0; got -1"),
        (lambda: _checks.as_number("t", 0.0, above=0.0), ValueError, "t must be greater than 0; got 0"),
        (lambda: _checks.as_choice("ends", 3, ("a", "b")), ValueError, "ends must be one of 'a', 'b'; got 3"),
        (lambda: _checks.as_symmetric("A", np.ones((2, 3))), ValueError, r"A must be square; got shape \(2, 3\)"),
        (lambda: _checks.as_symmetric("A", np.eye(2), 3), ValueError, r"A must have shape \(3, 3\); got \(2, 2\)"),
        (lambda: _checks.as_symmetric("A", [[0, 1], [0, 0]]), ValueError, "A must be symmetric; it differs .* by 1"),
        (lambda: _checks.as_symmetric("A", [[np.nan, 0], [0, 0]]), ValueError, "A must hold finite numbers"),
        (lambda: _checks.as_symmetric("A", sp.csr_array([[1j]])), TypeError, "A must be real; got dtype complex128"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()
