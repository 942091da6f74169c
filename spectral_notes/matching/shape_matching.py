"""From two meshes to a map between them: candidates, the one that lands right side up, and how far to doubt it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats, as_indices
from spectral_notes.descriptors import unit_area
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching.map_fitting import fit_functional_map, multiplications, point_descriptors, rotations
from spectral_notes.matching.map_refinement import bijective_zoomout, zoomout
from spectral_notes.matching.map_search import candidate_maps, misfit_of, view
from spectral_notes.matching.point_maps import orientation_score, precise_map
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import (
    TriangleMesh,
    connected_components,
    edges_with_counts,
    euler_characteristic,
    farthest_points,
    is_closed,
    signed_volume,
)
from spectral_notes.shapes.sampling import coarse_copy

Meshes = tuple[TriangleMesh, TriangleMesh]
Bases = tuple[Eigenbasis, Eigenbasis]

N_VIEWED = 400  # samples that the search sees
N_TRIED = 4  # candidates that are refined before they are compared
ENOUGH = 4  # landmarks from which on they give a candidate of their own, and the best is fitted a second time
SOFT_LANDMARKS = 12  # images under a candidate that the system is given beside true landmarks
# columns of each descriptor, how many of all give pairs of operators, and modes, of the system with orientation: where
# images under a map count beside landmarks, and where landmarks stand alone
WITH_IMAGES, ALONE = (20, 10, 40), (100, 60, 30)
COARSE = 80  # modes up to which candidates are refined, on samples
STEP = 20  # modes more in each round after that, with all vertices
FINE_STEP = 10  # the same, between the two fits that landmarks pay for
NEAR = 0.1  # images this close, in square roots of the area, count as the same place
MOSTLY_HOLE = 0.2  # holes, as circles of their length, of this share of the area leave a shape without an inside
LIGHT = 5000  # vertices of the copies that `fast` matches
BIAS = -4.0  # of the doubt, when no clue speaks
# the weight of each clue in the doubt, and from where on it counts
CLUES = {
    "upside down": (20.0, 0.0), "defect": (4.0, 0.0), "rival": (60.0, -0.25), "mirrored": (150.0, 0.05),
    "genus": (4.0, 0.0),
}


@dataclass(frozen=True, eq=False)
class ShapeMatch:
    """Hold a map between two shapes, and how far it is to be doubted.

    Parameters
    ----------
    C_12 : (k, k), coefficients of functions on 1 to those of functions on 2, in the bases below
    p2p_21 : (n2,) int, a vertex of 1 for each vertex of 2
    orientation : share of shape 2's area that lands right side up, from 0 to 1; see `orientation_score`
    doubt : from 0 to 1: how much speaks against the map, a score whose weights were chosen on four persons
    reason : why the map may be wrong, where that is more likely than not; else empty
    clues : what the doubt was computed from: the share of the area upside down; the defect from an isometry; how far
        the best map that leads elsewhere ranks above this one, less its own defect, and how far the best mirrored one
        does (-1 if there is none); and whether two closed shapes differ in their number of holes
    basis_1, basis_2 : the modes of both shapes, each scaled to area one
    """

    C_12: FloatArray
    p2p_21: IntArray
    orientation: float
    doubt: float
    reason: str
    clues: Mapping[str, float]
    basis_1: Eigenbasis
    basis_2: Eigenbasis

    @property
    def is_sure(self) -> bool:
        """Whether the map is more likely right than wrong."""
        return not self.reason


def match_shapes(
    mesh_1: TriangleMesh, mesh_2: TriangleMesh, landmarks: ArrayLike = (), *, k: int = 200, n_samples: int = 1500,
    up: ArrayLike | None = None, fast: bool = False, bases: Bases | None = None,
) -> ShapeMatch:
    """Return a map between two nearly isometric shapes, from signatures, landmarks and orientation, by ZoomOut.

    A tree over the signs of the first modes gives candidates that agree with signatures and landmarks. The best that
    land right side up are fitted again, by least squares with orientation, refined on samples to 80 modes, and ranked
    by the area that lands right side up, the defect from an isometry, and the misfit of signatures. The first of them
    is refined to k modes with all vertices, and once more by a precise map. From four landmarks on, a fit to them alone
    is a candidate too, and the best is fitted a second time, to images under what it was refined to. Bodies inside out
    are turned first.

    Parameters
    ----------
    mesh_1, mesh_2 : the shapes: connected, consistently oriented, with or without boundary
    landmarks : (q, 2) int, pairs (vertex of 1, vertex of 2) of the same point. Without, only signatures and the
        orientation tell places apart, which is not enough for a shape with a symmetry that is no mirror.
    k : modes of the map; at most the number of vertices of each shape
    n_samples : vertices that candidates are refined with, at least 80
    up : (3,), a direction that both shapes share, such as that away from the floor: a hint that is no longer intrinsic
    fast : match copies of 5,000 vertices, and carry the map over: for large meshes. Costs accuracy of about half an
        edge of the copy.
    bases : (Eigenbasis, Eigenbasis), at least k modes of both shapes, where they were computed before; else those of
        `cotan_laplacian`

    Returns
    -------
    The map, its orientation score, and its doubt.

    Raises
    ------
    ValueError
        If a shape is not connected.

    Examples
    --------
    >>> from spectral_notes import shapes
    >>> mesh = shapes.coarse_copy(shapes.goat(), 1000)[0]
    >>> match = match_shapes(mesh, mesh, k=60)
    >>> bool((match.p2p_21 == np.arange(mesh.n_vertices)).all()), match.orientation, match.is_sure
    (True, 1.0, True)

    References
    ----------
    Ren et al. (2018), for orientation; Melzi et al., "ZoomOut" (2019); Ren et al., "MapTree" (2020).
    """
    pairs = landmark_pairs(mesh_1, mesh_2, landmarks)
    k = as_count("k", k, 8, min(mesh_1.n_vertices, mesh_2.n_vertices))
    n_samples = min(as_count("n_samples", n_samples, COARSE), mesh_1.n_vertices, mesh_2.n_vertices)
    meshes = outward(mesh_1), outward(mesh_2)
    hints = [_heights(mesh, up) for mesh in meshes]
    if fast and max(mesh_1.n_vertices, mesh_2.n_vertices) > LIGHT:
        return _match_copies(meshes, pairs, k, n_samples, up, bases)
    both = _bases(*meshes, k, bases)
    samples = farthest_points(meshes[0].vertices, n_samples), farthest_points(meshes[1].vertices, n_samples)
    return best_match(meshes, both, refined_candidates(meshes, both, samples, pairs, hints), pairs)


def isometry_defect(C_12: ArrayLike) -> float:
    """Return how far a functional map is from that of an isometry, without unit: |C^T C - I| / sqrt(k1), Frobenius.

    Parameters
    ----------
    C_12 : (k2, k1), a functional map between shapes of equal area

    Returns
    -------
    0 for an isometry, about 0.1 for poses of one body, 1 for the zero map.

    Examples
    --------
    >>> isometry_defect(np.diag([1.0, -1.0])), isometry_defect(np.zeros((2, 2)))
    (0.0, 1.0)
    """
    C = as_floats("C_12", C_12, ("k2", "k1"))
    return float(np.linalg.norm(C.T @ C - np.eye(C.shape[1])) / np.sqrt(C.shape[1]))


def outward(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh, its faces turned over where it is a body inside out; what is mostly hole, a field, stays."""
    pairs, n_faces = edges_with_counts(mesh)
    i, j = rim = pairs[n_faces == 1].T
    holes = sp.csgraph.connected_components(sp.csr_array((np.ones(len(i)), rim), shape=2 * (mesh.n_vertices,)))[1]
    lengths = np.bincount(holes[i], np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1))
    if signed_volume(mesh) >= 0.0 or (lengths**2).sum() > 4.0 * np.pi * MOSTLY_HOLE * mesh.area:  # circles hold most
        return mesh
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1], mesh.name)


