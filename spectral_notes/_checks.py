"""Checks of arguments: the only place of the package that raises about types, shapes and ranges.

Each function takes the argument's name and its value, returns the value in the one form the package works with,
and raises `TypeError` or `ValueError` with the name, what was expected, what came, and where it helps the remedy.
"""

from __future__ import annotations

import numbers
import operator
from collections.abc import Mapping, Sequence
from string import Template
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
T = TypeVar("T")

REMEDIES = {  # as the library names them
    "clean": "clean_mesh",
    "reclean": "read_mesh(path, clean=True)",
    "robust": "robust_mesh_laplacian(mesh)",
    "weld": "weld_vertices(mesh, tolerance)",
    "orient": "orient_faces(mesh)",
    "path": "path",
}


def named(text: str, names: Mapping[str, str] = REMEDIES) -> str:
    """Return a message with its remedies, as `$clean` and `$robust`, under the names that a reader knows them by."""
    return Template(text).safe_substitute(names)


class Remedied(Exception):  # noqa: N818 (an error that says what to do)
    """Hold a message whose remedies have other names on the command line; `text` keeps them open."""

    def __init__(self, text: str) -> None:
        super().__init__(named(text))
        self.text = text


class Refusal(Remedied, ValueError):  # noqa: N818
    """Say that an argument is not what it must be."""


class Failure(Remedied, ArithmeticError):  # noqa: N818
    """Say that a computation failed."""


def as_floats(name: str, value: ArrayLike, shape: Sequence[int | str], *, positive: bool = False) -> FloatArray:
    """Return `value` as a finite float64 array of the given shape; a string in `shape` names a free axis."""
    array = _real_array(name, value)
    _check_shape(name, array, shape)
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must hold finite numbers; found {array[place]} at index {place}")
    if positive and (array <= 0.0).any():
        raise ValueError(f"{name} must be positive; found {array.min():g}")
    return array


def as_signal(name: str, value: ArrayLike, n: int) -> FloatArray:
    """Return `value` as floats of shape (n,) or (n, d): one value, or one row of values, per sample."""
    array = _real_array(name, value)
    if array.ndim == 2:
        return as_floats(name, array, (n, "d"))
    return as_floats(name, array, (n,))


def as_increasing(name: str, value: ArrayLike) -> FloatArray:
    """Return `value` as floats of shape (n,), n >= 2, that increase strictly."""
    points = as_floats(name, value, ("n",))
    if len(points) < 2:
        raise ValueError(f"{name} must have at least two points; got {len(points)}")
    if (np.diff(points) <= 0).any():
        i = int(np.argmax(np.diff(points) <= 0))
        raise ValueError(f"{name} must increase strictly; {points[i + 1]:g} at {i + 1} follows {points[i]:g}")
    return points


def as_indices(name: str, value: ArrayLike, shape: Sequence[int | str], stop: int) -> IntArray:
    """Return `value` as an int64 array whose entries lie in 0 .. stop - 1."""
    array = np.asarray(value)
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} must hold integers; got dtype {array.dtype}")
    _check_shape(name, array, shape)
    array = array.astype(np.int64)
    if array.size and (array.min() < 0 or array.max() >= stop):
        bad = int(array.min() if array.min() < 0 else array.max())
        raise ValueError(f"{name} must lie in 0 .. {stop - 1}; found {bad}")
    return array


def as_count(name: str, value: object, low: int, high: int | None = None) -> int:
    """Return `value` as an int with low <= value <= high."""
    if isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be an integer; got a boolean")
    try:
        count = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be an integer; got {type(value).__name__}") from None
    if high is not None and high < low:
        raise ValueError(f"{name} must be at least {low}, but only {max(high, 0)} can be had here: give more data")
    if count < low or (high is not None and count > high):
        bounds = f"at least {low}" if high is None else f"between {low} and {high}"
        raise ValueError(f"{name} must be {bounds}; got {count}")
    return count


def as_number(name: str, value: object, *, low: float | None = None, above: float | None = None) -> float:
    """Return `value` as a finite float, optionally with value >= low or value > above."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a real number; got {type(value).__name__}")
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite; got {number}")
    if low is not None and number < low:
        raise ValueError(f"{name} must be at least {low:g}; got {number:g}")
    if above is not None and number <= above:
        raise ValueError(f"{name} must be greater than {above:g}; got {number:g}")
    return number


def as_choice(name: str, value: object, options: Sequence[str]) -> str:
    """Return `value` if it is one of the options."""
    if not isinstance(value, str) or value not in options:
        listed = ", ".join(repr(option) for option in options)
        raise ValueError(f"{name} must be one of {listed}; got {value!r}")
    return value


def as_instance(name: str, value: Any, kind: type[T], remedy: str = "") -> T:
    """Return `value` if it is of the given class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        came = f"got {type(value).__name__}" + (f". {remedy}" if remedy else "")
        raise TypeError(f"{name} must be {article} {kind.__name__}; {came}")
    return value


def as_symmetric(name: str, value: object, n: int | None = None) -> sp.csr_array:
    """Return `value`, dense or sparse, as a real symmetric float64 `csr_array` of shape (n, n)."""
    given: Any = value if sp.issparse(value) else _real_array(name, value)
    if given.ndim != 2 or given.shape[0] != given.shape[1]:
        raise ValueError(f"{name} must be square; got shape {given.shape}")
    if np.iscomplexobj(given):
        raise TypeError(f"{name} must be real; got dtype {given.dtype}")
    if n is not None and given.shape[0] != n:
        raise ValueError(f"{name} must have shape ({n}, {n}); got {given.shape}")
    matrix = sp.csr_array(given).astype(np.float64)
    if not np.isfinite(matrix.data).all():
        raise ValueError(f"{name} must hold finite numbers; it has NaN or infinite entries")
    largest, asymmetry = (abs(A.data).max(initial=0.0) for A in (matrix, matrix - matrix.T))
    if asymmetry > 1e-10 * largest:
        raise ValueError(f"{name} must be symmetric; it differs from its transpose by {asymmetry:.2g}")
    return matrix


def _real_array(name: str, value: object) -> NDArray[Any]:
    """An array of booleans, integers or real numbers, or a TypeError."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise TypeError(f"{name} must be an array of numbers; got rows of different lengths") from None
    if array.size and array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be an array of real numbers; got dtype {array.dtype}")
    return array


def _check_shape(name: str, array: NDArray[Any], shape: Sequence[int | str]) -> None:
    """Refuse an array that has not the given shape."""
    fits = array.ndim == len(shape) and all(
        isinstance(want, str) or want == have for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join(str(want) for want in shape) + ("," if len(shape) == 1 else "")
        raise ValueError(f"{name} must have shape ({wanted}); got {array.shape}")
