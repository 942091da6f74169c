"""Write a file whole or not at all; the one place of the package that does."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Call `write` on a new file beside `path`, then move that file to `path`; on any error leave nothing behind.

    Parameters
    ----------
    path : where to, in a folder that exists
    write : writes to the place that it is given

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_whole(Path(folder, "a.txt"), lambda place: place.write_text("all or nothing"))
    ...     Path(folder, "a.txt").read_text()
    'all or nothing'
    """
    if not path.parent.is_dir():
        raise FileNotFoundError(f"path must be in an existing folder; there is none at {path.parent}")
    handle, name = tempfile.mkstemp(prefix=f".{path.stem[:40]}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    place = Path(name)
    try:
        write(place)
        mask = os.umask(0)
        os.umask(mask)
        place.chmod(0o666 & ~mask)
        place.replace(path)
    finally:
        place.unlink(missing_ok=True)
