"""The bytes of OBJ, OFF, STL and XYZ files as vertices and triangles.

Nothing is allocated because a file announces it: every count is held against what follows. Compiled readers of these
formats end the interpreter on some damaged files, so none is used.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray

Surface = tuple[FloatArray, IntArray]
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_HEADER = 84  # bytes before the first triangle of a binary file


def parse_obj(data: bytes) -> Surface:
    """Return vertices and triangles of an OBJ file; all but `v` and `f` is passed over."""
    data = re.sub(rb"#.*|/[^\s/]*|\\\r?\n", b" ", data) if re.search(rb"[#/\\]", data) else data
    rows: list[bytes] = []
    polygons: list[bytes] = []
    seen: list[int] = []  # vertices before each polygon: a negative index counts back from there
    for line in data.splitlines():
        kind, *rest = line.split(None, 1) or [b""]
        if kind == b"v":
            rows += rest or [b""]
        elif kind == b"f":
            polygons += rest or [b""]
            seen.append(len(rows))
    index, sizes = as_table(polygons, np.int64)
    if (index == 0).any():
        raise ValueError("a face names vertex 0; OBJ files count from 1")
    index = np.where(index < 0, index + np.repeat(np.array(seen, dtype=np.int64), sizes), index - 1)
    return first_three(rows), fans(index, sizes)


def parse_off(data: bytes) -> Surface:
    """Return vertices and triangles of an OFF file, with or without colours, normals and texture coordinates."""
    data = re.sub(rb"#.*", b"", data) if b"#" in data else data
    lines = [line for line in map(bytes.strip, data.splitlines()) if line]
    header = re.match(rb"(?:ST)?C?N?OFF\b\s*", lines[0]) if lines else None
    if header is None or lines[0][header.end() :].startswith(b"BINARY"):
        raise ValueError("it does not begin with OFF, or is of a kind that is not read (4OFF, nOFF, OFF BINARY)")
    lines[0] = lines[0][header.end() :]
    lines = lines if lines[0] else lines[1:]
    counts = as_values(lines[0].split()[:2] if lines else [], np.int64)
    if len(counts) < 2 or counts.min() < 0 or counts.sum() > len(lines) - 1:
        raise ValueError(f"it announces {counts.tolist()} vertices and faces and has {max(len(lines) - 1, 0)} lines")
    n, m = counts.tolist()
    values, lengths = as_table(lines[1 + n : 1 + n + m], np.float64)  # a face may end in a colour
    start = np.cumsum(lengths) - lengths
    sizes = values[start]
    if not ((sizes >= 0) & (sizes < lengths)).all():
        raise ValueError("a face names fewer vertices than it announces")
    sizes = _whole(sizes)
    corners = _whole(values[np.repeat(start + 1, sizes) + ramps(sizes)])
    return first_three(lines[1 : 1 + n]), fans(corners, sizes)


def parse_stl(data: bytes) -> Surface:
    """Return the corners of an STL file's triangles, ASCII or binary, each corner a vertex of its own."""
    announced = int.from_bytes(data[STL_HEADER - 4 : STL_HEADER], "little")
    size = STL_HEADER + announced * FACET.itemsize
    if data.lstrip().startswith(b"solid") and len(data) != size:
        corners = re.findall(rb"\bvertex\s+(\S+\s+\S+\s+\S+)", data)
        if len(corners) % 3 or b"endsolid" not in data:
            raise ValueError(f"it ends early, after {len(corners)} corners of triangles and before endsolid")
        vertices = first_three(corners)
    elif len(data) < max(size, STL_HEADER):
        raise ValueError(f"it has {len(data)} bytes where {announced} triangles take {size}")
    else:
        facets = np.frombuffer(data, FACET, announced, STL_HEADER)
        vertices = as_doubles(facets["corners"].reshape(-1, 3))
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)


def parse_xyz(data: bytes) -> Surface:
    """Return the points of a text of one point a line, with no triangle; what follows x, y and z is passed over."""
    text = re.sub(rb"(#|//).*", b"", data).translate(bytes.maketrans(b",;", b"  "))
    lines = [line for line in text.splitlines() if line.strip()]
    heading = bool(lines) and re.fullmatch(rb"[\sA-Za-z_\"]+", lines[0]) is not None  # as in "x y z red"
    return first_three([b" ".join(line.split()[:3]) for line in lines[heading:]]), np.zeros((0, 3), dtype=np.int64)


def as_values(words: Sequence[bytes], dtype: type) -> NDArray[Any]:
    """Return words as numbers; raise a ValueError where one is none."""
    return _parsed(b" ".join(words), len(words), dtype)


def as_table(lines: Sequence[bytes], dtype: type) -> tuple[NDArray[Any], IntArray]:
    """Return the numbers of all lines as one array, and how many each line has."""
    sizes = np.fromiter((len(line.split()) for line in lines), np.int64, len(lines))
    return _parsed(b" ".join(lines), int(sizes.sum()), dtype), sizes


def _parsed(text: bytes, count: int, dtype: type) -> NDArray[Any]:
    """The `count` numbers of a text."""
    values: NDArray[Any]
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how NumPy says that it stopped before the end
        try:
            values = np.fromstring(text.decode("ascii"), dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            values = np.zeros(0, dtype=dtype)
    if len(values) != count:
        raise ValueError(f"it holds a word where {'an integer' if dtype is np.int64 else 'a number'} should be")
    return values


def _whole(values: FloatArray) -> IntArray:
    """Floats as the integers that they are."""
    if not ((abs(values) < 2**53) & (values == np.rint(values))).all():
        raise ValueError("it holds a word where an integer should be")
    return values.astype(np.int64)


def as_doubles(values: NDArray[Any]) -> FloatArray:
    """Return numbers as float64; a NaN of any kind stays one, without a warning."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def first_three(lines: Sequence[bytes]) -> FloatArray:
    """Return the first three numbers of each line, shape (n, 3)."""
    values, sizes = as_table(lines, np.float64)
    if (sizes < 3).any():
        raise ValueError("a vertex has fewer than three coordinates")
    return values[(np.cumsum(sizes) - sizes)[:, None] + np.arange(3)]


def ramps(sizes: IntArray) -> IntArray:
    """Return 0 .. size - 1 for each size, one after the other."""
    return np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)


def fans(corners: IntArray, sizes: IntArray) -> IntArray:
    """Cut polygons, of `sizes[i]` corners each, into triangles that share the polygon's first corner."""
    if (sizes < 3).any():
        raise ValueError(f"face {int(np.argmax(sizes < 3))} has fewer than three corners")
    pieces = sizes - 2
    start = np.repeat(np.cumsum(sizes) - sizes, pieces)
    step = ramps(pieces)
    return corners[np.stack([start, start + step + 1, start + step + 2], axis=1)]
