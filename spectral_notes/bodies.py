"""The course's bodies, built from signed distances: the goat.

All are closed, of well-shaped triangles, and take seconds to build; the cache keeps them (see `spectral_notes._cache`).
"""

from __future__ import annotations

import sys
from collections.abc import Mapping

from spectral_notes import implicit, posing
from spectral_notes._cache import Arrays, cached_arrays
from spectral_notes._checks import as_choice
from spectral_notes.implicit import mesh_zero_set
from spectral_notes.meshes import TriangleMesh
from spectral_notes.posing import Body, Limb, Pose, body_distance, pose_body

_GOAT_LEFT = (
    Limb("front_left", "trunk", ((0.40, 0.70, 0.13, 0.105), (0.42, 0.38, 0.15, 0.06), (0.42, 0.05, 0.15, 0.05))),
    Limb("hind_left", "trunk", ((-0.44, 0.72, 0.13, 0.125), (-0.52, 0.38, 0.15, 0.06), (-0.49, 0.05, 0.15, 0.05))),
    Limb("ear_left", "neck", ((0.80, 1.13, 0.08, 0.045), (0.75, 1.13, 0.23, 0.034))),
    Limb("horn_left", "neck", ((0.83, 1.16, 0.05, 0.038), (0.80, 1.31, 0.08, 0.03), (0.70, 1.42, 0.11, 0.022))),
)
GOAT = (
    Limb(
        "trunk",
        None,
        ((-0.45, 0.79, 0.0, 0.205), (-0.18, 0.765, 0.0, 0.228), (0.14, 0.76, 0.0, 0.236), (0.42, 0.80, 0.0, 0.215)),
    ),
    Limb(
        "neck",
        "trunk",
        ((0.42, 0.82, 0.0, 0.165), (0.63, 1.0, 0.0, 0.112), (0.82, 1.09, 0.0, 0.112), (1.0, 1.0, 0.0, 0.078)),
    ),
    Limb("beard", "neck", ((0.95, 0.98, 0.0, 0.05), (0.93, 0.82, 0.0, 0.024))),
    Limb("tail", "trunk", ((-0.52, 0.85, 0.0, 0.07), (-0.66, 0.86, 0.0, 0.045), (-0.77, 0.70, 0.0, 0.028))),
    *_GOAT_LEFT,
    *(limb.mirrored(2) for limb in _GOAT_LEFT),
)

_GOAT_POSES: dict[str, Pose] = {
    "rest": {},
    "walk": {
        "front_left": [(0.0, 0.0, 0.3), (0.0, 0.0, -0.15)],
        "front_right": [(0.0, 0.0, -0.25), (0.0, 0.0, -0.35)],
        "hind_left": [(0.0, 0.0, -0.3), (0.0, 0.0, -0.1)],
        "hind_right": [(0.0, 0.0, 0.3), (0.0, 0.0, -0.15)],
    },
    "look": {"neck": [(0.0, -0.2, 0.05), (0.0, -0.45, 0.0), (0.0, -0.45, 0.0)]},
}


def goat(pose: str = "rest") -> TriangleMesh:
    """Return a goat of about 14,300 vertices, its head towards x and its back towards y: closed, genus 0.

    Its poses share the faces and are nearly isometric (`posing.pose_body`).

    Parameters
    ----------
    pose : {"rest", "walk", "look"}
        What it does.

    Returns
    -------
    TriangleMesh
        Closed, genus 0; the smallest angle at rest is above 20 degrees. About 1.8 long.

    Raises
    ------
    ValueError
        If the pose is not one of the three.

    Examples
    --------
    >>> from spectral_notes.meshes import euler_characteristic
    >>> euler_characteristic(goat())
    2
    """
    pose = as_choice("pose", pose, tuple(_GOAT_POSES))
    return _body_in_pose("goat", GOAT, _GOAT_POSES, pose)


_BOXES = {"goat": ((-0.95, -0.05, -0.35), (1.15, 1.5, 0.35))}
_FILLET, _STEP = 0.02, 0.018


def _body_in_pose(name: str, body: Body, poses: Mapping[str, Pose], pose: str) -> TriangleMesh:
    """Return a body, built at rest and then posed, both from the cache when they are there."""
    recipe = (sys.modules[__name__], implicit, posing)

    def build_rest() -> Arrays:
        vertices, faces = mesh_zero_set(body_distance(body, _FILLET), *_BOXES[name], _STEP)
        return {"vertices": vertices, "faces": faces}

    rest = cached_arrays(name, {}, recipe, build_rest)
    vertices, faces = rest["vertices"], rest["faces"]
    if pose == "rest":
        return TriangleMesh(vertices, faces, name)
    full_name = f"{name}_{pose}"
    posed = cached_arrays(full_name, {}, recipe, lambda: {"vertices": pose_body(vertices, faces, body, poses[pose])})
    return TriangleMesh(posed["vertices"], faces, full_name)
