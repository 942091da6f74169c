"""Candidates for a map that nobody started: a tree over the signs of the first modes, pruned by how points look.

The first modes of two shapes agree up to signs, and up to small rotations where eigenvalues lie close. A matrix of j
modes has two children, with +1 and -1 for mode j + 1; each goes to points and back twice, which turns it into the
nearest rotation, and the WIDTH children under which samples look most alike live on (Ren et al. 2020). Left and right
look alike in every signature; they differ in how the gradients of two signatures turn, which a mirror image reverses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.eigenbasis import Eigenbasis
from spectral_notes.matching.map_fitting import handed_functions, point_descriptors
from spectral_notes.meshes import TriangleMesh

N_LOOKS = 30  # columns of the signature, and of each landmark
HAND_GAP = 6  # columns of the signature between the two whose gradients tell left from right
LOOK_WEIGHT = 0.3  # of each of them beside the modes, which count one together
TREE_SIZE = 16  # modes of the tree
CANDIDATE_SIZE = 30  # modes of a candidate
WIDTH = 12  # nodes that live on
SAME_NODE, SAME_MAP = 0.57, 0.3  # distances |C - C'| and |C - C'| / sqrt(20) below which two are one


@dataclass(frozen=True, eq=False)
class View:
    """Hold what is seen of a shape at samples: rows of its modes (s, k), looks (s, p), and those of one hand (s, q)."""

    rows: FloatArray
    looks: FloatArray
    handed: FloatArray


@dataclass(frozen=True, eq=False)
class Candidate:
    """Hold a map between the first modes, and its misfit: squared distances to the nearest sample, both ways."""

    C_12: FloatArray
    misfit: float


def view(mesh: TriangleMesh, basis: Eigenbasis, at: IntArray, landmarks: IntArray, hint: FloatArray) -> View:
    """Return what the search sees at the vertices `at`; `hint` (n, h) holds functions known to correspond."""
    looks = point_descriptors(basis, landmarks, n_each=N_LOOKS)
    handed = handed_functions(mesh, basis, looks[:, :N_LOOKS], HAND_GAP)
    return View(basis.evecs[at, :CANDIDATE_SIZE], np.hstack([LOOK_WEIGHT * looks, hint])[at], LOOK_WEIGHT * handed[at])


def candidate_maps(view_1: View, view_2: View, *, handed: bool) -> list[Candidate]:
    """Return different maps of CANDIDATE_SIZE modes, that of the least misfit first; `handed` tells left from right."""
    if handed:
        view_1, view_2 = (replace(one, looks=np.hstack([one.looks, one.handed])) for one in (view_1, view_2))
    nodes = [Candidate(np.ones((1, 1)), 0.0)]
    size = min(CANDIDATE_SIZE, view_1.rows.shape[1], view_2.rows.shape[1])
    for j in range(1, min(TREE_SIZE, size)):
        grown = [np.pad(node.C_12, (0, 1)) + sign * np.diag(np.arange(j + 1) == j)
                 for node in nodes for sign in (1.0, -1.0)]
        nodes = _different([_settled(view_1, view_2, C, [j + 1] * 2) for C in grown], j + 1, SAME_NODE)[:WIDTH]
    ends = [_settled(view_1, view_2, node.C_12, [*range(TREE_SIZE + 2, size, 2), size]) for node in nodes]
    return _different(ends, 20, SAME_MAP * np.sqrt(20))


def _settled(view_1: View, view_2: View, C: FloatArray, sizes: list[int]) -> Candidate:
    """The map after going to points and back once for each size, as a rotation of so many modes; and its misfit."""
    for k in sizes:
        p2p_21, p2p_12, _ = _matched(view_1, view_2, C)
        there = np.linalg.lstsq(view_2.rows[:, :k], view_1.rows[p2p_21, :k], rcond=None)[0]
        back = np.linalg.lstsq(view_1.rows[:, :k], view_2.rows[p2p_12, :k], rcond=None)[0]
        left, _, right = np.linalg.svd(there + back.T)
        C = left @ right
    return Candidate(C, _matched(view_1, view_2, C)[2])


def misfit_of(view_1: View, view_2: View, C_12: FloatArray) -> float:
    """The mean squared distance to the nearest sample, both ways, of the square map's first modes and of looks."""
    return _matched(view_1, view_2, C_12[:CANDIDATE_SIZE, :CANDIDATE_SIZE])[2]


def _matched(view_1: View, view_2: View, C: FloatArray) -> tuple[IntArray, IntArray, float]:
    """For each sample of 2 that of 1 most like it in modes and looks, for each of 1 that of 2; the mean square gap."""
    j = len(C)
    first = np.hstack([view_1.rows[:, :j] @ C.T / np.sqrt(j), view_1.looks]).astype(np.float32)
    second = np.hstack([view_2.rows[:, :j] / np.sqrt(j), view_2.looks]).astype(np.float32)
    squares = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2.0 * first @ second.T  # (s1, s2)
    return squares.argmin(axis=0), squares.argmin(axis=1), float(squares.min(0).mean() + squares.min(1).mean()) / 2.0


def _different(found: list[Candidate], size: int, near: float) -> list[Candidate]:
    """The candidates by their misfit, without those whose first modes nearly repeat a better one."""
    kept: list[Candidate] = []
    for one in sorted(found, key=lambda candidate: candidate.misfit):
        if all(np.linalg.norm((one.C_12 - other.C_12)[:size, :size]) > near for other in kept):
            kept.append(one)
    return kept
