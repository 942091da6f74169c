"""Geometry bits of `.sgn` files against Draco's at the same error, from real files written and read back.

    python benchmarks/compression.py [SHAPE ...] [--surface]

For each shape Draco codes the mesh at level 10 with 8, 10 and 12 bits a coordinate; its error is then asked of `encode`
and of an idealised Karni-Gotsman coder. Printed: Draco's bits a vertex beyond connectivity, and the others' as a share
of them. Each shape is marked: choices of method were made having "seen" it or a relative, or it is only reported on.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from importlib import resources

import DracoPy
import igl
import numpy as np

from spectral_notes import shapes
from spectral_notes.compression import decode, describe, encode, renumbered
from spectral_notes.compression.bases import graph, partition
from spectral_notes.compression.connectivity import draco_decode, draco_encode, encode_connectivity
from spectral_notes.files.mesh_files import read_mesh
from spectral_notes.geometry.mesh_distances import hausdorff_error, normal_deviation, surface_error, vertex_error
from spectral_notes.meshes import TriangleMesh, clean_mesh

BITS = (8, 10, 12)


def bundled(name: str) -> TriangleMesh:
    """A model that ships with PyVista, coinciding vertices merged."""
    mesh = read_mesh(resources.files("pyvista") / "examples" / f"{name}.ply")
    points, at = np.unique(mesh.vertices.astype(np.float32), axis=0, return_inverse=True)
    return clean_mesh(points.astype(np.float64), at.ravel()[mesh.faces])


def roughened(mesh: TriangleMesh, n_faces: int, amplitude: float, seed: int) -> TriangleMesh:
    """A stand-in for a scan: bumps of many sizes, then irregular decimation."""
    rng, V = np.random.default_rng(seed), mesh.vertices
    size = np.linalg.norm(np.ptp(V, axis=0))
    height = np.zeros(len(V))
    for wavelength in np.geomspace(0.01, 0.3, 60) * size:
        direction = rng.normal(size=3)
        direction *= 2 * np.pi / wavelength / np.linalg.norm(direction)
        height += wavelength * np.sin(V @ direction + rng.uniform(0, 2 * np.pi))
    height *= amplitude * size / height.std()
    normals = igl.per_vertex_normals(V, mesh.faces)
    U, F = igl.decimate(V + height[:, None] * normals, mesh.faces, n_faces)[:2]
    return TriangleMesh(U, F)


SHAPES: dict[str, tuple[str, Callable[[], TriangleMesh]]] = {
    "goat": ("seen", shapes.goat),
    "doll": ("seen", lambda: shapes.doll("walk")),
    "egg": ("seen", shapes.egg),
    "potato": ("seen", shapes.potato),
    "rough goat": ("seen", lambda: roughened(shapes.goat(), 10000, 0.002, 1)),
    "rough doll": ("seen", lambda: roughened(shapes.doll(), 8000, 0.001, 2)),
    "torus": ("seen", shapes.torus),
    "rough torus": ("unseen", lambda: roughened(shapes.torus(240, 120), 12000, 0.003, 3)),
    "bracket": ("seen", shapes.bracket),
    "terrain": ("unseen", shapes.terrain),
    "nut": ("unseen", lambda: bundled("nut")),
    "ant": ("unseen", lambda: bundled("ant")),
    "airplane": ("seen", lambda: bundled("airplane")),
}


def draco(mesh: TriangleMesh, bits: int) -> tuple[float, float, TriangleMesh]:
    """Draco's bits a vertex beyond connectivity at levels 10 and 9, and the decoded mesh."""
    V, c = mesh.vertices.astype(np.float32), encode_connectivity(mesh.faces, mesh.n_vertices)
    grid = bits, float(np.ptp(V, axis=0).max()), V.min(axis=0)
    streams = [draco_encode(mesh.vertices, mesh.faces, *grid, level) for level in (10, 9)]
    points, faces = draco_decode(streams[0])
    if len(points) != len(c.first) + len(c.mends.again) or (faces != c.cut_faces).any():
        raise ValueError("Draco changed the faces; merge coinciding vertices first")
    rates = [8 * (len(stream) - len(c.stream)) / mesh.n_vertices for stream in streams]
    return rates[0], rates[1], TriangleMesh(points[c.first], c.faces)


