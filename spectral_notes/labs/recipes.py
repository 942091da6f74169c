"""The data of the labs that need more than a surface and its modes: maps, parts of poses, tangent fields, a graph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import as_count
from spectral_notes.clustering import match_labels, spectral_clusters, spectral_embedding
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.functional_maps import as_point_map, functional_map
from spectral_notes.graphs import neighbor_graph
from spectral_notes.labs.data import MAX_VERTICES, LabData, in_unit_area, surface_data, viewpoint
from spectral_notes.laplacians import cotan_laplacian, graph_laplacian
from spectral_notes.mesh_calculus import spread_faces
from spectral_notes.meshes import TriangleMesh, euler_characteristic, is_closed, vertex_normals
from spectral_notes.shapes import spherical_cap
from spectral_notes.vector_fields import arrows_of_field, edge_transport

CAP_ANGLE, CAP_RINGS, CAP_EYE = 1.2, 36, [0.3, -1.0, 0.5]  # the cap of the chapter on curvature
HAIRS, LIFT = 420, 0.006  # how many arrows are drawn of a tangent field, and how far above the surface


def map_data(mesh_1: TriangleMesh, mesh_2: TriangleMesh, p2p_21: ArrayLike, k: int) -> LabData:
    """Return two surfaces with their modes and the functional map between them that a point map implies.

    C_12 = Phi_2^T M_2 Phi_1[p2p_21] takes the coefficients of a function on 1 to those of its image on 2. Arrays and
    facts are those of `surface_data`, their names ending in _1 and _2; with C_12 (k, k) and p2p_21 (n_2,).

    Parameters
    ----------
    mesh_1, mesh_2 : the surfaces
    p2p_21 : (n_2,) int, vertex of 2 -> vertex of 1
    k : how many modes of each

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> data = map_data(egg(2), egg(2), np.arange(egg(2).n_vertices), 4)
    >>> bool(abs(data.arrays["C_12"] - np.eye(4)).max() < 1e-6)  # nothing moves: the identity
    True
    """
    p2p_21 = as_point_map(p2p_21, mesh_1.n_vertices, mesh_2.n_vertices)
    basis_1, basis_2 = (compute_eigenbasis(*cotan_laplacian(in_unit_area(mesh)), k) for mesh in (mesh_1, mesh_2))
    C_12 = functional_map(basis_1, basis_2, p2p_21)
    facts: dict[str, Any] = {}
    arrays: dict[str, NDArray[Any]] = {"C_12": C_12.astype(np.float32), "p2p_21": p2p_21.astype(np.uint16)}
    for side, mesh in (("_1", mesh_1), ("_2", mesh_2)):
        data = surface_data(mesh, k)
        facts |= {name + side: fact for name, fact in data.facts.items()}
        arrays |= {name + side: array for name, array in data.arrays.items()}
    return LabData(facts, arrays)


def cap_data(k: int = 21) -> LabData:
    """Return a cap of the unit sphere with its first k modes; the fact angle is that of its rim from the pole."""
    mesh = spherical_cap(CAP_ANGLE, CAP_RINGS)
    basis = compute_eigenbasis(*cotan_laplacian(mesh), k)
    facts = viewpoint(mesh) | {"n": mesh.n_vertices, "k": k, "rings": CAP_RINGS, "angle": CAP_ANGLE, "eye": CAP_EYE}
    arrays: dict[str, NDArray[Any]] = {"faces": mesh.faces.astype(np.uint16)}
    for name, values in (("vertices", mesh.vertices), ("evecs", basis.evecs)):
        arrays[name] = values.T.astype(np.float32)
    return LabData(facts, arrays)


def parts_data(poses: Sequence[TriangleMesh], counts: Sequence[int], *, d: int = 8) -> LabData:
    """Return poses of one mesh, and the parts that clustering finds in each of them by itself.

    The numbers of the parts are matched afterwards: within the first pose from one count to the next, then every other
    pose to the first. Facts: name, n, poses, counts, the camera. Arrays: faces (m, 3), vertices (poses, 3, n),
    mass (n,) of the first pose, and labels (poses, counts, n).

    Parameters
    ----------
    poses : sequence of TriangleMesh, meshes with the same faces
    counts : sequence of int, numbers of parts, in ascending order, at most 12
    d : coordinates of the embedding

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> parts_data([egg(2)], [2, 3]).arrays["labels"].shape
    (1, 2, 162)
    """
    counts = [as_count("counts", count, 1, 12) for count in counts]
    if any(not np.array_equal(pose.faces, poses[0].faces) for pose in poses):
        raise ValueError("poses must share their faces: the same vertices in the same order, moved")
    labels = np.zeros((len(poses), len(counts), poses[0].n_vertices), dtype=np.int64)
    for p, pose in enumerate(poses):
        basis = compute_eigenbasis(*cotan_laplacian(pose), d + 1)
        rows, mass = spectral_embedding(basis, d), basis.M.diagonal()
        for i, count in enumerate(counts):
            found = spectral_clusters(rows, count, mass=mass)
            reference = labels[0, i] if p else labels[0, max(i - 1, 0)]
            labels[p, i] = match_labels(found, reference) if p or i else found
    facts = {"n": poses[0].n_vertices, "poses": [pose.name for pose in poses], "counts": counts}
    arrays: dict[str, NDArray[Any]] = {
        "faces": poses[0].faces.astype(np.uint16),
        "vertices": np.array([in_unit_area(pose).vertices.T for pose in poses]).astype(np.float16),
        "labels": labels.astype(np.int8),
        "mass": cotan_laplacian(poses[0])[1].diagonal().astype(np.float32),
    }
    return LabData(facts | viewpoint(poses[0]), arrays)


def arrows_data(mesh: TriangleMesh) -> LabData:
    """Return a surface of area one with the turns and weights of its edges, which is all that tangent fields need.

    Facts: name, n, the camera, and the Euler characteristic of a closed surface. Arrays: vertices, above where arrows
    stand, first and second, the directions 1 and i in space, each (3, n); hairs, where arrows are drawn; faces (m, 3)
    with the turns (m, 3) along their sides and their holonomy (m,); edges (e, 2), each once, with edge_turns and
    weights (e,); mass (n,).
    """
    as_count("mesh's number of vertices", mesh.n_vertices, 1, MAX_VERTICES)
    mesh = in_unit_area(mesh)
    edges, ones = edge_transport(mesh), np.ones(mesh.n_vertices)
    once = edges.tails < edges.heads
    facts = viewpoint(mesh) | {"n": mesh.n_vertices}
    if is_closed(mesh):
        facts["euler"] = euler_characteristic(mesh)
    whole = {"faces": mesh.faces, "edges": np.column_stack([edges.tails, edges.heads])[once]}
    whole["hairs"] = np.unique(mesh.faces[spread_faces(mesh, min(HAIRS, mesh.n_faces)), 0])
    half = {"vertices": mesh.vertices, "above": mesh.vertices + LIFT * vertex_normals(mesh)}
    half |= {"first": arrows_of_field(mesh, ones), "second": arrows_of_field(mesh, 1j * ones)}
    single = {"turns": edges.turns[: mesh.faces.size], "holonomy": edges.holonomy, "mass": edges.vertex_areas}
    single |= {"edge_turns": edges.turns[once], "weights": edges.weights[once]}
    arrays: dict[str, NDArray[Any]] = {name: values.astype(np.uint16) for name, values in whole.items()}
    arrays |= {name: values.T.astype(np.float16) for name, values in half.items()}
    return LabData(facts, arrays | {name: values.astype(np.float32) for name, values in single.items()})


def filter_data(n: int = 300, neighbors: int = 7, *, seed: int = 0) -> LabData:
    """Return a graph of random points in a square with all its modes, and three signals on it.

    Facts: n and the names of the signals. Arrays: points (2, n), edges (e, 2) and their weights (e,), evals (n,),
    evecs (n, n), mode after mode, and signals (3, n).
    """
    rng = np.random.default_rng(seed)
    points = rng.random((n, 2))
    W = neighbor_graph(points, neighbors)
    evals, evecs = np.linalg.eigh(graph_laplacian(W)[0].toarray())
    edges = np.argwhere(np.triu(W.toarray()))
    x, y = points.T
    spark = np.eye(n)[np.hypot(x - 0.5, y - 0.5).argmin()]
    signals = {
        "a spark": spark,
        "hills in noise": np.cos(6 * x) * np.sin(6 * y) + 0.4 * rng.normal(size=n),
        "two halves": np.sign(x - 0.5),
    }
    single = {"points": points.T, "weights": W.toarray()[*edges.T], "evals": evals, "evecs": evecs.T}
    single["signals"] = np.array(list(signals.values()))
    arrays = {name: values.astype(np.float32) for name, values in single.items()}
    return LabData({"n": n, "names": list(signals)}, arrays | {"edges": edges.astype(np.uint16)})
