"""What the codec reads off connectivity alone, in integers: patches, cells, coarse graphs.

Encoder and decoder run this on the same faces and must get the same answer on every machine and with every version of
the libraries. So nothing here depends on a floating-point comparison or on how a library breaks a tie: hop distances
are unique integers, and ties go to the lower index.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse import csgraph

from spectral_notes._checks import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Cells:
    """Small groups of vertices of a graph: `label` (n,) names the cell of each vertex, `graph` joins touching cells."""

    label: IntArray
    graph: sp.csr_array

    def means(self, X: FloatArray) -> FloatArray:
        """The mean of the rows of X in each cell."""
        count = np.bincount(self.label)
        return np.stack([np.bincount(self.label, x) / count for x in X.T], axis=1)  # (cells, 3)


def adjacency(faces: IntArray, n: int) -> sp.csr_array:
    """Return the 0/1 adjacency matrix of the edges of the faces, with sorted indices."""
    i, j = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    W = sp.csr_array((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), shape=(n, n))
    return _binary(W)


def _binary(W: sp.csr_array) -> sp.csr_array:
    """The same sparsity without the diagonal, every entry one, indices sorted."""
    C = sp.coo_array(W)
    keep = C.row != C.col
    out = sp.csr_array((np.ones(int(keep.sum())), (C.row[keep], C.col[keep])), shape=W.shape)
    out.sum_duplicates()
    out.sort_indices()
    out.data[:] = 1.0
    return out


def partition(W: sp.csr_array, size: int) -> list[IntArray]:
    """Return patches of at most `size` vertices: components are bisected, small ones share a patch.

    Each patch is an ascending array of vertices; each vertex is in one patch. A component of m vertices gives
    ceil(m / size) patches that differ by one vertex at most, so their spectra line up row by row.
    """
    patches: list[IntArray] = []
    packed: list[IntArray] = []
    for members in _components(W):
        if len(members) > size:
            patches += _bisect(W, members, -(-len(members) // size))
        elif sum(map(len, packed)) + len(members) > size:
            patches.append(np.sort(np.concatenate(packed)))
            packed = [members]
        else:
            packed.append(members)
    if packed:
        patches.append(np.sort(np.concatenate(packed)))
    return patches


def _components(W: sp.csr_array) -> list[IntArray]:
    """The connected components, ordered by their first vertex."""
    label = csgraph.connected_components(W, directed=False)[1]
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted((group.astype(np.int64) for group in groups), key=lambda group: int(group[0]))


def _bisect(W: sp.csr_array, members: IntArray, parts: int) -> list[IntArray]:
    """Split a set of vertices into parts of equal size, each time across its longest hop distance."""
    done: list[IntArray] = []
    stack = [(members, parts)]
    while stack:
        members, parts = stack.pop()
        if parts == 1:
            done.append(members)
            continue
        near = W[members][:, members]
        one = _hops(near, 0)
        one = _hops(near, _farthest(one))
        two = _hops(near, _farthest(one))
        order = np.lexsort((np.arange(len(members)), one, one - two))
        cut = len(members) * (parts // 2) // parts
        stack.append((np.sort(members[order[cut:]]), parts - parts // 2))
        stack.append((np.sort(members[order[:cut]]), parts // 2))
    return done


def _hops(W: sp.csr_array, start: int) -> IntArray:
    """Number of edges from a vertex to every other; vertices out of reach count one more than the farthest."""
    hops = csgraph.dijkstra(W, unweighted=True, indices=start)
    reached = np.isfinite(hops)
    return np.where(reached, hops, hops[reached].max() + 1).astype(np.int64)


def _farthest(hops: IntArray) -> int:
    return int(np.argmax(hops))


def cells(W: sp.csr_array, radius: int) -> Cells:
    """Return cells around seeds more than `radius` edges apart, chosen greedily in the order of the vertices."""
    n = W.shape[0]
    label = np.full(n, n, dtype=np.int64)
    starts, ends, columns = W.indptr.tolist(), W.indptr[1:].tolist(), W.indices.tolist()
    blocked = bytearray(n)
    count = 0
    for seed in range(n):
        if blocked[seed]:
            continue
        label[seed] = count
        count += 1
        ring, reached = [seed], {seed}
        for _ in range(radius):
            ring = list({w for v in ring for w in columns[starts[v] : ends[v]]} - reached)
            reached.update(ring)
        for w in reached:
            blocked[w] = 1
    rows = np.repeat(np.arange(n), np.diff(W.indptr))
    for _ in range(radius):
        best = np.full(n, n, dtype=np.int64)
        np.minimum.at(best, rows, label[W.indices])
        label = np.where(label == n, best, label)
    member = sp.csr_array((np.ones(n), (np.arange(n), label)), shape=(n, count))
    return Cells(label, _binary(sp.csr_array(member.T @ W @ member)))
