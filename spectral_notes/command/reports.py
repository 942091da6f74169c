"""A result as one HTML page that needs no network: the picture, the numbers, and scenes to turn with the mouse.

The scripts that turn the scenes are copied into the page, so that the file can be sent to anybody. The still picture is
there without a script; the scenes are started on a click.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

from matplotlib.figure import Figure

from spectral_notes.plotting.packing import registering
from spectral_notes.plotting.pages import SCRIPTS
from spectral_notes.plotting.rendering import SurfaceView
from spectral_notes.plotting.scenes import plain_text, scene

PAGE = Path(__file__).with_name("report.html")
LONGEST = 12  # numbers of a list that the table shows; the rest is counted


def report_page(title: str, facts: Mapping[str, Any], views: Sequence[SurfaceView], still: Figure) -> str:
    """Return a whole HTML page about a shape.

    Parameters
    ----------
    title : str
        What stands above.
    facts : mapping of str to number, string, list or mapping
        The rows of the table.
    views : sequence of SurfaceView
        What the scene shows, side by side.
    still : Figure
        The same, as a picture.

    Returns
    -------
    str
        The page; it asks nothing of any host.

    Examples
    --------
    >>> from spectral_notes import plotting, shapes
    >>> view = SurfaceView(shapes.sphere(1), title="a ball")
    >>> page = report_page("A ball", {"faces": 80}, [view], plotting.plot_views([view]))
    >>> page.startswith("<!doctype html>"), "<td>80</td>" in page
    (True, True)
    """
    picture = io.BytesIO()
    still.savefig(picture, format="png")
    names = [plain_text(view.title) or "the shape" for view in views]
    packed = scene(views)
    values = {**packed.pop("meshes"), "scene": packed}
    scripts = [(SCRIPTS / f"{name}.js").read_text(encoding="utf-8") for name in ("arrays", "viewer", "stage")]
    return Template(PAGE.read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        alt=html.escape(f"Still pictures of {', '.join(names)}."),
        picture=base64.b64encode(picture.getvalue()).decode(),
        rows="".join(f"<tr><th>{html.escape(_words(k))}</th><td>{html.escape(v)}</td></tr>" for k, v in _rows(facts)),
        style=(SCRIPTS / "stage.css").read_text(encoding="utf-8"),
        data="".join(registering(name, value) for name, value in values.items()).replace("</", "<\\/"),
        scripts="\n".join(scripts),
    )


def _rows(facts: Mapping[str, Any], before: str = "") -> list[tuple[str, str]]:
    """The rows of the table, those of a mapping after its name."""
    rows = []
    for name, value in facts.items():
        if isinstance(value, Mapping):
            rows += _rows(value, f"{before}{name} ")
        elif value != "":
            rows.append((f"{before}{name}", _text(value)))
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


def _words(name: str) -> str:
    """The name of a fact in words."""
    return name.replace("_", " ")
