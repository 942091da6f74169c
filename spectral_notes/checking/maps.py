"""Checks of functional maps and point maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from spectral_notes._checks import IntArray, as_count, as_floats, as_indices
from spectral_notes.checking.answers import place_of, read_array, read_matrix, slip
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, wrong
from spectral_notes.eigenbasis import Eigenbasis

WITHIN = 1e-4  # single precision passes


@judged
def check_functional_map(
    answer: object, basis_1: Eigenbasis, basis_2: Eigenbasis, p2p_21: ArrayLike, *, within: float = WITHIN
) -> Verdict:
    """Judge a functional map C_12 (k2, k1), from functions on 1 to functions on 2: evecs_2^T M_2 evecs_1[p2p_21].

    Parameters
    ----------
    answer : what the student passes
    basis_1, basis_2 : the bases it is written in
    p2p_21 : (n2,) int, the point map: the vertex of 1 for each vertex of 2
    within : how far off an entry may be; entries of a good map are at most about 1

    Examples
    --------
    >>> from spectral_notes.eigenbasis import compute_eigenbasis
    >>> from spectral_notes.laplacians import interval_laplacian
    >>> one, two = (compute_eigenbasis(*interval_laplacian(n), 3) for n in (21, 41))
    >>> p2p_21 = np.arange(41) // 2
    >>> C_12 = two.analyze(one.evecs[p2p_21])
    >>> print(check_functional_map(C_12.T, one, two, p2p_21))
    Not right. It is transposed: this map goes from 2 to 1.
    The law: C_12 takes coefficients on 1 to coefficients on 2.
    """
    p2p = as_indices("p2p_21", p2p_21, (basis_2.n,), basis_1.n)
    true = basis_2.analyze(basis_1.evecs[p2p])  # (k2, k1)
    law = "C_12 takes coefficients on 1 to coefficients on 2"
    given = read_array(answer, "C_12", ("k2", "k1"))
    demand(
        given.shape != true.T.shape or given.shape == true.shape,
        f"The shape is {given.shape}: this map goes from 2 to 1.",
        law,
    )
    demand(given.shape == true.shape, f"The shape is {given.shape}.", f"C_12 has shape (k2, k1) = {true.shape}")
    error = given - true
    if abs(error).max() <= within:
        return right("C_12 takes every function of the basis to its partner.", law)
    if given.shape == given.T.shape:
        demand(abs(given.T - true).max() > max(within, 1e-3), "It is transposed: this map goes from 2 to 1.", law)
    flat = basis_2.evecs.T @ basis_1.evecs[p2p]
    demand(
        abs(given - flat).max() > 1e-3 * abs(flat).max(),
        "It was computed without the mass of shape 2.",
        "C_12 = evecs_2.T @ M_2 @ evecs_1[p2p_21]",
    )
    demand(abs(abs(given) - abs(true)).max() > 1e-3, "Some signs are turned: are these the bases that were given?", law)
    constant = abs(given[1:, 0]).max(initial=0.0)
    demand(
        constant <= max(within, 10 * abs(true[1:, 0]).max(initial=0.0), 1e-3),
        f"The first column should be zero below its top; its largest entry there is {constant:.2g}.",
        "a constant function goes to a constant function",
    )
    raise Stop(wrong(f"It differs by {abs(error).max():.2g} at {place_of(error)}.{slip(given, true)}", law))


@judged
def check_point_map(
    answer: object, truth: ArrayLike, n_1: int, *, distances: ArrayLike | None = None, within: float = 0.0
) -> Verdict:
    """Judge a point map p2p_21: for each vertex of 2 a vertex of 1.

    Parameters
    ----------
    answer : n2 indices, or an (n2, n1) matrix with one 1 a row
    truth : (n2,) int, the right map
    n_1 : the number of vertices of shape 1
    distances : (n1, n1), distances on shape 1; without them a vertex counts as right or wrong
    within : the mean distance to the truth that is allowed; without distances, the share of wrong vertices

    Examples
    --------
    >>> print(check_point_map([1, 2, 3], [0, 1, 2], 3))
    Not right. Indices reach 3, where 2 is the last vertex of 1: do they count from 1?
    The law: p2p_21 names vertices of 1.
    """
    n_1 = as_count("n_1", n_1, 1)
    true = as_indices("truth", truth, ("n2",), n_1)
    given = _indices_of(answer, len(true), n_1)
    D = None if distances is None else as_floats("distances", distances, (n_1, n_1))
    error = float(np.mean(given != true) if D is None else D[given, true].mean())
    if error <= within:
        return right("Each vertex of 2 finds its partner on 1.", "p2p_21 names a vertex of 1 for each vertex of 2")
    law = "each vertex of 2 goes to its partner on 1"
    if len(set(given.tolist())) == 1:
        return wrong("All vertices go to one vertex.", law)
    everyone = np.arange(len(true))
    one_to_one = len(true) == n_1 and np.array_equal(np.sort(true), everyone)
    if one_to_one and np.array_equal(given[true], everyone):
        return wrong("It is the inverse: this map goes from 1 to 2.", law)
    what = "share of wrong vertices" if D is None else "mean distance to the right vertex"
    return wrong(f"The {what} is {error:.3g}; at most {within:.3g} is asked for.", law)


def _indices_of(answer: Any, n_2: int, n_1: int) -> IntArray:
    """A point map as indices."""
    if (sp.issparse(answer) or isinstance(answer, np.ndarray)) and answer.shape == (n_2, n_1) and n_1 > 1:
        answer = read_matrix(answer, "p2p_21", (n_2, n_1)).argmax(axis=1).ravel()
    array = read_array(answer, "p2p_21", ("n",))
    hint = ": this map goes from 1 to 2." if len(array) == n_1 else "."
    law = "p2p_21 has one entry a vertex of 2"
    demand(len(array) == n_2, f"{len(array)} entries came for {n_2} vertices{hint}", law)
    fraction = abs(array - np.round(array))
    demand(not fraction.any(), f"{array[np.argmax(fraction)]:.4g} is none.", "p2p_21 holds whole numbers")
    indices = array.astype(np.int64)
    demand(indices.min() >= 0, f"Vertex {indices.min()} does not exist.", "p2p_21 names vertices of 1")
    hint = ": do they count from 1?" if indices.min() == 1 and indices.max() == n_1 else "."
    demand(
        indices.max() < n_1,
        f"Indices reach {indices.max()}, where {n_1 - 1} is the last vertex of 1{hint}",
        "p2p_21 names vertices of 1",
    )
    return indices
