"""Corrections for the vertices that the spectral codec leaves further away than a bound."""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray
from spectral_notes.compression.range_coder import CorruptStreamError, RangeDecoder, RangeEncoder

SAFETY = 0.999  # leaves room for rounding that differs between machines


def encode_corrections(wanted: FloatArray, have: FloatArray, bound: float) -> bytes:
    """Code a displacement for every vertex further than `bound` from where it is wanted, on a grid fine enough."""
    gap = wanted - have
    far = np.flatnonzero((gap * gap).sum(axis=1) > (SAFETY * bound) ** 2)
    if not len(far):
        return b""
    steps = np.rint(gap[far] / grid(bound)).astype(np.int64)
    coder = RangeEncoder()
    coder.put_unsigned(len(far) - 1)
    for skip, step in zip((np.diff(far, prepend=-1) - 1).tolist(), steps.tolist(), strict=True):
        coder.put_unsigned(skip)
        for s in step:
            coder.put_unsigned(2 * s - 1 if s > 0 else -2 * s)
    return np.float32(bound).tobytes() + coder.finish()


def decode_corrections(data: bytes, have: FloatArray) -> FloatArray:
    """The corrected positions."""
    if not data:
        return have
    bound = float(np.frombuffer(data[:4].ljust(4, b"\0"), dtype="<f4")[0])
    coder, out, at = RangeDecoder(data[4:]), have.copy(), -1
    count = coder.get_unsigned() + 1
    if not 1e-30 < bound < 1e30 or count > len(have):
        raise CorruptStreamError("the corrections are more than there are vertices, or without a bound")
    for _ in range(count):
        at += coder.get_unsigned() + 1
        if at >= len(have) or coder.overrun:
            raise CorruptStreamError("the corrections name a vertex that is not there")
        codes = [coder.get_unsigned() for _ in range(3)]
        out[at] += grid(bound) * np.array([(c + 1) // 2 if c % 2 else -(c // 2) for c in codes])
    return out


def grid(bound: float) -> float:
    """Spacing at which rounding three coordinates stays within the bound."""
    return float(np.float32(bound)) * 2 * 0.99 / 3**0.5
