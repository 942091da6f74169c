"""Errors of maps between differently triangulated poses, beside pyFM's on the same pairs in the same run.

    python benchmarks/functional_maps.py [--pairs tuned|reported|all] [--samples 100]

Printed for each pair: the mean geodesic error over the square root of the area, at sampled vertices, of pyFM (five
landmarks, ZoomOut to 200 modes), without and with its orientation term, and of `match_shapes` with five landmarks,
three, and none; the share of the area that lands right side up; and the time over that of pyFM's ZoomOut. The pairs of
the first group were used to choose the method; those of the second are only reported on. Needs pyfmaps.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
from pyFM.functional import FunctionalMapping
from pyFM.mesh import TriMesh
from pyFM.refine import mesh_zoomout_refine
from threadpoolctl import threadpool_limits

from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
from spectral_notes.descriptors import unit_area
from spectral_notes.functional_maps import nearest_rows
from spectral_notes.matching.point_maps import coarse_copy, geodesic_errors, orientation_score, surface_weights
from spectral_notes.matching.shape_matching import match_shapes
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import bodies
from spectral_notes.shapes.contouring import mesh_zero_set
from spectral_notes.shapes.posing import body_distance

K = 200
BODIES: dict[str, tuple[Any, tuple[float, ...], tuple[float, ...], float, Callable[[str], TriangleMesh]]] = {
    "doll": (bodies.DOLL, (-0.96, -0.06, -0.26), (1.06, 1.91, 0.31), 0.0245, shapes.doll),
    "goat": (bodies.GOAT, (-0.96, -0.06, -0.36), (1.16, 1.51, 0.36), 0.0305, shapes.goat),
}
LANDMARKS = {  # at rest: head, hands, feet; nose, hooves
    "doll": [[0, 1.83, 0.01], [0.97, 1.17, 0.01], [-0.83, 1.19, 0.01], [0.2, 0.03, 0.18], [-0.2, 0.03, 0.18]],
    "goat": [[1.08, 0.97, 0], [0.42, 0, 0.15], [0.42, 0, -0.15], [-0.49, 0, 0.15], [-0.49, 0, -0.15]],
}
TUNED = [("doll", "rest", "walk"), ("doll", "arms_down", "wave"), ("goat", "rest", "walk")]
REPORTED = [
    ("doll", "rest", "arms_down"), ("doll", "walk", "wave"), ("doll", "wave", "rest"), ("doll", "walk", "arms_down"),
    ("goat", "rest", "look"), ("goat", "walk", "look"), ("goat", "look", "rest"),
]


class Body:
    """Two triangulations of a body that share no vertex, and the true map from the second to the first."""

    def __init__(self, name: str) -> None:
        limbs, low, high, step, self.pose = BODIES[name]
        rest = self.pose("rest")
        points, self.faces_1 = mesh_zero_set(body_distance(limbs, 0.02), low, high, step)
        self.P_1 = surface_weights(points, rest)
        self.faces_2, self.P_2 = coarse_copy(rest, 8000)
        at_rest = self.P_2 @ rest.vertices
        self.true_21 = nearest_rows(self.P_1 @ rest.vertices, at_rest)
        lm_2 = nearest_rows(at_rest, np.array(LANDMARKS[name], dtype=np.float64))
        self.landmarks = np.column_stack([self.true_21[lm_2], lm_2])

    def pair(self, pose_1: str, pose_2: str) -> tuple[TriangleMesh, TriangleMesh]:
        return (TriangleMesh(self.P_1 @ self.pose(pose_1).vertices, self.faces_1),
                TriangleMesh(self.P_2 @ self.pose(pose_2).vertices, self.faces_2))


def pyfm_map(one: TriMesh, two: TriMesh, landmarks: Any, w_orient: float) -> tuple[Any, float]:
    """pyFM's map after ZoomOut by the weights of its manual, and the seconds of ZoomOut."""
    model = FunctionalMapping(one, two)
    model.preprocess(n_descr=100, landmarks=landmarks, subsample_step=2, k_process=K, k_descr=128)
    model.fit(K=(30, 30), w_descr=1, w_lap=0.1, w_dcomm=1, w_orient=w_orient)
    start = time.process_time()
    _, p2p_21 = mesh_zoomout_refine(model.FM_12, model.mesh1, model.mesh2, nit=17, step=10, return_p2p=True)
    return np.asarray(p2p_21), time.process_time() - start


def compare(body: Body, pose_1: str, pose_2: str, n_samples: int) -> dict[str, tuple[float, float, float, str]]:
    """Mean error, orientation score, seconds and doubt of each method on one pair."""
    mesh_1, mesh_2 = body.pair(pose_1, pose_2)
    bases = tuple(unit_area(compute_eigenbasis(*cotan_laplacian(mesh), K)) for mesh in (mesh_1, mesh_2))
    one, two = (TriMesh(m.vertices / np.sqrt(m.area), m.faces) for m in (mesh_1, mesh_2))
    for theirs, basis in ((one, bases[0]), (two, bases[1])):  # the same modes for both
        theirs.mass = sp.csc_matrix(basis.M)
        theirs.eigenvalues, theirs.eigenvectors = np.array(basis.evals), np.array(basis.evecs)
    maps: dict[str, tuple[Any, float, str]] = {}
    for name, weight in (("pyFM 5", 0.0), ("pyFM 5 oriented", 1.0)):
        p2p_21, seconds = pyfm_map(one, two, body.landmarks, weight)
        maps[name] = (p2p_21, seconds, "")
    for n_landmarks in (5, 3, 0):
        start = time.process_time()
        match = match_shapes(mesh_1, mesh_2, body.landmarks[:n_landmarks], bases=bases)
        maps[f"ours {n_landmarks}"] = (match.p2p_21, time.process_time() - start, match.doubt)
    at = np.random.default_rng(0).choice(len(body.true_21), n_samples, replace=False)
    errors = geodesic_errors(mesh_1, np.array([p2p_21[at] for p2p_21, _, _ in maps.values()]), body.true_21[at])
    return {
        name: (float(error.mean()), orientation_score(mesh_1, mesh_2, p2p_21), seconds, doubt)
        for (name, (p2p_21, seconds, doubt)), error in zip(maps.items(), errors, strict=True)
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--pairs", choices=["tuned", "reported", "all"], default="all")
    parser.add_argument("--samples", type=int, default=100, help="vertices where the error is measured")
    arguments = parser.parse_args()
    print(f"pyFM {version('pyfmaps')}, k = {K}; error, (right side up), [time / pyFM's ZoomOut]")
    made = {name: Body(name) for name in BODIES}
    for group, pairs in (("tuned", TUNED), ("reported", REPORTED)):
        table = []
        for name, pose_1, pose_2 in pairs if arguments.pairs in (group, "all") else []:
            with threadpool_limits(limits=1):
                row = compare(made[name], pose_1, pose_2, arguments.samples)
            table.append([error for error, *_ in row.values()])
            clock = row["pyFM 5"][2]
            cells = [f"{m} {e:.4f} ({o:.3f}) [{s / clock:.2f}]{' UNSURE' * bool(d)}" for m, (e, o, s, d) in row.items()]
            print(f"{group}: {name} {pose_1} -> {pose_2}: " + "; ".join(cells), flush=True)
        if table:
            means = np.mean(table, axis=0)
            print(f"{group}: means " + "; ".join(f"{m} {e:.4f}" for m, e in zip(row, means, strict=True)), flush=True)


if __name__ == "__main__":
    main()
