"""Several shapes at once: functions that all of them share, so that every map agrees with every way round."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.functional_maps import as_functional_map, as_point_map, functional_map, nearest_rows
from spectral_notes.laplacians import mass_matrix
from spectral_notes.meshes import TriangleMesh

Maps = Mapping[tuple[int, int], ArrayLike]


def shared_functions(bases: Sequence[Eigenbasis], maps: Maps, k: int | None = None) -> list[FloatArray]:
    """Return k functions on each shape that correspond, as coefficients: maps carry those of one to those of another.

    The matrices Y_i (k_i, k) minimise sum |C_ij Y_i - Y_j|^2 over the maps that are given, with sum Y_i^T Y_i = n I:
    the lowest eigenvectors of a block matrix, turned so that smooth functions come first. From them every map follows,
    C_ij = Y_j Y_i^+, and those round a cycle compose to the identity (Wang, Huang and Guibas, "Image co-segmentation
    via consistent functional maps", 2013, section 3; Huang et al., "Consistent ZoomOut", 2020).

    Parameters
    ----------
    bases : the modes of n shapes, each scaled to area one
    maps : for pairs (i, j) the functional map (k_j, k_i) from functions on i to functions on j, as by `match_shapes`.
        They must join all shapes, as those from one of them to each other do.
    k : how many functions; as many as the smallest map has modes by default

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=2)), k=6)
    >>> turn = np.diag([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    >>> Y = shared_functions([basis] * 3, {(0, 1): turn, (1, 2): turn})
    >>> bool(np.allclose(Y[1] @ np.linalg.pinv(Y[0]), turn))
    True
    """
    _check_joined(len(bases), maps)
    checked = {(i, j): as_functional_map(bases[i], bases[j], C) for (i, j), C in maps.items()}
    sizes = [min(C.shape[1 - ends.index(shape)] for ends, C in checked.items() if shape in ends)
             for shape in range(len(bases))]
    k = as_count("k", min(sizes) if k is None else k, 1, min(sizes))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    system = np.zeros((starts[-1], starts[-1]))
    for (i, j), C in checked.items():
        C = C[: sizes[j], : sizes[i]]
        one, two = slice(starts[i], starts[i + 1]), slice(starts[j], starts[j + 1])
        system[one, one] += C.T @ C
        system[two, two] += np.eye(sizes[j])
        system[two, one] -= C
        system[one, two] -= C.T
    lowest = np.linalg.eigh(system)[1][:, :k] * np.sqrt(len(bases))
    Y = [lowest[starts[i] : starts[i + 1]] for i in range(len(bases))]
    # the lowest are any mixture; turned so that the mean Laplacian is diagonal, smooth ones first
    energy = sum(y.T @ (basis.evals[: len(y), None] * y) for y, basis in zip(Y, bases, strict=True))
    turn = np.linalg.eigh(energy)[1]
    return [y @ turn for y in Y]


def shared_embedding(
    bases: Sequence[Eigenbasis], shared: Sequence[ArrayLike], d: int | None = None
) -> list[FloatArray]:
    """Return d coordinates (n_i, d) of every vertex of every shape, in one space: equal rows are the same point.

    The shared functions, matrices (k_i, k) as from `shared_functions`, over the square root of their mean energy, as in
    `global_point_signature`, without constants; all k - 1 by default. `nearest_rows` of two shapes is a point map,
    `spectral_clusters` of all cuts all of them at once.

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=2)), k=6)
    >>> Y = shared_functions([basis] * 2, {(0, 1): np.eye(6)})
    >>> rows_1, rows_2 = shared_embedding([basis] * 2, Y)
    >>> bool((nearest_rows(rows_1, rows_2) == np.arange(basis.n)).all())
    True
    """
    Y = [as_floats("shared", y, ("k_i", "k")) for y in shared]
    if len(Y) != len(bases):
        raise ValueError(f"shared must have one matrix for each of the {len(bases)} bases; got {len(Y)}")
    d = as_count("d", Y[0].shape[1] - 1 if d is None else d, 1, Y[0].shape[1] - 1)
    energies = np.mean([(y**2 * basis.evals[: len(y), None]).sum(0) for y, basis in zip(Y, bases, strict=True)], axis=0)
    return [np.asarray(basis.evecs[:, : len(y)] @ y)[:, 1 : d + 1] / np.sqrt(energies[1 : d + 1])
            for y, basis in zip(Y, bases, strict=True)]


def consistent_maps(bases: Sequence[Eigenbasis], maps: Maps, *, n_rounds: int = 2) -> dict[tuple[int, int], IntArray]:
    """Return for all pairs (i, j) of shapes a vertex of i for each vertex of j, so that the maps agree with each other.

    `bases` and `maps` are those of `shared_functions`. Each of n_rounds rounds: functions that the shapes share, for
    every pair the map of nearest points among them, and its matrix; after the first, maps between all pairs count
    (Huang et al., "Consistent ZoomOut: efficient spectral map synchronization", 2020).

    >>> from spectral_notes import compute_eigenbasis, cotan_laplacian, shapes
    >>> basis = compute_eigenbasis(*cotan_laplacian(shapes.potato(subdivisions=2)), k=6)
    >>> found = consistent_maps([basis] * 3, {(0, 1): np.eye(6), (1, 2): np.eye(6)})
    >>> bool((found[0, 2] == np.arange(basis.n)).all())
    True
    """
    C = {pair: np.asarray(matrix) for pair, matrix in maps.items()}
    for _ in range(as_count("n_rounds", n_rounds, 1)):
        Y = shared_functions(bases, C)
        rows = [basis.evecs[:, : len(y)] @ y for y, basis in zip(Y, bases, strict=True)]
        pairs = list(itertools.permutations(range(len(bases)), 2))
        p2p = {(i, j): nearest_rows(rows[i], rows[j]) for i, j in pairs}
        short = [basis.truncate(len(y)) for y, basis in zip(Y, bases, strict=True)]
        C = {(i, j): functional_map(short[i], short[j], p2p[i, j]) for i, j in pairs}
    return p2p


def cycle_error(meshes: Sequence[TriangleMesh], maps: Mapping[tuple[int, int], ArrayLike]) -> float:
    """Return how far points come back from where they started, round all triangles i -> j -> l -> i of maps.

    The mean distance through space over the square root of the area, each vertex counted by its area: 0 for maps that
    agree. `maps` holds for all pairs (i, j) of the meshes, both ways, a vertex of i for each vertex of j, as from
    `consistent_maps`.

    >>> from spectral_notes.shapes import sphere
    >>> ball, same = sphere(2), np.arange(162)
    >>> cycle_error([ball] * 3, {(i, j): same for i in range(3) for j in range(3) if i != j})
    0.0
    """
    if len(meshes) < 3:
        raise ValueError(f"meshes must be at least three for a way round; got {len(meshes)}")
    missing = [pair for pair in itertools.permutations(range(len(meshes)), 2) if pair not in maps]
    if missing:
        raise ValueError(f"maps must hold all pairs, both ways; missing: {missing[:3]}. `consistent_maps` returns them")
    p2p = {(i, j): as_point_map(p, meshes[i].n_vertices, meshes[j].n_vertices) for (i, j), p in maps.items()}
    errors = []
    for i, j, m in itertools.permutations(range(len(meshes)), 3):
        mesh, back = meshes[i], p2p[i, j][p2p[j, m][p2p[m, i]]]
        gaps = np.linalg.norm(mesh.vertices[back] - mesh.vertices, axis=1)
        errors.append(np.average(gaps, weights=mass_matrix(mesh).diagonal()) / np.sqrt(mesh.area))
    return float(np.mean(errors))


def _check_joined(n: int, maps: Maps) -> None:
    """Refuse keys that are no pairs of shapes, and maps that do not reach every shape from every other."""
    pairs = list(maps)
    if any(np.shape(pair) != (2,) or pair[0] == pair[1] or not set(pair) <= set(range(n)) for pair in pairs):
        raise ValueError(f"maps must have pairs of two of the shapes 0 .. {n - 1} as keys; got {pairs}")
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    graph = sp.csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
    pieces = sp.csgraph.connected_components(graph, directed=False)[0]
    if pieces > 1:
        raise ValueError(f"maps must join all {n} shapes; they leave {pieces} groups. Map one shape to each other")
