"""Turn what a still picture shows: the same `SurfaceView`s as a scene, in a notebook and in the book.

A scene is data for `static/viewer.js`: each surface whole, vertex for vertex and face for face, with its positions in
16 bits (a 65,535th of the size of what is seen) and its values in half precision. Nodal lines and edges are drawn on
the surface itself, so they need no data. A surface that several pictures show travels once.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import unicodedata
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from spectral_notes._checks import FloatArray, as_instance
from spectral_notes.meshes import PointCloud
from spectral_notes.plotting.packing import Packed, pack, registering
from spectral_notes.plotting.pages import Page, page
from spectral_notes.plotting.rendering import LABEL_COLORS, PLAIN_COLOR, SurfaceView, values_to_draw

MIME = "application/vnd.spectral-notes.scenes+json"
SWITCH = "SPECTRAL_NOTES_SCENES"  # set while the notebooks run for the book: figures then bring their scenes
NONE = np.zeros((0, 3))
TOP = 65535  # of a coordinate in 16 bits
SIGNS = {"lambda": "λ", "approx": "≈", "times": "×", "cdot": "·", "infty": "∞"}


def show(*views: SurfaceView, color_bar: str = "") -> Page:
    """Return views as a page to turn with the mouse; as the last line of a notebook's cell it is shown.

    The page is HTML that asks nobody for anything.

    Parameters
    ----------
    *views : what to show, side by side, one at least; they turn together; none is looked at along its upward direction
    color_bar : label of a colour bar; none where empty

    Examples
    --------
    >>> from spectral_notes.meshes import TriangleMesh
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> "spectralNotes.register" in show(SurfaceView(triangle, [1.0, 0.0, -1.0])).page
    True
    """
    if not views:
        raise ValueError("views must hold at least one view; SurfaceView(mesh, values) makes one")
    packed = scene(views, color_bar=color_bar)
    texts = [registering(name, mesh) for name, mesh in packed.pop("meshes").items()]
    body = '<div class="scene-alone" data-scene="scene"></div>'
    return page("scene", body, [*texts, registering("scene", packed)], ("arrays", "viewer", "stage"))


def scene(views: Sequence[SurfaceView], *, color_bar: str = "") -> Packed:
    """Return what the viewer draws for views: ``{"meshes", "pictures", "bar"}``.

    Each of the pictures names its surface by a digest of its content, under which `meshes` holds it.
    """
    meshes, pictures = {}, []
    for view in views:
        as_instance("views", view, SurfaceView, "SurfaceView(mesh, values) makes one")
        eye, up = (np.asarray(direction, dtype=np.float64) for direction in view.view_direction)
        if np.linalg.norm(np.cross(up, eye)) < 1e-9 * np.linalg.norm(up) * np.linalg.norm(eye):
            raise ValueError(f"camera must look along another direction than up; got {view.view_direction}")
        surface = pack(*_surface(view))
        name = "scenes/mesh-" + hashlib.sha256(json.dumps(surface).encode()).hexdigest()[:16]
        meshes[name] = surface
        pictures.append(pack(*_picture(view)) | {"name": plain_text(view.title), "mesh": name})
    bar = {"label": plain_text(color_bar), "limits": views[0].color_limits} if color_bar else None
    return {"meshes": meshes, "pictures": pictures, "bar": bar}


def quantised(points: FloatArray) -> tuple[dict[str, Any], NDArray[np.uint16]]:
    """Return positions as whole numbers of 16 bits, shape (3, n), and the facts that undo it: the corner and a step."""
    low = points.min(axis=0)
    step = float(np.ptp(points, axis=0).max()) / TOP or 1.0
    return {"low": low.tolist(), "step": step}, np.rint((points - low) / step).T.astype(np.uint16)


def _surface(view: SurfaceView) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """The surface or cloud alone."""
    facts, vertices = quantised(view.positions)
    if isinstance(view.surface, PointCloud):
        return facts, {"vertices": vertices}
    faces = view.surface.faces
    return facts, {"vertices": vertices, "faces": faces.astype(np.uint16 if faces.max() <= TOP else np.uint32)}


def _picture(view: SurfaceView) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What is on the surface, and where it is seen from."""
    eye, up = view.view_direction
    facts: dict[str, Any] = {"eye": list(eye), "up": list(up), "color": PLAIN_COLOR, "edges": view.edges}
    arrays: dict[str, NDArray[Any]] = {}
    if view.values is not None:
        values, on_faces = values_to_draw(view)
        facts |= {"onFaces": on_faces, "colors": color_stops(view)}
        facts["nodal"] = view.kind == "signed" and view.nodal_lines and not on_faces
        if view.kind == "labels":
            facts["limits"], arrays["values"] = [-0.5, len(LABEL_COLORS) - 0.5], values.astype(np.int8)
        else:  # shares of the colour map: half precision keeps the signs of small values, and so the nodal lines
            low, high = view.color_limits
            base, unit = (0.0, high) if low == -high else (low, high - low)
            shares = (values - base) / (unit or 1.0)
            facts["limits"], arrays["values"] = [(low - base) / (unit or 1.0), 1.0], shares.astype(np.float16)
    curves = [np.asarray(curve) for curve in view.curves]
    feet, vectors = (np.asarray(part) for part in view.arrows or (NONE, NONE))
    points = np.asarray(NONE if view.points is None else view.points)
    facts["ends"] = np.cumsum([len(curve) for curve in curves]).tolist()
    marks = {"curves": np.vstack([NONE, *curves]), "points": points, "feet": feet, "tips": feet + vectors}
    for name, places in marks.items():
        if len(places):
            facts[name], arrays[name] = quantised(places)
    return facts, arrays


