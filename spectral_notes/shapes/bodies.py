"""The course's bodies, built from signed distances: goat and doll, which take poses, and the bracket.

All are closed, of well-shaped triangles. Building one takes seconds; a cache keeps it (`shapes.cache`).
"""

from __future__ import annotations

import sys
import types
from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp

from spectral_notes._checks import FloatArray, as_choice
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import TriangleMesh
from spectral_notes.shapes import contouring, implicit, posing
from spectral_notes.shapes.cache import Arrays, cached_arrays
from spectral_notes.shapes.contouring import mesh_zero_set
from spectral_notes.shapes.implicit import (
    blend,
    cut,
    infinite_cylinder,
    round_cone,
    rounded_box,
    rounded_extrusion,
)
from spectral_notes.shapes.posing import Body, Limb, Pose, body_distance, pose_body

_GOAT_LEFT = (
    Limb("front_left", "trunk", ((0.40, 0.70, 0.13, 0.105), (0.42, 0.38, 0.15, 0.06), (0.42, 0.05, 0.15, 0.05))),
    Limb("hind_left", "trunk", ((-0.44, 0.72, 0.13, 0.125), (-0.52, 0.38, 0.15, 0.06), (-0.49, 0.05, 0.15, 0.05))),
    Limb("ear_left", "neck", ((0.80, 1.13, 0.08, 0.045), (0.75, 1.13, 0.23, 0.034))),
    Limb("horn_left", "neck", ((0.83, 1.16, 0.05, 0.038), (0.80, 1.31, 0.08, 0.03), (0.70, 1.42, 0.11, 0.022))),
)
_GOAT_TRUNK = (
    (-0.45, 0.79, 0.0, 0.205),
    (-0.18, 0.765, 0.0, 0.228),
    (0.14, 0.76, 0.0, 0.236),
    (0.42, 0.80, 0.0, 0.215),
)
_GOAT_NECK = ((0.42, 0.82, 0.0, 0.165), (0.63, 1.0, 0.0, 0.112), (0.82, 1.09, 0.0, 0.112), (1.0, 1.0, 0.0, 0.078))
GOAT: Body = (
    Limb("trunk", None, _GOAT_TRUNK),
    Limb("neck", "trunk", _GOAT_NECK),
    Limb("beard", "neck", ((0.95, 0.98, 0.0, 0.05), (0.93, 0.82, 0.0, 0.024))),
    Limb("tail", "trunk", ((-0.52, 0.85, 0.0, 0.07), (-0.66, 0.86, 0.0, 0.045), (-0.77, 0.70, 0.0, 0.028))),
    *_GOAT_LEFT,
    *(limb.mirrored(2) for limb in _GOAT_LEFT),
)
GOAT_POSES: Mapping[str, Pose] = {
    "rest": {},
    "walk": {
        "front_left": [(0.0, 0.0, 0.3), (0.0, 0.0, -0.15)],
        "front_right": [(0.0, 0.0, -0.25), (0.0, 0.0, -0.35)],
        "hind_left": [(0.0, 0.0, -0.3), (0.0, 0.0, -0.1)],
        "hind_right": [(0.0, 0.0, 0.3), (0.0, 0.0, -0.15)],
    },
    "look": {"neck": [(0.0, -0.2, 0.05), (0.0, -0.45, 0.0), (0.0, -0.45, 0.0)]},
}

