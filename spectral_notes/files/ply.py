"""The bytes of a PLY file, ASCII or binary of either byte order, as vertices and polygons; strips become triangles.

A PLY file describes itself: a header names elements and the properties of their rows, some of them lists. Rows
without lists, and lists that all have the length of the first, are read at once; anything else row by row.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import IntArray
from spectral_notes.files.parsing import Line, as_doubles, as_table, quoted, without_mark
from spectral_notes.files.polygons import Polygons, no_polygons, strips

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")


Column = Callable[[int], tuple[NDArray[Any], IntArray]]  # number of a property -> all values, how many each row has


@dataclass(frozen=True)
class Property:
    """One property of a row: a number, or a list after its length."""

    name: str
    kind: str
    length_kind: str = ""


@dataclass(frozen=True)
class Element:
    """A kind of row, how many there are, and what one holds."""

    name: str
    count: int
    properties: tuple[Property, ...]

    def place(self, *names: str) -> int:
        """Return which property has one of the names, or raise."""
        for place, prop in enumerate(self.properties):
            if prop.name in names:
                return place
        raise ValueError(f"its element {self.name!r} lacks the property {names[0]!r}")


def parse_ply(data: bytes) -> Polygons:
    """Return vertices and polygons of a PLY file; all other elements and properties are passed over."""
    data = without_mark(data)
    header = re.match(rb"ply\s.*?[\r\n]end_header[ \t]*(\r\n|\n|\r)", data, re.DOTALL)
    if header is None:
        raise ValueError("it has no header from 'ply' to 'end_header'")
    order, elements = _read_header(header[0].decode("ascii", "replace"))
    body = data[header.end() :]
    above = len(header[0].splitlines())
    rows = _text_rows(body, above, elements) if not order else _binary_rows(body, elements, order)
    found = no_polygons(np.zeros((0, 3)))
    for element, column, lines in rows:
        if element.name == "vertex":
            vertices = np.stack([as_doubles(column(element.place(axis))[0]) for axis in "xyz"], axis=1)
            found = replace(found, vertices=vertices, vertex_lines=lines)
        elif element.name in ("face", "tristrips"):
            corners, sizes = column(element.place(*INDICES))
            if corners.dtype.kind == "f":
                raise ValueError("its faces name vertices by numbers with a fraction")
            corners = corners.astype(np.int64)
            if element.name == "tristrips":
                corners, sizes, lines = *strips(corners, sizes), None
            both = lines is not None and (found.polygon_lines is not None or not len(found.sizes))
            before = np.zeros(0, dtype=np.int64) if found.polygon_lines is None else found.polygon_lines
            found = replace(
                found,
                corners=np.r_[found.corners, corners],
                sizes=np.r_[found.sizes, sizes],
                polygon_lines=np.r_[before, lines] if both else None,
            )
    return found


def _read_header(text: str) -> tuple[str, list[Element]]:
    """The byte order ("" for ASCII) and the elements."""
    order, elements = None, []
    for words in (line.split() for line in text.splitlines()):
        prop = None
        match words:
            case ["format", name, _] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count), ()))
            case ["property", "list", length, kind, name] if TYPES.get(length, "f")[0] != "f" and kind in TYPES:
                prop = Property(name, TYPES[kind], TYPES[length])
            case ["property", kind, name] if kind in TYPES:
                prop = Property(name, TYPES[kind])
            case ["ply"] | ["end_header"] | ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise ValueError(f"its header has a line that is not understood: {' '.join(words)[:60]!r}")
        if prop:
            if not elements:
                raise ValueError("its header names a property before an element")
            elements[-1] = replace(elements[-1], properties=(*elements[-1].properties, prop))
    if order is None:
        raise ValueError(f"its header names no format of {', '.join(ORDERS)}")
    return order, [element for element in elements if element.count and element.properties]


def _text_rows(body: bytes, above: int, elements: list[Element]) -> Iterator[tuple[Element, Column, IntArray | None]]:
    """The columns of each element of an ASCII file, one row a line, and the lines' numbers."""
    lines = [(number, line) for number, line in enumerate(body.splitlines(), above + 1) if line.strip()]
    at = 0
    for element in elements:
        if element.count > len(lines) - at:
            raise ValueError(f"it announces {element.count} rows of {element.name!r} and has {len(lines) - at} lines")
        rows = lines[at : at + element.count]
        yield element, _text_column(rows, element), np.array([number for number, _ in rows])
        at += element.count


