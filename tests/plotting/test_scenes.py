"""Scenes: every surface arrives whole, values keep their signs, marks their places, and the camera is the still's."""

from __future__ import annotations

import json

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from unpacking import unpack_array

from spectral_notes import plotting, shapes
from spectral_notes.meshes import PointCloud, TriangleMesh, row_norms
from spectral_notes.plotting import scenes
from spectral_notes.plotting.packing import pack_array
from spectral_notes.plotting.rendering import LABEL_COLORS, SurfaceView


@pytest.fixture(scope="module")
def ball() -> TriangleMesh:
    """The unit sphere."""
    return shapes.sphere(3)


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
        "signed": SurfaceView(mesh, x, curves=(feet, feet[:5]), points=feet[:3]),
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


def opened(view: SurfaceView) -> dict:
    """A scene of one view as the page finds it: positions, faces, values and marks."""
    scene = json.loads(json.dumps(scenes.scene([view])))
    (picture,), (mesh,) = scene["pictures"], scene["meshes"].values()
    found = dict(picture["facts"])
    for facts, arrays in ((mesh["facts"], mesh["arrays"]), (picture["facts"], picture["arrays"])):
        for name, packed in arrays.items():
            found[name] = unpack_array(packed)
            place = facts if name == "vertices" else facts.get(name)
            if name not in ("faces", "values"):
                found[name] = (np.array(place["low"])[:, None] + place["step"] * found[name]).T
    return found


@pytest.mark.parametrize("kind", kinds(shapes.sphere(1)))
def test_a_scene_is_its_shape_vertex_for_vertex_and_face_for_face(kind, ball):
    view = kinds(ball)[kind]
    found = opened(view)
    assert np.abs(found["vertices"] - view.positions).max() <= 0.51 * 2 / scenes.TOP
    if isinstance(view.surface, TriangleMesh):
        assert np.array_equal(found["faces"], view.surface.faces)
        assert found["faces"].dtype == np.uint16


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_moved_and_scaled_it_is_as_near(move, scale):
    corners = scale * np.array([[0, 0, 0], [1, 0, 0], [0, 0.3, 0.7]]) + move
    found = opened(SurfaceView(TriangleMesh(corners, [[0, 1, 2]])))["vertices"]
    assert np.abs(found - corners).max() <= 0.51 * scale / scenes.TOP + 1e-9 * abs(move)


def test_bad_meshes_come_whole(book_of_three, mobius):
    sliver = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
    soup = TriangleMesh(mobius.vertices[mobius.faces].reshape(-1, 3), np.arange(3 * mobius.n_faces).reshape(-1, 3))
    one_point = PointCloud([[1.0, 2.0, 3.0]])
    for surface in (book_of_three, mobius, sliver, soup, one_point):
        found = opened(SurfaceView(surface))
        view = SurfaceView(surface)
        assert np.abs(found["vertices"] - view.positions).max() < 1e-4


def test_many_vertices_take_wider_numbers():
    points = np.random.default_rng(0).normal(size=(70_000, 3))
    found = opened(SurfaceView(TriangleMesh(points, [[0, 1, 69_999]])))
    assert found["faces"].tolist() == [[0, 1, 69_999]]


def test_a_surface_of_several_pictures_travels_once(ball):
    views = [SurfaceView(ball, ball.vertices[:, k]) for k in range(3)]
    scene = scenes.scene([*views, SurfaceView(shapes.sphere(1))])
    assert len(scene["meshes"]) == 2
    assert len({picture["mesh"] for picture in scene["pictures"][:3]}) == 1


# --- values ---------------------------------------------------------------------------------------------------------


def test_values_are_shares_of_the_colour_map_and_small_ones_keep_their_sign(ball):
    f = np.where(np.arange(ball.n_vertices) % 2, 1.0, -1e-6)
    found = opened(SurfaceView(ball, f, limits=(-2, 2)))
    assert np.array_equal(np.sign(found["values"]), np.sign(f))
    assert found["limits"] == [-1.0, 1.0]
    assert np.abs(2 * found["values"].astype(float) - f).max() < 2e-3
    assert found["nodal"]
    high = opened(SurfaceView(ball, 1000 + ball.vertices[:, 2], kind="positive", limits=(999, 1001)))
    assert np.abs(999 + 2 * high["values"].astype(float) - 1000 - ball.vertices[:, 2]).max() < 1e-3
    assert not high["nodal"]


def test_labels_of_vertices_are_drawn_on_faces_with_steps_of_colour(ball):
    found = opened(SurfaceView(ball, np.full(ball.n_vertices, 14), kind="labels"))
    assert found["onFaces"] and set(found["values"]) == {2}
    middle = (2 - found["limits"][0]) / (found["limits"][1] - found["limits"][0])
    around = [color for share, color in found["colors"] if abs(share - middle) < 0.5 / len(LABEL_COLORS) + 1e-9]
    assert around.count(LABEL_COLORS[2]) == 2


