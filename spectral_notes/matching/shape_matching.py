"""From two meshes to a map between them: candidates, the one that lands right side up, and how far to doubt it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats, as_indices
from spectral_notes.descriptors import unit_area
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.geometry.geodesics import path_lengths
from spectral_notes.geometry.mending import outward
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching.map_fitting import fit_functional_map, multiplications, point_descriptors, rotations
from spectral_notes.matching.map_refinement import bijective_zoomout, zoomout
from spectral_notes.matching.map_search import View, candidate_maps, misfit_of, view
from spectral_notes.matching.point_maps import orientation_score, precise_map
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import (
    TriangleMesh,
    connected_components,
    euler_characteristic,
    farthest_points,
    is_closed,
)
from spectral_notes.shapes.sampling import coarse_copy

Meshes = tuple[TriangleMesh, TriangleMesh]
Bases = tuple[Eigenbasis, Eigenbasis]

N_VIEWED = 400  # samples that the search sees
N_WAYS = 30  # samples between which ways are compared
N_HANDED, N_PLAIN = 3, 2  # candidates of two searches that are refined before they are compared
ENOUGH = 4  # landmarks from which on they give a candidate of their own
SOFT_LANDMARKS = 12  # images under a candidate that the system is given beside true landmarks
# columns of each descriptor, how many of all give pairs of operators, and modes, of the system with orientation: where
# images under a map count beside landmarks, and where landmarks stand alone
WITH_IMAGES, ALONE = (20, 10, 40), (100, 60, 30)
COARSE = 80  # modes up to which candidates are refined, on samples
STEP = 10  # modes more in each round after that, with all vertices
RIGID = 0.35  # the strain from which on a mirrored map is no sign of a mirror image
NEAR = 0.1  # images this close, in square roots of the area, count as the same place
LIGHT = 5000  # vertices of the copies that `fast` matches
BIAS = -5.2  # of the doubt, when no clue speaks
# the weight of each clue in the doubt, and from where on it counts
CLUES = {
    "upside down": (30.0, 0.0), "defect": (4.0, 0.0), "rival": (150.0, -0.55), "mirrored": (12.0, 0.0),
    "mirror image": (200.0, 0.05), "genus": (6.0, 0.0),
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
        the best mirrored map ranks above this one, and how far if it is nearly an isometry, as a mirror image is; how
        far the best other map that leads elsewhere does, less what it strains; -1 each, if there is none; and whether
        two closed shapes differ in their number of holes
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

    A tree over the signs of the first modes gives candidates that agree with signatures, with their gradients' turns,
    which tell left from right, and with landmarks; from four landmarks on, a fit to them alone is one more. They are
    fitted again, by least squares with orientation, refined on samples to 80 modes, and ranked by the area that lands
    right side up, the defect from an isometry, and the misfits of signatures and of lengths of ways. The first of them
    is refined with all vertices, fitted a second time, to images under what it was refined to, refined to k modes, and
    once more by a precise map. Bodies inside out are turned first (Ren et al., 2018, for orientation; Melzi et al.,
    "ZoomOut", 2019; Ren et al., "MapTree", 2020).

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

    Examples
    --------
    >>> from spectral_notes import shapes
    >>> mesh = shapes.coarse_copy(shapes.goat(), 1000)[0]
    >>> match = match_shapes(mesh, mesh, k=60)
    >>> bool((match.p2p_21 == np.arange(mesh.n_vertices)).all()), match.orientation, match.is_sure
    (True, 1.0, True)
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
    """Return how far a functional map C_12 (k2, k1) of shapes of equal area is from that of an isometry, without unit.

    |C^T C - I| / sqrt(k1), Frobenius: 0 for an isometry, about 0.1 for poses of one body, 1 for the zero map.

    >>> isometry_defect(np.diag([1.0, -1.0])), isometry_defect(np.zeros((2, 2)))
    (0.0, 1.0)
    """
    C = as_floats("C_12", C_12, ("k2", "k1"))
    return float(np.linalg.norm(C.T @ C - np.eye(C.shape[1])) / np.sqrt(C.shape[1]))


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
    """Hold a candidate after refinement on samples, with its rank: the higher, the better it fits."""

    start: FloatArray
    C_12: FloatArray
    p2p_21: IntArray
    strain: float  # how far it is from an isometry: the defect, and ways that change their length
    rank: float
    is_upright: bool


def refined_candidates(
    meshes: Meshes, bases: Bases, samples: tuple[IntArray, IntArray], pairs: IntArray, hints: list[FloatArray]
) -> list[Refined]:
    """The map that landmarks give, and those with the least misfit that land right side up, and one that is mirrored.

    A search that tells left from right finds the first N_HANDED; one that does not finds N_PLAIN more, for shapes that
    have no left and right, and the mirrored one.
    """
    one, two = (view(meshes[i], bases[i], samples[i][:N_VIEWED], pairs[:, i], hints[i]) for i in (0, 1))
    starts: list[tuple[FloatArray, bool]] = []
    for right in (True, False):
        facing = _facing(meshes, right)
        if len(pairs) >= ENOUGH and not starts and _lands(facing, bases, alone := _fitted(facing, bases, pairs)):
            starts.append((alone, right))
    for handed, wanted in ((True, {True: N_HANDED}), (False, {True: N_PLAIN, False: 1})):
        found = [(near.C_12, _lands(meshes, bases, near.C_12)) for near in candidate_maps(one, two, handed=handed)]
        for right, n in wanted.items():
            first = [C_12 for C_12, lands in found if lands == right][:n]
            starts += [(_fitted(_facing(meshes, right), bases, pairs, C_12), right) for C_12 in first]
    return [_refined(_facing(meshes, right), bases, samples, (one, two), start, right) for start, right in starts]


def best_match(meshes: Meshes, bases: Bases, ends: list[Refined], pairs: IntArray) -> ShapeMatch:
    """The first by rank, or the first that leads where it leads if landmarks were enough, refined, with its doubt."""
    best = max(ends, key=lambda end: (end.is_upright, end.rank))
    if len(pairs) >= ENOUGH:  # they say more of details than the search does
        beside = [end.is_upright == best.is_upright and not _elsewhere(meshes, bases[1], best, end) for end in ends]
        best = ends[beside.index(True)]
    C_12 = zoomout(*bases, best.start, k=len(best.C_12), step=STEP)  # its images say more than those of the search
    C_12 = zoomout(*bases, _fitted(_facing(meshes, best.is_upright), bases, pairs, C_12), step=STEP)
    C_12 = functional_map(*bases, precise_map(meshes[0], *bases, C_12))
    p2p_21 = point_map(*bases, C_12)
    score = orientation_score(*meshes, p2p_21)
    far = [end for end in ends if end is not best and _elsewhere(meshes, bases[1], best, end)]
    clues = _clues(meshes, score, isometry_defect(C_12), best, far)
    return ShapeMatch(C_12, p2p_21, score, *doubt_of(clues), clues, *bases)


def _facing(meshes: Meshes, is_upright: bool) -> Meshes:
    """The shapes as they are, or the second turned over, for a map that is upside down, as of a mirror image."""
    return meshes if is_upright else (meshes[0], TriangleMesh(meshes[1].vertices, meshes[1].faces[:, ::-1]))


def _lands(meshes: Meshes, bases: Bases, C_12: FloatArray) -> bool:
    """Whether most of shape 2 lands right side up."""
    return orientation_score(*meshes, point_map(*bases, C_12)) > 0.5


def _refined(
    meshes: Meshes, bases: Bases, samples: tuple[IntArray, IntArray], views: tuple[View, View], start: FloatArray,
    is_upright: bool,
) -> Refined:
    """A map refined to COARSE modes; its rank: the area on its own side, less the defect, less the log of its gaps."""
    C, _ = bijective_zoomout(*bases, start, start.T, k=max(len(start), min(COARSE, bases[0].k)), samples=samples)
    p2p_21, defect = point_map(*bases, C), isometry_defect(C)
    distortion = _distortion(meshes, p2p_21, samples[1][:N_WAYS])
    gaps = (misfit_of(*views, C) + 0.05) * (distortion + 0.02)  # smaller ones are the triangles', not the maps'
    rank = orientation_score(*meshes, p2p_21) - defect - 0.5 * np.log(gaps)
    return Refined(start, C, p2p_21, defect + 8.0 * distortion, float(rank), is_upright)


def _distortion(meshes: Meshes, p2p_21: IntArray, at_2: IntArray) -> float:
    """How far ways between some vertices of 2 differ from those between their images, in square roots of the area."""
    ways = [path_lengths(mesh, at)[:, at] / np.sqrt(mesh.area)
            for mesh, at in zip(meshes, (p2p_21[at_2], at_2), strict=True)]
    return float(abs(ways[0] - ways[1]).mean())


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
    ahead = {up: [(one.rank - best.rank, one.strain) for one in others if one.is_upright == up] for up in (True, False)}
    holes = {euler_characteristic(mesh) if is_closed(mesh) else None for mesh in meshes}
    return {
        "upside down": 1.0 - score, "defect": defect, "genus": float(len(holes) == 2 and None not in holes),
        "rival": max((gap - strain for gap, strain in ahead[True]), default=-1.0),
        "mirrored": max((gap for gap, _ in ahead[False]), default=-1.0),
        "mirror image": max((min(gap, RIGID - strain) for gap, strain in ahead[False]), default=-1.0),
    }


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
        "mirrored": "upside down the map fits better: it is wrong, or one shape is the mirror image of the other",
        "mirror image": "upside down the map fits better: one shape is perhaps the mirror image of the other",
    }
    return float(doubt), words[max(parts, key=lambda name: parts[name])] if doubt >= 0.5 else ""
