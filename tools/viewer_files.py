"""Put what the pages load on request beside the sources of the book: Plotly.js as it comes in the plotly wheel."""

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