def test_colours_are_those_of_the_still(ball):
    assert opened(SurfaceView(ball, ball.vertices[:, 0]))["colors"][0] == [0.0, "#053061"]  # the blue end of RdBu_r
    assert not opened(SurfaceView(ball, ball.vertices[:, 0], nodal_lines=False))["nodal"]


# --- marks and camera -----------------------------------------------------------------------------------------------


def test_marks_keep_their_places(ball):
    view = SurfaceView(
        ball, curves=(ball.vertices[:4], ball.vertices[5:8]), points=[[2.0, 0, 0], [0, 3.0, 0]], arrows=([[0, 0, 1.0]], [[0, 0, 0.5]])
    )
    found = opened(view)
    assert found["ends"] == [4, 7]
    assert found["curves"] == pytest.approx(np.vstack([ball.vertices[:4], ball.vertices[5:8]]), abs=1e-4)
    assert found["points"] == pytest.approx(np.array([[2.0, 0, 0], [0, 3.0, 0]]), abs=1e-4)
    assert row_norms(found["tips"] - found["feet"]) == pytest.approx([0.5], abs=1e-4)
    assert "feet" not in opened(SurfaceView(ball, arrows=(np.zeros((0, 3)), np.zeros((0, 3)))))


def test_the_camera_is_the_still_s_and_may_not_look_along_up(ball):
    view = SurfaceView(ball)
    assert (opened(view)["eye"], opened(view)["up"]) == tuple(map(list, view.view_direction))
    with pytest.raises(ValueError, match="camera must look along another direction than up"):
        scenes.scene([SurfaceView(ball, camera=((0.0, 0.0, 2.0), (0.0, 0.0, 1.0)))])


def test_labels_lose_their_markup():
    assert scenes.plain_text(r"$\chi$ = 2, total $4\pi$") == "χ = 2, total 4π"
    assert scenes.plain_text(r"the surface: $x(u, v)$") == "the surface: x(u, v)"
    assert scenes.plain_text(r"$\lambda \approx 3$") == "λ≈3"


# --- packing --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.uint16, np.uint32, np.int8])
@pytest.mark.parametrize("shape", [(0,), (7,), (3, 5)])
def test_an_array_comes_back_bit_by_bit(dtype, shape):
    bits = np.random.default_rng(0).integers(0, 100, shape)
    array = (bits - 50 if np.dtype(dtype).kind != "u" else bits).astype(dtype)
    back = unpack_array(pack_array(array))
    assert back.dtype == array.dtype and back.shape == array.shape
    assert back.tobytes() == array.tobytes()


def test_an_array_of_another_type_is_refused():
    with pytest.raises(ValueError, match="array's type must be one of 'float16', 'float32', .*; got 'float64'"):
        pack_array(np.zeros(3))


# --- notebooks and the book -----------------------------------------------------------------------------------------


def test_a_scene_in_a_notebook_is_a_page_that_asks_nobody(ball):
    shown = plotting.show(SurfaceView(ball, ball.vertices[:, 0], title="</script><b>"), SurfaceView(ball), color_bar="x")
    assert "</script><b>" not in shown.page
    assert "://" not in shown.page
    assert len(repr(shown)) < 100
    assert "choose File &gt; Trust Notebook" in shown._repr_html_().split("<iframe")[0]
    with pytest.raises(ValueError, match="views must hold at least one view"):
        plotting.show()
    with pytest.raises(TypeError, match=r"views must be .*SurfaceView"):
        plotting.show(ball)


def test_a_figure_brings_its_scene_only_while_the_book_is_made(monkeypatch):
    mesh = shapes.sphere(2)
    views = [SurfaceView(mesh, mesh.vertices[:, k], title=rf"$\phi_{k}$") for k in range(3)]
    assert not hasattr(plotting.plot_views(views), "_repr_mimebundle_")
    monkeypatch.setenv(scenes.SWITCH, "1")
    bundle = plotting.plot_views(views, n_columns=2)._repr_mimebundle_(include=None, exclude=None)
    pictures = bundle[scenes.MIME]["pictures"]
    assert [one["name"] for one in pictures] == ["φ0", "φ1", "φ2"]
    (left, top, width, height), beside, below = (one["box"] for one in pictures)
    assert 0 <= left < 0.1
    assert 0 < top < height
    assert beside[0] == pytest.approx(left + width, abs=0.01)
    assert beside[1] == top
    assert below[0] == left
    assert below[1] > top + height


def test_a_figure_needs_axes_for_its_views():
    with pytest.raises(ValueError, match="figure must have one axes for each of the 1 views; got 0"):
        scenes.attach(plt.figure(), [SurfaceView(shapes.sphere(1))])
