"""Parts onto wholes, and sets of shapes whose maps agree, on cases with a known answer."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes import shapes
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.functional_maps import functional_map, nearest_rows
from spectral_notes.geometry import cut_mesh
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.matching import (
    consistent_maps,
    cycle_error,
    match_part,
    shared_embedding,
    shared_functions,
)
from spectral_notes.meshes import TriangleMesh

SMALL = shapes.potato(subdivisions=2)  # 162 vertices
BASIS = compute_eigenbasis(*cotan_laplacian(SMALL), 8)


def orthogonal(rng: np.random.Generator, k: int) -> np.ndarray:
    return np.asarray(np.linalg.qr(rng.normal(size=(k, k)))[0])


@pytest.fixture(scope="module")
def goats() -> tuple[TriangleMesh, TriangleMesh, np.ndarray]:
    """A goat at rest, one that walks, of other triangles, and the true image of each of its vertices."""
    rest = shapes.goat()
    one, two = shapes.coarse_copy(rest, 1000)[0], shapes.coarse_copy(rest, 800)
    return (one, TriangleMesh(two[1] @ shapes.goat("walk").vertices, two[0].faces),
            nearest_rows(one.vertices, two[0].vertices))


def test_a_part_in_another_pose_finds_its_place_and_its_overlap(goats: Any) -> None:
    whole, walking, true_21 = goats
    part, kept = cut_mesh(walking, whole.vertices[true_21, 0] < 0.75)  # without its head
    truth = true_21[kept]
    found = match_part(whole, part, [[truth[i], i] for i in (0, 200, 400)], k=60, n_rounds=2)
    off = np.linalg.norm(whole.vertices[found.p2p_21] - whole.vertices[truth], axis=1).mean() / np.sqrt(whole.area)
    covered = whole.vertices[:, 0] < 0.75
    assert (found.overlap & covered).sum() > 0.85 * (found.overlap | covered).sum() and not found.overlap.all()
    assert off < 0.03 and found.doubt < 0.5 and not found.reason


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(2, 5), st.integers(2, 8))
def test_maps_that_agree_are_found_again_from_a_chain_of_them(seed: int, n: int, k: int) -> None:
    rng = np.random.default_rng(seed)
    turns = [orthogonal(rng, k) for _ in range(n)]
    chain = {(i, i + 1): turns[i + 1] @ turns[i].T for i in range(n - 1)}
    shared = shared_functions([BASIS] * n, chain)
    for i, j in itertools.permutations(range(n), 2):
        np.testing.assert_allclose(shared[j] @ np.linalg.pinv(shared[i]), turns[j] @ turns[i].T, atol=1e-8)
    assert np.isclose(sum(np.sum(y**2) for y in shared), n * k)


def test_equal_points_have_equal_rows() -> None:
    signs = np.diag([1.0, -1, 1, -1, 1, 1, -1, -1])
    flipped = Eigenbasis(BASIS.evals, BASIS.evecs @ signs, BASIS.M)
    rows_1, rows_2 = shared_embedding([BASIS, flipped], shared_functions([BASIS, flipped], {(0, 1): signs}), 5)
    assert rows_1.shape == (162, 5)
    np.testing.assert_allclose(rows_1, rows_2, atol=1e-8)


def test_one_wrong_map_is_outvoted() -> None:
    rng = np.random.default_rng(0)
    orders = [np.arange(162), *(rng.permutation(162) for _ in range(3))]
    meshes = [TriangleMesh(SMALL.vertices[p], np.argsort(p)[SMALL.faces]) for p in orders]
    bases = [compute_eigenbasis(*cotan_laplacian(mesh), 8) for mesh in meshes]
    true = {(i, j): np.argsort(orders[i])[orders[j]] for i, j in itertools.permutations(range(4), 2)}
    given_maps = {pair: functional_map(bases[pair[0]], bases[pair[1]], p) for pair, p in true.items()}
    given_maps[0, 1] = given_maps[0, 1] @ np.diag([1.0, -1, -1, 1, 1, 1, 1, 1])
    wrong = {pair: nearest_rows(bases[pair[0]].evecs @ C.T, bases[pair[1]].evecs) for pair, C in given_maps.items()}
    assert cycle_error(meshes, wrong) > 0.05
    found = consistent_maps(bases, given_maps)
    assert cycle_error(meshes, found) == 0.0
    for pair, p2p in true.items():
        np.testing.assert_array_equal(found[pair], p2p)


def test_the_way_round_is_measured() -> None:
    ball = shapes.sphere(2)
    same, across = np.arange(162), nearest_rows(ball.vertices, -ball.vertices)
    maps = dict.fromkeys(itertools.permutations(range(3), 2), same)
    assert cycle_error([ball] * 3, maps) == 0.0
    # three of the six ways round use the map from 0 to 1, and end on the other side, at distance 2
    assert np.isclose(cycle_error([ball] * 3, maps | {(0, 1): across}), 1.0 / np.sqrt(ball.area))


E3 = np.eye(3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: match_part(SMALL, SMALL, [[0, 162]]), "landmarks must lie in 0 .. 161"),
        (lambda: match_part(SMALL, SMALL, [0, 1, 2]), r"landmarks must have shape \(q, 2\)"),
        (lambda: match_part(SMALL, SMALL, k=163), "k must be between 8 and 162; got 163"),
        (lambda: match_part(SMALL, SMALL, n_rounds=0), "n_rounds must be at least 1; got 0"),
        (lambda: shared_functions([BASIS] * 3, {(0, 1): E3}), "maps must join all 3 shapes; they leave 2 groups. Map one"),
        (lambda: shared_functions([BASIS] * 2, {}), "maps must join all 2 shapes"),
        (lambda: shared_functions([BASIS] * 2, {(0, 2): E3}), "pairs of two of the shapes 0 .. 1 as keys"),
        (lambda: shared_functions([BASIS] * 2, {(1, 1): E3}), "pairs of two of the shapes 0 .. 1 as keys"),
        (lambda: shared_functions([BASIS] * 2, {0: E3}), "pairs of two of the shapes 0 .. 1 as keys"),
        (lambda: shared_functions([BASIS] * 2, {(0, 1): np.eye(9)}), "C_12"),
        (lambda: shared_functions([BASIS] * 2, {(0, 1): E3}, k=4), "k must be between 1 and 3; got 4"),
        (lambda: shared_embedding([BASIS] * 2, [E3]), "shared must have one matrix for each of the 2 bases; got 1"),
        (lambda: shared_embedding([BASIS] * 2, [E3] * 2, 3), "d must be between 1 and 2; got 3"),
        (lambda: consistent_maps([BASIS] * 2, {(0, 1): E3}, n_rounds=0), "n_rounds must be at least 1; got 0"),
        (lambda: cycle_error([SMALL] * 2, {}), "meshes must be at least three for a way round; got 2"),
        (lambda: cycle_error([SMALL] * 3, {(0, 1): np.arange(162)}), r"maps must hold all pairs, both ways; missing: \[\(0, 2\)"),
    ],
)
def test_errors_name_the_argument(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
