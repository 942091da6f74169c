"""Clustering: the first modes as coordinates, and k-means among them, for meshes, graphs and point clouds alike."""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from spectral_notes._checks import FloatArray, IntArray, as_choice, as_count, as_floats, as_indices, as_symmetric
from spectral_notes.descriptors import first_nonzero, global_point_signature
from spectral_notes.eigenbasis import Eigenbasis, compute_eigenbasis
from spectral_notes.meshes import farthest_points

MAX_ROUNDS = 1000  # of k-means; it stops when no label changes, after some tens


def spectral_embedding(basis: Eigenbasis, d: int, *, weights: str = "gps") -> FloatArray:
    """Return the first d modes as coordinates: similar rows are samples that are well connected.

    weights="gps": row x is (phi_j(x) / sqrt(lambda_j)) for the first d modes with lambda_j > 0, the global point
    signature (Rustamov, 2007). All zero modes are left out, so components that are not connected lie on top of each
    other: cluster each by itself. weights="none": row x is (phi_j(x)) for the first d modes beside the constant; other
    zero modes stay, and part the components. That is Hall's drawing of a graph ("An r-dimensional quadratic placement
    algorithm", 1970), and with M = D the embedding of normalised cuts (Shi and Malik, 2000).

    Parameters
    ----------
    basis : the modes of a mesh, a graph or a point cloud
    d : how many coordinates, at least 1 and at most the modes that the basis offers
    weights : {"gps", "none"}, what a mode is multiplied by: one over its frequency, or nothing

    Returns
    -------
    rows : (n, d), without unit for "gps" on a surface
        Defined up to a sign of each column, and a rotation of columns that share an eigenvalue; distances between rows
        are defined up to nothing, unless d cuts through a group of equal eigenvalues.

    Examples
    --------
    >>> from spectral_notes import compute_eigenbasis, graph_laplacian, path_graph
    >>> basis = compute_eigenbasis(*graph_laplacian(path_graph(50)), k=4)
    >>> rows = spectral_embedding(basis, 2)
    >>> rows.shape, bool(np.allclose(rows, basis.evecs[:, 1:3] / np.sqrt(basis.evals[1:3])))
    ((50, 2), True)
    """
    weights = as_choice("weights", weights, ("gps", "none"))
    rows = global_point_signature(basis) if weights == "gps" else _without_constant(basis)
    d, most = as_count("d", d, 1), rows.shape[1]
    if d > most:
        raise ValueError(f"d must be at most {most}, the modes that the basis offers; got {d}: compute more modes")
    return np.array(rows[:, :d])


def spectral_clusters(rows: ArrayLike, n_clusters: int, *, mass: ArrayLike | None = None) -> IntArray:
    """Return the cluster of each row by k-means: the same on every run, as its seeds are chosen, not drawn.

    Minimises sum_x m_x |row_x - center_label(x)|^2 by Lloyd's steps ("Least squares quantization in PCM", 1982) from
    the rows that `seed_rows` chooses.

    Parameters
    ----------
    rows : (n, d), an embedding; see `spectral_embedding`
    n_clusters : how many clusters, 1 .. the number of different rows
    mass : (n,), positive, what each sample stands for; equal by default
        The diagonal of M, so that the result does not depend on how densely a part is sampled.

    Returns
    -------
    labels : (n,), 0 .. n_clusters - 1, each used; number i grew from seed i

    Examples
    --------
    >>> spectral_clusters([[0.0], [0.1], [5.0], [5.2], [9.0]], 3).tolist()
    [1, 1, 2, 2, 0]
    """
    rows, mass = _rows_and_mass(rows, mass)
    seeds = seed_rows(rows, n_clusters, mass=mass)
    lloyd = KMeans(len(seeds), init=rows[seeds], n_init=1, max_iter=MAX_ROUNDS, tol=0.0)
    with threadpool_limits(limits=1, user_api="openmp"):  # threads would add in another order each time
        return np.asarray(lloyd.fit(rows, sample_weight=mass).labels_, dtype=np.int64)


def cut_pieces(
    L: sp.csr_array, M: sp.csr_array, n_clusters: int, k: int | None = None, *, progress: bool = False
) -> IntArray:
    """Return labels of a domain in several pieces, each cut by itself by its first k modes (its share of clusters + 1).

    Each piece gets one cluster; the others go where a cluster has most mass and the piece samples for one more.
    """
    count, pieces = sp.csgraph.connected_components(L, directed=False)
    room, masses = np.bincount(pieces), np.bincount(pieces, M.diagonal())
    if not count <= n_clusters <= len(pieces):
        say = f"n must be at least {count}, the number of pieces of the shape, and at most {len(pieces)}, of its points"
        raise ValueError(f"{say}; got {n_clusters}")
    shares = np.ones(count, dtype=np.int64)
    for _ in range(n_clusters - count):
        shares[np.argmax(np.where(shares < room, masses / shares, 0.0))] += 1
    labels = (np.cumsum(shares) - shares)[pieces]
    for piece in np.flatnonzero(shares > 1):
        here = np.flatnonzero(pieces == piece)
        share = int(shares[piece])
        n_modes = as_count("k", min(share + 1 if k is None else k, len(here)), 2)
        basis = compute_eigenbasis(L[here][:, here], M[here][:, here], n_modes, progress=progress)
        rows = spectral_embedding(basis, basis.k - 1)
        labels[here] += spectral_clusters(rows, share, mass=M.diagonal()[here])
    return labels


