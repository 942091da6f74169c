"""Print the built book as one PDF: contents with page numbers, links, bookmarks, solutions apart.

    python tools/print_book.py _build/html --into _build/html/_downloads --edition full

The pages of the built book become one page of HTML, which Chromium prints twice: the first time tells on which page
each chapter begins. Folded code is left away; answers to predictions are shown; the labs are their stills.
"""

from __future__ import annotations

import html
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import downloads
import yaml
from bs4 import BeautifulSoup, Tag
from PIL import Image
from playwright.sync_api import Page, sync_playwright
from pypdf import PdfReader

TITLE = "Spectral Geometry Notes"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LEFT_AWAY = (
    ".headerlink, .scenes, .only-dark, .copybtn, form, button, script, style, source, details.hide, .onlyprint, "
    ".downloads, .tag_remove-input > .cell_input, nav, .sd-card-hover"
)
JPEG_QUALITY = 88
PATIENCE = 900_000  # milliseconds

STYLE = """
@page { size: A4; margin: 18mm 16mm 20mm; }
body { color: #000; font: 10pt/1.45 "DejaVu Serif", Georgia, serif; }
h1, h2, h3, h4, .title { font-family: "DejaVu Sans", sans-serif; break-after: avoid; line-height: 1.25; }
h1 { font-size: 20pt; } h2 { font-size: 14pt; } h3 { font-size: 12pt; } h4 { font-size: 11pt; }
article, .contents, .solutions { break-before: page; }
a { color: #0b4a9e; text-decoration: none; overflow-wrap: anywhere; }
.title { margin-top: 60mm; text-align: center; } .title h1 { font-size: 30pt; }
.contents p { display: flex; margin: 1mm 0; } .contents p.part { font-weight: bold; margin-top: 4mm; }
.contents i { border-bottom: 1px dotted #777; flex: 1; margin: 0 2mm 1mm; }
pre { background: #f6f6f6; font: 7.6pt/1.4 "DejaVu Sans Mono", monospace; margin: 2mm 0; overflow-wrap: anywhere;
  padding: 2mm; white-space: pre-wrap; }
code { font: 8.6pt "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
.cell_output pre { background: #fff; border: 1px solid #ddd; }
figure { break-inside: avoid; margin: 4mm 0; text-align: center; }
figcaption { font-size: 9pt; text-align: left; }
img { height: auto; max-height: 215mm; max-width: 100%; }
table { border-collapse: collapse; font-size: 8.5pt; margin: 3mm 0; max-width: 100%; }
th, td { border-bottom: 1px solid #ccc; overflow-wrap: anywhere; padding: 1mm 2mm; text-align: left;
  vertical-align: top; }
tr, div.math, mjx-container { break-inside: avoid; }
.eqno { float: right; }
.admonition { border-left: 1mm solid #7a96bd; margin: 3mm 0; padding: 0 3mm; }
.admonition-title { break-after: avoid; font-family: "DejaVu Sans", sans-serif; font-weight: bold; }
"""
FOOTER = '<p style="font: 8px sans-serif; text-align: center; width: 100%"><span class="pageNumber"></span></p>'


def chapters(toc: Path) -> list[tuple[str, list[str]]]:
    """Return the parts of the book: their captions, and the names of their pages in order."""
    found = yaml.safe_load(toc.read_text(encoding="utf-8"))
    parts = [("", [found["root"]])]
    return parts + [(part["caption"], [one["file"] for one in part["chapters"]]) for part in found["parts"]]


def own_name(address: str, page: str) -> str | None:
    """Return the name inside the one page of what an address inside the book names; None for an address elsewhere."""
    if re.match(r"[a-z]+:", address):
        return None
    target, _, place = address.partition("#")
    if target and not target.endswith(".html"):
        return None
    stem = Path(target).stem if target else Path(page).stem
    return f"{stem}--{place or 'top'}"


def article(root: Path, page: str, pictures: Path) -> tuple[Tag, list[Tag], str]:
    """Return the article of a page for paper, its solutions, and its title."""
    path = root / f"{page}.html"
    soup = BeautifulSoup(path.read_text(encoding="utf-8"), "html.parser")
    body = soup.select_one("article.bd-article") or soup.select_one("article")
    if body is None:
        raise ValueError(f"{path} must hold an article")
    for tag in body.select(LEFT_AWAY):
        tag.decompose()
    for tag in body.select("[id]"):
        tag["id"] = f"{path.stem}--{tag['id']}"
    for tag in body.select("a[href]"):
        if name := own_name(str(tag["href"]), page):
            tag["href"] = f"#{name}"
        elif not re.match(r"[a-z]+:", str(tag["href"])):
            del tag["href"]  # a file of the book's folder, which paper has not
    for tag in body.select("img[src]"):
        tag["src"] = picture((path.parent / str(tag["src"])).resolve(), pictures)
        for name in ("loading", "width", "height", "class"):
            tag.attrs.pop(name, None)
    title = body.select_one("h1")
    solutions = [tag.extract() for tag in body.select(".admonition.solution")]
    body["id"] = f"{path.stem}--top"
    return body, solutions, title.get_text(" ", strip=True) if title else path.stem


