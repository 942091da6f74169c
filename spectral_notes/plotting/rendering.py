"""Render a surface or a point cloud to an image, off screen, in the house look.

White ground, smooth shading, RdBu_r symmetric about zero for signed functions with nodal lines in black, viridis for
positive ones, seen from the broad side. A `SurfaceView` says what is to be seen; `render` turns it into pixels.
"""

from __future__ import annotations

import ctypes
import importlib
import os
import sys
import warnings
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import FloatArray, as_choice, as_count, as_floats
from spectral_notes.meshes import PointCloud, Shape, TriangleMesh, positions
from spectral_notes.plotting.cameras import Camera, camera_of

Image = NDArray[np.uint8]

LABEL_COLORS = (
    "#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb", "#6a423e", "#8ff0b0", "#2391f5",
    "#2d32b3", "#8844ee",
)
PLAIN_COLOR = "#d9dde3"

GL_REMEDY = """Surfaces are rendered with VTK, which found neither EGL nor OSMesa on this machine. Install one of them:
  Debian, Ubuntu   sudo apt-get install libegl1        (or libosmesa6)
  Fedora           sudo dnf install mesa-libEGL        (or mesa-libOSMesa)
macOS and Windows come with OpenGL; there, update the graphics driver, or install the Mesa build of OpenGL."""


@dataclass(frozen=True, eq=False)
class SurfaceView:
    """Hold what one picture shows: a surface or a cloud, values on it, and marks drawn over it.

    Parameters
    ----------
    surface : the shape
    values : (n,) or (m,), one number per vertex (or point), or per face
    kind : {"signed", "positive", "labels"}, how values become colours
        RdBu_r symmetric about zero, viridis, or one colour for each whole number.
    title : text above the picture
    limits : values of the two ends of the colour map; by default the 99.5th percentile decides
    nodal_lines : draw the zero set of signed vertex values in black
    edges : draw the edges of the triangles
    arrows : feet (a, 3) and vectors (a, 3), in the units of the vertices
    curves : polylines (c, 3) drawn in black
    points : (q, 3), positions marked by dots
    camera : direction to the eye and the upward direction; by default read off the shape (`cameras`)

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> SurfaceView(triangle, [0.0, 1.0, -2.0]).color_limits  # symmetric about zero
    (-1.99, 1.99)
    """

    surface: Shape
    values: ArrayLike | None = None
    kind: str = "signed"
    title: str = ""
    limits: tuple[float, float] | None = None
    nodal_lines: bool = True
    edges: bool = False
    arrows: tuple[ArrayLike, ArrayLike] | None = None
    curves: tuple[ArrayLike, ...] = ()
    points: ArrayLike | None = None
    camera: Camera | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.surface, TriangleMesh | PointCloud):
            raise TypeError(f"surface must be a TriangleMesh or a PointCloud; got {type(self.surface).__name__}")
        as_choice("kind", self.kind, ("signed", "positive", "labels"))
        if self.values is not None:
            values = as_floats("values", self.values, ("n",))
            faces = (self.surface.n_faces,) if isinstance(self.surface, TriangleMesh) else ()
            sizes = (len(self.positions), *faces)
            if len(values) not in sizes:
                raise ValueError(f"values must hold one number per vertex or face, {sizes}; got {len(values)}")
            object.__setattr__(self, "values", values)
        if self.limits is not None:
            low, high = as_floats("limits", self.limits, (2,)).tolist()
            if low > high:
                raise ValueError(f"limits must be (low, high); got ({low:g}, {high:g})")
        if self.arrows is not None:
            feet = as_floats("arrows' feet", self.arrows[0], ("a", 3))
            object.__setattr__(self, "arrows", (feet, as_floats("arrows' vectors", self.arrows[1], (len(feet), 3))))
        if self.points is not None:
            object.__setattr__(self, "points", as_floats("points", self.points, ("q", 3)))
        if self.camera is None:
            object.__setattr__(self, "camera", camera_of(self.surface))
        object.__setattr__(self, "curves", tuple(as_floats("curves", curve, ("c", 3)) for curve in self.curves))

    @property
    def positions(self) -> FloatArray:
        """Positions of the vertices or points, shape (n, 3)."""
        return positions(self.surface)

    @property
    def color_limits(self) -> tuple[float, float]:
        """Values at the two ends of the colour map."""
        if self.limits is not None:
            return self.limits
        values = np.zeros(1) if self.values is None else np.asarray(self.values)
        if self.kind == "signed":
            top = float(np.percentile(np.abs(values), 99.5)) or 1.0
            return (-top, top)
        if self.kind == "labels":
            return (0.0, float(len(LABEL_COLORS) - 1))
        return (float(np.percentile(values, 0.5)), float(np.percentile(values, 99.5)))

    @property
    def color_map(self) -> str | list[str]:
        """Name of the colour map, or the list of its colours."""
        return list(LABEL_COLORS) if self.kind == "labels" else {"signed": "RdBu_r", "positive": "viridis"}[self.kind]

    @property
    def view_direction(self) -> Camera:
        """Direction to the eye and the upward direction."""
        assert self.camera is not None
        return self.camera


