"""Store a mesh as data of the package, in the form that `spectral_notes.shapes.stored` reads."""

from __future__ import annotations

from collections.abc import Mapping
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


def save_stored(
    path: Path, whole: Mapping[str, NDArray[Any]], positions: Mapping[str, tuple[NDArray[Any], float]]
) -> None:
    """Write whole numbers and positions, each with its unit, to an .npz file."""
    arrays: dict[str, NDArray[Any]] = {name: pack(rows) for name, rows in whole.items()}
    for name, (rows, unit) in positions.items():
        arrays |= {name: pack(rows, unit), f"{name}_unit": np.array(unit)}
    np.savez_compressed(path, **arrays)
