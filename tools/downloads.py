"""Offer on the front page what was made of the book to take along, with its weight: the PDF, the EPUB, the slides."""

from __future__ import annotations

import re
from pathlib import Path

PLACE = re.compile(r'(<p class="downloads"[^>]*>).*?(</p>)', re.DOTALL)
KINDS = {".pdf": "PDF", ".epub": "EPUB"}


def name(edition: str) -> str:
    """Return the name of the files of an edition, without their endings."""
    return "spectral-geometry-notes" + ("-student" if edition == "student" else "")


def offer(root: Path) -> None:
    """Fill the place on the front page of a built book with links to the files that are there."""
    page = root / "book" / "index.html"
    links = [
        f'<a href="../_downloads/{path.name}" download>{KINDS[path.suffix]} ({path.stat().st_size / 1e6:.0f} MB)</a>'
        for path in sorted((root / "_downloads").glob("spectral-geometry-notes*"))
        if path.suffix in KINDS
    ]
    if (root / "slides" / "index.html").exists():
        links.append('<a href="../slides/index.html">slides</a>')
    said = f"To take along: {', '.join(links)}." if links else ""
    before = page.read_text(encoding="utf-8")
    after = PLACE.sub(lambda place: place[1] + said + place[2], before)
    if after != before:
        page.write_text(after, encoding="utf-8")