class KarniGotsman:
    """The coder of Karni and Gotsman (2000), idealised: patches, their spectra, one step, and an entropy for free.

    Patches of at most 500 vertices, the eigenvectors of D - W of each, coefficients rounded to one step. Rows of all
    patches are counted by bands that double in width up to 32; in a band p(q) ~ x^|q|, and nobody pays for x.
    """

    def __init__(self, mesh: TriangleMesh, size: int = 500) -> None:
        V, F, n = mesh.vertices, mesh.faces, mesh.n_vertices
        self.n, self.diagonal = n, np.linalg.norm(np.ptp(V, axis=0))
        W = graph(F.ravel(), F[:, [1, 2, 0]].ravel(), n)
        self.spectra = []
        for patch in partition(W, size):
            A = W[patch][:, patch].toarray()
            B = np.linalg.eigh(np.diag(A.sum(axis=1)) - A)[1]
            self.spectra.append(B.T @ (V[patch] - V.mean(axis=0)))

    def point(self, step: float) -> tuple[float, float]:
        """Bits a vertex and error in percent of the diagonal."""
        integers = [np.rint(c / step) for c in self.spectra]
        squares = sum(((c - step * q) ** 2).sum() for c, q in zip(self.spectra, integers, strict=True))
        rows, bits, start, width = max(map(len, integers)), 0.0, 0, 1
        while start < rows:
            size = np.abs(np.concatenate([q[start : start + width] for q in integers]))
            m = max(size.mean(), 1e-3)
            x = m / (1 + np.sqrt(1 + m * m))
            bits -= size.size * np.log2((1 - x) / (1 + x)) + size.sum() * np.log2(x)
            start, width = start + width, min(2 * width, 32)
        return bits / self.n, 100 * (squares / self.n) ** 0.5 / self.diagonal

    def rate(self, error: float) -> float:
        """Bits a vertex at an error: the coarsest step that meets it, by bisection."""
        low, high = error * self.diagonal / 1000, error * self.diagonal / 2
        for _ in range(25):
            middle = (low * high) ** 0.5
            low, high = (middle, high) if self.point(middle)[1] <= error else (low, middle)
        return self.point(low)[0]


def row(mesh: TriangleMesh, kg: KarniGotsman, bits: int, quality: str) -> dict[str, float]:
    """One comparison: Draco at some bits, and the others at the same error."""
    original = renumbered(mesh)
    ten, nine, theirs = draco(mesh, bits)
    measure = surface_error if quality == "surface" else vertex_error
    error = measure(original, theirs)
    out = {"draco": ten, "nine": nine / ten, "kg": kg.rate(vertex_error(original, theirs)) / ten}
    for codec in ("spectral", "auto"):
        start = time.process_time()
        data = encode(mesh, error=error * (1 + 1e-9), quality=quality, codec=codec)
        middle = time.process_time()
        ours = decode(data)
        out[f"{codec} encode s"], out[f"{codec} decode s"] = middle - start, time.process_time() - middle
        if measure(original, ours) > error * (1 + 1e-6):
            raise AssertionError("the file does not meet its error")
        out[codec] = describe(data).geometry_bits_per_vertex / ten
        for name, f in (("hausdorff", hausdorff_error), ("normals", normal_deviation)):
            out[f"{codec} {name}"] = f(original, ours) / f(original, theirs)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("shapes", nargs="*", default=[], help=f"some of {', '.join(SHAPES)}; all if none is named")
    parser.add_argument("--surface", action="store_true", help="compare surface errors instead of vertex errors")
    arguments = parser.parse_args()
    quality = "surface" if arguments.surface else "vertex"
    print(f"quality {quality}; Draco through DracoPy {getattr(DracoPy, '__version__', '')}; CPU seconds")
    print("shape, vertices, seen | bits: Draco 10 bits a vertex; per Draco 10: Draco 9, Karni-Gotsman, spectral, auto;")
    print("    of the spectral file Hausdorff and normals per Draco's; encode, decode")
    table: dict[int, list[dict[str, float]]] = {bits: [] for bits in BITS}
    for name in arguments.shapes or SHAPES:
        seen, make = SHAPES[name]
        mesh = make()
        kg = KarniGotsman(mesh)
        for bits in BITS:
            r = row(mesh, kg, bits, quality)
            table[bits].append(r)
            ratios = " ".join(f"{r[key]:6.3f}" for key in ("nine", "kg", "spectral", "auto"))
            print(
                f"{name:12s} {mesh.n_vertices:6d} {seen:6s} | {bits:2d}: {r['draco']:6.2f} {ratios}; "
                f"{r['spectral hausdorff']:5.2f} {r['spectral normals']:5.2f}; "
                f"{r['spectral encode s']:.2f} {r['spectral decode s']:.2f}",
                flush=True,
            )
    for bits, rows in table.items():
        logs = {key: [np.log(r[key]) for r in rows] for key in ("nine", "kg", "spectral", "auto")}
        means = {key: float(np.exp(np.mean(values))) for key, values in logs.items()}
        worst = max(r["auto"] / min(1.0, r["nine"], r["kg"]) for r in rows)
        tail = max(r["auto hausdorff"] for r in rows)
        print(f"geometric mean at {bits}:", {key: round(value, 3) for key, value in means.items()}, end=" ")
        print(f"auto per the best other: at most {worst:.3f}; auto's Hausdorff per Draco's: at most {tail:.2f}")
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


if __name__ == "__main__":
    main()