def picture(source: Path, pictures: Path) -> str:
    """Return the address of a picture for paper: a JPEG of a raster picture, the file itself of a drawing."""
    if source.suffix == ".webp" and source.with_suffix(".png").exists():
        source = source.with_suffix(".png")
    if source.suffix == ".svg" or not source.exists():
        return source.as_uri()
    target = pictures / f"{source.stem}.jpg"
    if not target.exists():
        with Image.open(source) as opened:
            opened.convert("RGB").save(target, quality=JPEG_QUALITY)
    return target.as_uri()


def one_page(root: Path, toc: Path, title: str, pictures: Path, numbers: dict[str, int]) -> str:
    """Return the whole book as one page of HTML; `numbers` are the pages of paper on which names lie, where known."""
    bodies, answers, lines = [], [], []

    def line(name: str, text: str) -> str:
        number = numbers.get(name, "")
        return f'<p><a href="#{name}">{html.escape(text)}</a><i></i><a href="#{name}">{number}</a></p>'

    for caption, pages in chapters(toc):
        if caption:
            lines.append(f'<p class="part">{html.escape(caption)}</p>')
        for page in pages:
            body, solutions, heading = article(root, page, pictures)
            bodies.append(str(body))
            lines.append(line(f"{Path(page).stem}--top", heading))
            if solutions:
                name = f"{Path(page).stem}--solutions"
                answers.append(f'<h2 id="{name}">{html.escape(heading)}</h2>' + "".join(map(str, solutions)))
    if answers:
        lines.append(line("solutions", "Solutions"))
        bodies.append('<div class="solutions"><h1 id="solutions">Solutions</h1>' + "".join(answers) + "</div>")
    static = root / "_static"
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f'<link rel="stylesheet" href="{(static / "pygments.css").as_uri()}"><style>{STYLE}</style>'
        '<script>window.MathJax = {options: {enableMenu: false, processHtmlClass: "math"}, '
        'startup: {pageReady: () => MathJax.startup.defaultPageReady().then(() => (window.ready = true))}}</script>'
        f'<script defer src="{(static / "mathjax" / "tex-chtml-full.js").as_uri()}"></script></head><body>'
        f'<div class="title"><h1>{html.escape(title)}</h1></div>'
        f'<div class="contents"><h1>Contents</h1>{"".join(lines)}</div>{"".join(bodies)}</body></html>'
    )


@contextmanager
def started_browser() -> Iterator[Page]:
    """Yield a page of a browser without a window."""
    browser_path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser_path is None:
        raise FileNotFoundError(f"printing needs a browser: none of {', '.join(BROWSERS)} is installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page()
        page.set_default_timeout(PATIENCE)
        yield page
        browser.close()


def print_page(text: str, target: Path) -> None:
    """Print a page of HTML into a PDF."""
    source = target.with_suffix(".html")
    source.write_text(text, encoding="utf-8")
    with started_browser() as page:
        page.goto(source.as_uri(), wait_until="load")
        page.wait_for_function("window.ready === true")
        form: dict[str, Any] = {"display_header_footer": True, "header_template": "<p></p>", "footer_template": FOOTER}
        page.pdf(path=target, outline=True, tagged=True, prefer_css_page_size=True, print_background=True, **form)
    source.unlink()


def page_numbers(path: Path) -> dict[str, int]:
    """Return on which page of a PDF, counted from 1, each named place lies."""
    reader = PdfReader(path)
    found = {name: reader.get_destination_page_number(place) for name, place in reader.named_destinations.items()}
    return {name.lstrip("/"): number + 1 for name, number in found.items() if number is not None}


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    root, target, toc = downloads.command_line(__doc__ or "", ".pdf", arguments)
    with tempfile.TemporaryDirectory() as folder:
        numbers: dict[str, int] = {}
        for _ in range(2):
            trial = Path(folder) / "book.pdf"
            print_page(one_page(root, toc, TITLE, Path(folder), numbers), trial)
            numbers = page_numbers(trial)
        shutil.copyfile(trial, target)
    reader = PdfReader(target)
    size = target.stat().st_size / 1e6
    print(f"{target.name}: {len(reader.pages)} pages, {size:.1f} MB, {len(reader.outline)} bookmarks at the top")
    downloads.offer(root)
    return 0


if __name__ == "__main__":
    sys.exit(main())
