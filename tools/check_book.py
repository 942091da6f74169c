"""Check a rendered book: its pages are there, ask no other host for anything, and show no noise.

    python tools/check_book.py _build/html --toc _toc.yml

Links a reader may follow are free to lead anywhere. What a page loads by itself (scripts, styles, fonts, pictures,
frames) must come with the book.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import yaml

LOADING = {
    "script": ("src",), "img": ("src", "srcset"), "link": ("href",), "iframe": ("src",), "source": ("src", "srcset"),
    "video": ("src", "poster"), "audio": ("src",), "embed": ("src",), "object": ("data",), "track": ("src",),
    "image": ("href", "xlink:href"), "use": ("href", "xlink:href"), "input": ("src",),
}
LOADING_LINKS = {"stylesheet", "preload", "prefetch", "modulepreload", "icon", "preconnect", "dns-prefetch", "manifest"}
OTHER_HOST = re.compile(r"^\s*(?:[a-z][a-z0-9+.-]*:)?//", re.IGNORECASE)
IN_STYLE = re.compile(r"""url\(\s*['"]?([^'")]+)|@import\s+['"]([^'"]+)""", re.IGNORECASE)
# A script that fetches names its address in one of these ways; an address that is only text is none of them.
IN_SCRIPT = re.compile(
    r"""(?:fetch|import|importScripts|Worker|open)\(\s*(?:['"]GET['"]\s*,\s*)?['"`]((?:https?:)?//[^'"`]+)"""
    r"""|\.(?:src|href)\s*=\s*['"`]((?:https?:)?//[^'"`]+)"""
    r"""|\bfrom\s*['"]((?:https?:)?//[^'"]+)"""
)
# Code of others that names hosts it never asks here (MathJax for Internet Explorer):
# reading cannot tell, so the browser tests watch that no request leaves while it runs.
WATCHED = ("mathjax",)


class Page(HTMLParser):
    """What one page loads, shows and says."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.without_alt: list[str] = []
        self.noise = 0
        self.title = False
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what a tag loads."""
        given = {name: value or "" for name, value in attrs}
        self._inside = tag if tag in ("script", "style") else ""
        self.title |= tag == "title" or given.get("http-equiv", "").lower() == "refresh"  # a redirect needs none
        if tag != "link" or set(given.get("rel", "").lower().split()) & LOADING_LINKS:
            self.loaded += [given[name] for name in LOADING.get(tag, ()) if given.get(name)]
        self.loaded += styled(given.get("style", ""))
        if tag == "img" and not given.get("alt", "").strip():
            self.without_alt.append(given.get("src", "")[:80])
        self.noise += bool({"stderr", "traceback"} & set(given.get("class", "").split()))

    def handle_endtag(self, tag: str) -> None:
        """Leave a script or a style."""
        self._inside = ""

    def handle_data(self, data: str) -> None:
        """Look into inline scripts and styles."""
        if self._inside == "style":
            self.loaded += styled(data)
        elif self._inside == "script":
            self.loaded += scripted(data)


def styled(text: str) -> list[str]:
    """Return what a style sheet loads."""
    return [first or second for first, second in IN_STYLE.findall(text)]


def scripted(text: str) -> list[str]:
    """Return the addresses on other hosts that a script fetches by itself."""
    return [next(filter(None, groups)) for groups in IN_SCRIPT.findall(text)]


def page_faults(path: Path) -> Iterator[str]:
    """Yield what is wrong with one page."""
    page = Page(path.read_text(encoding="utf-8"))
    yield from (f"asks another host for {address[:120]}" for address in page.loaded if OTHER_HOST.match(address))
    for address in page.loaded:
        local = unquote(urlsplit(address).path)
        is_file = local and not OTHER_HOST.match(address) and not urlsplit(address).scheme
        if is_file and not (path.parent / local).exists():
            yield f"loads {local}, which is not there"
    yield from (f"shows a picture without alternative text: {source}" for source in page.without_alt)
    if page.noise:
        yield f"shows {page.noise} warnings or tracebacks of a cell"
    if not page.title:
        yield "has no title"


def asset_faults(path: Path) -> Iterator[str]:
    """Yield what a style sheet or a script asks another host for."""
    text = path.read_text(encoding="utf-8", errors="replace")
    found = styled(text) if path.suffix == ".css" else scripted(text)
    yield from (f"asks another host for {address[:120]}" for address in found if OTHER_HOST.match(address))


def named_pages(toc: Path) -> list[str]:
    """Return the documents that the table of contents names."""

    def documents(node: object) -> Iterator[str]:
        if isinstance(node, dict):
            yield from (str(value) for key, value in node.items() if key in ("root", "file"))
            node = list(node.values())
        if isinstance(node, list):
            for child in node:
                yield from documents(child)

    contents = yaml.safe_load(toc.read_text(encoding="utf-8"))
    return [name.removesuffix(".ipynb").removesuffix(".md") for name in documents(contents)]


def faults(html: Path, toc: Path) -> list[str]:
    """Return everything that is wrong with a rendered book, one sentence each."""
    found = [f"{name}: there is no such page" for name in named_pages(toc) if not (html / f"{name}.html").exists()]
    assets = (p for p in html.rglob("*") if p.suffix in (".css", ".js") and not set(WATCHED) & set(p.parts))
    for path in sorted(html.rglob("*.html")):
        if "_static" not in path.parts:
            found += [f"{path.relative_to(html)}: {fault}" for fault in page_faults(path)]
    for path in sorted(assets):
        found += [f"{path.relative_to(html)}: {fault}" for fault in asset_faults(path)]
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("html", type=Path, help="the folder of the rendered book")
    parser.add_argument("--toc", type=Path, required=True, help="the table of contents, _toc.yml")
    options = parser.parse_args(arguments)
    wrong = faults(options.html, options.toc)
    for fault in wrong:
        sys.stderr.write(f"{fault}\n")
    pages = len(named_pages(options.toc))
    sys.stderr.write(f"book: {pages} pages, {len(wrong)} fault(s); open {options.html / 'index.html'}\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
