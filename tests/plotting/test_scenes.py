"""Scenes: every kind of view converts, values and nodal lines survive, the budget holds, the camera is the still's."""

from __future__ import annotations

import base64
import json

import matplotlib.pyplot as plt
import numpy as np
import plotly.graph_objects as go
import pytest
from scipy.spatial import cKDTree

from spectral_notes import plotting, shapes
from spectral_notes.meshes import PointCloud, TriangleMesh, edges, row_norms
from spectral_notes.plotting import scenes
from spectral_notes.plotting.rendering import DEFAULT_CAMERA, LABEL_COLORS, SurfaceView
from spectral_notes.plotting.scene_meshes import _carried, edge_polylines, lift, lighten, nodal_polylines


@pytest.fixture(scope="module")
def ball() -> TriangleMesh:
    """The unit sphere with more vertices than a scene takes."""
    return shapes.sphere(5)


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")


def kinds(mesh: TriangleMesh) -> dict[str, SurfaceView]:
    """One view of every kind."""
    x, height = mesh.vertices[:, 0], mesh.vertices[:, 2]
    feet = mesh.vertices[:20]
    return {
        "plain": SurfaceView(mesh),
        "signed": SurfaceView(mesh, x, curves=(feet,), points=feet[:3]),
        "positive": SurfaceView(mesh, height + 2, kind="positive"),
        "labels": SurfaceView(mesh, (x > 0).astype(int), kind="labels"),
        "labels of faces": SurfaceView(mesh, np.arange(mesh.n_faces) % 3, kind="labels"),
        "faces": SurfaceView(mesh, np.linspace(0, 1, mesh.n_faces), kind="positive"),
        "arrows": SurfaceView(mesh, x, arrows=(feet, 0.1 * feet)),
        "edges": SurfaceView(mesh, edges=True),
        "cloud": SurfaceView(PointCloud(mesh.vertices), x),
        "cloud of labels": SurfaceView(PointCloud(mesh.vertices), (x > 0).astype(int), kind="labels"),
        "cloud with arrows": SurfaceView(PointCloud(mesh.vertices), arrows=(feet, 0.1 * feet)),
    }


def unpacked(array: dict[str, str]) -> np.ndarray:
    """An array as Plotly.js unpacks it."""
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=f"<{array['dtype']}")


@pytest.mark.parametrize("kind", kinds(shapes.sphere(1)))
@pytest.mark.parametrize("level", [2, 5])
def test_every_kind_of_view_is_a_valid_figure_within_the_budget(kind, level):
    view = kinds(shapes.sphere(level))[kind]
    figure = scenes.figure(view, color_bar="what it shows")  # Plotly checks every property
    assert isinstance(figure, go.Figure)
    text = scenes.scene_text(view, color_bar="what it shows")
    assert 500 < len(text) <= scenes.MAX_BYTES
    first = json.loads(text)["data"][0]
    assert len(unpacked(first["x"])) <= scenes.MAX_VERTICES + 10
    assert {unpacked(first[name]).dtype for name in "xyz"} == {np.dtype("<i2")}


