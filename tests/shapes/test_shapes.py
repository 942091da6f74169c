"""Shapes given by formulas: counts, topology, closed forms, exact isometries, and every error message."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import igl
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from spectral_notes import shapes
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import (
    TriangleMesh,
    boundary_loops,
    connected_components,
    corner_angles,
    edge_lengths,
    edges_with_counts,
    euler_characteristic,
    face_normals,
)
from spectral_notes.shapes import (
    disk,
    egg,
    equilateral_triangle,
    flat_torus,
    gww_drums,
    potato,
    rectangle,
    sample_points,
    sheet,
    sphere,
    spherical_cap,
    terrain,
    torus,
    torus_patch,
)


def smallest_angle(mesh: TriangleMesh) -> float:
    return float(np.degrees(corner_angles(mesh).min()))


def signed_volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@pytest.mark.parametrize(
    ("mesh", "chi", "angle"),
    [(sphere(4), 2, 54), (egg(4), 2, 38), (potato(subdivisions=4), 2, 35), (torus(), 0, 30)],
    ids=lambda value: value.name if isinstance(value, TriangleMesh) else str(value),
)
def test_closed_surfaces(mesh: TriangleMesh, chi: int, angle: float) -> None:
    assert (edges_with_counts(mesh)[1] == 2).all()
    assert connected_components(mesh).max() == 0
    assert euler_characteristic(mesh) == chi
    assert signed_volume(mesh) > 0
    assert smallest_angle(mesh) > angle


@pytest.mark.parametrize(
    ("mesh", "angle"),
    [
        (torus_patch(), 30),
        (sheet(2.4), 44.9),
        (spherical_cap(), 38),
        (spherical_cap(rings_pushed_in=18), 38),
        (rectangle(1.5, 1.0), 33),
        (disk(), 44),
        (equilateral_triangle(), 59.9),
        (gww_drums()[0], 44.9),
        (gww_drums()[1], 44.9),
        (terrain(8), 35),
    ],
    ids=lambda value: value.name if isinstance(value, TriangleMesh) else str(value),
)
def test_surfaces_with_one_boundary(mesh: TriangleMesh, angle: float) -> None:
    assert len(boundary_loops(mesh)) == 1
    assert euler_characteristic(mesh) == 1
    assert len(np.unique(mesh.faces)) == mesh.n_vertices
    assert smallest_angle(mesh) > angle


def test_every_shape_is_the_same_twice() -> None:
    makers: list[Callable[[], TriangleMesh]] = [
        sphere, egg, potato, torus, torus_patch, lambda: sheet(2.4), spherical_cap, disk, lambda: gww_drums()[1], terrain,
    ]
    for make in makers:
        one, other = make(), make()
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.faces, other.faces)
        assert one.name == other.name != ""


def test_sphere_is_round_and_its_area_converges_at_order_two() -> None:
    errors = []
    for subdivisions in range(2, 6):
        ball = sphere(subdivisions)
        assert ball.n_vertices == 10 * 4**subdivisions + 2
        np.testing.assert_allclose(np.linalg.norm(ball.vertices, axis=1), 1.0, atol=1e-15)
        errors.append(4.0 * np.pi - ball.area)
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert (np.abs(orders - 2.0) < 0.03).all()


def test_egg_is_a_surface_of_revolution_blunt_below() -> None:
    points = egg(4).vertices
    z = points[:, 2] / 1.3
    profile = np.sqrt(np.maximum(1.0 - z**2, 0.0)) * np.exp(-0.18 * points[:, 2])
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), profile, atol=1e-7)
    assert points[np.hypot(points[:, 0], points[:, 1]).argmax(), 2] < -0.1


def test_potatoes_differ_by_seed_and_have_both_signs_of_curvature() -> None:
    assert np.abs(potato(1).vertices - potato(2).vertices).max() > 0.05
    defect = 2.0 * np.pi - np.bincount(potato().faces.ravel(), weights=corner_angles(potato()).ravel())
    assert 0.01 < np.mean(defect < 0) < 0.4


def test_torus_and_its_patch_lie_on_the_torus() -> None:
    for mesh in (torus(R=2.0, r=0.5), torus_patch(R=2.0, r=0.5)):
        x, y, z = mesh.vertices.T
        np.testing.assert_allclose(np.hypot(np.hypot(x, y) - 2.0, z), 0.5, atol=1e-14)
    assert torus(400, 200).area == pytest.approx(4.0 * np.pi**2 * 0.4, rel=5e-4)
    patch = torus_patch((0.2, 0.7), (-0.3, 0.4), n_major=5, n_minor=4)
    assert np.arctan2(patch.vertices[0, 1], patch.vertices[0, 0]) == pytest.approx(0.2)
    assert np.arctan2(patch.vertices[-1, 1], patch.vertices[-1, 0]) == pytest.approx(0.7)
    assert patch.vertices[3, 2] == pytest.approx(0.4 * np.sin(0.4))


def test_bent_sheets_keep_every_length() -> None:
    flat = sheet()
    assert np.ptp(flat.vertices, axis=0).tolist() == pytest.approx([1.0, 0.6, 0.0], abs=1e-14)
    for bend in (-1.0, 0.01, 2.4, 6.0, 4.0 * np.pi):
        bent = sheet(bend)
        np.testing.assert_array_equal(bent.faces, flat.faces)
        assert np.abs(edge_lengths(bent) - edge_lengths(flat)).max() < 1e-15
        first, last = bent.vertices[37] - bent.vertices[0], bent.vertices[-1] - bent.vertices[-1 - 37]
        turned = np.arctan2(last[2], last[0]) - np.arctan2(first[2], first[0])
        assert np.cos(turned) == pytest.approx(np.cos(bend))
        assert np.sin(turned) == pytest.approx(-np.sin(bend), abs=1e-12)


def test_rolled_sheet_does_not_meet_itself() -> None:
    section = sheet(4.0 * np.pi).vertices[::37][:, [0, 2]]
    apart = np.abs(np.subtract.outer(np.arange(61), np.arange(61)))
    distance = np.linalg.norm(section[:, None] - section[None], axis=2)
    assert distance[apart > 8].min() > 0.03


def test_pushed_in_cap_is_isometric_but_not_congruent() -> None:
    bump, dent = spherical_cap(), spherical_cap(rings_pushed_in=18)
    np.testing.assert_array_equal(bump.faces, dent.faces)
    assert np.abs(edge_lengths(bump) - edge_lengths(dent)).max() < 1e-15
    np.testing.assert_allclose(np.linalg.norm(bump.vertices, axis=1), 1.0, atol=1e-15)
    some = slice(None, None, 40)
    gap = np.sort(pdist(bump.vertices[some])) - np.sort(pdist(dent.vertices[some]))
    assert np.abs(gap).max() > 0.01  # a congruent copy, even a mirrored one, would have the same distances
    outside = bump.vertices[:, 2] < np.cos(0.6) + 1e-12
    np.testing.assert_array_equal(bump.vertices[outside], dent.vertices[outside])
    assert (bump.name, dent.name) == ("cap", "cap_pushed_in")


def test_cap_pushed_in_as_a_whole_is_its_mirror_image() -> None:
    bump, dent = spherical_cap(n_rings=6), spherical_cap(n_rings=6, rings_pushed_in=6)
    mirrored = bump.vertices * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2.0 * np.cos(1.2)])
    np.testing.assert_allclose(dent.vertices, mirrored, atol=1e-15)


def test_flat_domains_have_their_areas_and_lie_in_the_plane() -> None:
    assert rectangle(2.0, 0.5, 7, 9).area == pytest.approx(1.0, rel=1e-14)
    assert equilateral_triangle(2.0).area == pytest.approx(np.sqrt(3.0), rel=1e-14)
    n = 6 * 32
    assert disk(2.0).area == pytest.approx(0.5 * n * 4.0 * np.sin(2.0 * np.pi / n), rel=1e-13)
    for mesh in (rectangle(), disk(), equilateral_triangle(), *gww_drums()):
        assert (mesh.vertices[:, 2] == 0).all()
        np.testing.assert_array_equal(face_normals(mesh), np.tile([0.0, 0.0, 1.0], (mesh.n_faces, 1)))


@pytest.mark.parametrize("refinement", [1, 2, 5])
def test_drums_have_equal_area_and_perimeter_and_differ(refinement: int) -> None:
    corners = []
    for drum in gww_drums(refinement):
        assert drum.area == pytest.approx(14.0, rel=1e-14)
        (loop,) = boundary_loops(drum)
        outline = drum.vertices[loop]
        sides = np.roll(outline, -1, axis=0) - outline
        assert np.linalg.norm(sides, axis=1).sum() == pytest.approx(12.0 + 6.0 * np.sqrt(2.0), rel=1e-14)
        turns = np.abs(np.cross(sides, np.roll(sides, -1, axis=0))[:, 2]) > 1e-12
        corners.append(np.roll(outline, -1, axis=0)[turns])
        assert drum.n_faces == 7 * refinement**2
    assert [len(points) for points in corners] == [8, 8]
    assert np.abs(np.sort(pdist(corners[0])) - np.sort(pdist(corners[1]))).max() > 0.1


@pytest.mark.parametrize("mass", ["lumped", "full"])
def test_drums_have_one_discrete_spectrum(mass: str) -> None:
    spectra = []
    for drum in gww_drums(5):
        L, M = (matrix.toarray() for matrix in cotan_laplacian(drum, mass=mass))
        inside = np.ix_(*2 * [np.setdiff1d(np.arange(drum.n_vertices), boundary_loops(drum)[0])])
        spectra.append((eigh(L, M, eigvals_only=True), eigh(L[inside], M[inside], eigvals_only=True)))
    for one, other in zip(*spectra, strict=True):  # free, then fixed at the rim
        np.testing.assert_allclose(one, other, atol=1e-11 * one.max())


def test_flat_torus_closes_up_and_has_right_triangles() -> None:
    faces, lengths = flat_torus(2.0, 3.0, n_x=8, n_y=6)
    assert faces.shape == lengths.shape == (96, 3)
    mesh = TriangleMesh(np.random.default_rng(0).normal(size=(48, 3)), faces)  # positions do not matter here
    assert (edges_with_counts(mesh)[1] == 2).all()
    assert euler_characteristic(mesh) == 0
    np.testing.assert_allclose(np.sort(lengths, axis=1), np.tile([0.25, 0.5, np.sqrt(0.3125)], (96, 1)), atol=1e-15)
    a, b = np.sort(lengths, axis=1).T[:2]
    assert (a * b / 2).sum() == pytest.approx(6.0)
    sides = np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], axis=1).reshape(-1, 2)
    by_edge: dict[tuple[int, ...], set[float]] = {}
    for pair, length in zip(np.sort(sides, axis=1).tolist(), lengths.ravel(), strict=True):
        by_edge.setdefault(tuple(pair), set()).add(float(length))
    assert all(len(values) == 1 for values in by_edge.values())  # both faces agree on each edge


def test_flat_torus_has_the_spectrum_of_two_rings() -> None:
    faces, lengths = flat_torus(2.0, 3.0, n_x=8, n_y=6)
    L = -igl.cotmatrix_intrinsic(lengths, faces).toarray()
    found = np.linalg.eigvalsh(L) / (0.25 * 0.5)  # each vertex owns one cell
    along_x = (2.0 / 0.25 * np.sin(np.pi * np.arange(8) / 8)) ** 2
    along_y = (2.0 / 0.5 * np.sin(np.pi * np.arange(6) / 6)) ** 2
    np.testing.assert_allclose(found, np.sort(np.add.outer(along_x, along_y).ravel()), atol=1e-11)


def test_terrain_is_the_data_in_metres() -> None:
    hills = terrain(1)
    assert hills.n_vertices == 344 * 403
    assert (hills.vertices[:, 2].min(), hills.vertices[:, 2].max()) == (236.0, 1076.0)
    width, depth = np.ptp(hills.vertices[:, :2], axis=0)
    meridian = 2.0 * np.pi * 6_371_008.8 / 360.0  # metres of a degree
    assert depth == pytest.approx(343 * meridian / 1200.0, rel=1e-12)
    assert width == pytest.approx(402 * meridian / 1200.0 * np.cos(np.radians(36.58958333)), rel=1e-7)
    assert (face_normals(hills)[:, 2] > 0.1).all()
    assert cKDTree(hills.vertices).query(terrain(4).vertices)[0].max() < 1e-9  # a part of the samples, at their places


def test_terrain_keeps_the_map_the_right_way_round() -> None:
    hills = terrain(1)
    grid = hills.vertices[:, 2].reshape(403, 344)
    plain, ridge = grid[-100:, :100].mean(), grid[:100, :100].mean()
    assert ridge > plain + 200.0  # the mountains rise in the south-west, the valley lies in the south-east


def test_sampled_points_lie_on_the_mesh_and_are_uniform() -> None:
    mesh = torus()
    cloud = sample_points(mesh, 20_000, seed=1)
    squared, _, _ = igl.point_mesh_squared_distance(np.array(cloud.points), mesh.vertices, mesh.faces)
    assert squared.max() < 1e-28
    outer = np.hypot(cloud.points[:, 0], cloud.points[:, 1]) > 1.0
    share = 0.5 + 0.4 / np.pi  # of the torus's area that lies outside its centre circle
    assert np.mean(outer) == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / 20_000))
    assert cloud.name == "torus_points"
    np.testing.assert_array_equal(sample_points(mesh, 50, seed=1).points, sample_points(mesh, 50, seed=1).points)
    assert np.abs(sample_points(mesh, 50, seed=1).points - sample_points(mesh, 50, seed=2).points).max() > 0.1
    assert sample_points(TriangleMesh(mesh.vertices, mesh.faces), 5).name == "points"


def test_sampled_points_are_uniform_within_a_triangle() -> None:
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    x, y, _ = sample_points(triangle, 20_000).points.T
    for share in (x > 0.5, y > 0.5, x + y < 0.5):  # the three corners, a quarter of the area each
        assert np.mean(share) == pytest.approx(0.25, abs=5 * np.sqrt(0.25 * 0.75 / 20_000))


def test_names_at_the_door_are_all_there() -> None:
    assert all(getattr(shapes, name) is not None for name in shapes.__all__)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sphere(9), ValueError, "subdivisions must be between 0 and 8; got 9"),
        (lambda: sphere(2.0), TypeError, "subdivisions must be an integer; got float"),  # type: ignore[arg-type]
        (lambda: egg(-1), ValueError, "subdivisions must be between 0 and 8; got -1"),
        (lambda: potato(seed=-1), ValueError, "seed must be at least 0; got -1"),
        (lambda: potato(subdivisions=12), ValueError, "subdivisions must be between 0 and 8; got 12"),
        (lambda: torus(2, 10), ValueError, "n_major must be at least 3; got 2"),
        (lambda: torus(10, 2), ValueError, "n_minor must be at least 3; got 2"),
        (lambda: torus(r=0.0), ValueError, "r must be greater than 0; got 0"),
        (lambda: torus(R=0.4), ValueError, "R must be greater than 0.4; got 0.4"),
        (lambda: torus_patch((0.0, 7.0)), ValueError, r"u_range must increase by less than 2 pi; got \(0, 7\)"),
        (lambda: torus_patch(v_range=(1.0, 0.5)), ValueError, r"v_range must increase .* got \(1, 0.5\)"),
        (lambda: torus_patch((0.0, 1.0, 2.0)), ValueError, r"u_range must have shape \(2,\); got \(3,\)"),
        (lambda: torus_patch(n_major=1), ValueError, "n_major must be at least 2; got 1"),
        (lambda: torus_patch(n_minor=1), ValueError, "n_minor must be at least 2; got 1"),
        (lambda: torus_patch(r=2.0), ValueError, "R must be greater than 2; got 1"),
        (lambda: sheet(np.nan), ValueError, "bend must be finite; got nan"),
        (lambda: sheet(n_long=1), ValueError, "n_long must be at least 2; got 1"),
        (lambda: sheet(n_wide=1), ValueError, "n_wide must be at least 2; got 1"),
        (lambda: spherical_cap(0.0), ValueError, "half_angle must be greater than 0; got 0"),
        (lambda: spherical_cap(np.pi), ValueError, "half_angle must be less than pi; got 3.14159"),
        (lambda: spherical_cap(n_rings=0), ValueError, "n_rings must be at least 1; got 0"),
        (lambda: spherical_cap(rings_pushed_in=37), ValueError, "rings_pushed_in must be between 0 and 36; got 37"),
        (lambda: rectangle(0.0), ValueError, "width must be greater than 0; got 0"),
        (lambda: rectangle(1.0, -1.0), ValueError, "height must be greater than 0; got -1"),
        (lambda: rectangle(n_x=1), ValueError, "n_x must be at least 2; got 1"),
        (lambda: rectangle(n_y=1), ValueError, "n_y must be at least 2; got 1"),
        (lambda: disk(0.0), ValueError, "radius must be greater than 0; got 0"),
        (lambda: disk(n_rings=0), ValueError, "n_rings must be at least 1; got 0"),
        (lambda: equilateral_triangle(0.0), ValueError, "side must be greater than 0; got 0"),
        (lambda: equilateral_triangle(refinement=0), ValueError, "refinement must be at least 1; got 0"),
        (lambda: gww_drums(0), ValueError, "refinement must be at least 1; got 0"),
        (lambda: flat_torus(0.0), ValueError, "width must be greater than 0; got 0"),
        (lambda: flat_torus(1.0, 0.0), ValueError, "height must be greater than 0; got 0"),
        (lambda: flat_torus(n_x=2), ValueError, "n_x must be at least 3; got 2"),
        (lambda: flat_torus(n_y=2), ValueError, "n_y must be at least 3; got 2"),
        (lambda: terrain(0), ValueError, "step must be between 1 and 100; got 0"),
        (lambda: sample_points(sphere(1), 0), ValueError, "n must be at least 1; got 0"),
        (lambda: sample_points(sphere(1), 5, seed=-2), ValueError, "seed must be at least 0; got -2"),
    ],
)
def test_errors_name_the_argument(call: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()
