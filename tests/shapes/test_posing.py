"""Limbs and poses: mirror images, distances, rigid motions and bends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spectral_notes.meshes import TriangleMesh, edge_lengths
from spectral_notes.shapes.contouring import mesh_zero_set
from spectral_notes.shapes.implicit import round_cone
from spectral_notes.shapes.posing import Limb, body_distance, pose_body

ARM = Limb("arm", None, ((0.0, 0.0, 0.0, 0.1), (0.6, 0.0, 0.0, 0.1), (1.2, 0.0, 0.0, 0.08)))
HAND = Limb("hand", "arm", ((1.2, 0.0, 0.0, 0.08), (1.45, 0.0, 0.0, 0.1)))
BODY = (ARM, HAND)


@pytest.fixture(scope="module")
def surface() -> TriangleMesh:
    return TriangleMesh(*mesh_zero_set(body_distance(BODY, 0.02), (-0.2, -0.2, -0.2), (1.7, 0.2, 0.2), 0.04))


def test_mirrored_limb_changes_side_and_names() -> None:
    left = Limb("hand_left", "arm_left", ((1.0, 2.0, 3.0, 0.1), (4.0, 5.0, 6.0, 0.2)))
    right = left.mirrored(2)
    assert right == Limb("hand_right", "arm_right", ((1.0, 2.0, -3.0, 0.1), (4.0, 5.0, -6.0, 0.2)))
    assert right.mirrored(2).joints == left.joints
    assert ARM.mirrored(0).parent is None


def test_bones_of_one_limb_join_without_a_knob() -> None:
    points = np.random.default_rng(0).uniform(-0.5, 1.5, size=(200, 3))
    bones = [round_cone(points, a[:3], b[:3], a[3], b[3]) for a, b in zip(ARM.joints, ARM.joints[1:], strict=False)]
    np.testing.assert_allclose(body_distance([ARM], 0.02)(points), np.min(bones, axis=0), atol=1e-14)
    assert (body_distance(BODY, 0.02)(points) <= np.min(bones, axis=0) + 1e-14).all()


def test_empty_pose_is_the_rest(surface: TriangleMesh) -> None:
    posed = pose_body(surface.vertices, surface.faces, BODY, {})
    np.testing.assert_allclose(posed, surface.vertices, atol=1e-4)  # libigl fits rotations in single precision


def test_turning_the_root_turns_all(surface: TriangleMesh) -> None:
    turn = (0.3, -0.4, 0.9)
    posed = pose_body(surface.vertices, surface.faces, BODY, {"arm": [turn]})
    np.testing.assert_allclose(posed, Rotation.from_rotvec(turn).apply(surface.vertices.copy()), atol=1e-3)


def test_bent_elbow_carries_the_hand_and_keeps_lengths(surface: TriangleMesh) -> None:
    posed = pose_body(surface.vertices, surface.faces, BODY, {"arm": [(0, 0, 0), (0, 0, np.pi / 2)]})
    tip = surface.vertices[:, 0].argmax()
    np.testing.assert_allclose(posed[tip], [0.6, 0.95, 0.0], atol=0.03)
    upper = surface.vertices[:, 0] < 0.3
    np.testing.assert_allclose(posed[upper], surface.vertices[upper], atol=0.02)
    stretch = np.abs(edge_lengths(TriangleMesh(posed, surface.faces)) / edge_lengths(surface) - 1.0)
    assert np.median(stretch) < 0.01
    assert np.percentile(stretch, 90) < 0.15


def test_elbow_turns_with_the_shoulder(surface: TriangleMesh) -> None:
    bent = pose_body(surface.vertices, surface.faces, BODY, {"arm": [(0, 0, 0), (0, 0, 1.0)]})
    raised = pose_body(surface.vertices, surface.faces, BODY, {"arm": [(0, 0.8, 0), (0, 0, 1.0)]})
    np.testing.assert_allclose(raised, Rotation.from_rotvec((0, 0.8, 0)).apply(bent), atol=2e-3)
