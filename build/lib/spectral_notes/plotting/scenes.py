"""Turn what a still picture shows: the same `SurfaceView` as a scene of Plotly.js, in a notebook and in the book.

A scene is the dictionary that Plotly.js draws, `data` and `layout`, light enough to load on a click: about 5,000
vertices, positions in 16 bits, at most 250 kB. Its axes are those of the still's camera: x to the right, z up, y away
from the eye; so it opens as the still was seen, and a turn keeps up upward.
"""

from __future__ import annotations

import base64
import json
import os
import re
import unicodedata
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np

from spectral_notes._checks import as_count
from spectral_notes.meshes import TriangleMesh, row_norms
from spectral_notes.plotting.rendering import SurfaceView
from spectral_notes.plotting.scene_meshes import is_faceted, lighten
from spectral_notes.plotting.scene_traces import TOP, Frame, all_points, frame_of, traces_of

MAX_VERTICES = 5000
MAX_BYTES = 249_000  # of a scene as text: a file of 250 kB with the call around it
MIME = "application/vnd.spectral-notes.scenes+json"
SWITCH = "SPECTRAL_NOTES_SCENES"  # set while the notebooks run for the book: figures then bring their scenes
TURNED = 0.75  # of the farthest reach that a picture shows upward, even where the first sight is flatter
SIGNS = {"lambda": "λ", "approx": "≈", "times": "×", "cdot": "·", "infty": "∞"}

Scene = dict[str, Any]


def figure(view: SurfaceView, *, color_bar: str = "") -> Any:
    """Return a view as a Plotly figure, which a running notebook shows as a scene to turn.

    Parameters
    ----------
    view : SurfaceView
        What to show.
    color_bar : str
        Label of a colour bar; none where empty.

    Returns
    -------
    plotly.graph_objects.Figure
        The figure.

    Raises
    ------
    ValueError
        If the camera of the view looks along its upward direction.

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> [trace.type for trace in figure(SurfaceView(triangle, [1.0, 0.0, -1.0])).data]
    ['mesh3d', 'scatter3d']
    """
    import plotly.graph_objects as go

    drawn = scene(view, color_bar=color_bar)
    layout = {key: value for key, value in drawn["layout"].items() if key != "meta"}
    return go.Figure(drawn["data"], layout | {"height": 450, "title": {"text": plain_text(view.title)}})


def show(view: SurfaceView, *, color_bar: str = "") -> None:
    """Show a view in a running notebook as a scene to turn with the mouse.

    Parameters
    ----------
    view : SurfaceView
        What to show.
    color_bar : str
        Label of a colour bar; none where empty.
    """
    figure(view, color_bar=color_bar).show()


def scene(view: SurfaceView, *, color_bar: str = "", n_max: int = MAX_VERTICES) -> Scene:
    """Return what Plotly.js draws for a view: its traces, and a layout with the camera of the still.

    Parameters
    ----------
    view : SurfaceView
        What to show.
    color_bar : str
        Label of a colour bar; none where empty.
    n_max : int
        Number of vertices or points above which the surface is made lighter, at least 100.

    Returns
    -------
    dict
        `data`, the traces, and `layout`; arrays are of 16-bit integers where they are positions. `layout["meta"]`
        holds half the width and half the height that a picture must show, as shares of the width of the scene's box.

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> scene(SurfaceView(triangle))["data"][0]["type"]
    'mesh3d'
    """
    light = lighten(view, as_count("n_max", n_max, 100))
    frame = frame_of(view)
    faceted = isinstance(view.surface, TriangleMesh) and is_faceted(view.surface)
    return {
        "data": traces_of(light, frame, _color_bar(color_bar) if color_bar else None, faceted),
        "layout": _layout(view, frame),
    }


def scene_text(view: SurfaceView, *, color_bar: str = "") -> str:
    """Return a scene as JSON of at most MAX_BYTES characters, with arrays in base64 as Plotly.js reads them.

    Parameters
    ----------
    view : SurfaceView
        What to show.
    color_bar : str
        Label of a colour bar; none where empty.

    Returns
    -------
    str
        JSON; a view whose lines and arrows take much room gets a lighter surface.

    Raises
    ------
    ValueError
        If the marks of the view alone are more than a scene may hold.

    Examples
    --------
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> json.loads(scene_text(SurfaceView(triangle)))["data"][0]["i"]
    {'dtype': 'u2', 'bdata': 'AAA='}
    """
    for n_max in (MAX_VERTICES, 4000, 3000, 2000):
        text = json.dumps(_packed(scene(view, color_bar=color_bar, n_max=n_max)), separators=(",", ":"))
        if len(text) <= MAX_BYTES:
            return text
    raise ValueError(
        f"view must fit into a scene of {MAX_BYTES} bytes; {view.title!r} takes {len(text)}: draw fewer arrows, curves"
    )