def seed_rows(rows: ArrayLike, n_clusters: int, *, mass: ArrayLike | None = None) -> IntArray:
    """Return the numbers of rows that lie far apart, to start k-means from; no chance takes part.

    First the row farthest from the center of mass, then always the row farthest from all chosen ones (Gonzalez, 1985).
    Of equals the first.

    >>> seed_rows([[0.0], [1.0], [5.0], [9.0]], 3).tolist()
    [3, 0, 2]
    """
    rows, mass = _rows_and_mass(rows, mass)
    n_clusters = as_count("n_clusters", n_clusters, 1, len(rows))
    from_center = ((rows - mass @ rows / mass.sum()) ** 2).sum(axis=1)
    seeds = farthest_points(rows, n_clusters, first=int(from_center.argmax()))
    different = len(np.unique(rows[seeds], axis=0))
    if different < n_clusters:
        raise ValueError(f"n_clusters must be at most {different}, the number of different rows; got {n_clusters}")
    return seeds


def eigengaps(basis: Eigenbasis) -> FloatArray:
    """Return how far the spectrum jumps after each mode, (k - 1,): a large entry at K - 1 speaks for K clusters.

    Entry K - 1 is 1 - lambda_(K-1) / lambda_K, from 0 (no jump, or two zeros) to 1 (K components that are not
    connected); von Luxburg, "A tutorial on spectral clustering" (2007), section 8.3.

    >>> from spectral_notes import compute_eigenbasis, interval_laplacian
    >>> eigengaps(compute_eigenbasis(*interval_laplacian(101), k=4)).round(2).tolist()  # 1 - 0, 1 - 1/4, 1 - 4/9
    [1.0, 0.75, 0.56]
    """
    first = first_nonzero(basis, 1)
    gaps = np.zeros(basis.k - 1)
    lower = np.r_[0.0, basis.evals[first:-1]] if first else basis.evals[:-1]
    gaps[max(first - 1, 0) :] = 1.0 - lower / basis.evals[max(first, 1) :]
    return gaps


def normalized_cut(L: sp.csr_array, M: sp.csr_array, labels: ArrayLike) -> float:
    """Return what it costs to cut a domain into the given clusters: at least the sum of the K smallest eigenvalues.

    The sum over clusters A of 1_A^T L 1_A / 1_A^T M 1_A, in units of the eigenvalues. For a graph with M = D that is
    the weight of the edges that leave A over the weight of all edges at A, the normalised cut; with M = I the ratio cut
    (Shi and Malik, "Normalized cuts and image segmentation", 2000, eq. 2). The labels (n,) leave no number out.

    >>> from spectral_notes import graph_laplacian, path_graph
    >>> normalized_cut(*graph_laplacian(path_graph(4), mass="degree"), [0, 0, 1, 1])  # 1/3 + 1/3
    0.6666666666666666
    """
    L = as_symmetric("L", L)
    n = L.shape[0]
    M = as_symmetric("M", M, n)
    labels = as_indices("labels", labels, (n,), n)
    counts = np.bincount(labels)
    if not counts.all():
        raise ValueError(f"labels must leave no number out; no sample has {int(np.argmin(counts))}")
    inside = np.eye(len(counts))[labels]  # one column of ones and zeros a cluster
    return float((np.sum(inside * (L @ inside), axis=0) / np.sum(inside * (M @ inside), axis=0)).sum())


def match_labels(labels: ArrayLike, reference: ArrayLike) -> IntArray:
    """Return the same clusters under new numbers, so that as many samples as possible agree with a reference.

    The best one-to-one renumbering, by the Hungarian method; clusters without a partner take the numbers that are left.

    >>> match_labels([2, 2, 0, 1], [0, 0, 1, 2]).tolist()
    [0, 0, 1, 2]
    """
    reference = as_indices("reference", reference, ("n",), np.iinfo(np.int64).max)
    labels = as_indices("labels", labels, (len(reference),), np.iinfo(np.int64).max)
    n_names = 1 + max(labels.max(initial=0), reference.max(initial=0))
    shared = sp.coo_array((np.ones(len(labels)), (labels, reference)), (n_names, n_names)).toarray()
    _, new_names = linear_sum_assignment(shared, maximize=True)
    return np.asarray(new_names[labels], dtype=np.int64)


def _without_constant(basis: Eigenbasis) -> FloatArray:
    """The modes, the zero ones turned so that the constant is among them, and left out."""
    zero = first_nonzero(basis, 1)
    sums = basis.analyze(np.ones(basis.n))[:zero]  # the constant in terms of the zero modes
    return np.hstack([basis.evecs[:, :zero] @ scipy.linalg.null_space(sums[None]), basis.evecs[:, zero:]])


def _rows_and_mass(rows: ArrayLike, mass: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
    """Rows and positive masses as arrays."""
    rows = as_floats("rows", rows, ("n", "d"))
    return rows, as_floats("mass", np.ones(len(rows)) if mass is None else mass, (len(rows),), positive=True)
