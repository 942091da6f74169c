"""How large the next coefficient will be: a prediction in integers, and the symbols that carry the coefficient.

A coefficient's expected magnitude is learnt from the ones already coded: running means of its own patch along the
spectrum (four window lengths), of all patches in the rows before (three), and of the other axes. Their logarithms are
combined with fixed weights. All of it is fixed-point arithmetic in int64, so encoder and decoder agree to the last bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import IntArray
from spectral_notes._codec_tables import COUNTS, WEIGHTS
from spectral_notes._range_coder import CorruptStreamError, RangeDecoder, RangeEncoder, Table
from spectral_notes._trellis import NEXT, QUANTISER

ONE = 256  # fixed-point one of the running means
OCTAVE = 64  # fixed-point one of the logarithms
LOCAL = ((2, 77), (6, 38), (20, 20), (60, 13))  # (window in rows, offset under the logarithm in units of 1 / ONE)
SHARED = ((1, 20), (4, 13), (16, 13))
CLASSES = 44  # half octaves of the expected magnitude, from 2^-6
SPLIT = 18  # from this class on the low bits of a coefficient are coded as they are
TOKENS = 16  # the last one is the escape
LARGEST = 1 << 30  # no encoder writes a coefficient beyond it
_MANTISSA = np.rint(OCTAVE * np.log2(1 + np.arange(128) / 128)).astype(np.int64)


def log2_fixed(x: IntArray) -> IntArray:
    """Floor-like logarithm of positive integers in units of 1 / OCTAVE octave, from the top eight bits."""
    exponent = np.frexp(x.astype(np.float64))[1].astype(np.int64) - 1  # exact: x < 2^53
    top = np.where(exponent >= 7, x >> np.maximum(exponent - 7, 0), x << np.maximum(7 - exponent, 0))
    return exponent * OCTAVE + _MANTISSA[top & 127]


class Contexts:
    """Predict the class of each coefficient of a row, axis by axis, then learn from the row."""

    def __init__(self, present: NDArray[np.bool_]) -> None:
        patches = present.shape[1]
        self._present = present
        self._local = np.full((len(LOCAL), 3, patches), ONE, dtype=np.int64)
        self._shared = np.full((len(SHARED), 3), ONE, dtype=np.int64)
        self._seen = np.zeros(patches, dtype=np.int64)
        self._offsets = np.array([c for _, c in LOCAL])[:, None, None]
        self._row = 0
        self._now = np.zeros((3, patches), dtype=np.int64)
        self._logs, self._shared_logs = self._take_logs()

    def _take_logs(self) -> tuple[IntArray, IntArray]:
        """Logarithms of the running means of all axes."""
        shared_offsets = np.array([c for _, c in SHARED])[:, None]
        return log2_fixed(self._local + self._offsets), log2_fixed(self._shared + shared_offsets)

    def features(self, axis: int) -> IntArray:
        """The 12 features (12, patches) that predict an axis of the current row, in units of 1 / OCTAVE."""
        patches = self._local.shape[2]
        out = np.zeros((12, patches), dtype=np.int64)
        out[:4] = self._logs[:, axis]
        out[4:7] = self._shared_logs[:, axis, None]
        if axis == 0:
            out[7:9] = (self._logs[1::2, 1] + self._logs[1::2, 2]) >> 1
        else:
            out[7:9] = self._logs[1::2, 3 - axis]
        for j in range(axis):
            expected = self._local[2, j]
            out[9 + j] = log2_fixed((self._now[j] << 8) + 102) - log2_fixed(expected + 102)
        out[11] = OCTAVE
        return out

    def classes(self, axis: int) -> IntArray:
        """The class 0 .. CLASSES - 1 of the expected magnitude of each patch's coefficient."""
        weights = WEIGHTS[min(axis, 1)]
        level = (weights @ self.features(axis)) >> 8
        return np.clip((level + 6 * OCTAVE + OCTAVE // 4) // (OCTAVE // 2), 0, CLASSES - 1)

    def saw(self, axis: int, magnitude: IntArray) -> None:
        """Take note of the magnitudes (patches,) of an axis; after axis 2 the row is complete."""
        self._now[axis] = np.minimum(magnitude, 1 << 20)
        if axis == 2:
            self._learn()

    def _learn(self) -> None:
        """Move the running means towards the row."""
        here = self._present[self._row]
        self._seen += here
        now = self._now << 8
        for i, (window, _) in enumerate(LOCAL):
            rate = np.maximum(ONE // (window + 1), ONE // (self._seen + 1))
            self._local[i] += np.where(here, (now - self._local[i]) * rate >> 8, 0)
        count = int(here.sum())
        if count:
            mean = (now * here).sum(axis=1) // count
            for i, (window, _) in enumerate(SHARED):
                self._shared[i] += (mean - self._shared[i]) * max(ONE // (window + 1), ONE // (self._row + 2)) >> 8
        self._row += 1
        self._logs, self._shared_logs = self._take_logs()


def table_of(level: int) -> tuple[int, int]:
    """Which table a class uses, and how many low bits are coded plainly."""
    return (level, 0) if level < SPLIT else (SPLIT + level % 2, (level - SPLIT) // 2)


class Tables:
    """One adaptive table for each class and quantiser, started from counts that were measured once."""

    def __init__(self) -> None:
        self._tables = [[Table(COUNTS[c][q]) for q in (0, 1)] for c in range(SPLIT + 2)]

    def encode(self, coder: RangeEncoder, level: int, quantiser: int, k: int) -> None:
        """Code an index k of a quantiser."""
        which, shift = table_of(level)
        size = -k if k < 0 else k
        token = min(size >> shift, TOKENS - 1)
        self._tables[which][quantiser].encode(coder, token)
        if token == TOKENS - 1:
            coder.put_unsigned((size >> shift) - token)
        if shift:
            coder.put_bits(size, shift)
        if size:
            coder.put_bits(int(k < 0), 1)

    def decode(self, coder: RangeDecoder, level: int, quantiser: int) -> int:
        """Read an index."""
        which, shift = table_of(level)
        size = self._tables[which][quantiser].decode(coder)
        if size == TOKENS - 1:
            size += coder.get_unsigned()
        if shift:
            size = size << shift | coder.get_bits(shift)
        if size > LARGEST:
            raise CorruptStreamError("a coefficient is larger than any encoder writes")
        return -size if size and coder.get_bits(1) else size


def classify(magnitude: IntArray, present: NDArray[np.bool_]) -> IntArray:
    """The classes (rows, patches, 3) that the coder will use for coefficients of these magnitudes."""
    contexts, out = Contexts(present), np.zeros_like(magnitude)
    for row in range(len(magnitude)):
        for axis in range(3):
            out[row, :, axis] = contexts.classes(axis)
            contexts.saw(axis, magnitude[row, :, axis])
    return out


def encode_block(
    coder: RangeEncoder, tables: Tables, k: IntArray, quantiser: IntArray, level: IntArray, present: NDArray[np.bool_]
) -> None:
    """Code indices (rows, patches, 3) row by row, after the number of rows that are not all zero."""
    used = int(np.flatnonzero(k.any(axis=(1, 2))).max(initial=-1)) + 1
    coder.put_unsigned(used)
    for row in range(used):
        columns = np.flatnonzero(present[row])
        for axis in range(3):
            triples = (a[row, columns, axis].tolist() for a in (level, quantiser, k))
            for symbol in zip(*triples, strict=True):
                tables.encode(coder, *symbol)


def decode_block(coder: RangeDecoder, tables: Tables, present: NDArray[np.bool_], *, partial: bool = False) -> IntArray:
    """Read what `encode_block` wrote: signed multiples (rows, patches, 3) of half the step.

    With `partial`, rows that depend on missing bytes are left zero.
    """
    rows, patches = present.shape
    contexts, out = Contexts(present), np.zeros((rows, patches, 3), dtype=np.int64)
    used = coder.get_unsigned()
    if used > rows:
        raise CorruptStreamError("a block has more rows than its patches have modes")
    state = np.zeros((patches, 3), dtype=np.int64).tolist()
    for row in range(used):
        columns = np.flatnonzero(present[row]).tolist()
        for axis in range(3):
            level = contexts.classes(axis).tolist()
            for p in columns:
                s = state[p][axis]
                k = tables.decode(coder, level[p], QUANTISER[s])
                out[row, p, axis] = 2 * k - QUANTISER[s] * ((k > 0) - (k < 0))
                state[p][axis] = NEXT[s][k & 1]
            contexts.saw(axis, np.abs(out[row, :, axis]))
        if coder.exhausted and partial:
            out[row] = 0
            break
        if coder.overrun:
            raise CorruptStreamError("the coefficients end too early")
    return out
