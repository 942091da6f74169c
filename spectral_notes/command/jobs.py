"""What the command line does with a shape of your own: modes, segments, small files, health; each gives a `Result`.

A result is what is said, for people and for programs, and what can be written: functions on the shape and pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_count
from spectral_notes.clustering import cut_pieces
from spectral_notes.command import own_shape
from spectral_notes.command.reports import report_page
from spectral_notes.command.streams import OPTIONS
from spectral_notes.compression import decode, describe, encode, renumbered
from spectral_notes.descriptors import first_nonzero
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.files import write_whole
from spectral_notes.files.arrays import ARRAY_FORMATS, columns, named_arrays, write_arrays
from spectral_notes.files.eigenbasis_files import write_eigenbasis
from spectral_notes.geometry.mending import outward
from spectral_notes.geometry.mesh_distances import vertex_error
from spectral_notes.geometry.mesh_health import health
from spectral_notes.laplacians import Pair
from spectral_notes.matching import match_shapes
from spectral_notes.meshes import PointCloud, Shape, TriangleMesh, positions, signed_volume
from spectral_notes.plotting import plot_views
from spectral_notes.plotting.cameras import Camera
from spectral_notes.plotting.rendering import SurfaceView
from spectral_notes.solver.eigensolver import memory_needed

DEFAULT_MODES = 100
MAP_MODES = 200  # of a map
FORMATS = (*ARRAY_FORMATS, ".png", ".html")
MESH_FORMATS = (".obj", ".off", ".stl", ".ply", ".vtp")

HEALTH_FACTS = (
    "edges", "components", "boundary_loops", "euler_characteristic", "genus", "is_closed", "is_manifold", "volume",
    "crack",
)

Say = Callable[[str], None]


@dataclass(frozen=True)
class Result:
    """Hold what a job found: facts for programs, lines for people, and what can be written of it."""

    facts: dict[str, Any]  # numbers, strings and lists, for JSON
    lines: Sequence[str]
    shape: Shape  # that the functions live on
    title: str = ""  # above a report
    functions: dict[str, Any] = field(default_factory=dict)  # on the vertices, (n,) or (n, d)
    colors: str = ""  # the function that files show as colours
    kind: str = "signed"
    views: Sequence[SurfaceView] = ()
    save_npz: Callable[[Path], Any] | None = None  # writes the arrays of the result to a new file


def write_result(path: Path, result: Result) -> None:
    """Write what a result holds to a file whose ending names the format, whole or not at all."""
    suffix = path.suffix.lower()
    if suffix in (".png", ".html"):
        still = plot_views(result.views, n_columns=2 if len(result.views) == 4 else min(3, len(result.views)))
        plt.close(still)  # else a notebook would show it as well
        if suffix == ".png":
            write_whole(path, still.savefig)
        else:
            page = report_page(result.title, result.facts, result.views, still)
            write_whole(path, lambda place: place.write_text(page, encoding="utf-8"))
    elif suffix == ".npz" and result.save_npz is not None:
        write_whole(path, result.save_npz)
    else:
        write_arrays(path, result.shape, result.functions, colors=result.colors, kind=result.kind)


def operators_of(shape: Shape, laplacian: str, say: Say, mass: str = "lumped") -> Pair:
    """Return the pair (L, M) of a shape, after a note on each fault that spoils its modes without an error."""
    for warning in own_shape.warnings_of(shape, laplacian):
        say(f"note: {warning}")
    return own_shape.laplacian_of(shape, laplacian, mass)


def basis_of(
    shape: Shape, k: int, laplacian: str, say: Say, *, mass: str = "lumped", progress: bool = False,
    certify: bool = False,
) -> Eigenbasis:
    """Compute k modes of a shape, telling what is done and what may be wrong."""
    n = len(positions(shape))
    k = as_count("k", k, 1, n)
    L, M = operators_of(shape, laplacian, say, mass)
    if progress:
        gigabytes = memory_needed(n, k) / 1e9
        say(f"{k} modes of {n:,} vertices: the basis takes {gigabytes:.2f} GB; factoring first, then the time left")
    basis = compute_eigenbasis(L, M, k, progress=progress, certify=certify)
    count = first_nonzero(basis, 0)
    if count > 1:
        more = "; there may be further pieces: ask for more modes" if count == k else ""
        each = f"the first {count} modes have eigenvalue 0, each constant on one piece and zero on the others"
        say(f"note: the shape falls into {count} pieces: {each}{more}")
    return basis


def find_modes(
    shape: Shape, k: int | None, laplacian: str, say: Say, *, mass: str = "lumped", show: Sequence[int] = (),
    progress: bool = False, certify: bool = False, camera: Camera | None = None,
) -> Result:
    """Compute the eigenfunctions of a shape."""
    k = min(DEFAULT_MODES, len(positions(shape))) if k is None else k
    basis = basis_of(shape, k, laplacian, say, mass=mass, progress=progress, certify=certify)
    shown = [as_count("show", mode, 0, basis.k - 1) for mode in show] or own_shape.modes_to_show(basis)
    worst = float(np.asarray(basis.residuals).max())
    kind = own_shape.chosen(shape, laplacian)
    facts = own_shape.size_of(shape) | {
        "laplacian": kind, "mass": mass, "modes": basis.k, "zero_modes": first_nonzero(basis, 0),
        "area_of_mass": float(basis.M.sum()), "largest_residual": worst, "certified": certify,
        "eigenvalues": basis.evals.tolist(),
    }
    lines = [
        f"{shape}",
        f"{kind} Laplacian, {basis.k} modes, {facts['zero_modes']} with eigenvalue 0",
        *(f"mode {i:3d}   eigenvalue {basis.evals[i]:10.5g}" for i in sorted({*range(min(basis.k, 8)), basis.k - 1})),
    ]
    return Result(
        facts, lines, shape, f"{shape.name}: {basis.k} modes", {"mode": basis.evecs},
        colors=list(columns({"mode": basis.evecs}))[shown[0]],
        views=[SurfaceView(shape, basis.evecs[:, i], title=f"mode {i}", camera=camera) for i in shown],
        save_npz=lambda place: write_eigenbasis(place, basis),
    )


def find_segments(
    shape: Shape, n_segments: int, k: int | None, laplacian: str, say: Say, *, progress: bool = False,
    camera: Camera | None = None,
) -> Result:
    """Cut a shape into segments, each of its pieces by itself into a share of them by its area."""
    n_segments = as_count("n", n_segments, 1, len(positions(shape)))
    L, M = operators_of(shape, laplacian, say)
    count = sp.csgraph.connected_components(L, directed=False)[0]
    if count > 1:
        say(f"note: the shape falls into {count} pieces; each is cut by itself")
    labels = cut_pieces(L, M, n_segments, k, progress=progress)
    shares = np.bincount(labels, M.diagonal(), minlength=n_segments) / M.diagonal().sum()
    facts = own_shape.size_of(shape) | {
        "laplacian": own_shape.chosen(shape, laplacian), "segments": n_segments, "pieces": int(count),
        "vertices_of_segments": np.bincount(labels, minlength=n_segments).tolist(), "area_shares": shares.tolist(),
    }
    lines = [f"{shape}", f"{n_segments} segments"]
    lines += [f"segment {i}: {share:6.1%} of the area" for i, share in enumerate(shares)]
    view = SurfaceView(shape, labels, kind="labels", title=f"{n_segments} segments", camera=camera)
    arrays: dict[str, Any] = {**named_arrays(shape), "segment": labels}
    return Result(
        facts, lines, shape, f"{shape.name}: {n_segments} segments", {"segment": labels},
        colors="segment", kind="labels", views=[view],
        save_npz=lambda place: np.savez(place, **arrays),
    )


def find_map(
    mesh_1: Shape, mesh_2: Shape, landmarks: Sequence[str], k: int | None, laplacian: str, say: Say, *,
    progress: bool = False, cameras: tuple[Camera | None, Camera | None] = (None, None),
) -> Result:
    """Find, for each vertex of the second mesh, its vertex of the first."""
    if not isinstance(mesh_1, TriangleMesh) or not isinstance(mesh_2, TriangleMesh):
        raise ValueError("A and B must be triangle meshes to be matched; one of them holds points only")
    k = as_count("k", min(MAP_MODES, mesh_1.n_vertices, mesh_2.n_vertices) if k is None else k, 3)
    for mesh, name in ((mesh_1, "A"), (mesh_2, "B")):
        _name_sides(mesh, name, say)
    pairs = [_landmark(text) for text in landmarks]
    bases = tuple(basis_of(mesh, k, laplacian, say, progress=progress) for mesh in (mesh_1, mesh_2))
    match = match_shapes(mesh_1, mesh_2, pairs, k=k, bases=(bases[0], bases[1]))
    if match.reason:
        say(f"note: {match.reason}; three --landmark pairs, well apart, settle most doubts")
    hit = len(np.unique(match.p2p_21)) / mesh_1.n_vertices
    facts = {
        "a": own_shape.size_of(mesh_1), "b": own_shape.size_of(mesh_2),
        "laplacian": own_shape.chosen(mesh_1, laplacian),
        "modes": k, "landmarks": len(pairs), "orientation": match.orientation, "sure": match.is_sure,
        "doubt": round(match.doubt, 3), "reason": match.reason, "share_of_a_hit": hit,
    }
    lines = [
        f"A: {mesh_1}", f"B: {mesh_2}", f"map from {k} modes and {len(pairs)} landmarks",
        f"{match.orientation:.1%} of B's area lands right side up; {hit:.0%} of A's vertices are hit",
    ]
    image = mesh_1.vertices[match.p2p_21]
    functions = {"vertex_of_a": match.p2p_21} | {f"{axis}_of_a": image[:, i] for i, axis in enumerate("xyz")}
    longest = np.argsort(-np.ptp(mesh_1.vertices, axis=0), kind="stable")
    views = [
        SurfaceView(mesh, f, kind="positive", title=f"{name}, coloured by {'xyz'[i]} of A", camera=camera)
        for i in longest[:2]
        for name, mesh, f, camera in (
            ("A", mesh_1, mesh_1.vertices[:, i], cameras[0]),
            ("B", mesh_2, image[:, i], cameras[1]),
        )
    ]
    arrays: dict[str, Any] = {f"evals_{side}": basis.evals for side, basis in enumerate(bases, start=1)}
    arrays |= {"p2p_21": match.p2p_21, "C_12": match.C_12}
    return Result(
        facts, lines, mesh_2, f"{mesh_2.name} mapped to {mesh_1.name}", functions,
        colors=f"{'xyz'[longest[0]]}_of_a", kind="positive", views=views,
        save_npz=lambda place: np.savez(place, **arrays),
    )


def _name_sides(mesh: TriangleMesh, name: str, say: Say) -> None:
    """Say where faces disagree, and where a body is inside out, which the matching turns: else the map is mirrored."""
    found = health(mesh, crossings=False).faults["misoriented_edges"]
    if found:
        say(f"note: {name} has misoriented edges, {found}: its map may come out mirrored. $orient turns its faces")
    if (outward(mesh).faces != mesh.faces).any():
        say(f"note: {name} is inside out, of volume {signed_volume(mesh):.3g}: its faces are turned for the map")


def _landmark(text: str) -> list[int]:
    """A pair of vertices from the words of the command line."""
    words = text.split(",")
    if len(words) != 2 or not all(word.strip().isdecimal() for word in words):
        raise ValueError(f"--landmark must name a vertex of A and one of B, as in 12,40; got {text!r}")
    return [int(word) for word in words]


def examine_health(shape: Shape, nonplanar_polygons: int = 0) -> Result:
    """Count the faults of a mesh, or the repeated points of a cloud."""
    size = own_shape.size_of(shape)
    if isinstance(shape, PointCloud):
        repeated = shape.n_points - len(np.unique(shape.points + 0.0, axis=0))
        faults = {"duplicate_points": repeated} if repeated else {}
        say = f"duplicate points: {repeated}; --clean drops them" if repeated else "no fault found"
        return Result(size | {"faults": faults}, [f"{shape}", say], shape)
    report = health(shape, nonplanar_polygons=nonplanar_polygons)
    counts = {name: getattr(report, name) for name in HEALTH_FACTS}
    harmless = {name: report.faults[name] for name in own_shape.HARMLESS}
    faults = {name: n for name, n in report.faults.items() if n and name not in harmless}
    facts = size | counts | harmless | {"faults": faults}
    return Result(facts, [f"{shape}", *report.report(OPTIONS).splitlines()], shape)


def compress(mesh: Shape, **target: Any) -> tuple[Result, bytes]:
    """Encode a mesh as the bytes of a .sgn file, decode them, and measure what was lost."""
    if isinstance(mesh, PointCloud):
        raise ValueError("FILE must hold a triangle mesh to be compressed; it holds points only")
    if target.get("error") is None and target.get("bits_per_vertex") is None:
        target["error"] = 0.05
    data = encode(mesh, **target)
    summary = describe(data)
    plain = 12 * mesh.n_vertices + 12 * mesh.n_faces
    lost = vertex_error(renumbered(mesh), decode(data))
    facts = own_shape.size_of(mesh) | {
        "codec": summary.codec, "bytes": len(data), "plain_bytes": plain, "ratio": plain / len(data),
        "geometry_bits_per_vertex": summary.geometry_bits_per_vertex, "vertex_error_percent": lost,
    }
    lines = [
        f"{mesh}",
        f"{len(data):,} bytes, 1/{plain / len(data):.1f} of the {plain:,} of plain binary ({summary.codec} codec)",
        f"vertices moved by {lost:.3g} % of the diagonal (root mean square); decoded once to check",
    ]
    return Result(facts, lines, mesh), data


def decompress(data: bytes, **options: Any) -> tuple[Result, TriangleMesh]:
    """Decode the bytes of a .sgn file."""
    mesh = decode(data, **options)
    return Result(own_shape.size_of(mesh) | {"bytes": len(data)}, [f"{mesh}"], mesh), mesh
