"""Undo what `spectral_notes.plotting.packing` does, as `static/arrays.js` does in a browser."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes.plotting.packing import TYPES, Packed


def unpack_array(packed: Packed) -> NDArray[Any]:
    """Return the array that was packed, bit by bit."""
    dtype = np.dtype(TYPES[packed["type"]])
    planes = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), np.uint8)
    return planes.reshape(dtype.itemsize, -1).T.copy().view(dtype).reshape(packed["shape"])
