"""Positions, centred and of size one, as a stream of integers and back.

Coarse to fine: the means of cells in the eigenbasis of their graph, lifted to a smooth surface (the *base*); then what
is left, along the axes or along the normals and tangents of that surface, in the eigenbasis of each patch (the
*detail*); then corrections of the few vertices that are still too far away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.bases import Domain
from spectral_notes.compression.coefficients import Tables, code_block, quantise
from spectral_notes.compression.range_coder import Coder, CorruptStreamError

SOFTNESS, SOFTEST = (4, 6), 8  # of the lift: what the encoder tries, and what the fixed steps of the lift can bear
BASE_UNIT = 0.0025  # smallest unit of the base; else it is twice the error
AXES, FRAMES, SLIDING = 0, 1, 2  # the detail is measured along axes, in frames of the base, or coarsely in tangents
DIRECTIONS = ((AXES, FRAMES), (AXES, SLIDING))  # what the encoder tries, by quality
SLIDE, GAIN = 4, 1.5  # how much coarser tangents are when vertices slide, and how much that is worth, about
Choice = tuple["Head", IntArray, FloatArray, FloatArray, FloatArray]


def step_of(code: int) -> float:
    """The step that 16 bits stand for: 2^(4 - code / 1024)."""
    return float(2.0 ** (4 - code / 1024))


def code_of(step: float) -> int:
    """The code of the largest step that is not larger."""
    return int(np.clip(np.ceil(1024 * (4 - np.log2(step)) - 1e-9), 0, 65535))


@dataclass(frozen=True)
class Head:
    """What the decoder is told: codes of the units of detail and base, softness of the lift, directions of detail."""

    unit: int = 0
    base: int = 0
    softness: int = 0
    directions: int = 0

    def code(self, coder: Coder) -> Head:
        """Write the head, or read one."""
        fields = (16, self.unit), (8, self.base), (6, self.softness), (2, self.directions)
        return Head(*(coder.bits(width, value) for width, value in fields))

    def surface(self, domain: Domain, multiples: IntArray) -> FloatArray:
        """The base (n, 3) of coarse multiples."""
        return domain.lift(step_of(256 * self.base) * domain.coarse.inverse(multiples), self.softness)

    def frame(self, domain: Domain, surface: FloatArray) -> FloatArray:
        """The directions (n, 3, 3) that the detail is measured along."""
        return domain.frames(surface) if self.directions else np.broadcast_to(np.eye(3), (len(surface), 3, 3))

    def place(self, domain: Domain, surface: FloatArray, frame: FloatArray, multiples: IntArray) -> FloatArray:
        """The surface moved by the detail of multiples."""
        return surface + np.einsum("nij,ni->nj", frame, domain.fine.inverse(multiples * self.units))

    @property
    def units(self) -> FloatArray:
        """Units of the detail along its three directions, (3, 1)."""
        factor = SLIDE if self.directions == SLIDING else 1
        return step_of(self.unit) * np.array([[1.0], [factor], [factor]])


def chosen(x: FloatArray, domain: Domain, error: float, quality: int) -> Choice:
    """The base of positions (n, 3), and the directions whose detail will take the fewest bits, about.

    A head without unit, the indices of the base, the surface and the frame that follow, and the detail in them.
    """
    base, price, means = code_of(max(BASE_UNIT, 2 * error)) // 256, np.inf, domain.means(x)
    for softness in SOFTNESS:
        target = domain.coarse.forward(means + domain.means(x - domain.lift(means, softness)))
        k, value = quantise(target / step_of(256 * base))
        surface = Head(0, base, softness).surface(domain, value)
        for directions in DIRECTIONS[quality]:
            head = Head(0, base, softness, directions)
            frame = head.frame(domain, surface)
            c = domain.fine.forward(np.einsum("nij,nj->ni", frame, x - surface))
            worth = np.array([[1.0], [GAIN], [GAIN]]) if directions == SLIDING else 1.0
            bits = float(np.log2(1 + (c / worth / error) ** 2).sum())
            if bits < price:
                price, choice = bits, (head, k, surface, frame, c)
    return choice


def decode_positions(coder: Coder, domain: Domain) -> FloatArray:
    """The positions (n, 3), or as much of them as is there."""
    head, tables = Head().code(coder), Tables()
    if head.softness > SOFTEST:
        raise CorruptStreamError("the base is softer than any encoder makes it")
    surface = head.surface(domain, code_block(coder, tables, domain.coarse.shape))
    detail = code_block(coder, tables, domain.fine.shape)
    x = head.place(domain, surface, head.frame(domain, surface), detail)
    return x if coder.cut else corrected(coder, x, np.zeros_like(x), np.zeros(0, dtype=np.int64), 1.0)


def corrected(coder: Coder, x: FloatArray, missed: FloatArray, far: IntArray, bound: float) -> FloatArray:
    """Write, or read, displacements that bring the vertices `far` within a bound; return the corrected positions."""
    x, at, count = x.copy(), -1, coder.unsigned(len(far))
    if count > len(x):
        raise CorruptStreamError("the corrections are more than there are vertices")
    code, low = (coder.bits(16, code_of(bound * 2 * 0.99 / 3**0.5)), len(x) // count) if count else (0, 0)
    low = low.bit_length() - 1  # bits of a gap between two of them that no code shortens
    for i in range(count):
        gap = 0 if coder.reading else int(far[i]) - at - 1
        at += 1 + (coder.unsigned(gap >> low) << low | coder.bits(low, gap))
        if at >= len(x):
            raise CorruptStreamError("the corrections name a vertex that is not there")
        steps = np.rint(missed[at] / step_of(code)).astype(np.int64).tolist()
        x[at] += step_of(code) * np.array([coder.signed(step) for step in steps])
    return x
