"""Build goat, doll and bracket from signed distances, and write them as data of the package.

    python tools/bodies.py

A signed distance is negative inside a solid, zero on its surface, positive outside; unions, blends and cuts of solids
are formulas in their distances. Marching cubes makes a mesh of the zero set, a relaxation on the surface spreads its
vertices, and limbs that turn at their joints deform it nearly isometrically (Sorkine and Alexa 2007). libigl fits the
rotations in single precision, so that another version may differ in the sixth digit; what is shipped does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from storing import save_stored

from spectral_notes._checks import FloatArray, IntArray
from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import TriangleMesh

Distance = Callable[[FloatArray], FloatArray]
Vector = tuple[float, float, float]

def round_cone(
    points: FloatArray, start: Sequence[float], end: Sequence[float], start_radius: float, end_radius: float
) -> FloatArray:
    r"""Return the signed distance to the hull of two balls: a capsule whose radius changes along its axis."""
    origin = np.asarray(start, dtype=np.float64)
    axis = np.asarray(end, dtype=np.float64) - origin
    length = float(np.linalg.norm(axis))
    offset = points - origin
    along = offset @ (axis / length)
    across = np.sqrt(np.maximum(np.einsum("ij,ij->i", offset, offset) - along**2, 0.0))
    slope = (start_radius - end_radius) / length
    t = np.clip(along - across * slope / np.sqrt(1.0 - slope**2), 0.0, length)
    return np.asarray(np.sqrt((along - t) ** 2 + across**2) - (start_radius - slope * t))


def rounded_box(points: FloatArray, center: Sequence[float], half_size: Sequence[float], radius: float) -> FloatArray:
    """Return the signed distance to an upright box whose edges are rounded."""
    excess = np.abs(points - np.asarray(center)) - (np.asarray(half_size) - radius)
    outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
    return np.asarray(outside + np.minimum(excess.max(axis=1), 0.0) - radius)


def rounded_extrusion(profile: FloatArray, slab: FloatArray, radius: float) -> FloatArray:
    """Return the signed distance to the part of an endless prism inside a slab, its rims rounded."""
    a, b = profile + radius, slab + radius
    outside = np.sqrt(np.maximum(a, 0.0) ** 2 + np.maximum(b, 0.0) ** 2)
    return np.asarray(outside + np.minimum(np.maximum(a, b), 0.0) - radius)


def infinite_cylinder(points: FloatArray, center: Sequence[float], axis: int, radius: float) -> FloatArray:
    """Return the signed distance to an endless cylinder along coordinate axis 0, 1 or 2."""
    across = np.delete(points - np.asarray(center), axis, axis=1)
    return np.asarray(np.linalg.norm(across, axis=1) - radius)


def blend(distances: Sequence[FloatArray], width: float) -> FloatArray:
    r"""Return the smooth union of shapes: never above the smallest distance, with fillets where two come close."""
    nearest = np.min(distances, axis=0)
    return np.asarray(nearest - width * np.log(sum(np.exp((nearest - d) / width) for d in distances)))


def cut(distance: FloatArray, tool: FloatArray, width: float) -> FloatArray:
    """Return the smooth difference, the shape with the tool taken away: never below the given distance."""
    return -blend([-distance, tool], width)


def mesh_zero_set(
    distance: Distance, low: Sequence[float], high: Sequence[float], step: float, *, rounds: int = 20
) -> tuple[FloatArray, IntArray]:
    """Return a triangle mesh of the zero set, of edges near `step`, closed if the box holds the surface."""
    axes = [np.arange(a, b + step, step) for a, b in zip(low, high, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")  # x runs fastest, as libigl expects
    grid = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    values = distance(grid)
    _check_box(values.reshape(x.shape))
    values[np.abs(values) < 1e-9 * step] = 1e-9 * step  # a vertex of the grid on the surface would be met twice
    vertices, faces, _ = igl.marching_cubes(values, grid, *(len(axis) for axis in axes), 0.0)
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    if _signed_volume(vertices, faces) < 0:
        faces = faces[:, ::-1].copy()
    return _relax(distance, vertices, faces, step, rounds), faces


def _check_box(values: FloatArray) -> None:
    """Raise if the surface does not lie inside the grid."""
    inner = values[1:-1, 1:-1, 1:-1]
    if not (inner < 0).any():
        raise ValueError("low and high must span a box that holds the surface; no point of the grid lies inside it")
    if (values <= 0).sum() > (inner <= 0).sum():
        raise ValueError("low and high must span a box that holds the surface; it reaches the sides of the box")


def _relax(distance: Distance, vertices: FloatArray, faces: IntArray, step: float, rounds: int) -> FloatArray:
    """Spread the vertices evenly over the zero set."""
    n = len(vertices)
    pairs = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    adjacency = sp.csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))  # each edge both ways
    degree = adjacency.sum(axis=1)
    _, gradient = _value_and_gradient(distance, vertices)
    for _ in range(rounds):
        pull = adjacency @ vertices / degree[:, None] - vertices
        pull -= _along(gradient, np.einsum("ij,ij->i", pull, gradient))
        vertices = vertices + 0.5 * pull
        value, gradient = _value_and_gradient(distance, vertices)
        vertices = vertices - _along(gradient, np.clip(value, -step, step))
    return vertices


def _along(gradient: FloatArray, value: FloatArray) -> FloatArray:
    """Return the step along the gradient that changes a linear function by `value`; slopes count as 1/2 at least."""
    squared = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 0.25)
    return np.asarray((value / squared)[:, None] * gradient)


def _value_and_gradient(distance: Distance, points: FloatArray, h: float = 1e-7) -> tuple[FloatArray, FloatArray]:
    """Return a distance (n,) and its forward differences (n, 3)."""
    value = distance(points)
    return value, np.column_stack([(distance(points + h * axis) - value) / h for axis in np.eye(3)])


def _signed_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Return six times the enclosed volume: positive when the normals point out."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)))


@dataclass(frozen=True)
class Limb:
    """A chain of bones of changing thickness, attached to the last bone of its parent."""

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
    """Return the signed distance to a body: limbs blended by fillets, each limb the plain union of its bones."""

    def distance(points: FloatArray) -> FloatArray:
        limbs = [np.min(_bone_distances([limb], points), axis=0) for limb in body]
        return blend(limbs, width)

    return distance


def pose_body(vertices: FloatArray, faces: IntArray, body: Body, pose: Pose, *, softness: float = 0.02) -> FloatArray:
    """Return the vertices of a body whose limbs have turned: nearly an isometry."""
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


FOLDER = Path(__file__).resolve().parent.parent / "spectral_notes" / "shapes" / "data"
FILLET = 0.02


STEP = 0.018


BOXES = {"goat": ((-0.95, -0.05, -0.35), (1.15, 1.5, 0.35)), "doll": ((-0.95, -0.05, -0.25), (1.05, 1.9, 0.30))}


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


def build_bodies() -> dict[str, dict[str, FloatArray | IntArray]]:
    """Return the arrays of goat, doll and bracket by name: the faces, and the vertices of each pose."""
    made: dict[str, dict[str, FloatArray | IntArray]] = {}
    for name, body, poses in (("goat", GOAT, GOAT_POSES), ("doll", DOLL, DOLL_POSES)):
        rest, faces = mesh_zero_set(body_distance(body, FILLET), *BOXES[name], STEP)
        posed = {pose: pose_body(rest, faces, body, turns) if turns else rest for pose, turns in poses.items()}
        made[name] = {"faces": faces, **posed}
    vertices, faces = mesh_zero_set(_bracket_distance, (-1.15, -0.85, -0.25), (1.15, 0.85, 1.1), 0.035)
    made["bracket"] = {"faces": faces, "rest": vertices}
    return made


def build_doll_copy(doll: TriangleMesh) -> dict[str, FloatArray | IntArray]:
    """Return another triangulation of the doll at rest: its faces, and each vertex as corners and weights."""
    low, high = ([x - 0.007 for x in corner] for corner in BOXES["doll"])
    points, faces = mesh_zero_set(body_distance(DOLL, FILLET), low, high, 0.0195)
    P = surface_weights(points, doll)
    corners = P.indices.reshape(-1, 3)
    return {"faces": faces, "corners": corners, "weights": P.data.reshape(-1, 3)}


def main() -> None:
    """Write the data of the three bodies; print what each file weighs."""
    bodies = build_bodies()
    doll = TriangleMesh(bodies["doll"]["rest"], bodies["doll"]["faces"])
    for name, arrays in {**bodies, "doll_copy": build_doll_copy(doll)}.items():
        whole = {key: rows for key, rows in arrays.items() if key in ("faces", "corners")}
        positions = {key: (rows, 0.0) for key, rows in arrays.items() if key not in whole}
        path = FOLDER / f"{name}.npz"
        save_stored(path, whole, positions)
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
