"""Geometry bits of `.sgn` files against Draco's at the same error, from real files written and read back.

    python benchmarks/compression.py [SHAPE ...] [--surface]

For each shape Draco codes the mesh at its best level with 8, 10 and 12 bits a coordinate; its error is then asked of
`encode`. Printed: Draco's bits a vertex beyond connectivity, and ours as a share of them. Each shape is marked: the
constants of the format were "fitted" to it or a relative; choices of method were made having "seen" it or a relative;
or it is only reported on ("unseen").
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from importlib import resources
from itertools import starmap

import DracoPy
import igl
import numpy as np

from spectral_notes import shapes
from spectral_notes.compression import decode, describe, encode, renumbered
from spectral_notes.compression.connectivity import DRACO_HEADER, draco_decode, draco_encode, encode_connectivity
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
    "doll": ("fitted", lambda: shapes.doll("walk")),
    "egg": ("seen", shapes.egg),
    "potato": ("fitted", shapes.potato),
    "rough goat": ("seen", lambda: roughened(shapes.goat(), 10000, 0.002, 1)),
    "rough doll": ("fitted", lambda: roughened(shapes.doll(), 8000, 0.001, 2)),
    "torus": ("unseen", shapes.torus),
    "rough torus": ("unseen", lambda: roughened(shapes.torus(240, 120), 12000, 0.003, 3)),
    "bracket": ("fitted", shapes.bracket),
    "terrain": ("unseen", shapes.terrain),
    "nut": ("unseen", lambda: bundled("nut")),
    "ant": ("unseen", lambda: bundled("ant")),
    "airplane": ("unseen", lambda: bundled("airplane")),
}


def draco(mesh: TriangleMesh, bits: int) -> tuple[int, int, TriangleMesh]:
    """Bytes of Draco's file, of a file of the same faces whose positions cost nothing, and the decoded mesh."""
    V = mesh.vertices.astype(np.float32)
    extent = float(np.ptp(V, axis=0).max())
    stream = draco_encode(V, mesh.faces, bits, extent, V.min(axis=0))
    points, faces = draco_decode(stream, 1 << 24)
    c = encode_connectivity(mesh.faces, mesh.n_vertices)
    first = np.sort(np.unique(c.visited, return_index=True)[1])
    if len(points) != len(c.visited) or (faces != c.cut_faces).any():
        raise ValueError("Draco changed the faces; merge coinciding vertices first")
    decoded = TriangleMesh(points[first], c.faces)
    return len(stream) + len(DRACO_HEADER), len(c.stream) + len(DRACO_HEADER), decoded


def row(mesh: TriangleMesh, bits: int, quality: str) -> dict[str, float]:
    """One comparison: Draco at some bits, and our file at the same error."""
    original = renumbered(mesh)
    whole, faces, theirs = draco(mesh, bits)
    measure = surface_error if quality == "surface" else vertex_error
    error = measure(original, theirs)
    out = {"draco": 8 * (whole - faces) / mesh.n_vertices, "error": error}
    for codec in ("spectral", "auto"):
        start = time.process_time()
        data = encode(mesh, error=error * (1 + 1e-9), quality=quality, codec=codec)
        middle = time.process_time()
        ours = decode(data)
        out[f"{codec} encode s"], out[f"{codec} decode s"] = middle - start, time.process_time() - middle
        if measure(original, ours) > error * (1 + 1e-6):
            raise AssertionError("the file does not meet its error")
        out[codec] = (len(data) - faces) / (whole - faces)
        out[f"{codec} codec"] = float(describe(data).codec == "spectral")
    for name, f in (("hausdorff", hausdorff_error), ("normals", normal_deviation)):
        out[name] = f(original, ours) / f(original, theirs)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("shapes", nargs="*", default=[], help=f"some of {', '.join(SHAPES)}; all if none is named")
    parser.add_argument("--surface", action="store_true", help="compare surface errors instead of vertex errors")
    arguments = parser.parse_args()
    quality = "surface" if arguments.surface else "vertex"
    print(f"quality {quality}; Draco level 10 through DracoPy {getattr(DracoPy, '__version__', '')}")
    print("shape, vertices, seen before | bits: Draco bits a vertex, spectral, auto; Hausdorff, normals; seconds")
    for name in arguments.shapes or SHAPES:
        seen, make = SHAPES[name]
        mesh = make()
        rows = list(starmap(row, ((mesh, bits, quality) for bits in BITS)))
        for bits, r in zip(BITS, rows, strict=True):
            print(
                f"{name:11s} {mesh.n_vertices:6d} {seen:6s} | {bits:2d}: {r['draco']:6.2f} {r['spectral']:6.3f} "
                f"{r['auto']:6.3f}; {r['hausdorff']:5.2f} {r['normals']:5.2f}; "
                f"{r['spectral encode s']:.1f} {r['spectral decode s']:.1f}",
                flush=True,
            )
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


if __name__ == "__main__":
    main()
