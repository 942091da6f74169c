"""The files that meet a target: the search for the unit, for the spectral codec and for Draco."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import igl
import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression import connectivity as draco
from spectral_notes.compression.bases import Level, hierarchy
from spectral_notes.compression.file_format import Place, front, pack
from spectral_notes.compression.positions import Encoder, Head, corrected
from spectral_notes.compression.range_coder import Coder
from spectral_notes.geometry.mesh_distances import surface_error
from spectral_notes.meshes import TriangleMesh

QUALITIES = ("vertex", "surface")
TAIL = (2.2, 5.0)  # the largest distance of surfaces by default, per root mean square error, by quality
FINEST = 22  # bits a coordinate that Draco's float32 can carry
Found = list[tuple[bytes, float]]  # files and their errors


@dataclass(frozen=True)
class Target:
    """What the file must meet; errors in percent of the diagonal. The rate counts where no error is given."""

    error: float | None
    rate: float
    bound: float | None

    @property
    def guess(self) -> float:
        """About the error, as a fraction of the diagonal."""
        return 0.2 * 2.0 ** -min(self.rate, 20.0) if self.error is None else min(self.error / 100, 0.2)


class Job:
    """A mesh in the decoder's numbering, centred and of size one, with the measure of error that was asked for."""

    def __init__(self, mesh: TriangleMesh, quality: str, target: Target) -> None:
        self.connectivity = draco.encode_connectivity(mesh.faces, mesh.n_vertices)
        self.place = Place.of(mesh.vertices)
        self.faces, self.moved = mesh.faces, self.place.shrink(mesh.vertices)
        self.x = self.moved[self.connectivity.order]
        self.diagonal = float(np.linalg.norm(np.ptp(self.x, axis=0)))
        self.quality, self.target = QUALITIES.index(quality), target

    @cached_property
    def levels(self) -> list[Level]:
        """The bases that follow from the faces."""
        return hierarchy(self.connectivity.faces, len(self.x))

    def error(self, x: FloatArray) -> float:
        """Error in percent of the diagonal of decoded positions."""
        if self.quality == 0:
            return float(100 * np.sqrt(((x - self.x) ** 2).sum(axis=1).mean())) / self.diagonal
        original, decoded = (TriangleMesh(y, self.connectivity.faces) for y in (self.x, x))
        return surface_error(original, decoded)

    def far(self, x: FloatArray) -> tuple[IntArray, float]:
        """The vertices to correct and the bound: of vertices if one was asked for, else of the surfaces' distance."""
        bound = (self.target.bound or TAIL[self.quality] * self.error(x)) / 100 * self.diagonal
        if self.target.bound:
            return np.flatnonzero(((self.x - x) ** 2).sum(axis=1) > (0.999 * bound) ** 2), bound
        faces, n = self.connectivity.faces, len(x)
        far = np.zeros(n + len(faces), dtype=bool)
        for one, two in ((self.x, x), (x, self.x)):
            points = np.r_[one, one[faces].mean(axis=1)]
            far |= igl.point_mesh_squared_distance(points, two, faces)[0] > (0.999 * bound) ** 2
        return np.union1d(np.flatnonzero(far[:n]), faces[far[n:]].ravel()), bound

    def front(self, spectral: bool) -> Coder:
        """A coder that has written what comes before any position."""
        coder = Coder()
        front(coder, self.place, self.connectivity.mends, spectral, draco.MAX_VERTICES)
        return coder

    def step(self, error: Callable[[float], float], write: Callable[[float], bytes], per_error: float) -> float:
        """The step that meets the target, or 0 where none does; error and size grow and fall with it."""
        if self.target.error is not None:
            return meet(error, self.target.error, per_error * self.target.guess * self.diagonal)
        size, start = draco.size_of(self.connectivity), 1 / (per_error * self.target.guess)
        inverse = meet(lambda x: 8 * (len(write(1 / x)) - size) / len(self.x), self.target.rate, start)
        return 1 / inverse if inverse else 0.0


def spectral_files(job: Job) -> Found:
    """The spectral file that meets the target, and its error."""
    c, target = job.connectivity, job.target
    encoder = Encoder(job.front(True), job.x, c.faces, job.levels, target.guess, job.quality)

    @lru_cache
    def coded(unit: float) -> tuple[Head, IntArray, FloatArray, float]:
        head, k, x = encoder.quantise(unit)
        return head, k, x, job.error(x)

    @lru_cache
    def write(unit: float) -> bytes:
        head, k, x, _ = coded(unit)
        coder = encoder.stream(head, k)
        corrected(coder, x, job.x - x, *job.far(x))
        return pack(c.stream, coder.finish())

    unit = job.step(lambda unit: coded(unit)[3], write, 0.9)
    return [(write(unit), coded(unit)[3])] if unit else []


def draco_files(job: Job) -> Found:
    """Draco's files that meet the target, and their errors; nothing where Draco loses a vertex."""
    c, bound, goal = job.connectivity, job.target.bound, job.target.error
    low, extent = job.moved.min(axis=0).astype(np.float32), float(np.ptp(job.moved, axis=0).max()) * (1 + 1e-6)
    finest = extent / (2.0**FINEST - 1)
    coarsest = np.inf if bound is None else bound / 100 * job.diagonal * 2 * 0.99 / 3**0.5

    @lru_cache
    def error(step: float) -> float:
        rounded = low + np.floor((job.x - low) / step + 0.5) * step
        return job.error(rounded.astype(np.float32).astype(np.float64)) if finest <= step <= coarsest else np.inf

    @lru_cache
    def write(step: float, level: int = draco.BEST) -> bytes:
        bits = int(np.clip(np.ceil(np.log2(extent / step + 1) - 1e-6), 1, FINEST))
        stream = draco.draco_encode(job.moved, job.faces, bits, max(step, finest) * (2.0**bits - 1), low, level)
        return pack(stream, job.front(False).finish())

    if len(c.first) < len(c.order):
        return []
    steps = [job.step(error, write, 1.8)]
    if goal is not None:  # Draco's own choice of a grid may be luckier
        grids = extent / (2.0 ** np.arange(1, FINEST + 1) - 1)
        steps += [g for g in grids[grids < goal / 25 * job.diagonal][:2] if error(g) <= goal]
    steps = [s for s in steps if s and error(s) < np.inf]
    return [(write(s, level), error(s)) for s in steps for level in (draco.BEST, draco.BEST - 1)]


def meet(measure: Callable[[float], float], goal: float, start: float) -> float:
    """Return a step whose measure is at most the goal and if possible within a percent of it, or 0 if none is found.

    The measure grows with the step, roughly like a power of it.
    """
    step, best, slope, before = start, 0.0, 1.0, (0.0, 0.0)
    for _ in range(9):
        value = measure(step)
        if value <= goal:
            best = max(best, step)
            if value > 0.994 * goal:
                return best
        if value not in (0.0, np.inf, before[1]) and before[1] not in (0.0, np.inf):
            slope = float(np.clip(np.log(value / before[1]) / np.log(step / before[0]), 0.3, 3.0))
        before = step, value
        step *= float(np.clip((0.997 * goal / max(value, 1e-300)) ** (1 / slope), 0.05, 20.0))
        step = min(max(step, 1e-12), 1e12)
        if step == before[0]:
            break
    for _ in range(0 if best else 12):
        step *= 0.6
        if measure(step) <= goal:
            return step
    return best
