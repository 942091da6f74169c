"""The course's bodies: goat and doll, which take poses, and the bracket; closed, of well-shaped triangles.

`tools/bodies.py` builds them from signed distances; their finished meshes are data of the package.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import as_choice
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes.stored import load_stored


def goat(pose: str = "rest") -> TriangleMesh:
    """Return a goat of about 14,400 vertices, its head towards x and its back towards y: closed, genus 0, 1.8 long.

    Its poses share the faces and are nearly isometric; the smallest angle at rest is above 20 degrees.

    Parameters
    ----------
    pose : {"rest", "walk", "look"}, what it does

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(goat())
    2
    """
    return _stored_body("goat", as_choice("pose", pose, ("rest", "walk", "look")))


def doll(pose: str = "rest", connectivity: str = "same") -> TriangleMesh:
    """Return a jointed person of about 9,000 vertices with a ball in the left hand: closed, genus 0, 1.8 tall.

    Twenty round cones make the person, which is its own mirror image; the ball tells left from right. The poses share
    their vertices' order and their faces and are nearly isometric. The remeshed copies have other triangles: their
    vertices are points of the first mesh's faces, see `doll_correspondence`. It stands upright along y and looks
    towards z; its left hand is on the side of x > 0. The smallest angle at rest is above 20 degrees.

    Parameters
    ----------
    pose : {"rest", "arms_down", "walk", "wave"}, what it does
    connectivity : {"same", "remeshed"}, the triangulation

    Examples
    --------
    >>> rest, walk = doll(), doll("walk")
    >>> bool((rest.faces == walk.faces).all()), walk.name
    (True, 'doll_walk')
    """
    pose = as_choice("pose", pose, ("rest", "arms_down", "walk", "wave"))
    connectivity = as_choice("connectivity", connectivity, ("same", "remeshed"))
    mesh = _stored_body("doll", pose)
    if connectivity == "same":
        return mesh
    copy = load_stored("doll_copy")
    vertices = np.einsum("nc,ncd->nd", copy["weights"], mesh.vertices[copy["corners"]])
    return TriangleMesh(vertices, copy["faces"], f"{mesh.name}_remeshed")


def doll_correspondence() -> sp.csr_array:
    """Return the true correspondence P of the remeshed doll to the doll, the same in every pose; its rows sum to one.

    Row i of P (n_remeshed, n), sparse, holds the barycentric coordinates of vertex i of the remeshed doll in a face of
    the doll, so that ``P @ doll(pose).vertices`` are its vertices, and ``P @ f`` carries a function over. The nearest
    single vertex is ``P.argmax(axis=1)``, a map from the remeshed doll to the doll.

    Examples
    --------
    >>> P = doll_correspondence()
    >>> original, copy = doll("walk"), doll("walk", "remeshed")
    >>> bool(np.abs(P @ original.vertices - copy.vertices).max() < 1e-14)
    True
    """
    copy = load_stored("doll_copy")
    n_copy, n = len(copy["weights"]), int(load_stored("doll")["faces"].max()) + 1
    rows = np.repeat(np.arange(n_copy), 3)
    P = sp.csr_array((copy["weights"].ravel(), (rows, copy["corners"].ravel())), shape=(n_copy, n))
    P.eliminate_zeros()
    return P


def bracket() -> TriangleMesh:
    """Return a machined bracket of about 8,900 vertices: a plate with four bolt holes and two bored lugs, genus 6.

    Closed, 2 long (x), 1.4 wide (y), 1.05 high (z); the smallest angle is above 20 degrees.

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(bracket())
    -10
    """
    return _stored_body("bracket", "rest")


def _stored_body(name: str, pose: str) -> TriangleMesh:
    """Return a body in a pose, named after both."""
    stored = load_stored(name)
    return TriangleMesh(stored[pose], stored["faces"], name if pose == "rest" else f"{name}_{pose}")