def _match_copies(
    meshes: Meshes, pairs: IntArray, k: int, n_samples: int, up: ArrayLike | None, bases: Bases | None
) -> ShapeMatch:
    """The map of light copies, carried over to the meshes through the surface of the second copy."""
    copies = coarse_copy(meshes[0], LIGHT)[0], coarse_copy(meshes[1], LIGHT)[0]
    onto = [surface_weights(mesh.vertices, copy) for mesh, copy in zip(meshes, copies, strict=True)]
    marks = np.column_stack([np.asarray(P[pairs[:, i]].argmax(axis=1)).ravel() for i, P in enumerate(onto)])
    few = min(k, copies[0].n_vertices, copies[1].n_vertices)
    light = match_shapes(copies[0], copies[1], marks, k=few, n_samples=n_samples, up=up)
    images = precise_map(copies[0], light.basis_1, light.basis_2, light.C_12) @ copies[0].vertices
    p2p_21 = cKDTree(meshes[0].vertices).query(onto[1] @ images)[1].astype(np.int64)
    both = _bases(*meshes, k, bases)
    return replace(light, C_12=functional_map(*both, p2p_21), p2p_21=p2p_21, basis_1=both[0], basis_2=both[1])


def landmark_pairs(mesh_1: TriangleMesh, mesh_2: TriangleMesh, landmarks: ArrayLike) -> IntArray:
    """The landmarks as pairs, both shapes connected."""
    pairs = np.asarray(landmarks)
    if not pairs.size:
        pairs = np.empty((0, 2), dtype=np.int64)
    pairs = as_indices("landmarks", pairs, ("q", 2), max(mesh_1.n_vertices, mesh_2.n_vertices))
    for number, mesh in enumerate((mesh_1, mesh_2), start=1):
        as_indices(f"landmarks of shape {number}", pairs[:, number - 1], ("q",), mesh.n_vertices)
        n_pieces = int(connected_components(mesh).max()) + 1
        if n_pieces > 1:
            raise ValueError(f"mesh_{number} must be connected; it has {n_pieces} components. Match them one by one")
    return pairs