_ARM = ((0.19, 1.42, 0.0, 0.062), (0.444, 1.33, 0.0, 0.047), (0.68, 1.245, 0.0, 0.036), (0.79, 1.205, 0.01, 0.045))
_LEG = ((0.087, 0.88, 0.0, 0.091), (0.145, 0.50, 0.005, 0.062), (0.175, 0.10, 0.0, 0.044))
_DOLL_LEFT = (
    Limb("collar_left", "trunk", ((0.0, 1.30, 0.0, 0.09), (0.19, 1.42, 0.0, 0.066))),
    Limb("arm_left", "collar_left", _ARM),
    Limb("hip_left", "trunk", ((0.0, 0.95, 0.0, 0.11), (0.085, 0.88, 0.0, 0.095))),
    Limb("leg_left", "hip_left", _LEG),
    Limb("foot_left", "leg_left", ((0.175, 0.07, -0.01, 0.048), (0.195, 0.05, 0.14, 0.042))),
)
DOLL: Body = (
    Limb("trunk", None, ((0.0, 0.95, 0.0, 0.125), (0.0, 1.12, 0.01, 0.115), (0.0, 1.30, 0.0, 0.140))),
    Limb("neck", "trunk", ((0.0, 1.36, 0.0, 0.075), (0.0, 1.55, 0.005, 0.050))),
    Limb("head", "neck", ((0.0, 1.625, 0.015, 0.082), (0.0, 1.72, 0.01, 0.112))),
    *_DOLL_LEFT,
    *(limb.mirrored(0) for limb in _DOLL_LEFT),
    Limb("ball", "arm_left", ((0.86, 1.18, 0.01, 0.10), (0.87, 1.177, 0.01, 0.10))),
)
DOLL_POSES: Mapping[str, Pose] = {
    "rest": {},
    "arms_down": {"arm_left": [(0.0, 0.0, -0.85)], "arm_right": [(0.0, 0.0, 0.85)]},
    "walk": {
        "arm_left": [(0.0, 0.5, -0.75), (0.0, -0.4, 0.0)],
        "arm_right": [(0.0, 0.5, 0.75), (0.0, 0.5, 0.0)],
        "leg_left": [(-0.4, 0.0, 0.0), (0.3, 0.0, 0.0)],
        "leg_right": [(0.35, 0.0, 0.0), (0.3, 0.0, 0.0)],
    },
    "wave": {
        "arm_right": [(0.0, 0.0, -0.85), (0.0, 0.0, -0.95)],
        "arm_left": [(0.0, 0.0, -0.75)],
        "leg_left": [(0.0, 0.0, 0.2)],
        "head": [(0.0, 0.0, 0.2)],
    },
}

_FILLET = 0.02
_STEP = 0.018
_BOXES = {"goat": ((-0.95, -0.05, -0.35), (1.15, 1.5, 0.35)), "doll": ((-0.95, -0.05, -0.25), (1.05, 1.9, 0.30))}


def goat(pose: str = "rest") -> TriangleMesh:
    """Return a goat of about 14,400 vertices, its head towards x and its back towards y: closed, genus 0.

    Its poses share the faces and are nearly isometric (`spectral_notes.shapes.posing.pose_body`).

    Parameters
    ----------
    pose : {"rest", "walk", "look"}
        What it does.

    Returns
    -------
    TriangleMesh
        About 1.8 long; the smallest angle at rest is above 20 degrees.

    Raises
    ------
    ValueError
        If the pose is none of these.

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(goat())
    2
    """
    pose = as_choice("pose", pose, tuple(GOAT_POSES))
    return _body_in_pose("goat", GOAT, GOAT_POSES, pose)


def doll(pose: str = "rest", connectivity: str = "same") -> TriangleMesh:
    """Return a jointed person of about 9,000 vertices with a ball in the left hand: closed, genus 0.

    Twenty round cones make the person, which is its own mirror image; the ball tells left from right. The poses share
    their vertices' order and their faces and are nearly isometric. The remeshed copies have other triangles: their
    vertices are points of the first mesh's faces, see `doll_correspondence`.

    Parameters
    ----------
    pose : {"rest", "arms_down", "walk", "wave"}
        What it does. It stands upright along y and looks towards z; its left hand is on the side of x > 0.
    connectivity : {"same", "remeshed"}
        The triangulation.

    Returns
    -------
    TriangleMesh
        About 1.8 tall; the smallest angle at rest is above 20 degrees.

    Raises
    ------
    ValueError
        If the pose or the connectivity is none of these.

    Examples
    --------
    >>> rest, walk = doll(), doll("walk")
    >>> bool((rest.faces == walk.faces).all()), walk.name
    (True, 'doll_walk')
    """
    pose = as_choice("pose", pose, tuple(DOLL_POSES))
    connectivity = as_choice("connectivity", connectivity, ("same", "remeshed"))
    mesh = _body_in_pose("doll", DOLL, DOLL_POSES, pose)
    if connectivity == "same":
        return mesh
    copy = _doll_remeshed()
    vertices = np.einsum("nc,ncd->nd", copy["weights"], mesh.vertices[copy["corners"]])
    return TriangleMesh(vertices, copy["faces"], f"{mesh.name}_remeshed")


