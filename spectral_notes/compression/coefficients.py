"""Coefficients as integers, and integers as bits: how large will the next be, which multiple to take, how to code it.

**Contexts.** The expected magnitude of a coefficient is the mean of two running means of the magnitudes before it: of
its own patch over about four rows, and of all patches over two. It falls into half-octave classes, in integers, so
encoder and decoder agree to the last bit. Each class has tables of counts that learn as they go.

**Trellis.** A uniform quantiser of step 2 wastes 1.53 dB against the best there is. Here a coefficient is a multiple of
1 taken from quantiser 0 (even multiples) or quantiser 1 (odd multiples and zero); the parity of each index moves an
eight-state machine that chooses the quantiser of the next coefficient. The encoder picks the cheapest path (Viterbi),
weighing squared error against bits (Marcellin and Fischer 1990; in video coding, dependent quantisation).
"""

from __future__ import annotations

import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.range_coder import Coder, CorruptStreamError

ONE = 256  # fixed-point one of the running means
BOUNDS = np.rint(2.0 ** (2.75 + np.arange(80) / 2)).astype(np.int64)  # of the classes, for twice the mean
SPLIT = 18  # from this class on the low bits of a coefficient are coded as they are
TOKENS = 16  # the last one is the escape
LARGEST = 1 << 44  # no encoder writes a coefficient beyond it
TRADE = 0.2  # squared error, in units of the unit, that one bit is worth
DEAD = 0.15  # of the quantiser that guesses the contexts, in its steps
NEXT = ((0, 2), (5, 7), (1, 3), (6, 4), (2, 0), (4, 6), (3, 1), (7, 5))  # state after an even and an odd index
QUANTISER = (0, 1, 0, 1, 0, 1, 0, 1)  # the quantiser of each state
_CLASS = np.arange(len(BOUNDS) + 1)
_PLAIN = np.maximum(_CLASS - SPLIT, 0) // 2  # low bits that a class codes plainly
_TABLE = np.where(_CLASS < SPLIT, _CLASS, SPLIT + _CLASS % 2)
_BEFORE = np.array([[(s, p) for s in range(8) for p in (0, 1) if NEXT[s][p] == t] for t in range(8)])
_STATE, _PARITY = _BEFORE[:, :, 0], _BEFORE[:, :, 1]  # (8, 2) the two ways into a state
_OF = np.array(QUANTISER)
_MEAN = 2.0 ** ((np.arange(SPLIT + 2) - 12.5) / 2)[:, None]  # |v| of a class, where p(v) ~ x^|v|
_X, _K = _MEAN / (1 + np.sqrt(1 + _MEAN * _MEAN)), np.arange(TOKENS)
_P = np.stack([np.where(_K, 2 * _X ** np.maximum(2 * _K - q, 0), 1) for q in (0, 1)], axis=1)
COUNTS = 1 + np.rint(1000 * _P / _P.sum(axis=2, keepdims=True)).astype(np.int64)  # (tables, quantisers, tokens)


