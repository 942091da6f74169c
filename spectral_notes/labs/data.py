"""What the labs of the book compute with, packed into small JavaScript files: vertices, faces, modes, coefficients.

A lab runs in the page, without a kernel, so its numbers are quantised: half precision where 3 MB allow it, and for a
basis of many modes bytes with one step a mode beyond the first few, whose coefficients are large.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, as_count
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.geometry import nodal_domains
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import TriangleMesh, face_areas
from spectral_notes.plotting.packing import pack, registering
from spectral_notes.plotting.rendering import SurfaceView

MAX_VERTICES = 20_000  # of a lab; faces count vertices in 16 bits, and all of them are redrawn at every step
NODAL = 0.01  # of the largest value: what counts as zero beside a nodal line, as in chapter 8
HALF_MODES = 40  # how many modes of a long basis keep half precision


@dataclass(frozen=True)
class LabData:
    """Hold what one lab computes with: plain facts, and arrays in the precision they travel in.

    Parameters
    ----------
    facts : mapping
        Names to numbers, texts and lists of them.
    arrays : mapping of str to ndarray
        Names to arrays of one of the types that a lab reads.
    """

    facts: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]

    def script(self, name: str) -> str:
        """Return the text of a script that registers the data under a name.

        Parameters
        ----------
        name : where the file will lie below ``_static``, without ``.js``

        Returns
        -------
        One call of ``spectralNotes.register``.
        """
        return registering(name, pack(self.facts, self.arrays))


def in_unit_area(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh about its centre and with area one, in which eigenvalues of all shapes can be compared.

    Parameters
    ----------
    mesh : the mesh

    Returns
    -------
    Moved and scaled.

    Examples
    --------
    >>> from spectral_notes.shapes import sphere
    >>> round(float(face_areas(in_unit_area(sphere(2))).sum()), 12)
    1.0
    """
    middle = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    scale = math.sqrt(float(face_areas(mesh).sum()))
    return TriangleMesh((mesh.vertices - middle) / scale, mesh.faces, mesh.name)


def surface_data(mesh: TriangleMesh, k: int, *, in_bytes: bool = False) -> LabData:
    """Return a surface with its first k modes, in unit area.

    Facts: name, n, k, and the camera. Arrays: vertices (3, n), faces (m, 3), mass (n,), evals (k,), coefficients (3, k)
    of the three coordinates, and the modes, mode after mode: evecs (k, n) in half precision; or, in bytes, evecs for
    the first 40 and for the rest evecs_in_bytes (k - 40, n) with steps (k - 40,).

    Parameters
    ----------
    mesh : the surface, at most 20,000 vertices; see `coarse_copy`
    k : how many modes, up to the number of vertices
    in_bytes : whether modes beyond the 40th take one byte a vertex
    """
    as_count("mesh's number of vertices", mesh.n_vertices, k, MAX_VERTICES)
    mesh = in_unit_area(mesh)
    basis = compute_eigenbasis(*cotan_laplacian(mesh), k)
    arrays = {
        "vertices": mesh.vertices.T.astype(np.float16),
        "faces": mesh.faces.astype(np.uint16),
        "mass": basis.M.diagonal().astype(np.float32),
        "evals": basis.evals.astype(np.float32),
        "coefficients": basis.analyze(mesh.vertices).T.astype(np.float32),
    }
    facts = {"n": mesh.n_vertices, "k": k} | viewpoint(mesh)
    return LabData(facts, arrays | quantise(basis.evecs, HALF_MODES if in_bytes else k))


def modes_data(mesh: TriangleMesh, k: int) -> LabData:
    """Return a surface with its first k modes in bytes, and the number of nodal domains of each (fact `domains`)."""
    data = surface_data(mesh, k, in_bytes=True)
    basis = compute_eigenbasis(*cotan_laplacian(in_unit_area(mesh)), k)
    counts = [int(nodal_domains(mesh, f, tol=NODAL).max()) + 1 for f in basis.evecs.T]
    return LabData({**data.facts, "domains": counts}, data.arrays)


def viewpoint(mesh: TriangleMesh) -> dict[str, Any]:
    """Return the name of a mesh and where its stills are seen from, as facts of a lab.

    Parameters
    ----------
    mesh : the mesh

    Returns
    -------
    name, eye and up.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> viewpoint(egg(1))["up"]
    [0.0, 0.0, 1.0]
    """
    eye, up = SurfaceView(mesh).view_direction
    return {"name": mesh.name, "eye": list(eye), "up": list(up)}


def quantise(evecs: FloatArray, n_half: int) -> dict[str, NDArray[Any]]:
    """Return modes for the journey: the first in half precision, the others in steps of 1/127 of their largest entry.

    Parameters
    ----------
    evecs : ndarray (n, k), the modes
    n_half : how many keep half precision

    Returns
    -------
    evecs (n_half, n); and, if modes are left, evecs_in_bytes (k - n_half, n) and steps (k - n_half,).
    """
    half = {"evecs": evecs[:, :n_half].T.astype(np.float16)}
    rest = evecs[:, n_half:].T
    if not len(rest):
        return half
    steps = (abs(rest).max(axis=1) / 127).astype(np.float32)
    return half | {"evecs_in_bytes": np.rint(rest / steps[:, None]).astype(np.int8), "steps": steps}
