"""Put what the pages load on request beside the sources of the book: Plotly.js from its wheel, the labs' scripts."""

from __future__ import annotations

import shutil
from importlib.resources import as_file, files
from pathlib import Path


def copy_plotly(target: Path) -> None:
    """Copy plotly.min.js into the folder `target`, unless it is there already."""
    with as_file(files("plotly") / "package_data" / "plotly.min.js") as source:
        copy = target / "plotly.min.js"
        if not copy.exists() or copy.stat().st_size != source.stat().st_size:
            target.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, copy)


def copy_labs(target: Path, root: Path) -> None:
    """Copy the labs' scripts and styles out of the library's sources into the folder `target`/labs."""
    shutil.copytree(root / "spectral_notes" / "labs" / "static", target / "labs", dirs_exist_ok=True)
