"""Take the scenes out of executed notebooks: their data into small files, a name beside each figure.

A figure made while SPECTRAL_NOTES_SCENES is set brings its scene in its output (`plotting.scenes.attach`). A page that
held them would be megabytes; so each goes into a script that is loaded when the reader asks, each surface into one that
all its figures share, and the page keeps the names, which `book/_static/scenes.js` reads.
"""

from __future__ import annotations

from pathlib import Path

import nbformat
import notebooks

from spectral_notes.plotting.packing import registering
from spectral_notes.plotting.scenes import MIME


def take_out(nb: nbformat.NotebookNode) -> dict[str, str]:
    """Remove the scenes from a notebook, put a list after each figure, and return the data files by their names."""
    cells, files = [], {}
    for cell in nb.cells:
        cells.append(cell)
        for output in cell.get("outputs", []):
            scene = output.get("data", {}).pop(MIME, None)
            label = cell.metadata.get("mystnb", {}).get("figure", {}).get("name")
            if scene is not None and label:
                values = scene.pop("meshes") | {f"scenes/{label}": scene}
                files |= {name: registering(name, value) for name, value in values.items()}
                cells.append(_list_cell(label))
    nb.cells = cells
    return files


def _list_cell(label: str) -> nbformat.NotebookNode:
    """A cell whose raw HTML names the scene of one figure."""
    place = f'<div class="scenes" hidden data-figure="{label}" data-scene="scenes/{label}"></div>'
    source = f"```{{raw}} html\n{place}\n```"
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
