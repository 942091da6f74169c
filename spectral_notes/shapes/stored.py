"""Meshes that ship with the package: whole numbers, stored as differences of neighbouring rows.

Neighbouring vertices lie close, so the differences are small numbers whose high bytes are mostly zero; kept apart byte
by byte they are what zlib compresses well. What was written comes back to the last bit: nothing depends on a version.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def pack(rows: NDArray[Any], unit: float = 1.0) -> NDArray[np.uint8]:
    """Return the bytes (4 or 8, n, d) of the differences of rows (n, d), where 0, -1, 1, -2 count as 0 to 3.

    Rows are counted in whole units; with a unit of zero the bits of float64 are, and come back exactly.
    """
    whole = np.rint(rows / unit).astype("<i4") if unit else np.ascontiguousarray(rows, dtype="<f8").view("<i8")
    steps = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
    folded = np.ascontiguousarray((steps << 1) ^ (steps >> (8 * whole.itemsize - 1)))
    return np.moveaxis(folded.view(np.uint8).reshape(*rows.shape, whole.itemsize), 2, 0)


def unpack(planes: NDArray[np.uint8], unit: float = 1.0) -> NDArray[Any]:
    """Return the rows (n, d) whose bytes `pack` made: int64 of unit one, else float64."""
    folded = np.ascontiguousarray(np.moveaxis(planes, 0, 2)).view(f"<u{len(planes)}")[:, :, 0]
    steps = (folded >> 1).astype(np.int64) ^ -(folded & 1).astype(np.int64)
    whole = np.cumsum(steps, axis=0, dtype=np.int64)
    return whole.view(np.float64) if unit == 0.0 else whole if unit == 1.0 else whole * unit


def save_stored(
    path: Path, whole: Mapping[str, NDArray[Any]], positions: Mapping[str, tuple[NDArray[Any], float]]
) -> None:
    """Write whole numbers and positions, each with its unit, to an .npz file."""
    arrays: dict[str, NDArray[Any]] = {name: pack(rows) for name, rows in whole.items()}
    for name, (rows, unit) in positions.items():
        arrays |= {name: pack(rows, unit), f"{name}_unit": np.array(unit)}
    np.savez_compressed(path, allow_pickle=False, **arrays)


def load_stored(name: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file of the package's data: int64 where no unit stands beside them, else float64."""
    with files("spectral_notes.shapes").joinpath("data", f"{name}.npz").open("rb") as file, np.load(file) as data:
        arrays = {key: data[key] for key in data.files}
    units = {key: float(arrays.pop(f"{key}_unit")) for key in list(arrays) if f"{key}_unit" in arrays}
    return {key: unpack(planes, units.get(key, 1.0)) for key, planes in arrays.items()}
