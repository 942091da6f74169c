"""Nodal domains: the pieces of a surface on which a function keeps its sign."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from spectral_notes._checks import IntArray, as_floats, as_number
from spectral_notes.meshes import TriangleMesh, edges, pieces_of_graph


def nodal_domains(mesh: TriangleMesh, f: ArrayLike, *, tol: float = 0.0) -> IntArray:
    """Return the number of the nodal domain each vertex lies in, counted from 0; -1 on the nodal set itself.

    Two vertices share a domain when a chain of edges joins them along which f keeps its sign and is not zero. The
    number of domains is ``labels.max() + 1``; they are numbered by their first vertices.

    Parameters
    ----------
    mesh : with n vertices
    f : (n,), pointwise values
    tol : values up to tol * max |f| in magnitude count as zero

    Examples
    --------
    >>> strip = TriangleMesh([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], [[0, 2, 1], [1, 2, 3], [3, 2, 4]])
    >>> nodal_domains(strip, [1.0, 2.0, -1.0, 0.0, -3.0]).tolist()
    [0, 0, 1, -1, 1]
    """
    values = as_floats("f", f, (mesh.n_vertices,))
    tol = as_number("tol", tol, low=0.0)
    sign = np.where(np.abs(values) <= tol * np.abs(values).max(), 0.0, np.sign(values))
    pairs = edges(mesh)
    pieces = pieces_of_graph(pairs[sign[pairs].prod(axis=1) > 0], mesh.n_vertices)
    labels = np.full(mesh.n_vertices, -1, dtype=np.int64)
    inside = sign != 0
    _, first, which = np.unique(pieces[inside], return_index=True, return_inverse=True)
    labels[inside] = np.argsort(np.argsort(first))[which]
    return labels