def _text_column(lines: Sequence[Line], element: Element) -> Column:
    """The columns of one element's lines; only those that are asked for are read as numbers."""

    def column(wanted: int) -> tuple[NDArray[Any], IntArray]:
        words = []
        for number, line in lines:
            row, start = line.split(), 0
            for prop in element.properties[: wanted + 1]:
                size = 1
                if prop.length_kind:
                    size = int(row[start]) if start < len(row) and row[start].isdigit() else len(row)
                    start += 1
                if size > len(row) - start:
                    raise ValueError(f"line {number}: a row of {element.name!r} is too short: {quoted(line)}")
                start += size
            words.append((number, b" ".join(row[start - size : start])))
        kind = np.float64 if element.properties[wanted].kind[0] == "f" else np.int64
        return as_table(words, kind)

    return column


def _binary_rows(body: bytes, elements: list[Element], order: str) -> Iterator[tuple[Element, Column, IntArray | None]]:
    """The columns of each element of a binary file."""
    at = 0
    for element in elements:
        first_row = _row_by_row(body, at, replace(element, count=1), order)[0]
        sizes = [int(lengths[0]) for _, lengths in first_row]
        dtype = _row_type(element, order, sizes)
        lists = [i for i, prop in enumerate(element.properties) if prop.length_kind]
        table = np.frombuffer(body, dtype, min(element.count, (len(body) - at) // max(dtype.itemsize, 1)), at)
        if len(table) == element.count and all((table[f"n{i}"] == sizes[i]).all() for i in lists):
            at += element.count * dtype.itemsize
            yield element, lambda i: (table[f"v{i}"].ravel(), np.full(len(table), sizes[i])), None  # noqa: B023
        else:
            columns, at = _row_by_row(body, at, element, order)
            yield element, columns.__getitem__, None


def _row_type(element: Element, order: str, sizes: list[int]) -> np.dtype:
    """The layout of rows whose lists have the given lengths."""
    fields: list[tuple[object, ...]] = []
    for i, (prop, size) in enumerate(zip(element.properties, sizes, strict=True)):
        fields += [(f"n{i}", order + prop.length_kind)] if prop.length_kind else []
        fields.append((f"v{i}", order + prop.kind, (size,)))
    return np.dtype(fields)


def _row_by_row(body: bytes, at: int, element: Element, order: str) -> tuple[list[tuple[NDArray[Any], IntArray]], int]:
    """The columns of an element whose lists differ in length, and the place after it."""
    values: list[list[NDArray[Any]]] = [[] for _ in element.properties]
    for _ in range(element.count):  # each row takes bytes, so that the loop ends where the bytes do
        for place, prop in enumerate(element.properties):
            size = 1
            if prop.length_kind:
                size, at = _number(body, at, order + prop.length_kind, element.name)
            length = _checked(size, body, at, prop, element.name)
            values[place].append(np.frombuffer(body, order + prop.kind, size, at))
            at += length
    return [(np.concatenate(parts), np.array([len(part) for part in parts])) for parts in values], at


def _number(body: bytes, at: int, kind: str, name: str) -> tuple[int, int]:
    """The integer at a place and the place after it."""
    width = np.dtype(kind).itemsize
    if at + width > len(body):
        raise ValueError(f"it ends inside its element {name!r}")
    return int(np.frombuffer(body, kind, 1, at)[0]), at + width


def _checked(size: int, body: bytes, at: int, prop: Property, name: str) -> int:
    """The bytes of `size` values at a place, if they are there."""
    length = size * np.dtype(prop.kind).itemsize
    if size < 0 or at + length > len(body):
        raise ValueError(f"it ends inside its element {name!r}")
    return length
