"""Maps of a part: a cut body onto a whole one, with the overlap found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import IntArray, as_count
from spectral_notes.geometry.geodesics import path_lengths
from spectral_notes.geometry.mending import cut_mesh
from spectral_notes.matching.shape_matching import landmark_pairs, match_shapes
from spectral_notes.meshes import TriangleMesh, edge_lengths

REACH = 1.5  # edges of the part, as large as it lies on the whole, from an image within which the whole counts as hit


@dataclass(frozen=True, eq=False)
class PartMatch:
    """Hold a map of a part onto a whole, and what of the whole it covers.

    Parameters
    ----------
    p2p_21 : (n2,) int, a vertex of the whole, shape 1, for each vertex of the part, shape 2
    overlap : (n1,) bool, which vertices of the whole the part covers; the rest is left unmapped
    doubt : from 0 to 1, of the last round, between the part and what was left of the whole, as of `match_shapes`
    reason : why the map may be wrong; empty where doubt is below one half
    """

    p2p_21: IntArray
    overlap: NDArray[np.bool_]
    doubt: float
    reason: str


def match_part(
    whole: TriangleMesh, part: TriangleMesh, landmarks: ArrayLike = (), *, k: int = 100, n_rounds: int = 3
) -> PartMatch:
    """Return a map from a part of a shape onto a whole one, in another pose perhaps, and the overlap, with its doubt.

    Both are matched as if they were whole; what of the whole no image comes near is cut off, and what is left is
    matched again. A cut changes the low modes, so give three landmarks: without, a tenth of the area less may be
    enough to mistake one side for the other. Rodolà et al., "Partial functional correspondence" (2017), who posed the
    problem, find map and overlap together.

    Parameters
    ----------
    whole, part : shapes 1 and 2, connected, consistently oriented
    landmarks : (q, 2) int, pairs (vertex of the whole, vertex of the part) of the same point
    k, n_rounds : modes of the map, and how often the overlap is matched, at least 1

    Examples
    --------
    >>> from spectral_notes.shapes import coarse_copy, goat
    >>> whole = coarse_copy(goat(), 600)[0]
    >>> part, kept = cut_mesh(whole, whole.vertices[:, 0] < 0.7)  # without its head
    >>> landmarks = [[np.flatnonzero(kept)[i], i] for i in (0, 150, 300)]
    >>> found = match_part(whole, part, landmarks, k=40, n_rounds=2)
    >>> bool((found.overlap == kept).mean() > 0.95)
    True
    """
    pairs = landmark_pairs(whole, part, landmarks)
    k, kept = as_count("k", k, 8, part.n_vertices), np.ones(whole.n_vertices, dtype=bool)
    for _ in range(as_count("n_rounds", n_rounds, 1)):
        region, kept = cut_mesh(whole, kept)
        old = np.flatnonzero(kept)
        inside = kept[pairs[:, 0]]
        marks = np.column_stack([np.searchsorted(old, pairs[inside, 0]), pairs[inside, 1]])
        match = match_shapes(region, part, marks, k=min(k, region.n_vertices))
        p2p_21 = old[match.p2p_21]
        reach = REACH * edge_lengths(part).mean() * np.sqrt(region.area / part.area)
        kept = np.isfinite(path_lengths(whole, np.unique(p2p_21), reach=reach, from_nearest=True))
    return PartMatch(p2p_21, kept, match.doubt, match.reason)
