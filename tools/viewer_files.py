"""Put what the pages load on request beside the sources of the book: the viewer's and the labs' scripts and styles."""

from __future__ import annotations

import shutil
from pathlib import Path


def copy_scripts(target: Path, root: Path) -> None:
    """Copy the scripts and styles out of the library's sources into the folder `target`."""
    for room, name in (("plotting", "viewer"), ("labs", "labs")):
        shutil.copytree(root / "spectral_notes" / room / "static", target / name, dirs_exist_ok=True)
