"""Take the scenes out of executed notebooks: their data into small files, a list of them beside each figure.

A figure made while SPECTRAL_NOTES_SCENES is set brings its scenes in its output (`plotting.scenes.attach`). A
page that held them would be megabytes; so each goes into a script that is loaded when the reader asks, and the page
keeps their names, which `book/_static/scenes.js` reads.
"""

from __future__ import annotations

import html
import json
from pathlib import Path

import nbformat
import notebooks

MIME = "application/vnd.spectral-notes.scenes+json"


def take_out(nb: nbformat.NotebookNode) -> dict[str, str]:
    """Remove the scenes from a notebook, put a list after each figure, and return the data files by their names."""
    cells, files = [], {}
    for cell in nb.cells:
        cells.append(cell)
        for output in cell.get("outputs", []):
            scenes = output.get("data", {}).pop(MIME, None)
            label = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            if scenes is not None and label:
                listed = [{"file": f"scenes/{label}-{number}"} | one for number, one in enumerate(scenes)]
                files |= {one["file"]: registering(one["file"], one.pop("scene")) for one in listed}
                cells.append(_list_cell(label, listed))
    nb.cells = cells
    return files


def registering(name: str, value: str) -> str:
    """Return the script that registers a value, given as JSON, under a name (`book/_static/loading.js`)."""
    return f"spectralNotes.register({json.dumps(name)}, {value});\n"


def _list_cell(label: str, listed: list[dict[str, object]]) -> nbformat.NotebookNode:
    """A cell whose raw HTML lists the scenes of one figure."""
    text = html.escape(json.dumps(listed, ensure_ascii=False), quote=True)
    source = f'```{{raw}} html\n<div class="scenes" hidden data-figure="{label}" data-scenes="{text}"></div>\n```'
    return nbformat.v4.new_markdown_cell(source, id=f"scenes-{label}"[:64])


def write_scenes(executed: Path, pages: Path, static: Path) -> None:
    """Write each notebook of `executed` without its scenes into `pages`, and their data files into `static`."""
    wanted: dict[Path, str] = {}
    for path in sorted(executed.glob("*.ipynb")):
        nb = notebooks.read(path)
        wanted |= {static / f"{name}.js": text for name, text in take_out(nb).items()}
        wanted[pages / path.name] = notebooks.to_text(nb)
    for stale in {*pages.glob("*.ipynb"), *(static / "scenes").glob("*.js")} - set(wanted):
        stale.unlink()
    for path, text in wanted.items():
        notebooks.write(path, text)
