"""The faces of a mesh as a Draco stream without positions, and the order of the vertices that it implies.

Draco's Edgebreaker (Rossignac 1999) codes which triangles meet in one to three bits a vertex, and numbers the vertices
in the order it visits them. It cuts a mesh apart where it is not manifold and drops vertices that no face names; both
are mended by what follows the stream, so that faces come back exactly, up to the numbering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import DracoPy
import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.range_coder import CorruptStreamError

DRACO_HEADER = b"DRACO\x02\x02\x01\x01\x00\x00"  # bitstream 2.2, a mesh, Edgebreaker, no metadata: not stored
LEVEL = 10  # Draco's best compression
MAX_VERTICES = 1 << 24  # vertex numbers are exact in float32 up to here
PER_BYTE = 1000  # the most regular grids take more than a thousandth of a byte a vertex


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Faces as the decoder will number them, `order[i]` the encoder's vertex that becomes vertex i, and the bytes.

    `visited` and `cut_faces` are what Draco itself decodes, before the mends.
    """

    faces: IntArray
    order: IntArray
    stream: bytes
    mends: bytes
    visited: IntArray
    cut_faces: IntArray


def encode_connectivity(faces: IntArray, n: int) -> Connectivity:
    """Code the faces; every vertex carries its own number as a position to learn the order."""
    if n > MAX_VERTICES:
        raise ValueError(f"mesh must have at most {MAX_VERTICES} vertices; got {n}")
    bits = max(1, (n - 1).bit_length())
    numbers = np.zeros((n, 3), dtype=np.float32)
    numbers[:, 0] = np.arange(n)
    numbered = draco_encode(numbers, faces, bits, float(2**bits - 1), np.zeros(3))
    stream = draco_encode(numbers, faces, 1, 1e9, np.zeros(3))
    points, cut = draco_decode(numbered, n)
    visited = np.rint(points[:, 0]).astype(np.int64)
    first = np.sort(np.unique(visited, return_index=True)[1])
    again = np.setdiff1d(np.arange(len(visited)), first)
    lone = np.setdiff1d(np.arange(n), visited)
    new = np.empty(n, dtype=np.int64)
    new[visited[first]] = np.arange(len(first))
    mends = b""
    if len(again) or len(lone):
        mends = b"".join(map(pack_varint, [len(again), len(lone), *_gaps(again), *new[visited[again]].tolist()]))
    order = np.r_[visited[first], lone]
    new[lone] = np.arange(len(first), n)
    return Connectivity(new[visited[cut]], order, stream, mends, visited, cut)


def decode_connectivity(stream: bytes, mends: bytes, limit: int) -> tuple[FloatArray, IntArray, int]:
    """Return the positions in the stream (n, 3), the faces, and how many vertices at the end no face names.

    `limit` bounds the number of vertices. Raises CorruptStreamError for anything an encoder does not write.
    """
    points, faces = draco_decode(stream, limit)
    if not len(faces) or faces.max() >= len(points):
        raise CorruptStreamError("the connectivity has no faces, or names vertices it does not have")
    lone, again, twin = _read_mends(mends, len(points), limit)
    keep = np.ones(len(points), dtype=bool)
    keep[again] = False
    new = np.cumsum(keep) - 1
    if (twin >= keep.sum()).any():
        raise CorruptStreamError("the connectivity joins a vertex to one that is not there")
    new[again] = twin
    faces = new[faces]
    if (faces == np.roll(faces, 1, axis=1)).any() or keep.sum() + lone > limit:
        raise CorruptStreamError(f"the connectivity names a vertex twice in a face, or has more than {limit} vertices")
    return points[keep], faces, lone


def draco_encode(points: Any, faces: IntArray, bits: int, extent: float, origin: Any) -> bytes:
    """Encode a mesh with Draco at its best level, positions on a grid of 2^bits - 1 steps over `extent`; no header."""
    data = bytes(
        DracoPy.encode(
            np.asarray(points, dtype=np.float32),
            faces.astype(np.uint32),
            quantization_bits=bits,
            compression_level=LEVEL,
            quantization_range=extent,
            quantization_origin=[float(x) for x in origin],
        )
    )
    if not data.startswith(DRACO_HEADER):
        raise RuntimeError(f"this version of Draco writes another bitstream than 2.2: {data[:11]!r}")
    return data[len(DRACO_HEADER) :]


def draco_decode(stream: bytes, limit: int) -> tuple[FloatArray, IntArray]:
    """Decode a Draco stream without header into positions (n, 3) and faces (m, 3).

    Its header's counts are held against its size and the limit before Draco sees it and allocates anything.
    """
    vertices, at = unpack_varint(stream, 1)
    faces, _ = unpack_varint(stream, at)
    most = 3 * min(limit, PER_BYTE * (len(stream) + 1))  # a mesh cut apart has up to three points a face
    if max(vertices, faces) > most:
        raise CorruptStreamError(f"data announces {vertices} vertices and {faces} faces; {most} fit its size and limit")
    try:
        mesh = DracoPy.decode(DRACO_HEADER + stream)
    except Exception as error:  # DracoPy raises several kinds of its own
        raise CorruptStreamError(f"the connectivity is not a Draco stream: {error}") from None
    points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
    return points, np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)


def _read_mends(mends: bytes, cut: int, limit: int) -> tuple[int, IntArray, IntArray]:
    """The number of lone vertices, the points that repeat a vertex and which vertex they repeat."""
    if not mends:
        return 0, np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    count, at = unpack_varint(mends, 0)
    lone, at = unpack_varint(mends, at)
    if count >= max(cut, 1) or 2 * count > len(mends) or lone > limit:
        raise CorruptStreamError("the list of joined vertices is longer than the file allows")
    values = []
    for _ in range(2 * count):
        value, at = unpack_varint(mends, at)
        values.append(value)
    again = np.cumsum(np.array(values[:count], dtype=np.int64) + 1) - 1
    if at != len(mends) or (count and again[-1] >= cut):
        raise CorruptStreamError("the list of joined vertices does not fit the connectivity")
    return lone, again, np.array(values[count:], dtype=np.int64)


def _gaps(ascending: IntArray) -> list[int]:
    return (np.diff(ascending, prepend=-1) - 1).tolist()


def pack_varint(value: int) -> bytes:
    """Seven bits a byte, the high bit says that more follow."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def unpack_varint(data: bytes, at: int) -> tuple[int, int]:
    """Return the value that starts at a place and the place after it."""
    value = shift = 0
    while True:
        if at >= len(data) or shift > 35:
            raise CorruptStreamError("the file ends inside a number")
        value |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if data[at - 1] < 0x80:
            return value, at
