"""Arrays in small scripts: what the scenes and the labs of the pages load, quantised by who packs, deflated here.

An array travels as ``{"type", "shape", "data"}``: its bytes, first bytes of all elements first, deflated, in base64
(`static/arrays.js` reads it). A data file is one call, ``spectralNotes.register(name, {facts, arrays})``.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import as_choice

Packed = dict[str, Any]

TYPES = {"float16": "<f2", "float32": "<f4", "uint16": "<u2", "uint32": "<u4", "int8": "i1"}


def pack_array(array: NDArray[Any]) -> Packed:
    """Return an array as text: deflated bytes in base64, with its type and shape."""
    kind = as_choice("array's type", array.dtype.name, tuple(TYPES))
    width = array.dtype.itemsize
    planes = np.ascontiguousarray(array, TYPES[kind]).view(np.uint8).reshape(-1, width).T
    data = base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")
    return {"type": kind, "shape": list(array.shape), "data": data}


def pack(facts: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Packed:
    """Return plain facts and packed arrays as one value that JSON can hold."""
    return {"facts": dict(facts), "arrays": {name: pack_array(array) for name, array in arrays.items()}}


def registering(name: str, value: object) -> str:
    """Return the script that registers a value under a name."""
    return f"spectralNotes.register({json.dumps(name)}, {json.dumps(value, separators=(',', ':'))});\n"
