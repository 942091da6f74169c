"""Meshes that ship with the package: whole numbers of a small unit, stored as differences of neighbouring rows.

Neighbouring vertices lie close, so the differences are small numbers whose high bytes are mostly zero; kept apart byte
by byte they are what zlib compresses well. Positions are exact multiples of the unit: nothing depends on a version.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def pack(rows: NDArray[Any], unit: float = 1.0) -> NDArray[np.uint8]:
    """Return the bytes (4, n, d) of the differences of rows (n, d) in whole units; 0, -1, 1, -2 count as 0 to 3."""
    steps = np.diff(np.rint(rows / unit).astype("<i4"), axis=0, prepend=np.zeros_like(rows[:1], "<i4"))
    folded = np.ascontiguousarray((steps << 1) ^ (steps >> 31))
    return np.moveaxis(folded.view(np.uint8).reshape(*rows.shape, 4), 2, 0)


def unpack(planes: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return the whole numbers (n, d) whose bytes `pack` made."""
    folded = np.ascontiguousarray(np.moveaxis(planes, 0, 2)).view("<i4")[:, :, 0]
    return np.cumsum((folded >> 1) ^ -(folded & 1), axis=0, dtype=np.int64)


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
    return {key: unpack(planes) * units[key] if key in units else unpack(planes) for key, planes in arrays.items()}
