"""Checks of Laplacians and mass matrices."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_choice, as_symmetric
from spectral_notes.checking.answers import FACTORS, largest, place_in, read_array, read_matrix
from spectral_notes.checking.verdicts import Stop, Verdict, demand, judged, right, wrong
from spectral_notes.laplacians import MASSES, cotan_laplacian, mass_matrix
from spectral_notes.meshes import TriangleMesh

WITHIN = 1e-5  # of the largest entry: single precision passes


@judged
def check_laplacian(answer: object, expected: object, *, M: object = None, either_sign: bool = True) -> Verdict:
    """Judge a Laplacian L, first by the laws that the right one keeps, then entry by entry.

    Parameters
    ----------
    answer : (n, n), dense or sparse, or the pair (L, M), of which L is judged
    expected : a mesh, whose cotan Laplacian is meant, or the right matrix
    M : the mass, so that the pointwise M^-1 L can be told from the weak L
    either_sign : accept the negative semidefinite -L as well

    Examples
    --------
    >>> L = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    >>> bool(check_laplacian(-L, L)), bool(check_laplacian(-L, L, either_sign=False))
    (True, False)
    >>> print(check_laplacian(L - np.diag(np.diag(L)), L))
    Not right. Rows do not sum to zero (largest -2, row 1): is the diagonal missing?
    The law: the rows of L sum to zero.
    """
    true, M = _laplacian_of(expected, M)
    n = true.shape[0]
    L = read_matrix(_first_of_pair(answer), "L", (n, n))
    size = largest(true)
    demand(largest(L) > 0, "Every entry is zero.", "L sees its neighbours")
    _demand_row_sums(L, true, size)
    inverse = None if M is None else sp.diags_array(1.0 / M.sum(axis=1))
    pointwise = inverse is not None and largest(sp.csr_array(inverse @ true) - L) <= 1e-3 * largest(L)
    hint = ": is it divided by the mass already? The weak L is asked for." if pointwise else "."
    gap = sp.csr_array(L - L.T)
    demand(
        largest(gap) <= WITHIN * largest(L),
        f"It differs from its transpose by {largest(gap):.3g} at {place_in(gap)}{hint}",
        "L is symmetric",
    )
    turned = largest(L + true) < largest(L - true)
    demand(
        either_sign or not turned or L.diagonal().mean() > 0,
        f"Its diagonal is negative (smallest {L.diagonal().min():.3g}): is its sign turned?",
        "L is positive semidefinite in this book",
    )
    difference = sp.csr_array((-L if turned else L) - true)
    if largest(difference) <= WITHIN * size:
        return right("L is symmetric, its rows are right, and so is every entry.", "f^T L f is the Dirichlet energy")
    raise Stop(
        wrong(
            _slip_of_entries(-L if turned else L, true, difference),
            "L[i, j] is minus the weight of edge ij, and nothing where no edge is",
        )
    )


def _laplacian_of(expected: object, M: object) -> tuple[sp.csr_array, sp.csr_array | None]:
    """The right Laplacian, and the mass where it is known."""
    if isinstance(expected, TriangleMesh):
        L, mass = cotan_laplacian(expected)
        return L, mass if M is None else as_symmetric("M", M)
    return as_symmetric("expected", expected), None if M is None else as_symmetric("M", M)


def _first_of_pair(answer: object) -> object:
    """L of a pair (L, M) of matrices, or the answer itself."""
    is_pair = isinstance(answer, tuple) and len(answer) == 2
    return answer[0] if is_pair and all(sp.issparse(p) or isinstance(p, np.ndarray) for p in answer) else answer  # type: ignore[index, attr-defined]


def _demand_row_sums(L: sp.csr_array, true: sp.csr_array, size: float) -> None:
    """Refuse rows that do not sum to zero where the right ones do."""
    wanted = true.sum(axis=1)
    sums = np.where(abs(wanted) <= 1e-9 * size, L.sum(axis=1), 0.0)
    row = int(np.argmax(abs(sums)))
    diagonal = abs(L.diagonal()).max(initial=0.0)
    hint = ": is the diagonal missing?" if not diagonal else ": does the diagonal balance the row?"
    if diagonal and L.diagonal()[row] * (L.sum(axis=1)[row] - L.diagonal()[row]) > 0:
        hint = ": have the diagonal and the rest of the row the same sign?"
    demand(
        abs(sums).max() <= WITHIN * max(size, largest(L)),
        f"Rows do not sum to zero (largest {sums[row]:.3g}, row {row}){hint}",
        "the rows of L sum to zero",
    )


def _slip_of_entries(given: sp.csr_array, true: sp.csr_array, difference: sp.csr_array) -> str:
    """Say how the entries of a matrix are wrong."""
    ratio = (given * true).sum() / (true * true).sum()
    if ratio and largest(given / ratio - true) <= 1e-3 * largest(true):
        known = [words for f, words in FACTORS.items() if min(abs(abs(ratio) / f - 1), abs(abs(ratio) * f - 1)) < 2e-3]
        factor = known[0] if known else f"a factor of {ratio:.3g}"
        return f"It is off by {factor} everywhere: is each edge counted rightly?"
    far = sp.csr_array(abs(given) - abs(given) * (abs(true) > 0))
    message = f"It differs by {largest(difference):.3g}, most at {place_in(difference)}."
    if largest(far) > WITHIN * largest(given):
        return f"{message} At {place_in(far)} there is an entry though no edge joins the two."
    missing = int(((abs(true) > WITHIN * largest(true)).astype(int) - (abs(given) > 0).astype(int) > 0).sum())
    if missing:
        return f"{message} {missing} entries are missing: does every triangle give to both of its neighbours' edges?"
    return f"{message} Are the weights those of the angles opposite the edge?"


@judged
def check_mass_matrix(answer: object, expected: object, *, kind: str = "any", free_scale: bool = False) -> Verdict:
    """Judge a mass matrix: symmetric, positive, with the right total, and right entry by entry.

    Parameters
    ----------
    answer : (n, n), dense or sparse; n numbers stand for a diagonal one
    expected : a mesh, or the right matrix
    kind : {"any", "lumped", "voronoi", "full"}, which mass matrix of the mesh is asked for
    free_scale : accept any positive multiple

    Examples
    --------
    >>> mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> print(check_mass_matrix(np.full(3, 1 / 2), mesh))
    Not right. The entries sum to 1.5, 3 times the right total: a third of each triangle for each corner?
    The law: the entries of M sum to the area.
    """
    kinds = MASSES if as_choice("kind", kind, ("any", *MASSES)) == "any" else (kind,)
    is_mesh = isinstance(expected, TriangleMesh)
    if isinstance(expected, TriangleMesh):
        allowed = [mass_matrix(expected, kind=k) for k in kinds]
    else:
        allowed = [as_symmetric("expected", expected)]
    n = allowed[0].shape[0]
    M = _read_mass(answer, n)
    gap = sp.csr_array(M - M.T)
    demand(
        largest(gap) <= WITHIN * largest(M),
        f"It differs from its transpose by {largest(gap):.3g} at {place_in(gap)}.",
        "M is symmetric",
    )
    diagonal = M.diagonal()
    worst = int(np.argmin(diagonal))
    demand(diagonal[worst] > 0, f"Its diagonal is {diagonal[worst]:.3g} at index {worst}.", "M is positive")
    total, wanted = float(M.sum()), float(allowed[0].sum())
    if free_scale:
        M, total = M * (wanted / total), wanted
    whole = "the entries of M sum to the area" if is_mesh else "the entries of M sum to the size of the domain"
    hint = ": a third of each triangle for each corner?" if is_mesh else ": is the spacing in it?"
    demand(
        abs(total / wanted - 1) <= 1e-5,
        f"The entries sum to {total:.4g}, {total / wanted:.3g} times the right total{hint}",
        whole,
    )
    differences = [sp.csr_array(M - true) for true in allowed]
    least = min(differences, key=largest)
    if largest(least) <= WITHIN * largest(allowed[0]):
        return right("M is symmetric, positive, and right in every share.", whole)
    per = "each vertex" if is_mesh else "each sample"
    return wrong(
        f"The total is right, the shares are not: they differ by {largest(least):.3g}, most at {place_in(least)}.",
        f"M holds the share of {per}, so that f^T M g is the integral of f g",
    )


def _read_mass(answer: object, n: int) -> sp.csr_array:
    """A mass matrix from a matrix or from its diagonal."""
    if not sp.issparse(answer):
        try:
            is_vector = n > 1 and np.size(answer) == n  # type: ignore[arg-type]
        except Exception:
            is_vector = False
        if is_vector:
            return sp.csr_array(sp.diags_array(read_array(answer, "the diagonal of M", (n,))))
    return read_matrix(answer, "M", (n, n))