def _heights(mesh: TriangleMesh, up: ArrayLike | None) -> FloatArray:
    """The height of each vertex over the centre, in square roots of the area, as one column; none without `up`."""
    if up is None:
        return np.empty((mesh.n_vertices, 0))
    direction = as_floats("up", up, (3,))
    if not direction.any():
        raise ValueError("up must not be the zero vector; give the direction away from the floor, such as [0, 1, 0]")
    height = mesh.vertices @ (direction / np.linalg.norm(direction))
    return np.asarray((height - (height.max() + height.min()) / 2)[:, None] / np.sqrt(mesh.area))


def _bases(mesh_1: TriangleMesh, mesh_2: TriangleMesh, k: int, bases: Bases | None) -> Bases:
    """The first k modes of both shapes, scaled to area one."""
    if bases is None:
        bases = compute_eigenbasis(*cotan_laplacian(mesh_1), k), compute_eigenbasis(*cotan_laplacian(mesh_2), k)
    for number, (basis, mesh) in enumerate(zip(bases, (mesh_1, mesh_2), strict=True), start=1):
        if basis.n != mesh.n_vertices or basis.k < k:
            told = f"{k} modes of {mesh.n_vertices} vertices for shape {number}; got {basis.k} of {basis.n}"
            raise ValueError(f"bases must hold {told}")
    return unit_area(bases[0].truncate(k)), unit_area(bases[1].truncate(k))


@dataclass(frozen=True, eq=False)
class Refined:
    """Hold a candidate after refinement on samples, ranked: area on its own side, less defect, less log misfit / 4."""

    start: FloatArray
    C_12: FloatArray
    p2p_21: IntArray
    defect: float
    rank: float
    is_upright: bool


def refined_candidates(
    meshes: Meshes, bases: Bases, samples: tuple[IntArray, IntArray], pairs: IntArray, hints: list[FloatArray]
) -> list[Refined]:
    """The map that landmarks give, and those with the least misfit: N_TRIED right side up, one mirrored, if any are."""
    one, two = (view(bases[i], samples[i][:N_VIEWED], pairs[:, i], hints[i]) for i in (0, 1))
    found = candidate_maps(one, two)
    upright = [orientation_score(*meshes, point_map(*bases, candidate.C_12)) > 0.5 for candidate in found]
    ends = [
        _refined(meshes, bases, samples, _fitted(_facing(meshes, right), bases, pairs, near.C_12), near.misfit, right)
        for right, n in ((True, N_TRIED), (False, 1))
        for near in [one for one, up in zip(found, upright, strict=True) if up == right][:n]
    ]
    if len(pairs) < ENOUGH:
        return ends
    C_12 = _fitted(meshes, bases, pairs)
    right = orientation_score(*meshes, point_map(*bases, C_12)) > 0.5
    return [_refined(meshes, bases, samples, C_12, misfit_of(one, two, C_12), right), *ends]


def best_match(meshes: Meshes, bases: Bases, ends: list[Refined], pairs: IntArray) -> ShapeMatch:
    """The first by rank, or the first that leads where it leads if landmarks were enough, refined, with its doubt."""
    best = max(ends, key=lambda end: (end.is_upright, end.rank))
    if len(pairs) >= ENOUGH:
        # landmarks say more of details than the search does, and once refined, its images say more than its first ones
        beside = [end.is_upright == best.is_upright and not _elsewhere(meshes, bases[1], best, end) for end in ends]
        best = ends[beside.index(True)]
        C_12 = zoomout(*bases, best.start, step=FINE_STEP)
        C_12 = zoomout(*bases, _fitted(_facing(meshes, best.is_upright), bases, pairs, C_12), step=FINE_STEP)
    else:
        C_12 = zoomout(*bases, best.C_12, step=STEP)
    C_12 = functional_map(*bases, precise_map(meshes[0], *bases, C_12))
    p2p_21 = point_map(*bases, C_12)
    score = orientation_score(*meshes, p2p_21)
    far = [end for end in ends if end is not best and _elsewhere(meshes, bases[1], best, end)]
    clues = _clues(meshes, score, isometry_defect(C_12), best, far)
    return ShapeMatch(C_12, p2p_21, score, *doubt_of(clues), clues, *bases)


