"""The bytes of a `.sgn` file: magic, version, checksum, lengths, sections. Nothing is trusted before it is checked.

    "SGN" | version and kind, four bits each | crc32 of the rest | lengths as varints | sections

kind 0, Draco:     lengths: mends.                                    sections: mends, stream
kind 1, spectral:  lengths: mends, stream, base, corrections, detail. sections: head, crc32 of all but the detail,
                   mends, stream, base, corrections, detail

The second checksum lets a file whose end is missing be opened: the detail is last and ordered from smooth to rough.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

from spectral_notes.compression.coefficients import HEAD
from spectral_notes.compression.connectivity import pack_varint, unpack_varint
from spectral_notes.compression.range_coder import CorruptStreamError

MAGIC = b"SGN"
VERSION = 1
CRC = 4
FIXED = 8  # bytes before the lengths
DRACO, SPECTRAL = 0, 1


@dataclass(frozen=True, eq=False)
class Sections:
    """The parts of a file. A Draco file has only `mends` and `stream`."""

    kind: int
    mends: bytes
    stream: bytes
    head: bytes = b""
    base: bytes = b""
    corrections: bytes = b""
    detail: bytes = b""


def pack(s: Sections) -> bytes:
    """Join the sections into a file."""
    if s.kind == DRACO:
        body = pack_varint(len(s.mends)) + s.mends + s.stream
    else:
        parts = [s.mends, s.stream, s.base, s.corrections, s.detail]
        front = b"".join(pack_varint(len(part)) for part in parts) + s.head
        middle = b"".join(parts[:-1])
        body = front + _checksum(front + middle) + middle + s.detail
    return MAGIC + bytes([VERSION << 4 | s.kind]) + _checksum(body) + body


def unpack(data: bytes, *, progressive: bool) -> tuple[Sections, bool]:
    """Split a file into its sections and say whether it is whole; raise if a checksum does not hold."""
    if data[:3] != MAGIC:
        raise CorruptStreamError("data does not start with 'SGN': not a file of this format")
    if len(data) < FIXED + 1:
        raise CorruptStreamError(f"data ends after {len(data)} bytes, inside the header")
    version, kind = data[3] >> 4, data[3] & 15
    if version != VERSION:
        raise CorruptStreamError(f"data is of version {version}; this library reads version {VERSION}")
    if kind not in (DRACO, SPECTRAL):
        raise CorruptStreamError(f"data holds a mesh of unknown kind {kind}")
    body = data[FIXED:]
    whole = _checksum(body) == data[4:FIXED]
    if not (whole or (progressive and kind == SPECTRAL)):
        raise CorruptStreamError("data does not match its checksum: bytes were changed or are missing")
    return (_split_draco(body) if kind == DRACO else _split_spectral(body, whole)), whole


def _split_draco(body: bytes) -> Sections:
    """The sections of a Draco file."""
    length, at = unpack_varint(body, 0)
    return Sections(DRACO, body[at : at + length], body[at + length :])


def _split_spectral(body: bytes, whole: bool) -> Sections:
    """The sections of a spectral file; every length is held against the bytes that are there."""
    lengths, at = [], 0
    for _ in range(5):
        length, at = unpack_varint(body, at)
        lengths.append(length)
    front = body[: at + HEAD.size]
    at += HEAD.size + CRC
    end = at + sum(lengths)
    missing = end - len(body)
    if missing < 0 or missing > (0 if whole else lengths[-1]):
        raise CorruptStreamError(f"data has {len(body) + FIXED} bytes where its lengths say {end + FIXED}")
    if not whole and not missing:
        raise CorruptStreamError("data does not match its checksum, and no byte is missing: bytes were changed")
    inner = body[len(front) : at]
    parts = []
    for length in lengths:
        parts.append(body[at : at + length])
        at += length
    if _checksum(front + b"".join(parts[:-1])) != inner:
        raise CorruptStreamError("data does not match the checksum of its base: bytes were changed")
    mends, stream, base, corrections, detail = parts
    return Sections(SPECTRAL, mends, stream, front[-HEAD.size :], base, corrections, detail)


def _checksum(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(CRC, "little")
