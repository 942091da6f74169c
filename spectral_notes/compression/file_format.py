"""The bytes of a `.sgn` file. Nothing is trusted before it is checked.

    "SGN" | version | crc32 of the rest | length of the Draco stream | Draco stream | range-coded payload

The payload holds where the mesh lies, the mends of the connectivity, and of a spectral file (of which Draco's stream
has no positions) head, base, detail and corrections, from smooth to rough.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

from spectral_notes._checks import FloatArray
from spectral_notes.compression.connectivity import Mends
from spectral_notes.compression.range_coder import Coder, CorruptStreamError

FRAME = struct.Struct("<3sBII")
VERSION = 4


@dataclass(frozen=True)
class Place:
    """Where a mesh lies and how large it is: X = 2^exponent (x + corner), with x centred and of diagonal 1/2 to 1."""

    exponent: int = 0
    corner: tuple[int, ...] = (0, 0, 0)

    @staticmethod
    def of(X: FloatArray) -> Place:
        """The place of positions (n, 3)."""
        low, high = X.min(axis=0), X.max(axis=0)
        diagonal = float(np.linalg.norm(high - low))
        if not 1e-100 < diagonal < 1e100:
            raise ValueError(f"mesh must have an extent between 1e-100 and 1e100; its diagonal is {diagonal:g}")
        exponent = int(np.frexp(diagonal)[1])
        return Place(exponent, tuple(int(x) for x in np.rint(np.ldexp(low / 2 + high / 2, -exponent))))

    def shrink(self, X: FloatArray) -> FloatArray:
        """Positions centred and of size one."""
        return np.ldexp(X, -self.exponent) - np.array(self.corner, dtype=np.float64)

    def restore(self, x: FloatArray) -> FloatArray:
        """Positions where they were."""
        return np.ldexp(x + np.array(self.corner, dtype=np.float64), self.exponent)


def front(coder: Coder, place: Place, mends: Mends, spectral: bool, limit: int) -> tuple[Place, Mends, bool]:
    """Write what comes before any position, or read it."""
    exponent = coder.bits(10, place.exponent + 512) - 512
    place = Place(exponent, tuple(coder.signed(c) for c in place.corner))
    return place, mends.code(coder, limit), bool(coder.bits(1, spectral))


def pack(stream: bytes, payload: bytes) -> bytes:
    """Join the parts of a file."""
    body = FRAME.pack(b"SGN", VERSION, 0, len(stream))[8:] + stream + payload
    return FRAME.pack(b"SGN", VERSION, zlib.crc32(body), 0)[:8] + body


def unpack(data: bytes, *, progressive: bool) -> tuple[bytes, bytes, bool]:
    """Draco's stream, the payload, and whether the file is whole; raise if a checksum does not hold."""
    if data[:3] != b"SGN":
        raise CorruptStreamError("data does not start with 'SGN': not a file of this format")
    if len(data) < FRAME.size:
        raise CorruptStreamError(f"data ends after {len(data)} bytes, inside the header")
    _, version, checksum, length = FRAME.unpack_from(data)
    if version != VERSION:
        raise CorruptStreamError(
            f"data is of version {version >> 4 or version}; this library reads version {VERSION}: decode it with the "
            "release that wrote it, and encode the mesh again"
        )
    whole, end = zlib.crc32(data[8:]) == checksum, FRAME.size + length
    if not (whole or progressive):
        raise CorruptStreamError("data does not match its checksum: bytes were changed or are missing")
    if end > len(data):
        raise CorruptStreamError("data ends inside the connectivity")
    return data[FRAME.size : end], data[end:], whole
