"""Meshes that ship with the package: whole numbers, stored as differences of neighbouring rows.

Neighbouring vertices lie close, so the differences are small numbers whose high bytes are mostly zero; kept apart byte
by byte they are what zlib compresses well. What was written comes back to the last bit: nothing depends on a version.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray


def unpack(planes: NDArray[np.uint8], unit: float = 1.0) -> NDArray[Any]:
    """Return the rows (n, d) whose bytes `tools/storing.py` packed: int64 of unit one, else float64."""
    folded = np.ascontiguousarray(np.moveaxis(planes, 0, 2)).view(f"<u{len(planes)}")[:, :, 0]
    steps = (folded >> 1).astype(np.int64) ^ -(folded & 1).astype(np.int64)
    whole = np.cumsum(steps, axis=0, dtype=np.int64)
    return whole.view(np.float64) if unit == 0.0 else whole if unit == 1.0 else whole * unit


def load_stored(name: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file of the package's data: int64 where no unit stands beside them, else float64."""
    with files("spectral_notes.shapes").joinpath("data", f"{name}.npz").open("rb") as file, np.load(file) as data:
        arrays = {key: data[key] for key in data.files}
    units = {key: float(arrays.pop(f"{key}_unit")) for key in list(arrays) if f"{key}_unit" in arrays}
    return {key: unpack(planes, units.get(key, 1.0)) for key, planes in arrays.items()}
