"""Train the network of chapter 14 on four persons and judge it on four others: five seeds, two ablations, a baseline.

    python benchmarks/learning.py          a quarter of an hour of one core; writes benchmarks/learning.json
    python benchmarks/learning.py --quick  one seed and few steps; prints, and writes nothing

The code is the page's own: its cells tagged `network`. Who is learned from and who is only judged was fixed before the
first run, in `tuned_and_reported.json`; blocks, steps and their length were chosen on the first half alone, with "old"
held out.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from spectral_notes import compute_eigenbasis, descriptors, mesh_calculus, meshes, shapes, vector_fields
from spectral_notes.laplacians import cotan_laplacian, robust_cloud_laplacian

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "book" / "14_graphs_and_learning.ipynb"
SPLIT = json.loads((HERE / "tuned_and_reported.json").read_text())["persons"]
NAMES = shapes.PERSON_SEGMENTS
PARTS = sorted({name.removeprefix("left ").removeprefix("right ") for name in NAMES})  # without sides
PART_OF = np.array([PARTS.index(name.removeprefix("left ").removeprefix("right ")) for name in NAMES])
METHODS = ("the layer", "without gradients", "each point alone")
SEEDS = range(5)
SHOWN = ("slim", "walk")  # whose labels the page draws, as one hexadecimal digit a vertex


def code_of_the_page() -> SimpleNamespace:
    """The functions of the chapter's network, as they stand on the page."""
    names: dict[str, Any] = {
        "np": np, "sp": sp, "cKDTree": cKDTree, "SimpleNamespace": SimpleNamespace, "descriptors": descriptors,
        "mesh_calculus": mesh_calculus, "meshes": meshes, "vector_fields": vector_fields,
        "compute_eigenbasis": compute_eigenbasis,
    }
    cells = json.loads(PAGE.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        if "network" in cell["metadata"].get("tags", []):
            exec("".join(cell["source"]), names)
    return SimpleNamespace(**names)


def as_mesh(page: SimpleNamespace, name: str, pose: str, n: int = 0) -> tuple[Any, np.ndarray]:
    """A person and the labels of the vertices; with n, a copy of n vertices."""
    mesh, labels = shapes.person(name, pose), shapes.person_segments(name, pose)
    if n:
        mesh, P = shapes.coarse_copy(mesh, n)
        labels = labels[P.argmax(axis=1)]
    return page.prepare(mesh, cotan_laplacian(mesh), page.gradients_on_mesh), labels


def as_cloud(page: SimpleNamespace, name: str, pose: str) -> tuple[Any, np.ndarray]:
    """Five thousand random points of a person, whose normals and labels are those of the nearest vertices."""
    mesh = shapes.person(name, pose)
    cloud = shapes.sample_points(mesh, 5000, seed=1)
    nearest = cKDTree(mesh.vertices).query(cloud.points)[1]
    shape = (cloud.points, meshes.vertex_normals(mesh)[nearest])
    data = page.prepare(shape, robust_cloud_laplacian(cloud), page.gradients_on_cloud)
    return data, shapes.person_segments(name, pose)[nearest]


def without(data: Any, kind: str) -> Any:
    """The same data without what an ablation takes away: gradients, or gradients and heat."""
    taken = {"the layer": (), "without gradients": ("grad",), "each point alone": ("grad", "Phi")}[kind]
    return SimpleNamespace(**(vars(data) | {name: 0 * getattr(data, name) for name in taken}))


def shares(guess: np.ndarray, data: Any, labels: np.ndarray) -> tuple[float, float]:
    """Which share of the area has the right part and side, and which the right part."""
    by_part = np.stack([guess[:, part == PART_OF].sum(axis=1) for part in range(len(PARTS))], axis=1)
    right = (guess.argmax(axis=1) == labels, by_part.argmax(axis=1) == PART_OF[labels])
    return float(np.average(right[0], weights=data.w)), float(np.average(right[1], weights=data.w))


def main() -> None:
    """Train, judge and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    page, n_steps = code_of_the_page(), 20 if quick else 1000
    everybody = [(name, pose) for name in SPLIT["tuned_on"] for pose in shapes.PERSON_POSES]
    strangers = [(name, pose) for name in SPLIT["reported_on"] for pose in shapes.PERSON_POSES]
    known = [as_mesh(page, *who) for who in everybody]
    judged = {
        "learned from": known,
        "unseen persons": [as_mesh(page, *who) for who in strangers],
        "in 1,200 vertices": [as_mesh(page, *who, n=1200) for who in strangers],
        "as clouds": [as_cloud(page, *who) for who in strangers],
    }
    features = np.vstack([data.F for data, _ in known])
    shift, spread = features.mean(axis=0), features.std(axis=0)
    for pairs in judged.values():
        for data, _ in pairs:
            data.F = (data.F - shift) / spread
    answers = [np.eye(len(NAMES))[labels] for _, labels in known]
    tree = cKDTree(np.vstack([data.F for data, _ in known]))
    all_labels = np.concatenate([labels for _, labels in known])

    def marks(predict: Any) -> dict[str, list[tuple[float, float]]]:
        return {kind: [shares(predict(data), data, labels) for data, labels in pairs] for kind, pairs in judged.items()}

    def store(name: str, seed: int, predict: Any) -> None:
        found = marks(predict)
        report.append({"method": name, "seed": seed, "right": {k: np.round(v, 4).tolist() for k, v in found.items()}})
        if seed == 0:
            guess = predict(judged["unseen persons"][strangers.index(SHOWN)][0]).argmax(axis=1)
            shown[name] = "".join(f"{label:x}" for label in guess)
        print(name, seed, {kind: np.mean(v, axis=0).round(3).tolist() for kind, v in found.items()}, flush=True)
        if not quick:
            result = {"strangers": strangers, "n_steps": n_steps, "shown": shown, "runs": report}
            HERE.joinpath("learning.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")

    report: list[dict[str, Any]] = []
    shown: dict[str, str] = {}
    store("nearest neighbour", 0, lambda data: np.eye(len(NAMES))[all_labels[tree.query(data.F)[1]]])
    for seed in list(SEEDS)[: 1 if quick else None]:
        for kind in METHODS:
            data = [without(data, kind) for data, _ in known]
            net = page.start(seed, len(NAMES))
            page.train(net, data, answers, n_steps, 0.015, seed)
            store(kind, seed, lambda data, net=net, kind=kind: page.forward(net, without(data, kind))[0])


if __name__ == "__main__":
    main()
