"""Offer on the front page what was made of the book to take along, with its weight: the PDF, the EPUB, the slides."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from spectral_notes.files import write_whole

PLACE = re.compile(r'(<p class="downloads"[^>]*>).*?(</p>)', re.DOTALL)
KINDS = {".pdf": "PDF", ".epub": "EPUB"}


def name(edition: str) -> str:
    """Return the name of the files of an edition, without their endings."""
    return "spectral-geometry-notes" + ("-student" if edition == "student" else "")


def command_line(description: str, ending: str, arguments: list[str] | None) -> tuple[Path, Path, Path]:
    """Return the built book, the file to make of it in a folder that is there, and the table of contents."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("html", type=Path, help="the built book")
    parser.add_argument("--into", type=Path, required=True, help="the folder of what is made")
    parser.add_argument("--edition", choices=("full", "student"), default="full", help="names the file")
    parser.add_argument("--toc", type=Path, default=Path("_toc.yml"))
    options = parser.parse_args(arguments)
    options.into.mkdir(parents=True, exist_ok=True)
    return options.html.resolve(), options.into.resolve() / f"{name(options.edition)}{ending}", options.toc


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
        write_whole(page, lambda place: place.write_text(after, encoding="utf-8"))
