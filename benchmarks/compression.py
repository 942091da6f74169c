"""Bits of `.sgn` files against Draco's and Karni and Gotsman's at the same error, and what each part of the codec buys.

    python benchmarks/compression.py [SHAPE ...] [--parts]

For each shape Draco codes the mesh at level 10 with 8, 10 and 12 bits a coordinate; its error is then asked of `encode`
and of an idealised Karni-Gotsman coder. Bits are bits a vertex beyond connectivity, from files that were read back.
What was measured is kept in `benchmarks/compression.json`, shape by shape. Shapes marked "tuned" were looked at while
settings were chosen, as `tuned_and_reported.json` says of goat, doll and persons; the others are only reported on.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import json
import platform
import time
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import igl
import numpy as np

from spectral_notes import shapes
from spectral_notes.compression import bases, coefficients, decode, describe, encode, positions, renumbered, search
from spectral_notes.compression.bases import graph, partition
from spectral_notes.compression.connectivity import draco_decode, draco_encode, encode_connectivity, size_of
from spectral_notes.compression.file_format import VERSION
from spectral_notes.files.mesh_files import read_mesh
from spectral_notes.geometry.mesh_distances import hausdorff_error, normal_deviation, surface_error, vertex_error
from spectral_notes.meshes import TriangleMesh, clean_mesh

FILE = Path(__file__).with_suffix(".json")
BITS = (8, 10, 12)
PART_SHAPES = ("airplane", "rough doll", "goat", "bracket", "person, slim")


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


def persons() -> dict[str, tuple[str, Callable[[], TriangleMesh]]]:
    """All eight bodies, in the halves that were fixed before the first run."""
    halves = json.loads(Path(__file__).with_name("tuned_and_reported.json").read_text())["persons"]
    return {
        f"person, {name}": (half.split("_")[0], lambda name=name: shapes.person(name))
        for half, names in halves.items()
        for name in names
    }


SHAPES: dict[str, tuple[str, Callable[[], TriangleMesh]]] = {
    "goat": ("tuned", shapes.goat),
    "doll": ("reported", lambda: shapes.doll("walk")),
    "egg": ("tuned", shapes.egg),
    "bracket": ("tuned", shapes.bracket),
    "terrain": ("reported", shapes.terrain),
    "torus": ("tuned", shapes.torus),
    "rough goat": ("reported", lambda: roughened(shapes.goat(), 10000, 0.002, 1)),
    "rough doll": ("tuned", lambda: roughened(shapes.doll(), 8000, 0.001, 2)),
    "rough torus": ("reported", lambda: roughened(shapes.torus(240, 120), 12000, 0.003, 3)),
    "airplane": ("tuned", lambda: bundled("airplane")),
    "nut": ("reported", lambda: bundled("nut")),
    "ant": ("tuned", lambda: bundled("ant")),
    **persons(),
}


def draco(mesh: TriangleMesh, bits: int, level: int = 10) -> tuple[float, TriangleMesh]:
    """Draco's bits a vertex beyond connectivity and the decoded mesh."""
    V, c = mesh.vertices.astype(np.float32), encode_connectivity(mesh.faces, mesh.n_vertices)
    grid = bits, float(np.ptp(V, axis=0).max()), V.min(axis=0)
    stream = draco_encode(mesh.vertices, mesh.faces, *grid, level)
    points = np.delete(draco_decode(stream)[0], c.mends.again, axis=0)  # those that repeat a vertex
    if len(points) != mesh.n_vertices:
        raise ValueError("Draco changed the faces; merge coinciding vertices first")
    return 8 * (len(stream) - len(c.stream)) / mesh.n_vertices, TriangleMesh(points, c.faces)


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
        for patch in partition(W, n // -(-n // size)):
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


def timed(function: Callable[..., Any], *arguments: Any, **options: Any) -> tuple[Any, float]:
    """What a function returns, and its CPU seconds."""
    start = time.process_time()
    out = function(*arguments, **options)
    return out, round(time.process_time() - start, 2)


def row(mesh: TriangleMesh, kg: KarniGotsman, bits: int, quality: str) -> dict[str, Any]:
    """One comparison: Draco at some bits, and the others at the same error."""
    original, (theirs_bits, theirs) = renumbered(mesh), draco(mesh, bits)
    measure = surface_error if quality == "surface" else vertex_error
    error = measure(original, theirs)
    target = {"error": error * (1 + 1e-9), "quality": quality}
    data, seconds = timed(encode, mesh, codec="spectral", **target)
    ours, seconds_back = timed(decode, data)
    if measure(original, ours) > error * (1 + 1e-6):
        raise AssertionError("the file does not meet its error")
    spectral = describe(data).geometry_bits_per_vertex
    second = describe(encode(mesh, codec="draco", **target)).geometry_bits_per_vertex
    return {
        "quality": quality, "bits": bits, "error": error, "draco": theirs_bits, "draco 9": draco(mesh, bits, 9)[0],
        "karni-gotsman": kg.rate(vertex_error(original, theirs)) if quality == "vertex" else None,
        "spectral": spectral, "auto": min(spectral, second), "encode s": seconds, "decode s": seconds_back,
        "hausdorff": hausdorff_error(original, ours) / hausdorff_error(original, theirs),
        "normals": normal_deviation(original, ours) / normal_deviation(original, theirs),
    }


def uniform() -> dict[str, Any]:
    """Every other multiple in every state, and the best trade for that."""
    return {"coefficients.QUANTISER": (0,) * 8, "coefficients._OF": np.zeros(8, dtype=int), "coefficients.TRADE": 0.3}


def nothing(domain: bases.Domain, X: np.ndarray) -> np.ndarray:
    """Cell means of zero: a base that says nothing."""
    return np.zeros((int(domain.label.max()) + 1, *X.shape[1:]))


def one_class(contexts: coefficients.Contexts) -> np.ndarray:
    """The same class for every coefficient."""
    return np.full(contexts._own.shape, 12)


PARTS: dict[str, dict[str, Any]] = {
    "all parts": {},
    "no base": {"bases.Domain.means": nothing},
    "one softness of the lift": {"positions.SOFTNESS": (4,)},
    "axes only": {"positions.DIRECTIONS": ((positions.AXES,), (positions.SLIDING,))},
    "frames only": {"positions.DIRECTIONS": ((positions.FRAMES,), (positions.SLIDING,))},
    "patches of 75": {"bases.SIZE": 75},
    "no contexts": {"coefficients.Contexts.classes": one_class},
    "no trellis": uniform(),
    "path by error alone": {"coefficients.TRADE": 0.0},
    "no corrections": {"search.TAIL": np.inf},
}
ROOMS = {"bases": bases, "coefficients": coefficients, "positions": positions, "search": search}


def without(changes: dict[str, Any], mesh: TriangleMesh, errors: list[float]) -> dict[str, Any]:
    """Bits a vertex at each error and the largest distance per error, with parts of the codec changed."""
    kept = {}
    for name, value in changes.items():
        *path, last = name.split(".")
        place: Any = ROOMS[path[0]]
        for step in path[1:]:
            place = getattr(place, step)
        kept[name] = place, last, getattr(place, last)
        setattr(place, last, value)
    try:
        files = [encode(mesh, error=error, codec="spectral") for error in errors]
        original, decoded = renumbered(mesh), [decode(data) for data in files]
    finally:
        for place, last, value in kept.values():
            setattr(place, last, value)
    faces = size_of(encode_connectivity(mesh.faces, mesh.n_vertices))
    return {
        "bits": [8 * (len(data) - faces) / mesh.n_vertices for data in files],
        "largest": [hausdorff_error(original, mesh) / e for mesh, e in zip(decoded, errors, strict=True)],
    }


def keep(report: dict[str, Any]) -> None:
    """Write what was measured."""
    packages = ("numpy", "scipy", "DracoPy", "libigl")
    report["environment"] = {
        "date": datetime.date.today().isoformat(), "machine": platform.machine(), "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in packages},
    }
    FILE.write_text(json.dumps(report, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("shapes", nargs="*", default=[], help=f"some of {', '.join(SHAPES)}; all if none is named")
    parser.add_argument("--parts", action="store_true", help="measure what each part buys instead")
    arguments = parser.parse_args()
    report = json.loads(FILE.read_text()) if FILE.exists() else {"shapes": {}, "parts": {}}
    for name in arguments.shapes or (PART_SHAPES if arguments.parts else SHAPES):
        kind, make = SHAPES[name]
        mesh = make()
        if arguments.parts:
            coarse = vertex_error(renumbered(mesh), draco(mesh, 8)[1])
            errors = [4 * coarse, coarse, *(vertex_error(renumbered(mesh), draco(mesh, bits)[1]) for bits in BITS[1:])]
            report["parts"][name] = {part: without(changes, mesh, errors) for part, changes in PARTS.items()}
            whole = np.array(report["parts"][name]["all parts"]["bits"])
            for part, found in report["parts"][name].items():
                print(f"{name:15s} {part:26s}", (np.array(found["bits"]) / whole).round(3), flush=True)
        else:
            kg = KarniGotsman(mesh)
            rows = [row(mesh, kg, bits, "vertex") for bits in BITS] + [row(mesh, kg, 10, "surface")]
            report["shapes"][name] = {"kind": kind, "vertices": mesh.n_vertices, "format": VERSION, "rows": rows}
            for r in rows:
                shares = [f"{key} {r[key] / r['draco']:.3f}" for key in ("karni-gotsman", "spectral", "auto") if r[key]]
                print(f"{name:15s} {r['quality']} {r['bits']:2d}: {r['draco']:.2f}", *shares, end=" ")
                print(f"{r['hausdorff']:.2f} {r['normals']:.2f} {r['encode s']} {r['decode s']}", flush=True)
        keep(report)
    summary(report["shapes"])


def summary(found: dict[str, Any]) -> None:
    """Geometric means per Draco's bits, of all shapes and of those only reported on, and the worst."""
    for quality, bits in (*(("vertex", bits) for bits in BITS), ("surface", 10)):
        for kinds in (("tuned", "reported"), ("reported",)):
            rows = [r for shape in found.values() if shape["kind"] in kinds for r in shape["rows"]]
            rows = [r for r in rows if (r["quality"], r["bits"]) == (quality, bits)]
            if rows:
                ratios = np.array([[r["spectral"] / r["draco"], r["auto"] / r["draco"]] for r in rows])
                spectral, auto = np.exp(np.log(ratios).mean(axis=0))
                worst = max(r["auto"] / min(r[key] for key in ("draco", "karni-gotsman") if r[key]) for r in rows)
                print(f"{quality} {bits}, {' and '.join(kinds)}: spectral {spectral:.3f}, auto {auto:.3f};", end=" ")
                print(f"auto per the better other at most {worst:.3f};", end=" ")
                print(f"Hausdorff per Draco's at most {max(r['hausdorff'] for r in rows):.2f}")


if __name__ == "__main__":
    main()
