"""Pictures: the right colours in the right place, the house style, and every promised error."""

from __future__ import annotations

import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
import scipy.sparse as sp

from spectral_notes import plotting
from spectral_notes.eigenbasis import compute_eigenbasis
from spectral_notes.laplacians import cotan_laplacian
from spectral_notes.meshes import PointCloud, TriangleMesh
from spectral_notes.plotting import rendering
from spectral_notes.plotting.cameras import camera_of, guess_up
from spectral_notes.plotting.rendering import SurfaceView, render
from spectral_notes.shapes import bracket, disk, doll, egg, goat, potato, sphere, spherical_cap, terrain, torus

FRONT = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


@pytest.fixture
def square() -> TriangleMesh:
    """A fine square in the plane z = 0, seen from the front."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1, 1, 21)], indexing="ij"))
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    return TriangleMesh(np.c_[x, y, 0 * x], np.r_[np.c_[corner, corner + 21, corner + 22], np.c_[corner, corner + 22, corner + 1]])


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")


def ink(image):
    """Mask of the pixels that are not white."""
    return (image < 250).any(axis=2)


def test_a_ramp_is_blue_left_red_right_and_black_between(square):
    x = square.vertices[:, 0]
    image = render(SurfaceView(square, x, camera=FRONT), size=200).astype(int)
    row = image[100]
    left, middle, right = row[60], row[95:106], row[140]
    assert left[2] > left[0] + 40
    assert right[0] > right[2] + 40
    assert middle.min(axis=0).max() < 90  # the nodal line
    bare = render(SurfaceView(square, x, camera=FRONT, nodal_lines=False), size=200).astype(int)
    assert bare[100, 95:106].min() > 120
    assert (image[0, 0] == 255).all()


def test_values_on_faces_and_labels_take_their_colours(square):
    half = (square.vertices[square.faces].mean(axis=1)[:, 0] > 0).astype(float)
    image = render(SurfaceView(square, half, kind="positive", limits=(0, 1), camera=FRONT), size=120).astype(int)
    assert image[60, 85, 1] > image[60, 35, 1] + 80  # viridis: yellow against violet
    labels = (square.vertices[:, 0] > 0).astype(int)
    image = render(SurfaceView(square, labels, kind="labels", camera=FRONT), size=120).astype(int)
    assert image[60, 35, 2] > image[60, 35, 0]  # the first label is blue, the second red
    assert image[60, 85, 0] > image[60, 85, 2]


def test_marks_and_clouds_leave_ink(square):
    plain = render(SurfaceView(square, camera=FRONT), size=150)
    marks = {
        "arrows": ([[0, 0, 0.1]], [[0.5, 0.5, 0]]),
        "curves": ([[-1, -1, 0.01], [1, 1, 0.01]],),
        "points": [[0, 0, 0.05]],
        "edges": True,
    }
    for name, mark in marks.items():
        marked = render(SurfaceView(square, camera=FRONT, **{name: mark}), size=150)
        assert (np.abs(marked.astype(int) - plain) > 60).any(axis=2).sum() > 8, name
    cloud = PointCloud(square.vertices)
    assert ink(render(SurfaceView(cloud, cloud.points[:, 0], camera=FRONT), size=150)).mean() > 0.02


UPRIGHT = {"y": (goat("rest"), goat("walk"), goat("look"), doll("rest"), doll("wave"), doll("walk")),
           "z": (egg(2), potato(2), bracket(), torus(), sphere(2), disk(), terrain(), spherical_cap())}


@pytest.mark.parametrize("up", UPRIGHT)
def test_up_is_read_off_the_shape_and_not_off_its_name(up):
    for mesh in UPRIGHT[up]:
        named = TriangleMesh(mesh.vertices, mesh.faces, "disk_scan")
        assert guess_up(named)[0] == up, mesh.name
        assert SurfaceView(named).camera == SurfaceView(mesh).camera
        turned = TriangleMesh(1e-7 * mesh.vertices[:, [0, 2, 1]] * [1, -1, 1] + 3.0, mesh.faces, mesh.name)
        if mesh.name.startswith(("goat", "doll")):  # lying the other way, they stand up along z
            assert guess_up(turned)[0] == "z", mesh.name


def test_the_broad_side_is_turned_to_the_eye():
    for up, axis in (("y", 1), ("z", 2), ("x", 0)):
        for deep in {0, 1, 2} - {axis}:
            size = np.ones(3)
            size[axis], size[deep] = 2.0, 0.3
            eye, upward = camera_of(TriangleMesh(sphere(2).vertices * size, sphere(2).faces), up)
            assert np.argmax(np.abs(upward)) == axis
            assert np.argmax(np.abs(eye)) == deep
            assert eye[axis] > 0
    eye, upward = camera_of(disk())
    assert eye == (0.0, 0.0, 1.0)
    assert upward == (0.0, 1.0, 0.0)
    cloud = PointCloud(doll().vertices[::3])
    assert camera_of(cloud) == camera_of(doll())


def test_a_picture_does_not_depend_on_place_and_unit():
    mesh = egg(2)
    here = render(SurfaceView(mesh, mesh.vertices[:, 2]), size=80).astype(int)
    for scale, shift in ((1e-7, 0.0), (1e-3, 1e7), (1e7, -1e9)):
        far = TriangleMesh(scale * mesh.vertices + shift, mesh.faces)
        there = render(SurfaceView(far, mesh.vertices[:, 2], camera=SurfaceView(mesh).camera), size=80).astype(int)
        assert np.abs(here - there).mean() < 0.5


def test_colour_limits():
    triangle = TriangleMesh(np.eye(3), [[0, 1, 2]])
    low, high = SurfaceView(triangle, [-1.0, 0.0, 2.0]).color_limits
    assert low == -high
    assert SurfaceView(triangle, [0.0, 0.0, 0.0]).color_limits == (-1.0, 1.0)
    assert SurfaceView(triangle, [1.0, 2.0, 3.0], limits=(0, 9)).color_limits == (0, 9)


def test_rendering_is_silent_without_a_screen():
    code = (
        "import numpy as np; from spectral_notes.meshes import TriangleMesh; from spectral_notes.plotting.rendering import *;"
        "print(render(SurfaceView(TriangleMesh(np.eye(3), [[0, 1, 2]])), size=32).shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=_no_screen(), check=True)
    assert done.stdout.strip() == "(32, 32, 3)"
    assert done.stderr == ""


def _no_screen():
    import os

    return {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="macOS and Windows bring their own OpenGL")
def test_the_choice_of_gl_library(monkeypatch):
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    there: list[str] = []

    def load(library):
        if library not in there:
            raise OSError(library)

    monkeypatch.setattr(rendering.ctypes, "CDLL", load)
    with pytest.raises(RuntimeError, match=r"(?s)neither EGL nor OSMesa.*apt-get install libegl1.*dnf.*macOS and Windows"):
        rendering.choose_gl_window()
    there.append("libOSMesa.so.8")
    rendering.choose_gl_window()
    import os

    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "mine")
    rendering.choose_gl_window()
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "mine"


# -- figures -----------------------------------------------------------------------------------------------------------


def test_the_house_style_is_white_with_a_colour_blind_safe_cycle():
    plotting.use_house_style()
    assert plt.rcParams["axes.facecolor"] == "white"
    assert plt.rcParams["axes.prop_cycle"].by_key()["color"][0] == "#0072B2"


def test_matrix_picture_is_symmetric_about_zero():
    axes = plotting.plot_matrix(sp.csr_array([[1.0, -3.0]]), title="T")
    picture = axes.get_images()[0]
    assert picture.get_clim() == (-3.0, 3.0)
    assert axes.get_title() == "T"
    host = plt.figure().add_subplot()
    assert plotting.plot_matrix(np.zeros((2, 2)), ax=host) is host


def test_columns_rows_and_titles(square):
    basis = compute_eigenbasis(*cotan_laplacian(square), k=4)
    figure = plotting.plot_modes(square, basis, [0, 1, 3], n_columns=2)
    assert [axes.get_title() for axes in figure.axes] == ["mode 0", "mode 1", "mode 3"]
    boxes = [axes.get_position() for axes in figure.axes]
    assert boxes[0].y0 == boxes[1].y0 > boxes[2].y0
    shapes = {axes.get_images()[0].get_array().shape for axes in figure.axes}
    assert len(shapes) == 1


def test_a_colour_bar_makes_the_limits_common(square):
    x = square.vertices[:, 0]
    figure = plotting.plot_surfaces(square, np.c_[x, 4 * x], color_bar="height", camera=FRONT)
    pale, strong = (axes.get_images()[0].get_array().astype(int) for axes in figure.axes[:2])
    middle, right = pale.shape[0] // 2, int(0.85 * pale.shape[1])
    assert pale[middle, right, 2] > strong[middle, right, 2] + 40
    assert figure.axes[2].get_xlabel() == "height"
    assert figure.axes[2].get_xlim()[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda s: SurfaceView(s.vertices), TypeError, "surface must be a TriangleMesh or a PointCloud; got ndarray"),
        (lambda s: SurfaceView(s, [1.0, 2.0]), ValueError, r"values must hold one number per vertex or face, \(441, 800\); got 2"),
        (lambda s: SurfaceView(s, kind="hot"), ValueError, "kind must be one of 'signed', 'positive', 'labels'; got 'hot'"),
        (lambda s: render(SurfaceView(s), size=2), ValueError, "size must be at least 16; got 2"),
        (lambda s: render(SurfaceView(s, arrows=([[0, 0, 0]], [[1, 0]])), size=32), ValueError, "arrows' vectors must have shape"),
        (lambda s: render(SurfaceView(s, points=[[0, 0]]), size=32), ValueError, r"points must have shape \(q, 3\)"),
        (lambda s: render(SurfaceView(s, curves=([0, 0],)), size=32), ValueError, r"curves must have shape \(c, 3\)"),
        (lambda s: plotting.plot_surfaces([s, s], [None]), ValueError, "values must hold one array for each of the 2 surfaces; got 1"),
        (lambda s: plotting.plot_surfaces(s, titles=["a", "b"]), ValueError, "titles must hold one text for each of the 1 pictures"),
        (lambda s: plotting.plot_views([]), ValueError, "views must hold at least one view"),
        (lambda s: plotting.plot_matrix([1.0, 2.0]), ValueError, r"A must have shape \(m, n\); got \(2,\)"),
        (
            lambda s: plotting.plot_modes(s, compute_eigenbasis(*cotan_laplacian(s), k=2), [2]),
            ValueError,
            "modes must be between 0 and 1; got 2",
        ),
    ],
)
def test_refusals(square, call, error, message):
    with pytest.raises(error, match=message):
        call(square)


SIGHTS = {  # linear RGB as seen with each cone type missing: Machado, Oliveira and Fernandes (2009), severity 1
    "all three cones": np.eye(3),
    "no long-wave cone": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "no middle-wave cone": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "no short-wave cone": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


def nearest_labels(colors: list[str], seen_as: np.ndarray) -> float:
    """Return the least CIELAB distance (1976) of two colours."""
    rgb = np.array([[int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)] for color in colors])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.clip(linear @ np.transpose(seen_as), 0.002, 1) @ to_xyz.T / to_xyz.sum(axis=1)).T
    lab = np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])
    return float(np.min(np.linalg.norm(lab[:, None] - lab, axis=2) + 1e3 * np.eye(len(lab))))


@pytest.mark.parametrize("sight", SIGHTS)
def test_parts_can_be_told_apart_with_and_without_each_cone(sight):
    assert nearest_labels(list(rendering.LABEL_COLORS), SIGHTS[sight]) > (25 if sight == "all three cones" else 12)
    maroon_beside_magenta = [*rendering.LABEL_COLORS, "#882255"]
    assert nearest_labels(maroon_beside_magenta, SIGHTS["all three cones"]) < 25
