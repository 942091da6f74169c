"""From two meshes to a map between them: several starts, the one that lands right side up, and a word of doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import FloatArray, IntArray, as_count, as_indices
from spectral_notes.descriptors import unit_area
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, point_map
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.map_fitting import Pairs, fit_functional_map, multiplications, point_descriptors, rotations
from spectral_notes.map_refinement import sample_vertices, zoomout
from spectral_notes.meshes import TriangleMesh, connected_components
from spectral_notes.point_maps import orientation_score

START_SIZES = (30, 20, 40)  # modes of the least-squares start; each is one try
COARSE = 80  # modes up to which every start is refined before they are compared
EVERY = 10  # of this many descriptors one gives a pair of operators: neighbours hardly differ
SURE = 0.96  # orientation score below which a piece of some percent of the area is mirrored


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
    mesh_1: TriangleMesh, mesh_2: TriangleMesh, landmarks: ArrayLike = (), *, k: int = 200,
    n_samples: int | None = 1500, bases: tuple[Eigenbasis, Eigenbasis] | None = None,
) -> ShapeMatch:  # fmt: skip
    """Return a map between two nearly isometric shapes, from descriptors, landmarks and orientation, by ZoomOut.

    For several numbers of modes a functional map is fitted to wave kernel signatures and landmarks and refined on
    samples. The one that lands right side up with most of its area is refined to k modes.

    Parameters
    ----------
    mesh_1, mesh_2 : TriangleMesh
        The shapes: connected, consistently oriented, with or without boundary.
    landmarks : array_like of int, shape (q, 2), optional
        Pairs (vertex of 1, vertex of 2) of the same point; three, well apart, settle most symmetries.
    k : int
        Modes of the map; at most the number of vertices of each shape.
    n_samples : int, optional
        Vertices that the refinement works with before two last rounds with all of them; None works with all of them.
    bases : (Eigenbasis, Eigenbasis), optional
        At least k modes of both shapes, where they were computed before; else those of `cotan_laplacian`.

    Returns
    -------
    ShapeMatch
        The map, its orientation score, and its doubt.

    Raises
    ------
    TypeError, ValueError
        If a landmark is no vertex, a shape is not connected, or k is out of range.

    Examples
    --------
    >>> from spectral_notes import shapes
    >>> mesh = shapes.potato(subdivisions=3)
    >>> match = match_shapes(mesh, mesh, k=60)
    >>> bool((match.p2p_21 == np.arange(mesh.n_vertices)).all()), match.orientation, match.is_sure
    (True, 1.0, True)

    References
    ----------
    Ren et al. (2018) for operators that know the orientation; Melzi et al., "ZoomOut" (2019).
    """
    pairs = np.asarray(landmarks)
    pairs = as_indices("landmarks", pairs if pairs.size else np.empty((0, 2), dtype=np.int64), ("q", 2),
                       max(mesh_1.n_vertices, mesh_2.n_vertices))  # fmt: skip
    for number, mesh in enumerate((mesh_1, mesh_2), start=1):
        as_indices(f"landmarks of shape {number}", pairs[:, number - 1], ("q",), mesh.n_vertices)
        _check_connected(f"mesh_{number}", mesh)
    k = as_count("k", k, 3, min(mesh_1.n_vertices, mesh_2.n_vertices))
    basis_1, basis_2 = _bases(mesh_1, mesh_2, k, bases)
    samples = None
    if n_samples is not None:
        n_samples = as_count("n_samples", n_samples, k)
        n_least = min(n_samples, mesh_1.n_vertices, mesh_2.n_vertices)
        samples = sample_vertices(mesh_1, n_least), sample_vertices(mesh_2, n_least)
    starts = []
    for C_12 in _starts(mesh_1, mesh_2, basis_1, basis_2, pairs):
        coarse = max(len(C_12), min(COARSE, k))
        C_12 = zoomout(basis_1, basis_2, C_12, k=coarse, samples=samples)
        starts.append((orientation_score(mesh_1, mesh_2, point_map(basis_1, basis_2, C_12)), C_12))
    _, C_12 = max(starts, key=lambda start: start[0])
    C_12 = zoomout(basis_1, basis_2, C_12, k=k, samples=samples)
    for _ in range(2):
        p2p_21 = point_map(basis_1, basis_2, C_12)
        C_12 = functional_map(basis_1, basis_2, p2p_21)
    score = orientation_score(mesh_1, mesh_2, p2p_21)
    return ShapeMatch(C_12, p2p_21, score, _doubt(score), basis_1, basis_2)


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
    starts = []
    for size in sorted({min(size, basis_1.k) for size in START_SIZES}):
        few_1, few_2 = basis_1.truncate(size), basis_2.truncate(size)
        products: Pairs = list(zip(multiplications(few_1, f_1[:, ::EVERY]), multiplications(few_2, f_2[:, ::EVERY]),
                                   strict=True))  # fmt: skip
        turns: Pairs = list(zip(rotations(mesh_1, few_1, f_1[:, ::EVERY]), rotations(mesh_2, few_2, f_2[:, ::EVERY]),
                                strict=True))  # fmt: skip
        starts.append(fit_functional_map(few_1, few_2, f_1, f_2, operators=[*products, *turns]))
    return starts


def _doubt(score: float) -> str:
    """What speaks against a map, in words."""
    if score < SURE:
        return f"{1.0 - score:.0%} of the area lands upside down: a part of the map is mirrored, or the shapes differ"
    return ""
