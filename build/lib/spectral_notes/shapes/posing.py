"""Bodies made of limbs: a smooth surface around them, and its deformation when the limbs turn at their joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.shapes.contouring import Distance
from spectral_notes.shapes.implicit import blend, round_cone

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Limb:
    """A chain of bones of changing thickness, attached to the last bone of its parent.

    Parameters
    ----------
    name : str
        Name by which poses and other limbs refer to it.
    parent : str or None
        The limb that carries it; None for the root. A parent comes before its children.
    joints : tuple of (x, y, z, radius)
        Ends of the bones in order, with the radius of the body there.

    Examples
    --------
    >>> arm = Limb("arm_left", None, ((0.2, 1.4, 0.0, 0.06), (0.5, 1.4, 0.0, 0.05), (0.7, 1.4, 0.0, 0.04)))
    >>> arm.mirrored(0).joints[0], arm.mirrored(0).name
    ((-0.2, 1.4, 0.0, 0.06), 'arm_right')
    """

    name: str
    parent: str | None
    joints: tuple[tuple[float, float, float, float], ...]

    def mirrored(self, axis: int) -> Limb:
        """Return the limb of the other side: one coordinate changes sign, and "left" in the names becomes "right"."""
        sides = tuple(tuple(-x if i == axis else x for i, x in enumerate(joint)) for joint in self.joints)
        parent = None if self.parent is None else self.parent.replace("left", "right")
        return replace(self, name=self.name.replace("left", "right"), parent=parent, joints=sides)  # type: ignore[arg-type]


Body = Sequence[Limb]
Pose = Mapping[str, Sequence[Vector]]


def body_distance(body: Body, width: float) -> Distance:
    """Return the signed distance to a body: limbs blended by fillets, each limb the plain union of its bones.

    Two bones of a limb share the ball at their joint, so their union is smooth as it is; a blend would make a knob.

    Parameters
    ----------
    body : sequence of Limb
        The limbs.
    width : float
        Width of the fillets.

    Returns
    -------
    callable
        Points (n, 3) to values (n,).

    Examples
    --------
    >>> stick = [Limb("stick", None, ((0, 0, 0, 0.1), (1, 0, 0, 0.1)))]
    >>> body_distance(stick, 0.02)(np.array([[0.5, 0.5, 0.0]]))
    array([0.4])
    """

    def distance(points: FloatArray) -> FloatArray:
        limbs = [np.min(_bone_distances([limb], points), axis=0) for limb in body]
        return blend(limbs, width)

    return distance


def pose_body(vertices: FloatArray, faces: IntArray, body: Body, pose: Pose, *, softness: float = 0.02) -> FloatArray:
    """Return the vertices of a body whose limbs have turned: nearly an isometry.

    Each bone moves rigidly; vertices first follow a mixture of bones, then the rings in the middle of the bones are
    held and the rest is made as rigid as possible (Sorkine and Alexa 2007). libigl fits the rotations in single
    precision, so positions hold to about five digits.

    Parameters
    ----------
    vertices, faces : ndarray (n, 3), (m, 3)
        The surface of the body at rest.
    body : sequence of Limb
        Its limbs at rest.
    pose : mapping of limb name to rotation vectors
        One vector (radians, about the axes of space) for each joint of the limb, from the first on; the rest of the
        limb and all that it carries turn along.
    softness : float
        Width over which a vertex passes from one bone to the next.

    Returns
    -------
    ndarray (n, 3)
        The vertices in the pose.

    Examples
    --------
    >>> from spectral_notes.shapes.contouring import mesh_zero_set
    >>> arm = [Limb("arm", None, ((0, 0, 0, 0.1), (1, 0, 0, 0.1)))]
    >>> vertices, faces = mesh_zero_set(body_distance(arm, 0.02), (-0.2, -0.2, -0.2), (1.2, 0.2, 0.2), 0.05)
    >>> turned = pose_body(vertices, faces, arm, {"arm": [(0, 0, np.pi / 2)]})
    >>> bool(np.allclose(turned, np.column_stack([-vertices[:, 1], vertices[:, 0], vertices[:, 2]]), atol=1e-3))
    True
    """
    gaps = _bone_distances(body, vertices)  # (bones, n)
    gaps -= gaps.min(axis=0)
    weights = np.exp(-0.5 * (gaps / softness) ** 2)
    weights /= weights.sum(axis=0)
    motions = _bone_motions(body, pose)  # (bones, 3, 4)
    homogeneous = np.column_stack([vertices, np.ones(len(vertices))])
    start = np.einsum("bv,bij,vj->vi", weights, motions, homogeneous)
    return _as_rigid_as_possible(vertices, faces, start, _held_vertices(body, vertices, weights))


def _bones(body: Body) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Return the two ends (x, y, z, radius) of every bone, limb by limb."""
    return [pair for limb in body for pair in zip(limb.joints[:-1], limb.joints[1:], strict=True)]


def _bone_distances(body: Body, points: FloatArray) -> FloatArray:
    """Return the signed distance to every bone, (bones, n)."""
    return np.array([round_cone(points, a[:3], b[:3], a[3], b[3]) for a, b in _bones(body)])


def _bone_motions(body: Body, pose: Pose) -> FloatArray:
    """Return the rigid motion of every bone as a matrix [R | t], (bones, 3, 4)."""
    carried: dict[str | None, FloatArray] = {None: np.eye(4)}
    motions = []
    for limb in body:
        motion = carried[limb.parent]
        turns = list(pose.get(limb.name, ()))
        for k, joint in enumerate(limb.joints[:-1]):
            if k < len(turns):
                motion = motion @ _rotation_about(np.array(joint[:3]), turns[k])
            motions.append(motion[:3])
        carried[limb.name] = motion
    return np.array(motions)


def _rotation_about(center: FloatArray, vector: Vector) -> FloatArray:
    """Return the 4 x 4 matrix of a rotation that fixes `center`."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    motion[:3, 3] = center - motion[:3, :3] @ center
    return motion


def _held_vertices(body: Body, vertices: FloatArray, weights: FloatArray) -> NDArray[np.int32]:
    """Return the rings of vertices half-way along the bones."""
    held = np.zeros(len(vertices), dtype=bool)
    for (a, b), weight in zip(_bones(body), weights, strict=True):
        start, axis = np.array(a[:3]), np.array(b[:3]) - np.array(a[:3])
        along = (vertices - start) @ axis / (axis @ axis)
        held |= (weight > 0.97) & (along > 0.42) & (along < 0.58)
    return np.flatnonzero(held).astype(np.int32)


def _as_rigid_as_possible(
    vertices: FloatArray, faces: IntArray, start: FloatArray, held: NDArray[np.int32], rounds: int = 60
) -> FloatArray:
    """Minimise the as-rigid-as-possible energy from `start`, with the held vertices staying where `start` has them."""
    data = igl.ARAPData()
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES_AND_RIMS
    data.max_iter = rounds
    igl.arap_precomputation(vertices, faces, 3, held, data)
    return np.asarray(igl.arap_solve(start[held], data, start), dtype=np.float64)