def test_positions_survive_to_a_thousandth_and_lie_in_the_camera_s_axes(ball):
    view = SurfaceView(ball, camera=((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))  # its axes are those of space
    first = scenes.scene(view)["data"][0]
    placed = np.stack([first[name] for name in "xyz"], axis=1) / scenes.TOP
    assert np.abs(row_norms(placed) - 1).max() < 2e-3  # the sphere's own deviation is 1e-3
    turned = SurfaceView(ball, camera=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    first = scenes.scene(turned)["data"][0]
    back = np.stack([-first["y"], first["z"], -first["x"]], axis=1) / scenes.TOP  # x toward the eye, y up
    assert cKDTree(ball.vertices).query(back)[0].max() < 0.05


def test_the_camera_is_the_still_s(ball):
    layout = scenes.scene(SurfaceView(ball))["layout"]
    camera = layout["scene"]["camera"]
    eye = np.array([camera["eye"][name] for name in "xyz"]) / 4
    direction, up = (np.asarray(v) / np.linalg.norm(v) for v in DEFAULT_CAMERA)
    assert eye == pytest.approx([0, -np.sqrt(1 - (direction @ up) ** 2), direction @ up], abs=1e-4)
    assert camera["up"] == {"x": 0, "y": 0, "z": 1}
    assert layout["meta"]["half"] == pytest.approx([0.5, 0.5], abs=2e-3)
    with pytest.raises(ValueError, match="camera must look along another direction than up"):
        scenes.scene(SurfaceView(ball, camera=((0.0, 0.0, 2.0), (0.0, 0.0, 1.0))))


# --- fewer vertices -------------------------------------------------------------------------------------------------


def test_decimation_keeps_values(ball):
    f = np.sin(6 * ball.vertices[:, 0]) * np.cos(5 * ball.vertices[:, 1])
    light = lighten(SurfaceView(ball, f), 4000)
    assert 3900 < light.surface.n_vertices < 4010
    x, y, _ = (light.surface.vertices / row_norms(light.surface.vertices)[:, None]).T
    assert np.abs(light.values - np.sin(6 * x) * np.cos(5 * y)).max() < 0.02
    assert light.color_limits == SurfaceView(ball, f).color_limits


def test_flat_parts_keep_their_function_because_values_count_in_the_metric(monkeypatch):
    part = shapes.bracket()
    f = np.cos(9 * part.vertices[:, 0]) * np.cos(9 * part.vertices[:, 1])

    def error() -> float:
        light = lighten(SurfaceView(part, f), 4000)
        back = _carried(light.surface, light.values, part, False)
        return float(np.sqrt(np.mean((back - f) ** 2)))

    with_values = error()
    monkeypatch.setattr("spectral_notes.plotting.scene_meshes.VALUE_WEIGHT", 1e-9)
    assert 10 * with_values < error()


def test_decimation_keeps_the_values_of_faces(ball):
    middles = ball.vertices[ball.faces].mean(axis=1)
    light = lighten(SurfaceView(ball, (middles[:, 2] > 0).astype(int), kind="labels"), 3000)
    height = light.surface.vertices[light.surface.faces].mean(axis=1)[:, 2]
    assert len(light.values) == light.surface.n_faces
    clear = np.abs(height) > 0.1
    assert np.array_equal(light.values[clear], (height > 0)[clear])


def test_a_light_view_stays_as_it_is():
    mesh = shapes.sphere(2)
    light = lighten(SurfaceView(mesh, mesh.vertices[:, 0], edges=True), 5000)
    assert light.surface is mesh
    assert light.edges
    assert not lighten(SurfaceView(shapes.sphere(4), edges=True), 500).edges


def test_a_cloud_keeps_points_with_their_values(ball):
    cloud = PointCloud(ball.vertices)
    light = lighten(SurfaceView(cloud, ball.vertices[:, 2]), 700)
    assert light.surface.n_points == 700
    assert np.array_equal(light.values, light.surface.points[:, 2])


def test_a_faceted_mesh_is_joined_and_stays_faceted():
    mesh = shapes.sphere(2)
    soup = TriangleMesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3))
    light = lighten(SurfaceView(soup, soup.vertices[:, 0]), 5000)
    assert light.surface.n_vertices == mesh.n_vertices
    assert np.array_equal(light.values, light.surface.vertices[:, 0])
    assert scenes.scene(SurfaceView(soup))["data"][0]["flatshading"]
    assert not scenes.scene(SurfaceView(mesh))["data"][0]["flatshading"]


def test_bad_meshes_convert(book_of_three, mobius):
    sliver = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
    for mesh in (book_of_three, mobius, sliver):
        assert scenes.scene_text(SurfaceView(mesh, mesh.vertices[:, 0] - 0.3, edges=True))


# --- lines ----------------------------------------------------------------------------------------------------------


