"""The files that meet a target: the search for the unit, for the spectral codec and for Draco."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, lru_cache

import igl
import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.compression import connectivity as draco
from spectral_notes.compression.bases import Domain
from spectral_notes.compression.coefficients import Tables, code_block, quantise
from spectral_notes.compression.file_format import Place, front, pack
from spectral_notes.compression.positions import Head, chosen, code_of, corrected
from spectral_notes.compression.range_coder import Coder
from spectral_notes.geometry.mesh_distances import surface_error
from spectral_notes.meshes import TriangleMesh

QUALITIES = ("vertex", "surface")
TAIL = 1.45  # the largest distance of surfaces by default, per that of Draco's grid of about the same error
STEP = (2.0, 4.7)  # of a grid, per its error, by quality, about
FINEST = 22  # bits a coordinate that Draco's float32 can carry
Found = list[tuple[bytes, float]]  # files and their errors


class Job:
    """A mesh as the decoder numbers it, centred and of size one, and what to meet: errors in percent, or a rate."""

    def __init__(self, mesh: TriangleMesh, quality: int, goal: float | None, rate: float, bound: float | None) -> None:
        self.connectivity = draco.encode_connectivity(mesh.faces, mesh.n_vertices)
        self.place = Place.of(mesh.vertices)
        self.faces, self.moved = mesh.faces, self.place.shrink(mesh.vertices)
        self.x = self.moved[self.connectivity.order]
        self.diagonal = float(np.linalg.norm(np.ptp(self.x, axis=0)))
        self.quality, self.goal, self.rate, self.bound = quality, goal, rate, bound
        self.guess = 0.2 * 2.0 ** -min(rate, 20.0) if goal is None else min(goal / 100, 0.2)  # of the error, about

    @cached_property
    def domain(self) -> Domain:
        """The bases that follow from the faces."""
        return Domain(self.connectivity.faces, len(self.x))

    def error(self, x: FloatArray) -> float:
        """Error in percent of the diagonal of decoded positions."""
        if self.quality == 0:
            return float(100 * np.sqrt(((x - self.x) ** 2).sum(axis=1).mean())) / self.diagonal
        original, decoded = (TriangleMesh(y, self.connectivity.faces) for y in (self.x, x))
        return surface_error(original, decoded)

    def far(self, x: FloatArray) -> tuple[IntArray, float]:
        """The vertices to correct and the bound: of vertices if one was asked for, else of the surfaces' distance."""
        percent = self.diagonal / 100
        if self.bound:
            gap, bound = np.linalg.norm(self.x - x, axis=1), self.bound * percent
        else:
            low, extent = self.x.min(axis=0), np.ptp(self.x, axis=0).max()
            error = max(self.error(x), 1e-12) * percent
            step = extent / (2 ** max(np.rint(np.log2(extent / (STEP[self.quality] * error) + 1)), 1) - 1)
            grid = low + np.rint((self.x - low) / step) * step
            tail = self.gaps(grid).max() / max(self.error(grid) * percent, 1e-300)
            gap, bound = self.gaps(x), TAIL * max(tail, 1.0) * error  # a grid may be exact
        return np.flatnonzero(gap > 0.999 * bound), bound

    def gaps(self, x: FloatArray) -> FloatArray:
        """How far each vertex lies from the surface it should be on, or its own place from the surface decoded."""
        pairs = (self.x, x), (x, self.x)
        return np.sqrt(np.max([igl.point_mesh_squared_distance(*p, self.connectivity.faces)[0] for p in pairs], axis=0))

    def front(self, spectral: bool) -> Coder:
        """A coder that has written what comes before any position."""
        front(coder := Coder(), self.place, self.connectivity.mends, spectral, draco.MAX_VERTICES)
        return coder

    def step(self, error: Callable[[float], float], write: Callable[[float], bytes], per_error: float) -> float:
        """The step that meets the target, or 0 where none does; error and size grow and fall with it."""
        if self.goal is not None:
            return meet(error, self.goal, per_error * self.guess * self.diagonal)
        size, start = draco.size_of(self.connectivity), 1 / (per_error * self.guess)
        inverse = meet(lambda x: 8 * (len(write(1 / x)) - size) / len(self.x), self.rate, start)
        return 1 / inverse if inverse else 0.0


def spectral_files(job: Job) -> Found:
    """The spectral file that meets the target, and its error."""
    domain = job.domain
    start, base, surface, frame, detail = chosen(job.x, domain, job.guess, job.quality)

    @lru_cache
    def coded(unit: float) -> tuple[Head, IntArray, FloatArray, float]:
        head = replace(start, unit=code_of(unit))
        k, value = quantise(detail / head.units)
        x = head.place(domain, surface, frame, value)
        return head, k, x, job.error(x)

    @lru_cache
    def write(unit: float) -> bytes:
        head, k, x, _ = coded(unit)
        coder, tables = job.front(True), Tables()
        head.code(coder)
        code_block(coder, tables, domain.coarse.shape, base)
        code_block(coder, tables, domain.fine.shape, k)
        corrected(coder, x, job.x - x, *job.far(x))
        return pack(job.connectivity.stream, coder.finish())

    unit = job.step(lambda unit: coded(unit)[3], write, 0.9)
    return [(write(unit), coded(unit)[3])] if unit else []


def draco_files(job: Job) -> Found:
    """Draco's files that meet the target, and their errors; nothing where Draco loses a vertex."""
    c, goal = job.connectivity, job.goal
    low, extent = job.moved.min(axis=0).astype(np.float32), float(np.ptp(job.moved, axis=0).max()) * (1 + 1e-6)
    finest = extent / (2.0**FINEST - 1)
    coarsest = np.inf if job.bound is None else job.bound / 100 * job.diagonal * 2 * 0.99 / 3**0.5

    @lru_cache
    def error(step: float) -> float:
        step = max(step, finest)
        rounded = low + np.floor((job.x - low) / step + 0.5) * step
        return job.error(rounded.astype(np.float32).astype(np.float64)) if step <= coarsest else np.inf

    @lru_cache
    def write(step: float, level: int = draco.BEST) -> bytes:
        bits = int(np.clip(np.ceil(np.log2(extent / step + 1) - 1e-6), 1, FINEST))
        stream = draco.draco_encode(job.moved, job.faces, bits, max(step, finest) * (2.0**bits - 1), low, level)
        return pack(stream, job.front(False).finish())

    if c.mends.lone:
        return []
    steps = [job.step(error, write, 1.8)]
    if goal is not None:  # Draco's own choice of a grid may be luckier
        grids = extent / (2.0 ** np.arange(1, FINEST + 1) - 1)
        steps += [g for g in grids[grids < goal / 25 * job.diagonal][:2] if error(g) <= goal]
    steps = [s for s in steps if s and error(s) < np.inf]
    return [(write(s, level), error(s)) for s in steps for level in (draco.BEST, draco.BEST - 1)]


def meet(measure: Callable[[float], float], goal: float, start: float) -> float:
    """A step whose measure, about a power of it, is at most the goal and if possible within a percent; 0 if none."""
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
