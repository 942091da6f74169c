"""The files that meet a target: the search for the unit, for the spectral codec and for Draco."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spectral_notes._checks import FloatArray
from spectral_notes.compression import sgn_format as sgn
from spectral_notes.compression.coefficients import Encoder, Head, Quantised, Shape, meet
from spectral_notes.compression.connectivity import (
    DRACO_HEADER,
    MAX_VERTICES,
    draco_decode,
    draco_encode,
    encode_connectivity,
)
from spectral_notes.compression.corrections import encode_corrections, grid
from spectral_notes.geometry.mesh_distances import surface_error, vertex_error
from spectral_notes.meshes import TriangleMesh

TANGENTIAL = {"vertex": 1, "surface": 4}  # how much coarser positions are kept along the surface
Found = list[tuple[bytes, float]]  # files and their errors


@dataclass(frozen=True)
class Target:
    """What the file must meet; errors in percent of the diagonal."""

    error: float | None
    rate: float | None
    bound: float | None


class Job:
    """A mesh in the decoder's numbering, with the measure of error that was asked for."""

    def __init__(self, mesh: TriangleMesh, quality: str, target: Target) -> None:
        self.mesh = mesh
        self.connectivity = encode_connectivity(mesh.faces, mesh.n_vertices)
        self.vertices: FloatArray = mesh.vertices[self.connectivity.order]
        self.diagonal = float(np.linalg.norm(np.ptp(self.vertices, axis=0)))
        if not 1e-25 < self.diagonal < 1e25:
            raise ValueError(f"mesh must have an extent between 1e-25 and 1e25; its diagonal is {self.diagonal:g}")
        self.quality, self.target = quality, target
        self.original = TriangleMesh(self.vertices, self.connectivity.faces)
        guess = target.error if target.error is not None else 20.0 * 2.0 ** -(target.rate or 0.0)
        self.start = min(guess, 20.0) / 100 * self.diagonal  # a first guess of the error as a length

    def error(self, X: FloatArray) -> float:
        """Error in percent of the diagonal of decoded positions."""
        measure = surface_error if self.quality == "surface" else vertex_error
        return measure(self.original, TriangleMesh(X, self.connectivity.faces))

    def rate(self, data: bytes) -> float:
        """Bits a vertex of a file beyond its connectivity."""
        c = self.connectivity
        return 8 * (len(data) - len(DRACO_HEADER) - len(c.stream) - len(c.mends)) / len(self.vertices)

    def solve(self, make: Callable[[float], tuple[bytes, float]], first: float) -> Found:
        """The file and error at the unit that meets the target, or nothing where no unit does."""
        made: dict[float, tuple[bytes, float]] = {}

        def measure(x: float) -> float:
            made[x] = make(x if self.target.rate is None else 1 / x)
            return made[x][1] if self.target.rate is None else self.rate(made[x][0])

        if self.target.rate is None:
            unit = meet(measure, self.target.error or 0.0, first)
        else:
            unit = meet(measure, self.target.rate, 1 / first)
        return [made[unit]] if unit else []


def spectral_files(job: Job) -> Found:
    """The spectral file that meets the target, and its error."""
    shape = Shape(job.connectivity.faces, len(job.vertices))
    encoder = Encoder(job.vertices, shape, job.start, TANGENTIAL[job.quality])
    c = job.connectivity
    sizes_matter = job.target.rate is not None
    ready: dict[float, tuple[Head, Quantised]] = {}

    def pack(head: Head, q: Quantised) -> bytes:
        corrections = b""
        if job.target.bound is not None:
            bound = job.target.bound / 100 * job.diagonal
            corrections = encode_corrections(job.vertices, encoder.positions(head, q), bound)
        detail = encoder.detail(q)
        return sgn.pack(sgn.Sections(sgn.SPECTRAL, c.mends, c.stream, head.pack(), encoder.base, corrections, detail))

    def make(unit: float) -> tuple[bytes, float]:
        head, q = encoder.quantise(unit)
        if job.quality == "surface":
            error = job.error(encoder.positions(head, q))
        else:
            error = 100 * (encoder.squared_error(head, q) / len(job.vertices)) ** 0.5 / job.diagonal
        ready[error] = head, q
        return pack(head, q) if sizes_matter else b"", error

    found = job.solve(make, 0.9 * job.start)
    return [(data or pack(*ready[error]), error) for data, error in found]


def draco_files(job: Job) -> Found:
    """The Draco file that meets the target, and its error; nothing where Draco loses a vertex or changes a face."""
    c, mesh = job.connectivity, job.mesh
    first = np.unique(c.visited, return_index=True)[1]
    if len(first) < mesh.n_vertices:
        return []
    low, extent = mesh.vertices.min(axis=0), float(np.ptp(mesh.vertices, axis=0).max())
    faithful = True

    def make(step: float) -> tuple[bytes, float]:
        nonlocal faithful
        if job.target.bound is not None:
            step = min(step, grid(job.target.bound / 100 * job.diagonal))
        bits = int(np.clip(np.ceil(np.log2(extent / step + 1) - 1e-6), 1, 30))
        stream = draco_encode(mesh.vertices, mesh.faces, bits, step * (2.0**bits - 1), low)
        points, faces = draco_decode(stream, MAX_VERTICES)
        faithful = faithful and faces.shape == c.cut_faces.shape and bool((faces == c.cut_faces).all())
        data = sgn.pack(sgn.Sections(sgn.DRACO, c.mends, stream))
        return data, job.error(points[np.sort(first)]) if faithful else 0.0

    found = job.solve(make, 2 * job.start)
    for bits in range(1, 21) if job.target.rate is None else ():  # Draco's own choice of a grid may be luckier
        plain = make(extent / (2.0**bits - 1))
        if plain[1] <= (job.target.error or 0.0):
            found.append(plain)
            break
    return found if faithful else []
