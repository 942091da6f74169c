"""Put a built book beside its other versions: a folder a version, and a list that every page of every version reads.

    python tools/publish_version.py SITE BOOK NAME

SITE is the folder that is published, BOOK a built `_build/html`, NAME its version ("0.2.0") or "latest". A book of
that name is replaced. SITE/versions.js names all versions, the newest release first, and SITE/index.html leads to it.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

from packaging.version import Version

NAME = re.compile(r"latest|\d+\.\d+\.\d+")


def put(site: Path, book: Path, name: str) -> list[str]:
    """Copy a built book into the site under its name; return the names of all versions, the newest release first."""
    if not NAME.fullmatch(name):
        raise ValueError(f"name must be a version, like 0.2.0, or latest; got {name!r}")
    if not (book / "index.html").exists():
        raise FileNotFoundError(f"book must be a built book; {book} has no index.html: run make book")
    shutil.rmtree(site / name, ignore_errors=True)
    shutil.copytree(book, site / name)
    releases = [path.name for path in site.iterdir() if path.is_dir() and re.fullmatch(r"\d+\.\d+\.\d+", path.name)]
    names = [*sorted(releases, key=Version, reverse=True), *(["latest"] if (site / "latest").exists() else [])]
    (site / "versions.js").write_text(f"spectralNotesVersions({json.dumps(names)});\n", encoding="utf-8")
    target = f"{names[0]}/index.html"
    (site / "index.html").write_text(
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={target}">'
        f'<title>Spectral Geometry Notes</title><a href="{target}">Spectral Geometry Notes</a>\n',
        encoding="utf-8",
    )
    (site / ".nojekyll").touch()
    return names


if __name__ == "__main__":
    print("versions:", ", ".join(put(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])))
