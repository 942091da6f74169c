"""The bytes of OBJ, OFF, STL and XYZ files as vertices and polygons.

Nothing is allocated because a file announces it: every count is held against what follows. Compiled readers of these
formats end the interpreter on some damaged files, so none is used. What is refused is named by its line and its word.
"""

from __future__ import annotations

import codecs
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.files.polygons import Polygons

Line = tuple[int | str, bytes]  # its number in the file, counted from 1, or its place in words; and what it says

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_HEADER = 84  # bytes before the first triangle of a binary file
MARKS = {  # the longest first: the mark of UTF-16 begins that of UTF-32
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32", codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}
DECIMAL_COMMA = re.compile(rb"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
SEPARATORS = bytes.maketrans(b",;", b"  ")
SHOWN = 40  # characters of a word that a message quotes


def without_mark(data: bytes) -> bytes:
    """Return the text after its byte order mark, as UTF-8; bytes without a mark as they are."""
    for mark, encoding in MARKS.items():
        if data.startswith(mark):
            if encoding == "utf-8-sig":
                return data[len(mark) :]
            try:
                return data.decode(encoding).encode()
            except UnicodeDecodeError as error:
                raise ValueError(f"its byte order mark announces {encoding.upper()}, which it is not") from error
    return data


def parse_obj(data: bytes) -> Polygons:
    """Return vertices and polygons of an OBJ file; all but `v` and `f` is passed over."""
    rows: list[Line] = []
    polygons: list[Line] = []
    seen: list[int] = []  # vertices before each polygon: a negative index counts back from there
    for number, line in _obj_lines(without_mark(data)):
        kind, *rest = line.split(None, 1) or [b""]
        if kind == b"v":
            rows.append((number, rest[0] if rest else b""))
        elif kind == b"f":
            polygons.append((number, rest[0] if rest else b""))
            seen.append(len(rows))
    index, sizes = as_table(polygons, np.int64)
    numbers = np.array([number for number, _ in polygons], dtype=np.int64)
    if (index == 0).any():
        line_number = np.repeat(numbers, sizes)[np.argmax(index == 0)]
        raise ValueError(f"line {line_number}: a face names vertex 0, and OBJ files count from 1")
    index = np.where(index < 0, index + np.repeat(np.array(seen, dtype=np.int64), sizes), index - 1)
    return Polygons(first_three(rows), index, sizes, _numbers(rows), numbers, first=1)


def _obj_lines(data: bytes) -> Iterator[Line]:
    """The lines without comments, textures and normals; a line that ends in a backslash goes on."""
    odd = re.search(rb"[#/\\]", data) is not None
    begun, before = 0, b""
    for number, line in enumerate(data.splitlines(), 1):
        if odd:
            line = re.sub(rb"#.*|/[^\s/]*", b" ", line)
            if line.endswith(b"\\"):
                begun, before = begun or number, before + line[:-1] + b" "
                continue
            line, at = before + line, begun or number
            begun, before = 0, b""
            yield at, line
        else:
            yield number, line
    if before:
        yield begun, before


def parse_off(data: bytes) -> Polygons:
    """Return vertices and polygons of an OFF file, with or without colours, normals and texture coordinates."""
    data = without_mark(data)
    data = re.sub(rb"#.*", b"", data) if b"#" in data else data
    lines = [(number, line.strip()) for number, line in enumerate(data.splitlines(), 1) if line.strip()]
    header = re.match(rb"(?:ST)?C?N?OFF(?=\s|\d|\Z)\s*", lines[0][1]) if lines else None  # OFF8 12 0: ModelNet
    if header is None or lines[0][1][header.end() :].startswith(b"BINARY"):
        raise ValueError("it does not begin with OFF, or is of a kind that is not read (4OFF, nOFF, OFF BINARY)")
    lines[0] = (lines[0][0], lines[0][1][header.end() :])
    lines = lines if lines[0][1] else lines[1:]
    counts: IntArray = np.zeros(0, dtype=np.int64)
    if lines:
        counts = as_table([(lines[0][0], b" ".join(lines[0][1].split()[:2]))], np.int64)[0]
    if len(counts) < 2 or counts.min() < 0 or counts.sum() > len(lines) - 1:
        raise ValueError(f"it announces {counts.tolist()} vertices and faces and has {max(len(lines) - 1, 0)} lines")
    n, m = map(int, counts)
    rows = lines[1 + n : 1 + n + m]
    values, lengths = as_table(rows, np.float64)  # a face may end in a colour
    start = np.cumsum(lengths) - lengths
    sizes = values[start]
    bad = ~((sizes >= 0) & (sizes < lengths))
    if bad.any():
        number, line = rows[int(np.argmax(bad))]
        raise ValueError(f"line {number}: a face names fewer vertices than it announces: {quoted(line)}")
    sizes = _whole(sizes, rows.__getitem__)
    place = np.repeat(start + 1, sizes) + ramps(sizes)
    owner = np.repeat(np.arange(m), sizes)
    corners = _whole(values[place], lambda i: rows[owner[i]])
    return Polygons(first_three(lines[1 : 1 + n]), corners, sizes, _numbers(lines[1 : 1 + n]), _numbers(rows))


def parse_stl(data: bytes) -> Polygons:
    """Return the corners of an STL file's triangles, ASCII or binary, each corner a vertex of its own.

    A binary file may begin with "solid", too, and may announce fewer triangles than it holds: its bytes decide.
    """
    announced = int.from_bytes(data[STL_HEADER - 4 : STL_HEADER], "little")
    size = STL_HEADER + announced * FACET.itemsize
    numbers = None
    if len(data) != size and _is_ascii_stl(data):
        text = without_mark(data)
        ends = np.flatnonzero(np.frombuffer(text, np.uint8) == ord("\n"))
        found = list(re.finditer(rb"(?i)\bvertex\s+(\S+\s+\S+\s+\S+)", text))
        at = 1 + np.searchsorted(ends, [match.start() for match in found])
        corners = [(number, match[1]) for number, match in zip(at.tolist(), found, strict=True)]
        if len(corners) % 3 or not re.search(rb"(?i)endsolid", text):
            raise ValueError(f"it ends early, after {len(corners)} corners of triangles and before endsolid")
        vertices, numbers = first_three(corners), _numbers(corners)
    elif len(data) < max(size, STL_HEADER):
        raise ValueError(f"it has {len(data)} bytes where {announced} triangles take {size}")
    else:
        held, rest = divmod(len(data) - STL_HEADER, FACET.itemsize)
        facets = np.frombuffer(data, FACET, announced if rest else held, STL_HEADER)
        vertices = as_doubles(facets["corners"].reshape(-1, 3))
    triangles = len(vertices) // 3
    lines = None if numbers is None else numbers[::3]
    return Polygons(vertices, np.arange(3 * triangles), np.full(triangles, 3), numbers, lines)


def _is_ascii_stl(data: bytes) -> bool:
    """Whether an STL file is text: it begins with solid, and no byte of its beginning is none of a text."""
    text = without_mark(data[:1000])
    return text[:512].lstrip()[:5].lower() == b"solid" and b"\0" not in text


def parse_xyz(data: bytes) -> Polygons:
    """Return the points of a text of one point a line, with no polygon; what follows x, y and z is passed over.

    Blanks, commas or semicolons separate. A first line of names, or one with the number of points, is passed over.
    """
    text = re.sub(rb"(#|//).*", b"", without_mark(data))
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    if lines and _is_heading(lines[0][1], len(lines) - 1):
        lines = lines[1:]
    rows = []
    for number, line in lines:
        if b"," in line and len(words := re.split(rb"[\s;]+", line)) > 1:
            for word in words:
                if DECIMAL_COMMA.fullmatch(word):
                    raise ValueError(_no_number(number, word, "a number"))
        rows.append((number, b" ".join(line.translate(SEPARATORS).split()[:3])))
    none = np.zeros(0, dtype=np.int64)
    return Polygons(first_three(rows), none, none, _numbers(rows))


def _is_heading(line: bytes, below: int) -> bool:
    """Whether a first line names columns, as in "x y z red", or says how many lines follow."""
    words = line.translate(SEPARATORS).split()
    if len(words) == 1 and words[0].isdigit():
        return int(words[0]) == below
    return not any(_is_number(word, np.float64) for word in words) and re.search(rb"[A-Za-z]", line) is not None


def as_table(lines: Sequence[Line], dtype: type) -> tuple[NDArray[Any], IntArray]:
    """Return the numbers of all lines as one array, and how many each line has."""
    sizes = np.fromiter((len(line.split()) for _, line in lines), np.int64, len(lines))
    values = _parsed(b" ".join([line for _, line in lines]), dtype)
    if len(values) != sizes.sum():
        for number, line in lines:
            for word in line.split():
                if not _is_number(word, dtype):
                    raise ValueError(_no_number(number, word, "an integer" if dtype is np.int64 else "a number"))
    return values, sizes


def _parsed(text: bytes, dtype: type) -> NDArray[Any]:
    """The numbers of a text; none where a word is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how NumPy says that it stopped before the end
        try:
            values: NDArray[Any] = np.fromstring(text.decode("ascii"), dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            values = np.zeros(0, dtype=dtype)
    return values


def _is_number(word: bytes, dtype: type) -> bool:
    """Whether one word is one number."""
    return len(_parsed(word, dtype)) == 1


def _no_number(place: int | str, word: bytes, kind: str) -> str:
    """The message about a word that is no number."""
    place = f"line {place}" if isinstance(place, int) else place
    comma = "; it has a decimal comma: write a point" if DECIMAL_COMMA.fullmatch(word) else ""
    return f"{place}: {quoted(word)} stands where {kind} should be{comma}"


def quoted(word: bytes) -> str:
    """Return a word as a message shows it."""
    text = ascii(word.decode("utf-8", "replace"))
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}...'"


def _whole(values: FloatArray, line_of: Callable[[int], Line]) -> IntArray:
    """Floats as the integers that they are; `line_of(i)` is where value i stands."""
    whole = (abs(values) < 2**53) & (values == np.rint(values))
    if not whole.all():
        number, line = line_of(int(np.argmin(whole)))
        raise ValueError(f"line {number}: a number stands where an integer should be: {quoted(line)}")
    return values.astype(np.int64)


def _numbers(lines: Sequence[Line]) -> IntArray:
    """The numbers of lines."""
    return np.array([number for number, _ in lines], dtype=np.int64)


def as_doubles(values: NDArray[Any]) -> FloatArray:
    """Return numbers as float64; a NaN of any kind stays one, without a warning."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def first_three(lines: Sequence[Line]) -> FloatArray:
    """Return the first three numbers of each line, shape (n, 3)."""
    values, sizes = as_table(lines, np.float64)
    if (sizes < 3).any():
        number, line = lines[int(np.argmax(sizes < 3))]
        raise ValueError(f"line {number}: a vertex has fewer than three coordinates: {quoted(line)}")
    return values[(np.cumsum(sizes) - sizes)[:, None] + np.arange(3)]


def ramps(sizes: IntArray) -> IntArray:
    """Return 0 .. size - 1 for each size, one after the other."""
    return np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
