"""Positions, centred and of size one, as a stream of integers and back.

Coarse to fine: cell means of a coarse graph in its eigenbasis, lifted to a smooth surface (the *base*); then what is
left, along the axes or along the normals and tangents of that surface, in the eigenbasis of each patch (the *detail*);
then corrections of the few vertices that are still too far away.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.bases import Level, frames
from spectral_notes.compression.coefficients import Tables, code_block, quantise
from spectral_notes.compression.range_coder import Coder, CorruptStreamError

SOFTNESS = (2, 4, 6, 8)  # of the lift: what the encoder tries
BASE_UNIT = 0.0025  # smallest unit of the base
Block = tuple[NDArray[np.bool_], IntArray]  # where coefficients are, and their indices
AXES, FRAMES, SLIDING = 0, 1, 2  # the detail is measured along axes, in frames of the base, or coarsely in tangents


def step_of(code: int) -> float:
    """The step that 16 bits stand for: 2^(4 - code / 1024)."""
    return float(2.0 ** (4 - code / 1024))


def code_of(step: float) -> int:
    """The code of the largest step that is not larger."""
    return int(np.clip(np.ceil(1024 * (4 - np.log2(step)) - 1e-9), 0, 65535))


@dataclass(frozen=True)
class Head:
    """What the decoder is told: codes of the units of detail and base, softness of lifts, directions of the detail."""

    unit: int = 0
    base: int = 0
    softness: int = 0
    directions: int = 0

    def code(self, coder: Coder) -> Head:
        """Write the head, or read one."""
        fields = (16, self.unit), (8, self.base), (6, self.softness), (2, self.directions)
        return Head(*(coder.bits(width, value) for width, value in fields))

    @property
    def units(self) -> FloatArray:
        """Units of the detail along its three directions, (3, 1)."""
        factor = 4 if self.directions == SLIDING else 1
        return step_of(self.unit) * np.array([[1.0], [factor], [factor]])

    def surface(self, levels: list[Level], multiples: Callable[[int, FloatArray], IntArray]) -> FloatArray:
        """The base: each level's cell means, corrected by multiples of the unit, are lifted to the next finer level."""
        X: FloatArray = np.zeros((len(levels[-1].label), 3))
        for depth in range(len(levels) - 1, 0, -1):
            c = multiples(depth, X) * step_of(256 * self.base)
            X = levels[depth - 1].lift(X + levels[depth].inverse(c.astype(np.float64)), self.softness)
        return X


def corrected(coder: Coder, x: FloatArray, gap: FloatArray, far: IntArray, bound: float) -> FloatArray:
    """Write, or read, displacements that bring the vertices `far` within a bound; return the corrected positions."""
    x, at, count = x.copy(), -1, coder.unsigned(len(far))
    if count > len(x):
        raise CorruptStreamError("the corrections are more than there are vertices")
    code = coder.bits(16, code_of(bound * 2 * 0.99 / 3**0.5)) if count else 0
    for i in range(count):
        at += 1 + coder.unsigned(0 if coder.reading else int(far[i]) - at - 1)
        if at >= len(x):
            raise CorruptStreamError("the corrections name a vertex that is not there")
        steps = np.rint(gap[at] / step_of(code)).astype(np.int64).tolist()
        x[at] += step_of(code) * np.array([coder.signed(step) for step in steps])
    return x


class Encoder:
    """Code positions (n, 3): the base once, then the detail at any unit."""

    def __init__(
        self, front: Coder, x: FloatArray, faces: IntArray, levels: list[Level], error: float, quality: int
    ) -> None:
        base = code_of(max(BASE_UNIT, 2 * error)) // 256
        tries = [_code_base(Head(0, base, softness), x, levels) for softness in SOFTNESS]
        head, self._blocks, self._surface = min(tries, key=lambda t: float(((x - t[2]) ** 2).sum()))
        self._front, self._level = front, levels[0]
        price = np.inf
        for directions in (SLIDING,) if quality else (AXES, FRAMES):
            D = directions_of(directions, self._surface, faces, levels[0])
            c = levels[0].forward(np.einsum("nij,nj->ni", D, x - self._surface))
            bits = float(np.log2(1 + (c / error) ** 2).sum())  # about
            if bits < price:
                price, self._directions, self._c = bits, D, c
                self.head = replace(head, directions=directions)
        self._last: FloatArray | None = None  # the outcome at the unit before, as lengths

    def quantise(self, unit: float) -> tuple[Head, IntArray, FloatArray]:
        """The indices of the detail at a unit, and the positions (n, 3) that the decoder will get from them."""
        head = replace(self.head, unit=code_of(unit))
        guess = None if self._last is None else self._last / head.units
        k, value = quantise(self._c / head.units, self._level.present, guess)
        self._last = value * head.units
        return head, k, place(self._surface, self._directions, self._level, self._last)

    def stream(self, head: Head, k: IntArray) -> Coder:
        """The coder after front, head, base and detail."""
        coder, tables = copy.deepcopy(self._front), Tables()
        head.code(coder)
        for present, indices in (*self._blocks, (self._level.present, k)):
            code_block(coder, tables, present, indices)
        return coder


def _code_base(head: Head, x: FloatArray, levels: list[Level]) -> tuple[Head, list[Block], FloatArray]:
    """The blocks of the base, and its surface; each level is coded against what the decoder will have."""
    means, blocks = [x], []
    for level in levels[:-1]:
        target = level.means(means[-1])
        target += level.means(means[-1] - level.lift(target, head.softness))  # so that the lift comes closer
        means.append(target)

    def code(depth: int, X: FloatArray) -> IntArray:
        k, value = quantise(levels[depth].forward(means[depth] - X) / step_of(256 * head.base), levels[depth].present)
        blocks.append((levels[depth].present, k))
        return value

    return head, blocks, head.surface(levels, code)


def decode_positions(coder: Coder, faces: IntArray, levels: list[Level]) -> FloatArray:
    """The positions (n, 3), or as much of them as is there."""
    head, tables = Head().code(coder), Tables()

    def read(depth: int, _: FloatArray | None = None) -> IntArray:
        return code_block(coder, tables, levels[depth].present)

    surface = head.surface(levels, read)
    D = directions_of(head.directions, surface, faces, levels[0])
    x = place(surface, D, levels[0], read(0) * head.units)
    return x if coder.cut else corrected(coder, x, np.zeros_like(x), np.zeros(0, dtype=np.int64), 1.0)


def directions_of(kind: int, surface: FloatArray, faces: IntArray, level: Level) -> FloatArray:
    """The directions (n, 3, 3) that the detail is measured along."""
    return np.broadcast_to(np.eye(3), (len(surface), 3, 3)) if kind == AXES else frames(surface, faces, level.patches)


def place(surface: FloatArray, D: FloatArray, level: Level, detail: FloatArray) -> FloatArray:
    """The surface moved along directions."""
    return surface + np.einsum("nij,ni->nj", D, level.inverse(detail))