class Contexts:
    """Running means of the magnitudes of a block, row after row."""

    def __init__(self, patches: int) -> None:
        self._own = np.full((3, patches), ONE, dtype=np.int64)
        self._all = np.full((3, 1), ONE, dtype=np.int64)

    def classes(self) -> IntArray:
        """The classes (3, patches) of the row to come."""
        return BOUNDS.searchsorted(self._own + self._all, side="right")

    def learn(self, row: IntArray) -> None:
        """Move the running means towards the magnitudes of a whole row (3, patches)."""
        now = row * ONE
        self._own += (now - self._own) >> 2
        self._all += (now.sum(axis=1, keepdims=True) // row.shape[1] - self._all) >> 1


class Tables:
    """One adaptive table for each class and quantiser, the counts and their total."""

    def __init__(self) -> None:
        self._tables = [[[*counts, sum(counts)] for counts in pair] for pair in COUNTS.tolist()]
        self._which, self._plain = _TABLE.tolist(), _PLAIN.tolist()

    def code(self, coder: Coder, level: int, quantiser: int, k: int = 0) -> int:
        """Code an index k of a quantiser."""
        plain, size = self._plain[level], -k if k < 0 else k
        high = size >> plain
        token = coder.symbol(self._tables[self._which[level]][quantiser], high if high < TOKENS else TOKENS - 1)
        high = token if token < TOKENS - 1 else token + coder.unsigned(high - token if high else 0)
        size = high << plain | coder.bits(plain, size) if plain else high
        if size > LARGEST:
            raise CorruptStreamError("a coefficient is larger than any encoder writes")
        return -size if size and coder.bits(1, k < 0) else size


def quantise(c: FloatArray) -> tuple[IntArray, IntArray]:
    """Indices and their multiples for coefficients (rows, 3, patches) in units, chosen by error and bits together."""
    # the bits depend on the indices before: guessed as those of a quantiser with a dead zone
    contexts, level = Contexts(c.shape[2]), np.empty(c.shape, dtype=np.int64)
    for row, into in zip(2 * np.rint(np.maximum(np.abs(c) / 2 - DEAD, 0)).astype(np.int64), level, strict=True):
        into[:] = contexts.classes()
        contexts.learn(row)
    return best_path(c, level)


def best_path(c: FloatArray, level: IntArray) -> tuple[IntArray, IntArray]:
    """The indices and multiples (rows, 3, patches) of least sum (|c| - multiple)^2 + TRADE * bits in each column."""
    bits, size = -np.log2(COUNTS / COUNTS.sum(axis=2, keepdims=True)), np.abs(c)
    cost, index = np.empty((2, 2, *c.shape)), np.empty((2, 2, *c.shape), dtype=np.int64)
    for q in (0, 1):
        for parity in (0, 1):
            near = np.maximum(np.rint(((size + q) / 2 - parity) / 2) * 2 + parity, parity).astype(np.int64)
            k = np.stack([near, np.maximum(near - 2, parity), np.full_like(near, parity)])
            price = bits[_TABLE[level], q, np.minimum(k >> _PLAIN[level], TOKENS - 1)] + (k > 0)
            costs = (size - (2 * k - q * (k > 0))) ** 2 + TRADE * price
            best = costs.argmin(axis=0)[None]
            cost[q, parity] = np.take_along_axis(costs, best, 0)[0]
            index[q, parity] = np.take_along_axis(k, best, 0)[0]
    total = np.full((8, *c.shape[1:]), np.inf)
    total[0] = 0.0
    came = np.zeros((len(c), *total.shape), dtype=np.int8)
    for r in range(len(c)):
        one, two = (total[_STATE[:, i]] + cost[_OF[_STATE[:, i]], _PARITY[:, i], r] for i in (0, 1))
        came[r], total = two < one, np.minimum(one, two)
    state, k, quantiser = total.argmin(axis=0), np.empty_like(level), np.empty_like(level)
    axis, patch = np.indices(c.shape[1:])
    for r in range(len(c) - 1, -1, -1):  # follow the chosen path back to its start
        state, parity = _BEFORE[state, came[r, state, axis, patch]].transpose(2, 0, 1)
        quantiser[r] = _OF[state]
        k[r] = index[quantiser[r], parity, r, axis, patch]
    k = np.where(c < 0, -k, k)
    return k, 2 * k - quantiser * np.sign(k)


def code_block(coder: Coder, tables: Tables, shape: tuple[int, int, int], k: IntArray | None = None) -> IntArray:
    """Write or read indices (rows, 3, patches) up to the last row not zero or not cut off; return the multiples."""
    out = np.zeros(shape, dtype=np.int64)
    given = np.zeros_like(out) if k is None else k
    try:
        used = coder.unsigned(int(np.flatnonzero(given.any(axis=(1, 2))).max(initial=-1)) + 1)
        if used > len(out):
            raise CorruptStreamError("a block has more rows than its patches have modes")
        contexts, states = Contexts(shape[2]), np.zeros(shape[1:], dtype=np.int64).tolist()
        for row in range(used):
            multiples: list[list[int]] = [[], [], []]
            lists = states, contexts.classes().tolist(), given[row].tolist(), multiples
            for state, levels, indices, into in zip(*lists, strict=True):
                for p, level in enumerate(levels):
                    quantiser = QUANTISER[state[p]]
                    index = tables.code(coder, level, quantiser, indices[p])
                    into.append(2 * index - quantiser * ((index > 0) - (index < 0)))
                    state[p] = NEXT[state[p]][index & 1]
            if coder.ended:
                break
            out[row] = multiples
            contexts.learn(np.abs(out[row]))
    except CorruptStreamError:
        if not coder.ended:
            raise
    return out