def render(view: SurfaceView, *, size: int = 600) -> Image:
    """Return the picture of a view, (size, size, 3), as a square image of `size` pixels with a white ground.

    Parameters
    ----------
    view : what to show
    size : width and height in pixels, at least 16

    Raises
    ------
    RuntimeError
        If there is no OpenGL library to render with; the message names the system package.

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> render(SurfaceView(triangle, [0.0, 1.0, -1.0]), size=64).shape
    (64, 64, 3)
    """
    size = as_count("size", size, 16)
    view = placed(view)
    choose_gl_window()
    pv = load_pyvista()  # after the choice of window, which VTK reads when it starts

    plotter: Any = pv.Plotter(off_screen=True, window_size=[size, size], lighting="light kit")
    plotter.set_background("white")
    try:
        _add_surface(plotter, view, size)
        _add_marks(plotter, view, size)
        direction, up = view.view_direction
        plotter.view_vector(direction, viewup=up)
        plotter.enable_parallel_projection()  # as the scenes are drawn: a still has the outline of what opens
        plotter.reset_camera()
        plotter.enable_anti_aliasing("ssaa")
        image: Image = plotter.screenshot(return_img=True)
    finally:
        plotter.close()
    return image


def load_pyvista() -> Any:
    """Return the module pyvista, or say how to get it: pictures are an extra of the library."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="IProgress not found")  # a progress bar, where there are no widgets
        try:
            return importlib.import_module("pyvista")
        except ModuleNotFoundError as error:
            what = f"pictures of surfaces are drawn by pyvista, and {error.name} is missing"
            raise ModuleNotFoundError(f'{what}; pip install "spectral-notes[pictures]" brings it') from error


def placed(view: SurfaceView) -> SurfaceView:
    """Return a view as graphics of single precision can draw it: one far off comes to the origin, in size one."""
    low, high = view.positions.min(axis=0), view.positions.max(axis=0)
    middle, size = (low + high) / 2, float((high - low).max()) or 1.0
    if 1e-3 < size < 1e3 and np.abs(middle).max() < 1e2 * size:
        return view

    def move(points: ArrayLike) -> FloatArray:
        return (np.asarray(points) - middle) / size

    shape, at = view.surface, move(view.positions)
    surface: Shape = replace(shape, points=at) if isinstance(shape, PointCloud) else replace(shape, vertices=at)
    arrows = None if view.arrows is None else (move(view.arrows[0]), np.asarray(view.arrows[1]) / size)
    points = None if view.points is None else move(view.points)
    curves = tuple(move(curve) for curve in view.curves)
    return replace(view, surface=surface, arrows=arrows, points=points, curves=curves)


def choose_gl_window() -> None:
    """Tell VTK to render without a screen, before it looks for one and complains on stderr; Linux only.

    EGL is used where it is installed, else OSMesa; the environment variable VTK_DEFAULT_OPENGL_WINDOW overrides that.
    """
    if not sys.platform.startswith("linux") or "VTK_DEFAULT_OPENGL_WINDOW" in os.environ:
        return
    for library, window in (("libEGL.so.1", "vtkEGLRenderWindow"), ("libOSMesa.so.8", "vtkOSOpenGLRenderWindow")):
        with suppress(OSError):
            ctypes.CDLL(library)
            os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = window
            return
    raise RuntimeError(GL_REMEDY)


def _add_surface(plotter: Any, view: SurfaceView, size: int) -> None:
    """Draw the surface or cloud with its values."""
    pv = load_pyvista()

    style: dict[str, Any] = {"show_scalar_bar": False, "specular": 0.1, "ambient": 0.28, "diffuse": 0.75}
    if isinstance(view.surface, PointCloud):
        data = pv.PolyData(view.surface.points)
        style |= {"render_points_as_spheres": True, "point_size": size / 60}
    else:
        data = pv.PolyData.from_regular_faces(view.surface.vertices, view.surface.faces)
        style |= {"smooth_shading": not view.edges, "show_edges": view.edges, "line_width": size / 900}
    if view.values is None:
        plotter.add_mesh(data, color=PLAIN_COLOR, **style | {"ambient": 0.45, "diffuse": 0.65})
        return
    values, on_faces = values_to_draw(view)
    (data.cell_data if on_faces else data.point_data)["values"] = values
    plotter.add_mesh(data, scalars="values", cmap=view.color_map, clim=view.color_limits, **style)
    if view.kind == "signed" and view.nodal_lines and not on_faces and not isinstance(view.surface, PointCloud):
        zero_set = data.contour([0.0], scalars="values")
        if zero_set.n_points:
            _add_lines(plotter, view, zero_set, max(2.0, size / 130))


def values_to_draw(view: SurfaceView) -> tuple[FloatArray, bool]:
    """Return the values and whether they belong to faces; labels of vertices become labels of faces, by majority."""
    values = np.asarray(view.values, dtype=np.float64)
    if isinstance(view.surface, PointCloud):
        return (values % len(LABEL_COLORS) if view.kind == "labels" else values), False
    if view.kind != "labels":
        return values, len(values) != view.surface.n_vertices
    if len(values) == view.surface.n_vertices:
        a, b, c = values[view.surface.faces].T
        values = np.where(b == c, b, a)
    return values % len(LABEL_COLORS), True


def _add_marks(plotter: Any, view: SurfaceView, size: int) -> None:
    """Draw arrows, curves and dots over the surface."""
    pv = load_pyvista()

    if view.arrows is not None:
        feet, vectors = view.arrows
        cloud = pv.PolyData(feet)
        cloud["vectors"], cloud["lengths"] = vectors, np.linalg.norm(vectors, axis=1)
        glyphs = cloud.glyph(orient="vectors", scale="lengths", geom=pv.Arrow(tip_radius=0.16, shaft_radius=0.06))
        plotter.add_mesh(glyphs, color="#111111", ambient=0.3)
    for curve in view.curves:
        _add_lines(plotter, view, pv.MultipleLines(curve), max(2.5, size / 100))
    if view.points is not None:
        ball = pv.Sphere(radius=0.013 * np.linalg.norm(np.ptp(view.positions, axis=0)))
        dots = pv.PolyData(view.points).glyph(geom=ball, scale=False, orient=False)
        plotter.add_mesh(dots, color="#111111", ambient=0.3)


def _add_lines(plotter: Any, view: SurfaceView, lines: Any, width: float) -> None:
    """Draw black lines, moved a little towards the eye so that the surface they lie on does not swallow them."""
    towards_eye = np.asarray(view.view_direction[0])
    step = 0.003 * np.linalg.norm(np.ptp(view.positions, axis=0)) * towards_eye / np.linalg.norm(towards_eye)
    plotter.add_mesh(lines.translate(step), color="black", line_width=width, render_lines_as_tubes=True)
