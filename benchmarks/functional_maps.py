"""Errors of maps between persons, poses and published sets, beside pyFM's on the same pairs in the same run.

    python benchmarks/functional_maps.py [--pairs tuned|reported] [--methods "ours 0" ...] [--result FILE]
    python benchmarks/functional_maps.py --set faust|scape|shrec19|tosca --folder FOLDER [--number 20]
    python benchmarks/functional_maps.py --together --result FILE

For each pair and method: the mean geodesic error over the square root of the area and its standard error, at sampled
vertices; the share of them that is off by more than 0.2, as on a flipped limb; the area that lands right side up; the
doubt; the seconds beside pyFM's. Methods are pyFM (landmarks, ZoomOut to 100 modes; without and with its orientation
term) and `match_shapes`, with five landmarks, three, and none; and none once more with all candidates near the true map
taken away, so that the doubt has wrong maps to find. Results are kept as JSON and not run again: with three landmarks,
none, and astray in `functional_maps.json`; with five beside pyFM in `functional_maps_more.json`, with eight persons
at once (`--together`).
Which persons were tuned on and which are only reported was fixed before the first run, in `tuned_and_reported.json`.
The public sets are read from a folder of your own, in the layout in which they are published; see `published_pairs`.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
from spectral_notes.clustering import match_labels, spectral_clusters, spectral_embedding
from spectral_notes.descriptors import unit_area
from spectral_notes.files import read_mesh
from spectral_notes.functional_maps import nearest_rows
from spectral_notes.geometry.mending import outward
from spectral_notes.matching import (
    ShapeMatch,
    consistent_maps,
    cycle_error,
    geodesic_errors,
    match_shapes,
    orientation_score,
    shape_matching,
    shared_embedding,
    shared_functions,
)
from spectral_notes.meshes import TriangleMesh, farthest_points

HERE = Path(__file__).parent
SPLIT = json.loads((HERE / "tuned_and_reported.json").read_text())
K, N_SAMPLES, FAR = 100, 100, 0.2
WITH_FIVE = ("pyFM 5", "pyFM 5 oriented", "ours 5")
TOGETHER = 60  # modes of maps between several shapes
SIZES = 3000, 2500  # vertices of the copies that are matched
METHODS = ("pyFM 5", "pyFM 5 oriented", "ours 5", "ours 3", "ours 0", "ours 0 led astray")
POSES = ("stand", "walk", "reach")
LANDMARKS = {  # where the bodies stand at rest: head, hands, feet; nose, hooves
    "doll": [[0, 1.83, 0.01], [0.97, 1.17, 0.01], [-0.83, 1.19, 0.01], [0.2, 0.03, 0.18], [-0.2, 0.03, 0.18]],
    "goat": [[1.08, 0.97, 0], [0.42, 0, 0.15], [0.42, 0, -0.15], [-0.49, 0, 0.15], [-0.49, 0, -0.15]],
}


@dataclass(frozen=True, eq=False)
class Pair:
    """Hold two shapes, vertices of 2 and their true images on 1, and five landmarks as pairs."""

    name: str
    mesh_1: TriangleMesh
    mesh_2: TriangleMesh
    at_2: np.ndarray
    true_21: np.ndarray
    landmarks: np.ndarray


# --- pairs ----------------------------------------------------------------------------------------------------------


def own_pairs(half: str) -> Iterator[tuple[str, Callable[[], Pair]]]:
    """Yield the pairs of one half, "tuned" or "reported", each with what builds it."""
    names = SPLIT["persons"][f"{half}_on"]
    for i, name in enumerate(names):
        after, pose, other = names[(i + 1) % len(names)], POSES[i % 3], POSES[(i + 1) % 3]
        for ends in (((name, pose), (name, other)), ((name, pose), (after, other))):
            yield "person " + " -> ".join(" ".join(end) for end in ends), lambda ends=ends: _persons(*ends)
    for body in ("goat", "doll"):
        a, b = SPLIT[body][f"{half}_on"]
        yield f"{body} {a} -> {b}", lambda body=body, a=a, b=b: _bodies(body, a, b)


@cache
def _light_person(name: str, pose: str, n_vertices: int) -> tuple[TriangleMesh, Any]:
    return shapes.coarse_copy(shapes.person(name, pose), n_vertices)


def _persons(first: tuple[str, str], second: tuple[str, str]) -> Pair:
    """Two persons, or one in two poses, of different triangles, landmarks at head, hands and feet."""
    (one, _), (two, P_2) = _light_person(*first, SIZES[0]), _light_person(*second, SIZES[1])
    parts = shapes.person_segments(*second)[np.asarray(P_2.argmax(axis=1)).ravel()]
    tips = {"head": [0, 1, 0], "left hand": [1, 0, 0], "right hand": [-1, 0, 0], "left foot": [0, 0, 1],
            "right foot": [0, 0, 1]}
    marks = np.array([np.where(parts == shapes.PERSON_SEGMENTS.index(part), two.vertices @ way, -np.inf).argmax()
                      for part, way in tips.items()])
    true_21 = _true_person_map(first, second)
    return _pair(" ".join((*first, "->", *second)), one, two, np.arange(len(true_21)), true_21, marks)


def _true_person_map(first: tuple[str, str], second: tuple[str, str]) -> np.ndarray:
    """For each vertex of the copy of the second person, the vertex of that of the first nearest to its place there."""
    places = shapes.person_correspondence(*second, *first) @ shapes.person(*first).vertices
    return nearest_rows(_light_person(*first, SIZES[0])[0].vertices, _light_person(*second, SIZES[1])[1] @ places)


def _bodies(body: str, pose_1: str, pose_2: str) -> Pair:
    """The doll or the goat in two poses, of different triangles."""
    make = {"doll": shapes.doll, "goat": shapes.goat}[body]
    rest = make("rest")
    (finer, P_1), (coarse, P_2) = (shapes.coarse_copy(rest, n_vertices) for n_vertices in SIZES)
    true_21 = nearest_rows(finer.vertices, coarse.vertices)
    marks = nearest_rows(coarse.vertices, np.array(LANDMARKS[body], dtype=np.float64))
    one = TriangleMesh(P_1 @ make(pose_1).vertices, finer.faces)
    two = TriangleMesh(P_2 @ make(pose_2).vertices, coarse.faces)
    return _pair(f"{body} {pose_1} -> {pose_2}", one, two, np.arange(len(true_21)), true_21, marks)


def _pair(
    name: str, one: TriangleMesh, two: TriangleMesh, at_2: np.ndarray, true_21: np.ndarray, marks: np.ndarray | None
) -> Pair:
    """A pair with a sample of its known vertices; without landmarks given, far ones."""
    if marks is None:
        order = farthest_points(two.vertices, two.n_vertices)
        place = {int(vertex): i for i, vertex in reversed(list(enumerate(at_2)))}
        marks = np.array([place[int(vertex)] for vertex in order if int(vertex) in place][:5])
    some = np.random.default_rng(0).choice(len(at_2), min(N_SAMPLES, len(at_2)), replace=False)
    return Pair(name, one, two, at_2[some], true_21[some], np.column_stack([true_21[marks], at_2[marks]]))


def published_pairs(kind: str, folder: Path, number: int | None = None) -> Iterator[tuple[str, Callable[[], Pair]]]:
    """Yield the pairs of a public set in a folder of the reader's, each with what builds it, the first `number`.

    faust, scape: remeshed (Ren et al. 2018), shapes `off/NAME.off` and for each `corres/NAME.vts`, a line for each
    template point with the number of its vertex, from 1; neighbours in the order of names. Copies of these sets keep
    shapes in `off_2` or `shapes`, as OFF, PLY or OBJ, and the other files in `correspondences`: read likewise.
    shrec19: remeshed, `off/N.off` and `corres/A_B.map`, for each vertex of A a vertex of B, from 1.
    tosca: `NAME.vert` and `NAME.tri`, plain numbers, faces from 1; poses of one class, cat0 to cat10, share numbers.
    """
    if kind in ("faust", "scape"):
        found = [(a, b, None) for a, b in itertools.pairwise(sorted(_shape_files(folder)))]
    elif kind == "shrec19":
        maps = sorted(_within(folder, "corres", "correspondences").glob("*.map"))
        found = [(*path.stem.split("_"), path) for path in maps]
    else:
        names = sorted((path.stem for path in folder.glob("*.vert")), key=lambda name: (_class(name), len(name), name))
        found = [(a, b, None) for a, b in itertools.pairwise(names) if _class(a) == _class(b)]
    if not found:
        raise SystemExit(f"no pair of the set {kind} in {folder}: is its layout the one described in published_pairs?")
    for a, b, path in found[:number]:
        yield f"{kind} {a} -> {b}", lambda a=a, b=b, path=path: _published(kind, folder, a, b, path)


def _within(folder: Path, *names: str) -> Path:
    """The first of some folders that is there."""
    return next((folder / name for name in names if (folder / name).is_dir()), folder / names[0])


def _shape_files(folder: Path) -> dict[str, Path]:
    """The files of shapes, by their names without ending."""
    place = _within(folder, "off", "off_2", "shapes")
    return {path.stem: path for path in place.glob("*") if path.suffix.lower() in (".off", ".ply", ".obj")}


def _class(name: str) -> str:
    """The class of a TOSCA shape: its name without the number."""
    return name.rstrip("0123456789")


def _published(kind: str, folder: Path, a: str, b: str, path: Path | None) -> Pair:
    """One pair of a public set: meshes, known vertices of the second, and their images on the first."""
    if kind == "tosca":
        one, two = (TriangleMesh(np.loadtxt(folder / f"{name}.vert"), np.loadtxt(folder / f"{name}.tri", dtype=int) - 1)
                    for name in (a, b))
        at_2 = true_21 = np.arange(two.n_vertices)
    else:
        files = _shape_files(folder)
        one, two = (read_mesh(files[name]) for name in (a, b))
        if path is not None:
            at_2 = np.loadtxt(path, dtype=int) - 1
            true_21 = np.arange(len(at_2))
        else:
            known = _within(folder, "corres", "correspondences")
            true_21, at_2 = (np.loadtxt(known / f"{name}.vts", dtype=int) - 1 for name in (a, b))
    return _pair(f"{kind} {a} -> {b}", one, two, at_2, true_21, None)


# --- methods --------------------------------------------------------------------------------------------------------


def run(method: str, pair: Pair, bases: tuple[Any, Any]) -> dict[str, Any]:
    """The map of one method with what it says of itself, and its seconds of processor time."""
    n = int(method.split()[1])
    start = time.process_time()
    if method.endswith("astray"):
        match = led_astray(pair, bases)
        found = {"p2p_21": match.p2p_21, "doubt": match.doubt, "reason": match.reason, "clues": match.clues}
    elif method.startswith("ours"):
        match = match_shapes(pair.mesh_1, pair.mesh_2, pair.landmarks[:n], k=K, bases=bases)
        found = {"p2p_21": match.p2p_21, "doubt": match.doubt, "reason": match.reason, "clues": match.clues}
    else:
        found = {"p2p_21": pyfm_map(pair, bases, pair.landmarks[:n], float(method.endswith("oriented")))}
    return found | {"seconds": time.process_time() - start}


def led_astray(pair: Pair, bases: tuple[Any, Any]) -> ShapeMatch:
    """The map that is chosen when every candidate near the true map is taken away: a wrong one, to test the doubt."""
    meshes = outward(pair.mesh_1), outward(pair.mesh_2)
    samples = farthest_points(meshes[0].vertices, 1500), farthest_points(meshes[1].vertices, 1500)
    none, no_hints = np.empty((0, 2), dtype=np.int64), [np.empty((mesh.n_vertices, 0)) for mesh in meshes]
    ends = shape_matching.refined_candidates(meshes, bases, samples, none, no_hints)
    points, scale = pair.mesh_1.vertices, np.sqrt(pair.mesh_1.area)
    gaps = [np.linalg.norm(points[end.p2p_21[pair.at_2]] - points[pair.true_21], axis=1) / scale for end in ends]
    astray = [end for end, gap in zip(ends, gaps, strict=True) if gap.mean() > 0.1 or not end.is_upright]
    return shape_matching.best_match(meshes, bases, astray or ends, none)


def pyfm_map(pair: Pair, bases: tuple[Any, Any], landmarks: np.ndarray, w_orient: float) -> np.ndarray:
    """pyFM's map by the weights of its manual, ZoomOut to K modes, on the same modes as ours."""
    from pyFM.functional import FunctionalMapping
    from pyFM.mesh import TriMesh
    from pyFM.refine import mesh_zoomout_refine

    meshes = [TriMesh(mesh.vertices / np.sqrt(mesh.area), mesh.faces) for mesh in (pair.mesh_1, pair.mesh_2)]
    for theirs, basis in zip(meshes, bases, strict=True):
        theirs.mass = sp.csc_matrix(basis.M)
        theirs.eigenvalues, theirs.eigenvectors = np.array(basis.evals), np.array(basis.evecs)
    model = FunctionalMapping(*meshes)
    some = landmarks if len(landmarks) else None
    model.preprocess(n_descr=100, landmarks=some, subsample_step=2, k_process=K, k_descr=min(128, K))
    model.fit(K=(30, 30), w_descr=1, w_lap=0.1, w_dcomm=1, w_orient=w_orient)
    return np.asarray(mesh_zoomout_refine(model.FM_12, *meshes, nit=(K - 30) // 10, step=10, return_p2p=True)[1])


def measure(pair: Pair, methods: list[str]) -> dict[str, dict[str, Any]]:
    """What is kept of each method on one pair."""
    bases = tuple(unit_area(compute_eigenbasis(*cotan_laplacian(mesh), K)) for mesh in (pair.mesh_1, pair.mesh_2))
    found = {method: run(method, pair, bases) for method in methods}  # type: ignore[arg-type]
    maps = [one.pop("p2p_21") for one in found.values()]
    errors = geodesic_errors(pair.mesh_1, np.array([p2p_21[pair.at_2] for p2p_21 in maps]), pair.true_21)
    for one, p2p_21, error in zip(found.values(), maps, errors, strict=True):
        one["error"], one["standard_error"] = float(error.mean()), float(error.std() / np.sqrt(len(error)))
        one["far"] = float((error > FAR).mean())
        one["orientation"] = orientation_score(pair.mesh_1, pair.mesh_2, p2p_21)
    return {method: {key: round(value, 4) if isinstance(value, float) else value for key, value in one.items()}
            for method, one in found.items()}


# --- several shapes at once -----------------------------------------------------------------------------------------


def together(names: Sequence[str] = shapes.PERSONS, n_parts: int = 8) -> dict[str, float]:
    """Persons in three poses: maps of the first to the others by three landmarks, made consistent, and one clustering.

    Agreement is the share of a body's area whose label is that of its true partner on the first, the mean over bodies.
    """
    start, ends = time.process_time(), [(name, POSES[i % 3]) for i, name in enumerate(names)]
    pairs = [_persons(ends[0], end) for end in ends[1:]]
    meshes = [pairs[0].mesh_1, *(pair.mesh_2 for pair in pairs)]
    bases = [unit_area(compute_eigenbasis(*cotan_laplacian(mesh), K)) for mesh in meshes]
    found = [match_shapes(meshes[0], meshes[j], pair.landmarks[:3], k=K, bases=(bases[0], bases[j]))
             for j, pair in enumerate(pairs, start=1)]
    star = {(0, j): match.C_12[:TOGETHER, :TOGETHER] for j, match in enumerate(found, start=1)}
    maps = consistent_maps(bases, star)
    rows = shared_embedding(bases, shared_functions(bases, star), n_parts)
    masses = [basis.M.diagonal() for basis in bases]
    cuts = np.cumsum([len(mass) for mass in masses])[:-1]
    joint = np.split(spectral_clusters(np.vstack(rows), n_parts, mass=np.concatenate(masses)), cuts)
    alone = [spectral_clusters(spectral_embedding(basis, n_parts), n_parts, mass=mass)
             for basis, mass in zip(bases, masses, strict=True)]
    agree: dict[str, list[float]] = {"agreement_alone": [], "agreement_jointly": []}
    for j, end in enumerate(ends[1:], start=1):
        true = _true_person_map(ends[0], end)
        for name, labels in (("agreement_alone", [alone[0], match_labels(alone[j], alone[0][true])]),
                             ("agreement_jointly", [joint[0], joint[j]])):
            agree[name].append(float(masses[j][labels[1] == labels[0][true]].sum() / masses[j].sum()))
    scale, points = np.sqrt(meshes[0].area), meshes[0].vertices
    gaps = {name: [np.linalg.norm(points[p2p[pair.at_2]] - points[pair.true_21], axis=1).mean() / scale
                   for p2p, pair in zip(all_maps, pairs, strict=True)]
            for name, all_maps in (("matched", [match.p2p_21 for match in found]),
                                   ("consistent", [maps[0, j] for j in range(1, len(meshes))]))}
    return {name: round(float(np.mean(value)), 4) for name, value in agree.items()} | {
        "persons": len(names), "parts": n_parts, "cycle_error": round(cycle_error(meshes, maps), 4),
        "error_matched": round(float(np.mean(gaps["matched"])), 4),
        "error_consistent": round(float(np.mean(gaps["consistent"])), 4),
        "seconds": round(time.process_time() - start, 1),
    }


def beside_pyfm(rows: dict[str, dict[str, Any]]) -> list[str]:
    """The lines of a table: errors with five landmarks, ours over the better of pyFM's two, with three and none."""
    errors = {name: [row[method]["error"] for method in (*WITH_FIVE, "ours 3", "ours 0")] for name, row in rows.items()}
    errors["mean"] = np.mean(list(errors.values()), axis=0).tolist()
    return [f"| {name} | " + " | ".join(f"{error:.4f}" for error in all_five[:3])
            + f" | {all_five[2] / min(all_five[:2]):.2f} | {all_five[3]:.4f} | {all_five[4]:.4f} |"
            for name, all_five in errors.items()]


def is_wrong(entry: dict[str, Any]) -> bool:
    """Whether a map counts as wrong: a mean error above 0.1, or a limb on the wrong place."""
    return bool(entry["error"] > 0.1 or entry["far"] > 0.03)


# --- the doubt ------------------------------------------------------------------------------------------------------


def counts(entries: list[dict[str, Any]], doubts: list[float]) -> str:
    """The four counts of a doubt."""
    table = {(wrong, doubted): 0 for wrong in (True, False) for doubted in (True, False)}
    for entry, doubt in zip(entries, doubts, strict=True):
        table[is_wrong(entry), doubt >= 0.5] += 1
    return (f"wrong: {table[True, True]} doubted, {table[True, False]} not; "
            f"right: {table[False, True]} doubted, {table[False, False]} not")


def store(path: Path, results: dict[str, Any]) -> None:
    """Write the results whole or not at all."""
    draft = path.with_suffix(".part")
    draft.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")
    os.replace(draft, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--pairs", choices=["tuned", "reported"], default="reported")
    parser.add_argument("--only", default="", help="only pairs whose name holds this")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--set", choices=["faust", "scape", "shrec19", "tosca"], help="a public set instead")
    parser.add_argument("--folder", type=Path, help="where the public set lies")
    parser.add_argument("--number", type=int, help="how many pairs of it")
    parser.add_argument("--result", type=Path, default=HERE / "functional_maps.json")
    parser.add_argument("--together", action="store_true", help="eight persons at once instead of pairs")
    arguments = parser.parse_args()
    if arguments.set and not arguments.folder:
        parser.error("--set needs --folder, where you keep it")
    group = arguments.set or arguments.pairs
    pairs = published_pairs(group, arguments.folder, arguments.number) if arguments.set else own_pairs(group)
    results = json.loads(arguments.result.read_text()) if arguments.result.exists() else {}
    if arguments.together:
        with threadpool_limits(limits=1):
            results["together"] = together()
        store(arguments.result, results)
        print(results["together"])
        return
    rows = results.setdefault(group, {})
    for name, build in pairs:
        missing = [method for method in arguments.methods if method not in rows.get(name, {})]
        if missing and arguments.only in name:
            with threadpool_limits(limits=1):
                rows.setdefault(name, {}).update(measure(build(), missing))
            store(arguments.result, results)
        if name in rows:
            print(f"{name}: " + "; ".join(f"{m} {one['error']:.4f}{' WRONG' * is_wrong(one)}"
                                          f"{' doubted' * (one.get('doubt', 0) >= 0.5)}"
                                          for m, one in rows[name].items()), flush=True)
    for method in METHODS:
        entries = [row[method] for row in rows.values() if method in row]
        if entries:
            print(f"{method}: mean {np.mean([one['error'] for one in entries]):.4f} over {len(entries)} pairs, "
                  f"{sum(map(is_wrong, entries))} wrong")
    ours = [one for row in rows.values() for method, one in row.items() if "doubt" in one]
    if ours:
        print("doubt:", counts(ours, [one["doubt"] for one in ours]))


if __name__ == "__main__":
    main()