def color_stops(view: SurfaceView) -> list[list[Any]]:
    """Return the colour map as stops, ``[share, "#rrggbb"]``; two stops at one place make a step."""
    if view.kind == "labels":
        ends = np.arange(len(LABEL_COLORS) + 1) / len(LABEL_COLORS)
        steps = zip(ends[:-1], ends[1:], LABEL_COLORS, strict=True)
        return [[float(end), color] for low, high, color in steps for end in (low, high)]
    shades = mpl.colormaps[str(view.color_map)]
    return [[k / 32, to_hex(shades(k / 32))] for k in range(33)]


def attach(figure: Any, views: Sequence[SurfaceView], *, color_bar: str = "") -> Any:
    """Let a matplotlib figure bring the scene of its views, one an axes, while the book is made; else do nothing.

    Its display then holds the scene as the MIME type `MIME`, beside the still picture.
    """
    if len(figure.axes) < len(views):
        raise ValueError(f"figure must have one axes for each of the {len(views)} views; got {len(figure.axes)}")
    if os.environ.get(SWITCH):

        def bundle(**_: Any) -> dict[str, Any]:
            brought = scene(views, color_bar=color_bar)
            for picture, box in zip(brought["pictures"], _boxes(figure, len(views)), strict=True):
                picture["box"] = box
            return {MIME: brought}

        figure._repr_mimebundle_ = bundle
    return figure


def _boxes(figure: Any, count: int) -> list[list[float]]:
    """Where the first axes lie in the saved picture: left, top, width, height, as shares of the picture.

    A notebook saves the figure cut to its content, with a margin.
    """
    tight = figure.get_tightbbox().padded(mpl.rcParams["savefig.pad_inches"])  # inches
    width, height = figure.get_size_inches()
    boxes = []
    for axes in figure.axes[:count]:
        box = axes.get_position()
        left, top = (box.x0 * width - tight.x0) / tight.width, (tight.y1 - box.y1 * height) / tight.height
        shares = (left, top, box.width * width / tight.width, box.height * height / tight.height)
        boxes.append([round(share, 4) for share in shares])
    return boxes


def plain_text(label: str) -> str:
    r"""Return a label of matplotlib without its formulas' markup.

    >>> plain_text(r"mode 3, $\lambda_3 = 2\pi$")
    'mode 3, λ3 = 2π'
    """

    def letter(match: re.Match[str]) -> str:
        try:
            return SIGNS.get(match[1]) or unicodedata.lookup(f"GREEK SMALL LETTER {match[1].upper()}")
        except KeyError:
            return match[1]

    formulas = label.split("$")
    for k in range(1, len(formulas), 2):
        formulas[k] = re.sub(r"[{}_^]", "", re.sub(r"\\([A-Za-z]+)\s*", letter, formulas[k]))
    return "".join(formulas)