def _facing(meshes: Meshes, is_upright: bool) -> Meshes:
    """The shapes as they are, or the second turned over, for a map that is upside down, as of a mirror image."""
    return meshes if is_upright else (meshes[0], TriangleMesh(meshes[1].vertices, meshes[1].faces[:, ::-1]))


def _refined(
    meshes: Meshes, bases: Bases, samples: tuple[IntArray, IntArray], start: FloatArray, misfit: float, is_upright: bool
) -> Refined:
    """A map refined to COARSE modes, and ranked; one that is upside down as a mirror image."""
    C, _ = bijective_zoomout(*bases, start, start.T, k=max(len(start), min(COARSE, bases[0].k)), samples=samples)
    p2p_21 = point_map(*bases, C)
    defect = isometry_defect(C)
    score = orientation_score(*_facing(meshes, is_upright), p2p_21)
    rank = score - defect - 0.25 * np.log(max(misfit, 0.0) + 1e-9)
    return Refined(start, C, p2p_21, defect, float(rank), is_upright)


def _fitted(meshes: Meshes, bases: Bases, pairs: IntArray, C_12: FloatArray | None = None) -> FloatArray:
    """A map fitted to signatures, landmarks, products and orientation; and to some images under a map that is known."""
    n_each, n_operators, size = ALONE if C_12 is None else WITH_IMAGES
    if C_12 is not None:
        at_2 = farthest_points(meshes[1].vertices, min(SOFT_LANDMARKS, meshes[1].n_vertices))
        pairs = np.vstack([pairs, np.column_stack([point_map(*bases, C_12)[at_2], at_2])])
    few, functions, operators = [], [], []
    for mesh, basis, marks in zip(meshes, bases, pairs.T, strict=True):
        f = point_descriptors(basis, marks, n_each=n_each)
        some = f[:, np.linspace(0, f.shape[1] - 1, n_operators).astype(np.int64)]
        short = basis.truncate(min(size, basis.k))
        unit = TriangleMesh(mesh.vertices / np.sqrt(mesh.area), mesh.faces)  # of area one, as the bases are
        few.append(short)
        functions.append(f)
        operators.append(multiplications(short, some) + rotations(unit, short, some))
    return fit_functional_map(few[0], few[1], *functions, operators=list(zip(*operators, strict=True)))


def _elsewhere(meshes: Meshes, basis_2: Eigenbasis, one: Refined, other: Refined) -> bool:
    """Whether two maps send more than a twentieth of shape 2's area to places that are not near."""
    points = meshes[0].vertices
    gaps = np.linalg.norm(points[one.p2p_21] - points[other.p2p_21], axis=1) / np.sqrt(meshes[0].area)
    return bool(basis_2.M.sum(axis=1)[gaps > NEAR].sum() > 0.05)


def _clues(meshes: Meshes, score: float, defect: float, best: Refined, others: list[Refined]) -> dict[str, float]:
    """What speaks against a map; a rival speaks by its rank and by how nearly it is an isometry, as a symmetry is."""
    rival = max((one.rank - best.rank - one.defect for one in others if one.is_upright), default=-1.0)
    mirrored = max((one.rank - best.rank for one in others if not one.is_upright), default=-1.0)
    holes = {euler_characteristic(mesh) if is_closed(mesh) else None for mesh in meshes}
    genus = float(len(holes) == 2 and None not in holes)
    return {"upside down": 1.0 - score, "defect": defect, "rival": rival, "mirrored": mirrored, "genus": genus}


def doubt_of(clues: Mapping[str, float]) -> tuple[float, str]:
    """How likely a map is wrong, by a logistic function of the clues; and the one that weighs most, in words."""
    parts = {name: weight * max(clues[name] - start, 0.0) for name, (weight, start) in CLUES.items()}
    doubt = 1.0 / (1.0 + np.exp(-BIAS - sum(parts.values())))
    words = {
        "upside down": f"{clues['upside down']:.0%} of the area lands upside down: a part of the map is mirrored, or "
                       "the shapes differ",
        "defect": f"the map is far from an isometry (defect {clues['defect']:.2f}): it is wrong, or the shapes differ",
        "rival": "another map fits nearly as well and leads elsewhere: the shapes have a symmetry; give landmarks",
        "genus": "the shapes have different numbers of holes, so that no map between them is one to one",
        "mirrored": "upside down the map fits better: one shape is perhaps the mirror image of the other",
    }
    return float(doubt), words[max(parts, key=lambda name: parts[name])] if doubt >= 0.5 else ""
