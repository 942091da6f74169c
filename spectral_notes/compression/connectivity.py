"""The faces of a mesh as a Draco stream without positions, and the order of the vertices that it implies.

Draco's Edgebreaker (Rossignac 1999) codes which triangles meet in one to three bits a vertex, and numbers the vertices
in the order it visits them. It cuts a mesh apart where neighbours are not wound alike or more than two faces meet, and
drops vertices that no face names; both are mended, so that faces come back exactly, up to the numbering. Nothing may
reach Draco that is not finite, centred and of size about one: the process does not survive anything else.
"""

from __future__ import annotations

from dataclasses import dataclass

import DracoPy
import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.range_coder import Coder, CorruptStreamError

DRACO_HEADER = b"DRACO\x02\x02\x01\x01\x00\x00"  # bitstream 2.2, a mesh, Edgebreaker, no metadata: not stored
BEST = 10  # Draco's best compression by its own account; for positions 9 is at times smaller
MAX_VERTICES = 1 << 24  # vertex numbers are exact in float32 up to here
PER_BYTE = 1000  # the most regular grids take more than a thousandth of a byte a face


@dataclass(frozen=True, eq=False)
class Mends:
    """Points of Draco's that repeat a vertex (`again`, ascending), which one (`twin`), how many vertices it drops."""

    again: IntArray
    twin: IntArray
    lone: int

    def code(self, coder: Coder, limit: int) -> Mends:
        """Write the mends, or read them; `limit` bounds the number of vertices."""
        lone, count, again, twin = coder.unsigned(self.lone), coder.unsigned(len(self.again)), [], []
        width, at = coder.bits(5, int(self.twin.max(initial=0)).bit_length()), -1
        if max(lone, count // 3) > limit:
            raise CorruptStreamError("the list of joined vertices is longer than the mesh allows")
        for i in range(count):
            at += 1 + coder.unsigned(0 if coder.reading else int(self.again[i]) - at - 1)
            again.append(at)
            twin.append(coder.bits(width, 0 if coder.reading else int(self.twin[i])))
            if coder.ended or at > 1 << 40:
                raise CorruptStreamError("the list of joined vertices does not fit the mesh")
        return Mends(np.array(again, dtype=np.int64), np.array(twin, dtype=np.int64), lone)


NONE = Mends(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), 0)


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Faces as the decoder will number them, `order[i]` the encoder's vertex that becomes vertex i, and the bytes."""

    faces: IntArray
    order: IntArray
    stream: bytes
    mends: Mends


def encode_connectivity(faces: IntArray, n: int) -> Connectivity:
    """Code the faces; every vertex carries its own number as a position to learn the order."""
    if n > MAX_VERTICES:
        raise ValueError(f"mesh must have at most {MAX_VERTICES} vertices; got {n}")
    bits = max(1, (n - 1).bit_length())
    numbers = np.zeros((n, 3))
    numbers[:, 0] = np.arange(n)
    stream = draco_encode(numbers, faces, 1, 1e9, np.zeros(3))
    points, cut = draco_decode(draco_encode(numbers, faces, bits, float(2**bits - 1), np.zeros(3)))
    visited = np.rint(points[:, 0]).astype(np.int64)
    first = np.sort(np.unique(visited, return_index=True)[1])
    again, lone = np.setdiff1d(np.arange(len(visited)), first), np.setdiff1d(np.arange(n), visited)
    new, order = np.empty(n, dtype=np.int64), np.r_[visited[first], lone]
    new[order] = np.arange(n)
    mends = Mends(again, new[visited[again]], len(lone))
    return Connectivity(new[visited[cut]], order, stream, mends)


def size_of(c: Connectivity) -> int:
    """Bytes of a file of the faces alone: Draco's header and stream, and the mends if there are any."""
    c.mends.code(coder := Coder(), MAX_VERTICES)
    mends = coder.finish() if len(c.mends.again) or c.mends.lone else b""
    return len(DRACO_HEADER) + len(c.stream) + len(mends)


def decode_connectivity(stream: bytes, mends: Mends, limit: int) -> tuple[FloatArray, IntArray]:
    """The positions in the stream (n, 3) and the faces; vertices that no face names follow, without positions."""
    n, at = _varint(stream, 1)  # held against limit and size before Draco sees them and allocates anything
    m, _ = _varint(stream, at)
    if n - len(mends.again) + mends.lone > limit or n > 3 * m or m > PER_BYTE * (len(stream) + 1):
        raise CorruptStreamError(f"data announces {n} vertices and {m} faces: more than its size or {limit} allow")
    points, faces = draco_decode(stream)
    keep = np.ones(len(points), dtype=bool)
    if not len(faces) or faces.max() >= len(points) or mends.again.max(initial=0) >= len(points):
        raise CorruptStreamError("the connectivity names vertices it does not have")
    keep[mends.again] = False
    if mends.twin.max(initial=-1) >= keep.sum() or keep.sum() + mends.lone > limit:
        raise CorruptStreamError(f"the connectivity joins vertices it does not have, or has more than {limit}")
    new = np.cumsum(keep) - 1
    new[mends.again] = mends.twin
    faces = new[faces]
    if (faces == np.roll(faces, 1, axis=1)).any():
        raise CorruptStreamError("the connectivity names a vertex twice in a face")
    return points[keep], faces


def draco_encode(
    points: FloatArray, faces: IntArray, bits: int, extent: float, origin: FloatArray, level: int = BEST
) -> bytes:
    """Encode a mesh with Draco, positions on a grid of 2^bits - 1 steps over `extent`; no header."""
    data = bytes(
        DracoPy.encode(
            points.astype(np.float32), faces.astype(np.uint32), quantization_bits=bits, compression_level=level,
            quantization_range=extent, quantization_origin=origin.tolist(),
        )
    )
    if not data.startswith(DRACO_HEADER):
        raise RuntimeError(f"this version of Draco writes another bitstream than 2.2: {data[:11]!r}")
    return data[len(DRACO_HEADER) :]


def draco_decode(stream: bytes) -> tuple[FloatArray, IntArray]:
    """Decode a Draco stream without header into positions (n, 3) and faces (m, 3)."""
    try:
        mesh = DracoPy.decode(DRACO_HEADER + stream)
    except Exception as error:  # DracoPy raises several kinds of its own
        raise CorruptStreamError(f"the connectivity is not a Draco stream: {error}") from None
    points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
    return points, np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """The number that Draco writes at a place, seven bits a byte, and the place after it."""
    value = shift = 0
    while at < len(data) and shift <= 35:
        value |= (data[at] & 0x7F) << shift
        shift, at = shift + 7, at + 1
        if data[at - 1] < 0x80:
            return value, at
    raise CorruptStreamError("the connectivity ends inside a number")
