"""Positions as integers in spectral bases that the decoder rebuilds: the two halves of the codec, and their search.

Coarse to fine: cell means of a coarse graph in its eigenbasis, lifted to a smooth surface; then what is left, in frames
of that surface, in the eigenbasis of each patch. Everything up to the smooth surface is the *base*.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression.basis import Transform, frames, hierarchy, lift, make_transform
from spectral_notes.compression.contexts import Tables, classify, decode_block, encode_block
from spectral_notes.compression.patches import adjacency
from spectral_notes.compression.prices import PRICES
from spectral_notes.compression.range_coder import CorruptStreamError, RangeDecoder, RangeEncoder
from spectral_notes.compression.trellis import best_path, multiple

RADIUS = 3  # cells of about fifteen vertices
TOP = 700  # largest graph that is decomposed whole
SIZE = 500  # largest patch
LIFT_WEIGHTS = (0.3, 0.03)
BASE_STEP = 0.0025  # unit of the base in bounding-box diagonals
HEAD = struct.Struct("<ffBB")
TRADE = 0.15  # squared error, in units of the unit, that one bit is worth


@dataclass(frozen=True)
class Head:
    """The numbers of a stream: units of the detail and of the base, how stiff the lift is, the tangential factor."""

    unit: float
    base_unit: float
    stiffness: int
    tangential: int

    def pack(self) -> bytes:
        """The bytes of the head."""
        return HEAD.pack(self.unit, self.base_unit, self.stiffness, self.tangential)

    @staticmethod
    def unpack(data: bytes) -> Head:
        """Read and check a head."""
        unit, base_unit, stiffness, tangential = HEAD.unpack(data)
        if not (1e-30 < unit < 1e30 and 1e-30 < base_unit < 1e30 and stiffness < len(LIFT_WEIGHTS) and tangential):
            raise CorruptStreamError("the head of the file holds numbers that no encoder writes")
        return Head(unit, base_unit, stiffness, tangential)

    @property
    def units(self) -> FloatArray:
        """Units of the detail along normal and tangents."""
        return self.unit * np.array([1.0, self.tangential, self.tangential])


class Shape:
    """What both sides derive from connectivity: graphs, cells, transforms."""

    def __init__(self, faces: IntArray, n: int) -> None:
        self.faces = faces
        W = adjacency(faces, n)
        self.levels, coarsest = hierarchy(W, RADIUS, TOP)
        self.transforms = [make_transform(level.W, SIZE) for level in self.levels]
        self.top = make_transform(coarsest, TOP)

    @property
    def detail(self) -> Transform:
        """The transform of the finest level."""
        return self.transforms[0]


@dataclass(frozen=True, eq=False)
class Quantised:
    """Indices and quantisers of a block of coefficients and the multiples they stand for, all (rows, patches, 3)."""

    k: IntArray
    quantiser: IntArray
    level: IntArray
    value: IntArray


def quantise(c: FloatArray, transform: Transform, guess: FloatArray | None = None) -> Quantised:
    """Choose indices for coefficients (rows, patches, 3) in units, by error and bits together.

    The bits depend on the indices before; a guess of the outcome saves the round that otherwise finds one.
    """
    present = transform.present
    flat = np.where(present[:, :, None], c, np.nan).reshape(len(c), -1)
    value = np.abs(np.rint(c if guess is None else guess)).astype(np.int64)
    k = quantiser = np.zeros_like(value)
    for _ in range(2 if guess is None else 1):
        level = classify(value, present).reshape(len(c), -1)
        k, quantiser = best_path(flat, level, PRICES, TRADE)
        value = np.abs(multiple(k, quantiser)).reshape(c.shape)
    k, quantiser = k.reshape(c.shape), quantiser.reshape(c.shape)
    return Quantised(k, quantiser, classify(value, present), multiple(k, quantiser))


class Encoder:
    """Code positions on a shape: the base once, then the detail at any unit."""

    def __init__(self, vertices: FloatArray, shape: Shape, error: float, tangential: int = 1) -> None:
        self._vertices, self._shape = vertices, shape
        diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        base_unit = float(np.float32(max(BASE_STEP * diagonal, 2 * error)))
        tries = [self._code_base(Head(1.0, base_unit, s, tangential)) for s in range(len(LIFT_WEIGHTS))]
        self.head, self.base, self.surface = min(tries, key=lambda t: float(((vertices - t[2]) ** 2).sum()))
        self.frames = frames(self.surface, shape.faces, shape.detail.patches)
        rest = np.einsum("nij,nj->ni", self.frames, vertices - self.surface)
        self._coefficients = shape.detail.forward(rest)
        self._last: FloatArray | None = None  # the outcome at the unit before, as lengths

    def _code_base(self, head: Head) -> tuple[Head, bytes, FloatArray]:
        """Code the levels from the coarsest on; each is coded against what the decoder will have."""
        shape, weight = self._shape, LIFT_WEIGHTS[head.stiffness]
        means = [self._vertices]
        for level in shape.levels:
            target = level.cells.means(means[-1])
            for _ in range(3):  # the means whose lift comes closest
                target = target + level.cells.means(means[-1] - lift(level, target, weight))
            means.append(target)
        coder, tables = RangeEncoder(), Tables()
        X: FloatArray = np.zeros_like(means[-1])
        for depth in range(len(shape.levels), -1, -1):
            transform = shape.top if depth == len(shape.levels) else shape.transforms[depth]
            if depth < len(shape.levels):
                X = lift(shape.levels[depth], X, weight)
            if depth == 0:
                break
            q = quantise(transform.forward(means[depth] - X) / head.base_unit, transform)
            encode_block(coder, tables, q.k, q.quantiser, q.level, transform.present)
            X += transform.inverse(q.value.astype(np.float64) * head.base_unit)
        return head, coder.finish(), X

    def quantise(self, unit: float) -> tuple[Head, Quantised]:
        """The detail at a unit."""
        head = replace(self.head, unit=float(np.float32(unit)))
        guess = None if self._last is None else self._last / head.units
        q = quantise(self._coefficients / head.units, self._shape.detail, guess)
        self._last = q.value * head.units
        return head, q

    def squared_error(self, head: Head, q: Quantised) -> float:
        """Sum over vertices of the squared distance to the decoded ones; the bases are orthonormal."""
        return float((((self._coefficients - q.value * head.units) ** 2)).sum())

    def detail(self, q: Quantised) -> bytes:
        """The bytes of the detail."""
        coder = RangeEncoder()
        encode_block(coder, Tables(), q.k, q.quantiser, q.level, self._shape.detail.present)
        return coder.finish()

    def positions(self, head: Head, q: Quantised) -> FloatArray:
        """What the decoder will get."""
        rest = self._shape.detail.inverse(q.value * head.units)
        return self.surface + np.einsum("nij,ni->nj", self.frames, rest)


def decode_base(data: bytes, shape: Shape, head: Head) -> FloatArray:
    """The smooth surface (n, 3) of the base."""
    coder, tables, weight = RangeDecoder(data), Tables(), LIFT_WEIGHTS[head.stiffness]
    X: FloatArray = np.zeros((int(shape.top.present.sum()), 3))
    for depth in range(len(shape.levels), -1, -1):
        transform = shape.top if depth == len(shape.levels) else shape.transforms[depth]
        if depth < len(shape.levels):
            X = lift(shape.levels[depth], X, weight)
        if depth == 0:
            break
        q = decode_block(coder, tables, transform.present)
        X += transform.inverse(q.astype(np.float64) * head.base_unit)
    return X


def decode_detail(data: bytes, shape: Shape, head: Head, surface: FloatArray, *, partial: bool) -> FloatArray:
    """The positions (n, 3): the surface and its detail, or as much of it as is there."""
    multiples = decode_block(RangeDecoder(data), Tables(), shape.detail.present, partial=partial)
    rest = shape.detail.inverse(multiples * head.units)
    return surface + np.einsum("nij,ni->nj", frames(surface, shape.faces, shape.detail.patches), rest)


def meet(measure: Callable[[float], float], goal: float, start: float) -> float:
    """Return a unit whose measure is at most the goal and if possible within a percent of it, or 0 if none is found.

    The measure grows with the unit, roughly like a power of it.
    """
    unit, best, slope = start, 0.0, 1.0
    seen: list[tuple[float, float]] = []
    for _ in range(9):
        value = measure(unit)
        if value <= goal:
            best = max(best, unit)
            if value > 0.994 * goal:
                return best
        if seen and value != seen[-1][1] and unit != seen[-1][0] and value > 0 and seen[-1][1] > 0:
            slope = float(np.clip(np.log(value / seen[-1][1]) / np.log(unit / seen[-1][0]), 0.3, 3.0))
        seen.append((unit, value))
        unit *= float(np.clip((0.997 * goal / max(value, 1e-300)) ** (1 / slope), 0.05, 20.0))
    for _ in range(12):
        if best:
            return best
        unit *= 0.6
        best = unit if measure(unit) <= goal else 0.0
    return best