def test_nodal_lines_survive(ball):
    view = SurfaceView(ball, ball.vertices[:, 2] - 0.5, camera=((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))
    _, line = scenes.scene(view)["data"]
    height = line["z"][np.isfinite(line["z"])] / scenes.TOP
    assert np.abs(height - 0.5).max() < 0.01
    length = np.hypot(*(np.diff(line[name]) for name in "xy"))
    assert np.nansum(length) / scenes.TOP == pytest.approx(2 * np.pi * np.sqrt(0.75), rel=0.02)
    assert len(scenes.scene(SurfaceView(ball, ball.vertices[:, 2], nodal_lines=False))["data"]) == 1


def test_lines_are_lifted_outward_from_a_closed_surface_and_to_both_sides_of_an_open_one(ball, unit_square):
    ring = nodal_polylines(ball, ball.vertices[:, 2])
    assert row_norms(lift(ring, ball, 0.01)[0]) == pytest.approx(1.01, abs=2e-3)
    inside_out = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    assert row_norms(lift(ring, inside_out, 0.01)[0]) == pytest.approx(1.01, abs=2e-3)
    over, under = lift([np.array([[0.2, 0.3, 0.0], [0.4, 0.5, 0.0]])], unit_square, 0.01)
    assert (over[:, 2], under[:, 2]) == (pytest.approx(0.01), pytest.approx(-0.01))
    assert lift([], ball, 0.01) == []


def test_every_edge_is_drawn_once():
    mesh = shapes.bracket()
    polylines = edge_polylines(mesh)
    steps = np.vstack([np.stack([line[:-1], line[1:]], axis=1) for line in polylines])
    ends = np.sort(cKDTree(mesh.vertices).query(steps)[1], axis=1)
    assert np.array_equal(np.unique(ends, axis=0), edges(mesh))
    assert len(ends) == len(edges(mesh))


# --- marks and colours ----------------------------------------------------------------------------------------------


def test_arrows_reach_from_foot_to_tip(ball):
    view = SurfaceView(ball, arrows=([[0, 0, 1.0]], [[0, 0, 0.5]]), camera=((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))
    _, shaft, head = scenes.scene(view)["data"]
    units = 1.25 / scenes.TOP  # half of the height of what is seen
    assert units * np.nanmin(shaft["z"]) == pytest.approx(1.0 - 0.25, abs=1e-3)
    assert units * head["z"].max() == pytest.approx(1.5 - 0.25, abs=1e-3)
    assert units * np.ptp(head["z"]) == pytest.approx(0.125, abs=1e-3)


def test_colours_are_those_of_the_still(ball):
    signed = scenes.scene(SurfaceView(ball, ball.vertices[:, 0], limits=(-2, 2)))["data"][0]
    assert (signed["cmin"], signed["cmax"]) == (-2, 2)
    assert signed["colorscale"][0][1] == "#053061"  # the blue end of RdBu_r
    labels = scenes.scene(SurfaceView(ball, np.full(ball.n_vertices, 14), kind="labels"))["data"][0]
    assert set(labels["intensity"]) == {2}
    middle = (2 - labels["cmin"]) / (labels["cmax"] - labels["cmin"])
    around = [color for share, color in labels["colorscale"] if abs(share - middle) < 0.5 / len(LABEL_COLORS) + 1e-9]
    assert around.count(LABEL_COLORS[2]) == 2


def test_a_colour_bar_carries_its_label(ball):
    trace = scenes.scene(SurfaceView(ball, ball.vertices[:, 2]), color_bar="height $z$")["data"][0]
    assert trace["showscale"]
    assert trace["colorbar"]["title"]["text"] == "height z"
    assert not scenes.scene(SurfaceView(ball, ball.vertices[:, 2]))["data"][0]["showscale"]


def test_too_many_marks_are_refused(ball):
    steps = np.cumsum(np.random.default_rng(0).normal(size=(20_000, 3)), axis=0)
    with pytest.raises(ValueError, match=r"must fit into a scene of 249000 bytes; 'a tangle' takes \d+: draw fewer arrows"):
        scenes.scene_text(SurfaceView(ball, title="a tangle", curves=(steps,)))


def test_labels_lose_their_markup():
    assert scenes.plain_text(r"$\chi$ = 2, total $4\pi$") == "χ = 2, total 4π"
    assert scenes.plain_text(r"the surface: $x(u, v)$") == "the surface: x(u, v)"
    assert scenes.plain_text(r"$\lambda \approx 3$") == "λ≈3"


# --- figures of the book --------------------------------------------------------------------------------------------


def test_a_figure_brings_its_scenes_only_while_the_book_is_made(monkeypatch):
    mesh = shapes.sphere(2)
    views = [SurfaceView(mesh, mesh.vertices[:, k], title=rf"$\phi_{k}$") for k in range(3)]
    assert not hasattr(plotting.plot_views(views), "_repr_mimebundle_")
    monkeypatch.setenv(scenes.SWITCH, "1")
    bundle = plotting.plot_views(views, n_columns=2)._repr_mimebundle_(include=None, exclude=None)
    listed = bundle[scenes.MIME]
    assert [one["name"] for one in listed] == ["φ0", "φ1", "φ2"]
    assert all(json.loads(one["scene"])["data"] for one in listed)
    (left, top, width, height), beside, below = (one["box"] for one in listed)
    assert 0 <= left < 0.1
    assert 0 < top < height
    assert beside[0] == pytest.approx(left + width, abs=0.01)
    assert beside[1] == top
    assert below[0] == left
    assert below[1] > top + height


def test_a_figure_needs_axes_for_its_views():
    with pytest.raises(ValueError, match="figure must have one axes for each of the 1 views; got 0"):
        scenes.attach(plt.figure(), [SurfaceView(shapes.sphere(1))])
