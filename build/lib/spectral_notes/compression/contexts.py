"""How large the next coefficient will be: a prediction in integers, and the symbols that carry the coefficient.

A coefficient's expected magnitude is learnt from the ones already coded: running means of its own patch along the
spectrum (four window lengths), of all patches in the rows before (three), and of the other axes. Their logarithms are
combined with fixed weights. All of it is fixed-point arithmetic in int64, so encoder and decoder agree to the last bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import IntArray
from spectral_notes.compression.range_coder import CorruptStreamError, RangeDecoder, RangeEncoder, Table
from spectral_notes.compression.tables import COUNTS, WEIGHTS
from spectral_notes.compression.trellis import NEXT, QUANTISER

ONE = 256  # fixed-point one of the running means
OCTAVE = 64  # fixed-point one of the logarithms
LOCAL = ((2, 77), (6, 38), (20, 20), (60, 13))  # (window in rows, offset under the logarithm in units of 1 / ONE)
SHARED = ((1, 20), (4, 13), (16, 13))
OFFSETS = np.array([offset for _, offset in LOCAL + SHARED])
EXPECTED, SURPRISE = 2, 102  # the mean that a magnitude is measured against, and the offset of both
CLASSES = 44  # half octaves of the expected magnitude, from 2^-6
SPLIT = 18  # from this class on the low bits of a coefficient are coded as they are
TOKENS = 16  # the last one is the escape
CAP = 1 << 20  # magnitudes count as this much at most
LARGEST = 1 << 30  # no encoder writes a coefficient beyond it
_MANTISSA = np.rint(OCTAVE * np.log2(1 + np.arange(128) / 128)).astype(np.int64)


def log2_fixed(x: IntArray) -> IntArray:
    """Logarithm of positive integers in units of 1 / OCTAVE octave, from the top eight bits."""
    exponent = np.frexp(x.astype(np.float64))[1].astype(np.int64) - 1  # exact: x < 2^53
    top = (x << 7) >> exponent
    return exponent * OCTAVE + _MANTISSA[top & 127]


class Contexts:
    """Running means of the magnitudes of a block, row after row, and the classes they predict."""

    def __init__(self, present: NDArray[np.bool_]) -> None:
        rows, patches = present.shape
        self._present = present
        self._row = 0
        self._local = np.full((len(LOCAL), 3, patches), ONE, dtype=np.int64)
        self._shared = np.full((len(SHARED), 3, 1), ONE, dtype=np.int64)
        seen = np.maximum(np.cumsum(present, axis=0), 1)
        windows = np.array([window for window, _ in LOCAL])
        rates = np.maximum(ONE // (windows[None, :, None] + 1), ONE // (seen[:, None, :] + 1))
        self._rates = (rates * present[:, None, :])[:, :, None, :]  # (rows, windows, 1, patches); zero where absent
        shared = np.array([window for window, _ in SHARED])
        self._shared_rates = np.maximum(ONE // (shared + 1), ONE // (np.arange(rows)[:, None] + 2))[:, :, None, None]
        self._counts = present.sum(axis=1).tolist()

    @property
    def means(self) -> IntArray:
        """The running means of each patch, then of all together: (windows, 3, patches)."""
        return np.concatenate([self._local, np.broadcast_to(self._shared, (len(SHARED), *self._local.shape[1:]))])

    def learn(self, row: IntArray) -> None:
        """Move the running means towards the magnitudes of a whole row (3, patches)."""
        now = np.minimum(row, CAP) << 8
        self._local = self._local + ((now - self._local) * self._rates[self._row] >> 8)
        count = self._counts[self._row]
        if count:
            mean = (now * self._present[self._row]).sum(axis=1, keepdims=True) // count
            self._shared = self._shared + ((mean - self._shared) * self._shared_rates[self._row] >> 8)
        self._row += 1


def logarithms(means: IntArray) -> tuple[IntArray, IntArray]:
    """Logarithms of running means (..., 7, 3, patches), and of those that a magnitude is measured against."""
    return log2_fixed(means + OFFSETS[:, None, None]), log2_fixed(means[..., EXPECTED, :, :] + SURPRISE)


def predict(logs: tuple[IntArray, IntArray], row: IntArray, axis: int) -> IntArray:
    """The class 0 .. CLASSES - 1 of an axis (..., patches), from `logarithms` and magnitudes `row` (..., 3, patches).

    Only the axes of the row before this one are looked at.
    """
    log, expected = logs
    weights = WEIGHTS[min(axis, 1)]
    one, two = (1, 2) if axis == 0 else (3 - axis, 3 - axis)
    level = np.einsum("f,...fp->...p", weights[:7], log[..., axis, :]) + weights[11] * OCTAVE
    for i, window in enumerate((1, 3)):
        level += weights[7 + i] * ((log[..., window, one, :] + log[..., window, two, :]) >> 1)
    for j in range(axis):
        known = np.minimum(row[..., j, :], CAP) << 8
        level += weights[9 + j] * (log2_fixed(known + SURPRISE) - expected[..., j, :])
    return np.clip(((level >> 8) + 6 * OCTAVE + OCTAVE // 4) // (OCTAVE // 2), 0, CLASSES - 1)


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
    contexts, means = Contexts(present), []
    rows = np.ascontiguousarray(magnitude.transpose(0, 2, 1))  # (rows, 3, patches)
    for row in rows:
        means.append(contexts.means)
        contexts.learn(row)
    logs = logarithms(np.stack(means))
    return np.stack([predict(logs, rows, axis) for axis in range(3)], axis=-1)


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
        known = np.zeros((3, patches), dtype=np.int64)
        logs = logarithms(contexts.means)
        for axis in range(3):
            level = predict(logs, known, axis).tolist()
            for p in columns:
                s = state[p][axis]
                k = tables.decode(coder, level[p], QUANTISER[s])
                out[row, p, axis] = 2 * k - QUANTISER[s] * ((k > 0) - (k < 0))
                state[p][axis] = NEXT[s][k & 1]
            known[axis] = np.abs(out[row, :, axis])
        contexts.learn(known)
        if coder.exhausted and partial:
            out[row] = 0
            break
        if coder.overrun:
            raise CorruptStreamError("the coefficients end too early")
    return out
