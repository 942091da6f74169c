"""From two meshes to a map between them: several starts, the one that lands right side up, and a word of doubt."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_count, as_floats, as_indices
from spectral_notes.descriptors import unit_area
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching.map_fitting import fit_functional_map, multiplications, point_descriptors, rotations
from spectral_notes.matching.map_refinement import sample_vertices, zoomout
from spectral_notes.matching.point_maps import orientation_score, precise_map
from spectral_notes.meshes import TriangleMesh, connected_components

START_SIZES = (20, 30, 40)  # modes of the least-squares starts
COARSE = 80  # modes up to which each start is refined, on samples, before they are compared
STEP = 20  # modes more in each round after that, with all vertices
N_OPERATORS = 20  # descriptors, evenly taken, that give pairs of operators: neighbours hardly differ
SURE = 0.96  # orientation score below which a piece of some percent of the area is mirrored
STRETCHED = 0.15  # isometry defect above which shapes are hardly poses of each other
LEVEL = 0.05  # scores this close say the same
NEAR = 0.1  # images this close, in square roots of the area, count as the same place
ENOUGH = 3  # landmarks that settle the symmetries


@dataclass(frozen=True, eq=False)
class ShapeMatch:
    """Hold a map between two shapes, and how far it is to be trusted.

    Parameters
    ----------
    C_12 : (k, k) array
        Coefficients of functions on 1 to those of functions on 2, in the bases below.
    p2p_21 : (n2,) array of int
        A vertex of 1 for each vertex of 2.
    orientation : float
        Share of shape 2's area that lands right side up, from 0 to 1; see `orientation_score`.
    doubt : str
        Why the map may be wrong; empty where nothing speaks against it.
    basis_1, basis_2 : Eigenbasis
        The modes of both shapes, each scaled to area one.
    """

    C_12: FloatArray
    p2p_21: IntArray
    orientation: float
    doubt: str
    basis_1: Eigenbasis
    basis_2: Eigenbasis

    @property
    def is_sure(self) -> bool:
        """Whether nothing speaks against the map."""
        return not self.doubt


def match_shapes(
    mesh_1: TriangleMesh, mesh_2: TriangleMesh, landmarks: ArrayLike = (), *, k: int = 200, n_samples: int = 1500,
    fast: bool = False, bases: tuple[Eigenbasis, Eigenbasis] | None = None,
) -> ShapeMatch:
    """Return a map between two nearly isometric shapes, from descriptors, landmarks and orientation, by ZoomOut.

    Three functional maps, of 20, 30 and 40 modes, are fitted to wave kernel signatures and landmarks so that they
    commute with products and rotations, and refined on samples; with fewer than three landmarks, the best of them also
    with other signs of its first modes. They are ranked by the area that lands right side up, less the defect from an
    isometry. The best is averaged with those that agree with it, refined to k modes with all vertices, and once more by
    a precise map. Doubt is raised by a low rank, and by a map that ranks alike and leads elsewhere.

    Parameters
    ----------
    mesh_1, mesh_2 : TriangleMesh
        The shapes: connected, consistently oriented, with or without boundary.
    landmarks : array_like of int, shape (q, 2), optional
        Pairs (vertex of 1, vertex of 2) of the same point. Without, only signatures and the orientation tell places
        apart, which is not enough for a shape with a symmetry that is no mirror.
    k : int
        Modes of the map; at most the number of vertices of each shape.
    n_samples : int
        Vertices that the starts are refined with, at least 80.
    fast : bool
        Refine on the samples to the end: for meshes of many vertices. Costs accuracy of about half an edge.
    bases : (Eigenbasis, Eigenbasis), optional
        At least k modes of both shapes, where they were computed before; else those of `cotan_laplacian`.

    Returns
    -------
    ShapeMatch
        The map, its orientation score, and its doubt.

    Raises
    ------
    TypeError, ValueError
        If a landmark is no vertex, a shape is not connected, or a number is out of range.

    Examples
    --------
    >>> from spectral_notes import shapes
    >>> mesh = shapes.potato(subdivisions=3)
    >>> match = match_shapes(mesh, mesh, k=60)
    >>> bool((match.p2p_21 == np.arange(mesh.n_vertices)).all()), match.orientation, match.is_sure
    (True, 1.0, True)

    References
    ----------
    Ren et al. (2018) for operators that know the orientation; Melzi et al., "ZoomOut" (2019); Ezuz and Ben-Chen (2017).
    """
    pairs = _landmark_pairs(mesh_1, mesh_2, landmarks)
    k = as_count("k", k, 8, min(mesh_1.n_vertices, mesh_2.n_vertices))
    n_samples = min(as_count("n_samples", n_samples, COARSE), mesh_1.n_vertices, mesh_2.n_vertices)
    basis_1, basis_2 = _bases(mesh_1, mesh_2, k, bases)
    samples = sample_vertices(mesh_1, n_samples), sample_vertices(mesh_2, n_samples)
    level = min(COARSE, k)

    def refined(start: FloatArray) -> tuple[float, FloatArray, IntArray]:
        C_12 = zoomout(basis_1, basis_2, start, k=max(len(start), level), samples=samples)
        p2p_21 = point_map(basis_1, basis_2, C_12)
        return orientation_score(mesh_1, mesh_2, p2p_21) - isometry_defect(C_12), C_12, p2p_21

    maps = [refined(start) for start in _starts(mesh_1, mesh_2, basis_1, basis_2, pairs)]
    if len(pairs) < ENOUGH:
        first = max(maps, key=lambda candidate: candidate[0])[1]
        maps += [refined(start) for start in _turned(first)]
    best, _, at_best = max(maps, key=lambda candidate: candidate[0])
    rivals = [(C, _same_place(mesh_1, basis_2, at, at_best)) for score, C, at in maps if score > best - LEVEL]
    C_12 = np.mean([C for C, same in rivals if same], axis=0)
    C_12 = zoomout(basis_1, basis_2, C_12, k=k, step=STEP, samples=samples if fast else None)
    C_12 = functional_map(basis_1, basis_2, precise_map(mesh_1, basis_1, basis_2, C_12))
    p2p_21 = point_map(basis_1, basis_2, C_12)
    score = orientation_score(mesh_1, mesh_2, p2p_21)
    doubt = _doubt(score, isometry_defect(C_12), all(same for _, same in rivals))
    return ShapeMatch(C_12, p2p_21, score, doubt, basis_1, basis_2)


def isometry_defect(C_12: ArrayLike) -> float:
    """Return how far a functional map is from that of an isometry, without unit: |C^T C - I| / sqrt(k1), Frobenius.

    For shapes of equal area. About 0.1 for poses of one body in different triangulations.

    Parameters
    ----------
    C_12 : array_like, shape (k2, k1)
        The functional map.

    Returns
    -------
    float
        0 for an isometry, 1 for the zero map.

    Examples
    --------
    >>> isometry_defect(np.diag([1.0, -1.0])), isometry_defect(np.zeros((2, 2)))
    (0.0, 1.0)
    """
    C = as_floats("C_12", C_12, ("k2", "k1"))
    return float(np.linalg.norm(C.T @ C - np.eye(C.shape[1])) / np.sqrt(C.shape[1]))


def _turned(C_12: FloatArray) -> list[FloatArray]:
    """The start of a map with other signs of modes 1 to 4: where the symmetries of a shape would send it."""
    small = C_12[:8, :8]
    patterns = itertools.product((1.0, -1.0), repeat=4)
    return [small * np.array([1.0, *signs, *np.ones(len(small) - 5)]) for signs in patterns if min(signs) < 0.0]


def _landmark_pairs(mesh_1: TriangleMesh, mesh_2: TriangleMesh, landmarks: ArrayLike) -> IntArray:
    """The landmarks as pairs, both shapes connected."""
    pairs = np.asarray(landmarks)
    if not pairs.size:
        pairs = np.empty((0, 2), dtype=np.int64)
    pairs = as_indices("landmarks", pairs, ("q", 2), max(mesh_1.n_vertices, mesh_2.n_vertices))
    for number, mesh in enumerate((mesh_1, mesh_2), start=1):
        as_indices(f"landmarks of shape {number}", pairs[:, number - 1], ("q",), mesh.n_vertices)
        _check_connected(f"mesh_{number}", mesh)
    return pairs


def _same_place(mesh_1: TriangleMesh, basis_2: Eigenbasis, p2p_21: IntArray, other: IntArray) -> bool:
    """Whether two maps send all but a twentieth of shape 2's area to nearly the same places."""
    gaps = np.linalg.norm(mesh_1.vertices[p2p_21] - mesh_1.vertices[other], axis=1) / np.sqrt(mesh_1.area)
    return bool(basis_2.M.sum(axis=1)[gaps > NEAR].sum() < 0.05 * basis_2.M.sum())


