"""From where a shape is looked at, read off the shape itself: which way is up, and which side is broad.

No name and no file decides. Up is the normal of what lies flat, an axis in which the shape has no mirror symmetry where
it has one in the other, or the long axis of what is tall; z where none of these says y.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from spectral_notes._checks import FloatArray
from spectral_notes.meshes import PointCloud, Shape, TriangleMesh, face_areas, face_normals, positions

Vector = tuple[float, float, float]
Camera = tuple[Vector, Vector]  # where the eye stands, seen from the shape's centre; which way is up

FLAT = 0.9  # share of an axis in the normals above which a shape lies in the plane of the other two
TALL = 1.5  # how much higher than deep a shape is that stands up
PLATE = 0.7  # share of an axis in the normals above which it is more a plate that lies
SAME = 0.02  # of the size: how close a mirror image comes to what is symmetric
SAMPLE = 2000  # points that the symmetry is looked for in


def camera_of(shape: Shape, up: str = "") -> Camera:
    """Return the camera for a shape: `up` upward ("" is guessed), the broad side to the eye, from a little above."""
    axis = "xyz".index(up or guess_up(shape)[0])
    spread = _spread(shape)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    deep, wide = (2, 0) if axis == 1 else (1, 3 - axis - 1)  # the eye's custom: y-up faces +z, z-up faces -y
    broad = max(spread[first], spread[second]) > 1.2 * min(spread[first], spread[second])
    if broad and spread[deep] > spread[wide]:
        deep, wide = wide, deep
    frame = np.eye(3)
    if _flatness(shape)[axis] > 0.999:  # a map is read from above
        return _vector(frame[axis]), _vector(frame[second if axis == 2 else deep])
    front = frame[deep] if axis == 1 else -frame[deep]
    above = 0.3 if spread[axis] > spread[deep] else 0.75
    eye = front + (0.45 if broad else 0.6) * frame[wide] + above * frame[axis]
    return _vector(eye), _vector(frame[axis])


def guess_up(shape: Shape) -> tuple[str, str]:
    """Return the axis that probably points upward, and why, in words that may follow it."""
    flat = _flatness(shape)
    if flat.max() > FLAT:
        return "xyz"[int(np.argmax(flat))], "it lies flat"
    mirror = _mirror_errors(shape)
    _, y, z = _spread(shape)
    if mirror[2] < SAME < mirror[1]:
        return "y", "the halves of the shape are left and right of z = 0"
    if mirror[1] < SAME < mirror[2]:
        return "z", "the halves of the shape are left and right of y = 0"
    if y > TALL * z and flat[2] < PLATE and min(mirror[1], mirror[2]) > SAME:
        return "y", "the shape is higher than deep along it"
    return "z", "nothing speaks for another axis"


def _spread(shape: Shape) -> FloatArray:
    """Standard deviation of the surface along each axis."""
    points, weights = positions(shape), np.ones(len(positions(shape)))
    if isinstance(shape, TriangleMesh) and face_areas(shape).any():
        points, weights = shape.vertices[shape.faces].mean(axis=1), face_areas(shape)
    points = points - points.mean(axis=0)
    points /= float(np.abs(points).max()) or 1.0
    weights = weights / weights.sum()
    return np.sqrt(np.maximum(weights @ points**2 - (weights @ points) ** 2, 0.0))


def _flatness(shape: Shape) -> FloatArray:
    """Mean size of each component of the normals, by area; of a cloud, how much thinner it is than long."""
    if isinstance(shape, PointCloud):
        spread = _spread(shape)
        return np.asarray(spread < 1e-3 * spread.max(), dtype=np.float64)
    areas = face_areas(shape)
    if not areas.any():
        return np.zeros(3)
    return np.average(np.abs(face_normals(shape)), axis=0, weights=areas)


def _mirror_errors(shape: Shape) -> FloatArray:
    """How far most of the mirror image in each axis lies from the shape, as a share of its size.

    The mirror goes through the middle of the extent or through the median, whichever fits: a head that is turned moves
    the one, more vertices on one side the other.
    """
    points = positions(shape)
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max()) or 1.0
    errors = []
    for middle in ((low + high) / 2, np.median(points, axis=0)):
        placed = (points - middle) / size
        tree = cKDTree(placed)
        some = placed[np.linspace(0, len(placed) - 1, min(SAMPLE, len(placed))).astype(np.int64)]
        errors.append([np.median(tree.query(some * np.where(np.arange(3) == k, -1.0, 1.0))[0]) for k in range(3)])
    return np.min(errors, axis=0)


def _vector(values: FloatArray) -> Vector:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z