def doll_correspondence() -> sp.csr_array:
    """Return the true correspondence P of the remeshed doll to the doll, the same in every pose; its rows sum to one.

    Row i holds the barycentric coordinates of vertex i of the remeshed doll in a face of the doll, so that
    ``P @ doll(pose).vertices`` are its vertices, and ``P @ f`` carries a function over. The nearest single vertex is
    ``P.argmax(axis=1)``, a map from the remeshed doll to the doll.

    Returns
    -------
    csr_array (n_remeshed, n)
        Entries from 0 to 1, at most three a row.

    Examples
    --------
    >>> P = doll_correspondence()
    >>> original, copy = doll("walk"), doll("walk", "remeshed")
    >>> bool(np.abs(P @ original.vertices - copy.vertices).max() < 1e-14)
    True
    """
    copy = _doll_remeshed()
    n_copy, n = len(copy["corners"]), doll().n_vertices
    rows = np.repeat(np.arange(n_copy), 3)
    P = sp.csr_array((copy["weights"].ravel(), (rows, copy["corners"].ravel())), shape=(n_copy, n))
    P.eliminate_zeros()
    return P


def bracket() -> TriangleMesh:
    """Return a machined bracket of about 8,900 vertices: a plate with four bolt holes and two bored lugs, genus 6.

    Returns
    -------
    TriangleMesh
        Closed, 2 long (x), 1.4 wide (y), 1.05 high (z); the smallest angle is above 20 degrees.

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(bracket())
    -10
    """

    def build() -> Arrays:
        vertices, faces = mesh_zero_set(_bracket_distance, (-1.15, -0.85, -0.25), (1.15, 0.85, 1.1), 0.035)
        return {"vertices": vertices, "faces": faces}

    arrays = cached_arrays("bracket", {}, _recipe(), build)
    return TriangleMesh(arrays["vertices"], arrays["faces"], "bracket")


def _bracket_distance(points: FloatArray) -> FloatArray:
    """Return the signed distance to the bracket: plate and lugs blended, then the bore and the bolt holes cut."""
    x, z = points[:, 0], points[:, 2]
    arch = round_cone(points * np.array([0.0, 1.0, 1.0]), (0.0, 0.0, 0.25), (0.0, 0.0, 0.6), 0.36, 0.33)
    arch = np.maximum(arch, -z)  # the lugs end inside the plate
    plate = rounded_box(points, (0.0, 0.0, 0.0), (1.0, 0.7, 0.12), 0.06)
    lugs = [rounded_extrusion(arch, np.abs(x - middle) - 0.12, 0.06) for middle in (-0.36, 0.36)]
    solid = cut(blend([plate, *lugs], 0.04), infinite_cylinder(points, (0.0, 0.0, 0.6), 0, 0.17), 0.025)
    for center in ((-0.76, -0.46), (-0.76, 0.46), (0.76, -0.46), (0.76, 0.46)):
        solid = cut(solid, infinite_cylinder(points, (*center, 0.0), 2, 0.13), 0.025)
    return solid


def _body_in_pose(name: str, body: Body, poses: Mapping[str, Pose], pose: str) -> TriangleMesh:
    """Return a body, built at rest and then posed, both from the cache when they are there."""

    def build_rest() -> Arrays:
        vertices, faces = mesh_zero_set(body_distance(body, _FILLET), *_BOXES[name], _STEP)
        return {"vertices": vertices, "faces": faces}

    rest = cached_arrays(name, {}, _recipe(), build_rest)
    vertices, faces = rest["vertices"], rest["faces"]
    if pose == "rest":
        return TriangleMesh(vertices, faces, name)
    full_name = f"{name}_{pose}"
    posed = cached_arrays(full_name, {}, _recipe(), lambda: {"vertices": pose_body(vertices, faces, body, poses[pose])})
    return TriangleMesh(posed["vertices"], faces, full_name)


def _doll_remeshed() -> Arrays:
    """Return another triangulation of the doll at rest: faces, and for each vertex a face's corners and its weights."""

    def build() -> Arrays:
        low, high = ([x - 0.007 for x in corner] for corner in _BOXES["doll"])
        points, faces = mesh_zero_set(body_distance(DOLL, _FILLET), low, high, 0.0195)
        original = doll()
        P = surface_weights(points, original)
        return {"faces": faces, "corners": P.indices.reshape(-1, 3), "weights": P.data.reshape(-1, 3)}

    return cached_arrays("doll_remeshed", {}, _recipe(), build)


def _recipe() -> tuple[types.ModuleType, ...]:
    """Return the modules that decide what the bodies look like."""
    return sys.modules[__name__], contouring, implicit, posing