def _check_connected(name: str, mesh: TriangleMesh) -> None:
    """Refuse a shape in several pieces, whose zero modes say nothing about which piece goes where."""
    n_pieces = int(connected_components(mesh).max()) + 1
    if n_pieces > 1:
        raise ValueError(f"{name} must be connected; it has {n_pieces} components. Match them one by one")


def _bases(
    mesh_1: TriangleMesh, mesh_2: TriangleMesh, k: int, bases: tuple[Eigenbasis, Eigenbasis] | None
) -> tuple[Eigenbasis, Eigenbasis]:
    """The first k modes of both shapes, scaled to area one."""
    if bases is None:
        bases = compute_eigenbasis(*cotan_laplacian(mesh_1), k), compute_eigenbasis(*cotan_laplacian(mesh_2), k)
    for number, (basis, mesh) in enumerate(zip(bases, (mesh_1, mesh_2), strict=True), start=1):
        if basis.n != mesh.n_vertices or basis.k < k:
            told = f"{k} modes of {mesh.n_vertices} vertices for shape {number}; got {basis.k} of {basis.n}"
            raise ValueError(f"bases must hold {told}")
    return unit_area(bases[0].truncate(k)), unit_area(bases[1].truncate(k))


def _starts(
    mesh_1: TriangleMesh, mesh_2: TriangleMesh, basis_1: Eigenbasis, basis_2: Eigenbasis, pairs: IntArray
) -> list[FloatArray]:
    """Functional maps fitted with different numbers of modes."""
    f_1, f_2 = point_descriptors(basis_1, pairs[:, 0]), point_descriptors(basis_2, pairs[:, 1])
    some = np.linspace(0, f_1.shape[1] - 1, N_OPERATORS).astype(np.int64)
    g_1, g_2 = f_1[:, some], f_2[:, some]
    starts = []
    for size in sorted({min(size, basis_1.k) for size in START_SIZES}):
        few_1, few_2 = basis_1.truncate(size), basis_2.truncate(size)
        operators_1 = multiplications(few_1, g_1) + rotations(mesh_1, few_1, g_1)
        operators_2 = multiplications(few_2, g_2) + rotations(mesh_2, few_2, g_2)
        pairs_of_operators = list(zip(operators_1, operators_2, strict=True))
        starts.append(fit_functional_map(few_1, few_2, f_1, f_2, operators=pairs_of_operators))
    return starts


def _doubt(score: float, defect: float, agreed: bool) -> str:
    """What speaks against a map, in words."""
    if score < SURE:
        return f"{1.0 - score:.0%} of the area lands upside down: a part of the map is mirrored, or the shapes differ"
    if not agreed:
        return "another map is nearly as good and leads elsewhere: the shapes have a symmetry; give landmarks"
    if defect > STRETCHED:
        return f"the map is far from an isometry (defect {defect:.2f}): it is wrong, or the shapes differ"
    return ""
