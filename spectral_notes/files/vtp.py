"""The bytes of a VTP file, VTK's XML format for surfaces, as vertices and polygons; strips become triangles.

An XML header names arrays; their numbers stand in it as text or in base64, or behind it as they are, whole or in
blocks compressed by zlib or LZMA. LZ4, which needs more than Python has, is refused by name.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.files.parsing import as_doubles, as_table, without_mark
from spectral_notes.files.polygons import Polygons, strips

TYPES = {
    f"{kind}{bits}": f"{kind[0].lower()}{bits // 8}" for kind in ("Int", "UInt", "Float") for bits in (8, 16, 32, 64)
}
ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
APPENDED = re.compile(rb'<AppendedData\s[^>]*encoding\s*=\s*"(raw|base64)"[^>]*>\s*_')
BASE64 = re.compile(rb"[A-Za-z0-9+/]+={0,2}")  # pieces are padded one by one and stand in a row
LARGEST_BLOCK = 1 << 28  # bytes a compressed block may hold; VTK's hold 32 kB


@dataclass(frozen=True)
class Encoding:
    """How the numbers of a file are stored."""

    order: str
    header: np.dtype[Any]
    compressor: str
    appended: bytes
    appended_as_text: bool


def parse_vtp(data: bytes) -> Polygons:
    """Return vertices and polygons of a VTP file; everything else is passed over."""
    root, encoding = _open(data)
    vertices: list[FloatArray] = [np.zeros((0, 3))]
    corners: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    sizes: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    before = 0
    for piece in root.iterfind("PolyData/Piece"):
        n = _count(piece, "NumberOfPoints")
        vertices.append(as_doubles(_array(piece, "Points/DataArray", encoding, 3 * n)).reshape(-1, 3))
        for cells in ("Polys", "Strips"):
            m = _count(piece, f"NumberOf{cells}")
            if m:
                found = _cells(piece, cells, encoding, m)
                found = strips(*found) if cells == "Strips" else found
                corners.append(found[0] + before)
                sizes.append(found[1])
        before += n
    return Polygons(np.concatenate(vertices), np.concatenate(corners), np.concatenate(sizes))


def _count(piece: ElementTree.Element, name: str) -> int:
    """A number of the header."""
    text = piece.get(name) or "0"
    if not text.strip().isdecimal():
        raise ValueError(f"its {name} is no number: {text[:40]!a}")
    return int(text)


def _cells(piece: ElementTree.Element, tag: str, encoding: Encoding, count: int) -> tuple[IntArray, IntArray]:
    """Corners and sizes of the cells under a tag."""
    ends = _array(piece, f"{tag}/DataArray[@Name='offsets']", encoding, count).astype(np.int64)
    sizes = np.diff(ends, prepend=0)
    if sizes.min() < 0:
        raise ValueError("the ends of its polygons do not increase")
    corners = _array(piece, f"{tag}/DataArray[@Name='connectivity']", encoding, int(ends[-1]))
    if corners.dtype.kind == "f":
        raise ValueError("its faces name vertices by numbers with a fraction")
    return corners.astype(np.int64), sizes


def _open(data: bytes) -> tuple[ElementTree.Element, Encoding]:
    """The XML part, and how its arrays are stored."""
    plain = without_mark(data)
    if plain is not data:
        data = re.sub(rb"^\s*<\?xml.*?\?>", b"", plain, flags=re.DOTALL)  # it may name the encoding that the mark named
    appended = APPENDED.search(data)
    text = data[: appended.start()] + b"</VTKFile>" if appended else data
    if b"<!" in re.sub(rb"<!--.*?-->", b"", text, flags=re.DOTALL):
        raise ValueError("its XML declares entities, which no VTP file needs")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"its XML is broken: {error}") from error
    if root.tag != "VTKFile" or root.get("type") != "PolyData":
        raise ValueError(f"it is not a surface: it holds {root.get('type') or root.tag!r} and not PolyData")
    order = ORDERS.get(root.get("byte_order") or "LittleEndian")
    if order is None or root.get("header_type", "UInt32") not in ("UInt32", "UInt64"):
        raise ValueError("its byte_order or header_type is unknown")
    header = np.dtype(order + TYPES[root.get("header_type", "UInt32")])
    rest, as_text = (data[appended.end() :], appended[1] == b"base64") if appended else (b"", False)
    return root, Encoding(order, header, root.get("compressor") or "", rest, as_text)


def _array(piece: ElementTree.Element, place: str, encoding: Encoding, count: int) -> NDArray[Any]:
    """The `count` numbers of an array."""
    node = piece.find(place)
    if node is None or node.get("type") not in TYPES:
        raise ValueError(f"it lacks the array {place}, or its type is unknown")
    kind = TYPES[str(node.get("type"))]
    content = (node.text or "").encode()
    if node.get("format") == "ascii":
        values = as_table([(f"array {place}", content)], np.float64 if kind[0] == "f" else np.int64)[0]
    else:
        if node.get("format") == "appended":
            start = int(node.get("offset") or 0)
            content = encoding.appended[start:] if start >= 0 else b""
        as_text = encoding.appended_as_text if node.get("format") == "appended" else True
        stored = _stored(_from_base64(content) if as_text else content, encoding)
        values = np.frombuffer(stored[: len(stored) // int(kind[1:]) * int(kind[1:])], encoding.order + kind)
    if len(values) != count:
        raise ValueError(f"its array {place} has {len(values)} numbers where {count} are announced")
    return values


def _from_base64(text: bytes) -> bytes:
    """The bytes of base64 pieces that follow each other."""
    try:
        return b"".join(base64.b64decode(part) for part in BASE64.findall(text.split(b"<")[0]))
    except binascii.Error as error:
        raise ValueError(f"its base64 is broken: {error}") from error


def _stored(block: bytes, encoding: Encoding) -> bytes:
    """The bytes of an array, without the header that says how many there are."""
    if not encoding.compressor:
        (size,) = _header(block, 1, encoding)
        return block[encoding.header.itemsize :][:size]
    count, full, _ = _header(block, 3, encoding)
    sizes = _header(block, 3 + count, encoding)[3:]
    at, parts = (3 + count) * encoding.header.itemsize, []
    for size in sizes:
        parts.append(_inflated(block[at : at + size], min(full, LARGEST_BLOCK), encoding.compressor))
        at += size
    return b"".join(parts)


def _header(block: bytes, count: int, encoding: Encoding) -> list[int]:
    """The first `count` integers of a block."""
    if count * encoding.header.itemsize > len(block):
        raise ValueError("it ends inside an array")
    return [int(value) for value in np.frombuffer(block, encoding.header, count)]


def _inflated(part: bytes, size: int, compressor: str) -> bytes:
    """At most `size` bytes of a compressed block."""
    try:
        if compressor == "vtkZLibDataCompressor":
            return zlib.decompressobj().decompress(part, size)
        if compressor == "vtkLZMADataCompressor":
            return lzma.LZMADecompressor().decompress(part, size)
    except (zlib.error, lzma.LZMAError, EOFError) as error:
        raise ValueError(f"a compressed block is damaged: {error}") from error
    raise ValueError(f"it is compressed by {compressor}, which is not read: save it with zlib, or uncompressed")
