"""A result as one HTML page that needs no network: the picture, the numbers, and scenes to turn with the mouse.

The scripts that turn the scenes are copied into the page, so that the file can be sent to anybody. The still picture is
there without a script; the scenes are started on a click.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spectral_notes.meshes import PointCloud, TriangleMesh
from spectral_notes.plotting.packing import registering
from spectral_notes.plotting.pages import SCRIPTS
from spectral_notes.plotting.rendering import SurfaceView
from spectral_notes.plotting.scenes import plain_text, scene

PAGE = Path(__file__).with_name("report.html")
SAMPLES = 480_000  # vertices times numbers stored of each: a report stays below 2 MB
LONGEST = 12  # numbers of a list that the table shows; the rest is counted


def report_page(title: str, facts: Mapping[str, Any], views: Sequence[SurfaceView], still: Figure) -> str:
    """Return an HTML page about a shape, which asks nothing of any host: a table of facts, a picture, and its scene."""
    picture = io.BytesIO()
    still.savefig(picture, format="jpeg", pil_kwargs={"quality": 90})
    names = [plain_text(view.title) or "the shape" for view in views]
    packed = scene([lighter(view, max(1000, SAMPLES // (10 + len(views)))) for view in views])
    values = {**packed.pop("meshes"), "scene": packed}
    scripts = [(SCRIPTS / f"{name}.js").read_text(encoding="utf-8") for name in ("arrays", "viewer", "stage")]
    return Template(PAGE.read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        alt=html.escape(f"Still pictures of {', '.join(names)}."),
        picture=base64.b64encode(picture.getvalue()).decode(),
        rows="".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(v)}</td></tr>" for k, v in _rows(facts)),
        style=(SCRIPTS / "stage.css").read_text(encoding="utf-8"),
        data="".join(registering(name, value) for name, value in values.items()).replace("</", "<\\/"),
        scripts="\n".join(scripts),
    )


def lighter(view: SurfaceView, n_max: int) -> SurfaceView:
    """Return the view on at most `n_max` of its vertices or points: the first in each box of a grid, values kept.

    Faces whose corners fall into fewer than three boxes go (Rossignac and Borrel 1993).
    """
    points = view.positions
    if len(points) <= n_max:
        return view
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    boxes = 2.0 * n_max
    while True:
        code = np.floor((points - low) / extent * np.sqrt(boxes)).astype(np.int64)
        _, first, group = np.unique(code, axis=0, return_index=True, return_inverse=True)
        if len(first) <= n_max:
            break
        boxes *= 0.8
    values = None if view.values is None else np.asarray(view.values)
    if isinstance(view.surface, PointCloud):
        kept = PointCloud(points[first], view.surface.name)
        return replace(view, surface=kept, values=None if values is None else values[first])
    faces = group.ravel()[view.surface.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    if values is not None:
        values = values[first] if len(values) == len(points) else values[whole]
    limits = None if values is None or view.kind == "labels" else view.color_limits
    light = TriangleMesh(points[first], faces[whole], view.surface.name)
    return replace(view, surface=light, values=values, limits=limits, edges=False)


def _rows(facts: Mapping[str, Any], before: str = "") -> list[tuple[str, str]]:
    """The rows of the table, those of a mapping after its name."""
    rows = []
    for name, value in facts.items():
        if isinstance(value, Mapping):
            rows += _rows(value, f"{before}{name} ")
        elif value != "":
            rows.append((f"{before}{name}".replace("_", " "), _text(value)))
    return rows


def _text(value: Any) -> str:
    """A value as it is read."""
    if isinstance(value, list):
        more = f", … ({len(value)} in all)" if len(value) > LONGEST else ""
        return ", ".join(_text(item) for item in value[:LONGEST]) + more
    if value is None or isinstance(value, bool):
        return "–" if value is None else "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.5g}" if isinstance(value, float) else str(value)
