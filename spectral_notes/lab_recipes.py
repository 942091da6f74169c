"""The data of the labs that need more than one surface with its modes: a map between two shapes, parts of several poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import as_indices
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.lab_data import LabData, in_unit_area, surface_data
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh


def map_data(mesh_1: TriangleMesh, mesh_2: TriangleMesh, p2p_21: ArrayLike, k: int) -> LabData:
    """Return two surfaces with their modes and the functional map between them that a point map implies.

    C_12 = Phi_2^T M_2 Phi_1[p2p_21] takes the coefficients of a function on 1 to those of its image on 2. Arrays and facts
    are those of `surface_data`, their names ending in _1 and _2; with C_12 (k, k) and p2p_21 (n_2,).

    Parameters
    ----------
    mesh_1, mesh_2 : TriangleMesh
        The surfaces.
    p2p_21 : array_like of int, shape (n_2,)
        Vertex of 2 -> vertex of 1.
    k : int
        How many modes of each.

    Returns
    -------
    LabData
        The data.

    Raises
    ------
    TypeError, ValueError
        If the point map has not one vertex of the first surface for each vertex of the second.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> data = map_data(egg(2), egg(2), np.arange(egg(2).n_vertices), 4)
    >>> bool(abs(data.arrays["C_12"] - np.eye(4)).max() < 1e-6)  # nothing moves: the identity
    True
    """
    p2p_21 = as_indices("p2p_21", p2p_21, (mesh_2.n_vertices,), mesh_1.n_vertices)
    basis_1, basis_2 = (compute_eigenbasis(*cotan_laplacian(in_unit_area(mesh)), k) for mesh in (mesh_1, mesh_2))
    C_12 = basis_2.analyze(basis_1.evecs[p2p_21])
    facts: dict[str, Any] = {}
    arrays: dict[str, NDArray[Any]] = {"C_12": C_12.astype(np.float32), "p2p_21": p2p_21.astype(np.uint16)}
    for side, mesh in (("_1", mesh_1), ("_2", mesh_2)):
        data = surface_data(mesh, k)
        facts |= {name + side: fact for name, fact in data.facts.items()}
        arrays |= {name + side: array for name, array in data.arrays.items()}
    return LabData(facts, arrays)