def attach(figure: Any, views: Sequence[SurfaceView], *, color_bar: str = "") -> Any:
    """Let a matplotlib figure bring the scenes of its views when the book is being made; otherwise do nothing.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        A figure whose first axes show the views, one each, in their order.
    views : sequence of SurfaceView
        What they show.
    color_bar : str
        Label of one colour bar; none where empty.

    Returns
    -------
    matplotlib.figure.Figure
        The same figure. Its display holds the scenes as the MIME type `MIME`, beside the still picture.

    Raises
    ------
    ValueError
        If the figure has fewer axes than there are views.

    Examples
    --------
    >>> from spectral_notes import plotting
    >>> triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]])
    >>> still = plotting.plot_views([SurfaceView(triangle)])
    >>> hasattr(attach(still, [SurfaceView(triangle)]), "_repr_mimebundle_")
    False
    """
    if len(figure.axes) < len(views):
        raise ValueError(f"figure must have one axes for each of the {len(views)} views; got {len(figure.axes)}")
    if os.environ.get(SWITCH):

        def bundle(**_: Any) -> dict[str, Any]:
            names = [plain_text(view.title) for view in views]
            boxes = _boxes(figure, len(views))
            texts = [scene_text(view, color_bar=color_bar) for view in views]
            return {MIME: [{"name": n, "box": b, "scene": t} for n, b, t in zip(names, boxes, texts, strict=True)]}

        figure._repr_mimebundle_ = bundle
    return figure


def plain_text(label: str) -> str:
    r"""Return a label of matplotlib without its formulas' markup.

    Examples
    --------
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


def _layout(view: SurfaceView, frame: Frame) -> dict[str, Any]:
    """Bare axes, and the camera of the still without perspective."""
    eye = frame.axes @ view.view_direction[0]
    eye /= np.linalg.norm(eye)
    seen = frame.place(all_points(view)) / (2 * TOP)
    height = seen @ np.cross([1.0, 0.0, 0.0], -eye)
    wide, far = (float(row_norms(seen[:, :k]).max()) for k in (2, 3))  # a turn must not lead out of the picture
    half = [wide, max(float(np.abs(height).max()), TURNED * far)]
    zoom = 1 / (1.05 * max(half[1], half[0] / 1.4))  # fits a picture 1.4 times as wide as high
    axis = {"visible": False, "range": [-TOP * 1.05, TOP * 1.05], "autorange": False}
    return {
        "margin": dict.fromkeys("ltrb", 0),
        "paper_bgcolor": "white",
        "showlegend": False,
        "hovermode": False,
        "meta": {"half": [round(extent, 4) for extent in half]},
        "scene": {
            "xaxis": axis,
            "yaxis": axis,
            "zaxis": axis,
            "aspectmode": "manual",
            "aspectratio": dict.fromkeys("xyz", round(zoom, 4)),
            "dragmode": "turntable",
            "camera": {
                "eye": dict(zip("xyz", (4 * eye).round(5).tolist(), strict=True)),
                "center": dict.fromkeys("xyz", 0),
                "up": {"x": 0, "y": 0, "z": 1},
                "projection": {"type": "orthographic"},
            },
        },
    }


def _color_bar(label: str) -> dict[str, Any]:
    """A flat bar below the scene."""
    place = {"orientation": "h", "x": 0.5, "y": 0, "yanchor": "bottom", "len": 0.5, "thickness": 10}
    return place | {"title": {"text": plain_text(label), "side": "bottom"}, "outlinewidth": 0}


def _packed(value: Any) -> Any:
    """The value with arrays as Plotly.js unpacks them: their type, and their bytes in base64."""
    if isinstance(value, np.ndarray):
        little = value.astype(value.dtype.newbyteorder("<"))
        return {"dtype": value.dtype.str[1:], "bdata": base64.b64encode(little.tobytes()).decode()}
    if isinstance(value, dict):
        return {key: _packed(item) for key, item in value.items()}
    return [_packed(item) for item in value] if isinstance(value, list) else value
