"""Make a deck of slides for each chapter from the built book, and one for the two-hour tutorial: reveal.js, offline.

    python tools/slides.py _build/html --into _build/html/slides

A deck has at most twelve slides: the title with the objectives, one slide a section with its first figure, its first
displayed formula and the first sentence of the caption, and the summary. The tutorial takes the first figures of each
chapter.
"""

from __future__ import annotations

import argparse
import html
import re
import shutil
import sys
from importlib.resources import as_file, files
from pathlib import Path

import downloads
import yaml
from bs4 import BeautifulSoup, Tag

MOST = 12  # slides of a deck
NEEDED = ("dist/reset.css", "dist/reveal.css", "dist/reveal.js")
TUTORIAL = ("01", "02", "04", "05", "07", "08", "09", "10", "11", "12")

DECK = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="stylesheet" href="reveal/dist/reset.css"><link rel="stylesheet" href="reveal/dist/reveal.css">
<style>
body {{ background: #fff; color: #1c1e21; }}
.reveal {{ font: 26px/1.35 "DejaVu Sans", "Source Sans 3", sans-serif; }}
.reveal h1, .reveal h2 {{ font: bold 1.5em/1.2 "DejaVu Sans", sans-serif; letter-spacing: 0; text-transform: none; }}
.reveal h2 {{ font-size: 1.15em; }}
.reveal img {{ height: auto; margin: 0; max-height: 430px; max-width: 100%; width: auto; }}
.reveal p {{ margin: 0.4em 0; }} .reveal ul {{ display: block; font-size: 0.85em; text-align: left; }}
.reveal li {{ margin: 0.3em 0; }}
</style>
<script>window.MathJax = {{options: {{enableMenu: false, processHtmlClass: "math"}}}};</script>
<script defer src="../_static/mathjax/tex-chtml-full.js"></script>
</head><body><div class="reveal"><div class="slides">
{slides}
</div></div><script src="reveal/dist/reveal.js"></script>
<script>Reveal.initialize({{hash: true, width: 1100, height: 700, slideNumber: "c/t", transition: "none"}});</script>
</body></html>
"""


def first_sentence(text: str) -> str:
    """Return a text up to the end of its first sentence; a colon does not end one, nor does an initial."""
    found = re.match(r"(.+?[^.A-Z][.?!])(?= [A-Z]|$)", text.strip(), re.DOTALL)
    return found[1] if found else text.strip()


def slide(title: str, *parts: str) -> str:
    """Return one slide."""
    return f"<section><h2>{html.escape(title)}</h2>{''.join(parts)}</section>"


def heading(tag: Tag, level: str = "h2") -> str:
    """Return the words of a heading."""
    found = tag.select_one(level)
    for link in found.select(".headerlink") if found else []:
        link.decompose()
    return found.get_text(" ", strip=True) if found else ""


def figure_parts(figure: Tag, formula: Tag | None) -> list[str]:
    """Return a figure's picture and statement, and a formula above them."""
    image = figure.select_one("img.only-light, img")
    caption = figure.select_one(".caption-text")
    if image is None or caption is None:
        return []
    picture = f'<img src="{html.escape(str(image["src"]))}" alt="{html.escape(str(image.get("alt", "")))}">'
    words = "".join(str(child) for child in caption.contents)
    statement = f"<p>{first_sentence(words)}</p>"
    return [str(formula) if formula else "", picture, statement]


def slides_of(page: Path) -> tuple[str, list[str], list[str]]:
    """Return the title of a chapter, its slides, and those of its slides that show a figure."""
    soup = BeautifulSoup(page.read_text(encoding="utf-8"), "html.parser")
    article = soup.select_one("article.bd-article") or soup
    title = heading(article, "h1")
    objectives = next((ul for ul in article.select("ul.simple") if re.search(r"\d\.1\b", ul.get_text())), None)
    made, shown = [slide(title, str(objectives or ""))], []
    for section in article.select("section section"):
        if section.parent is not None and section.parent.find_parent("section") is not None:
            continue  # sections of a section belong to it
        figure = section.select_one("figure[id]")
        if figure is None or heading(section) in ("Exercises", "Further reading"):
            continue
        formulas = [tag for tag in section.select("div.math") if len(tag.get_text()) < 160]
        for number in section.select(".eqno"):
            number.decompose()
        if parts := figure_parts(figure, formulas[0] if formulas else None):
            shown.append(slide(heading(section), *parts))
    summary = article.select_one("section#summary")
    closing = [slide("Summary", *(str(p) for p in summary.select(":scope > p, :scope > ul")))] if summary else []
    return title, made + shown[: MOST - 1 - len(closing)] + closing, shown


def write_deck(target: Path, title: str, slides: list[str]) -> None:
    """Write one deck."""
    target.write_text(DECK.format(title=html.escape(title), slides="\n".join(slides)), encoding="utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("html", type=Path, help="the built book")
    parser.add_argument("--into", type=Path, required=True, help="the folder of the decks, in the book's")
    parser.add_argument("--toc", type=Path, default=Path("_toc.yml"))
    options = parser.parse_args(arguments)
    options.into.mkdir(parents=True, exist_ok=True)
    with as_file(files("sphinx_revealjs") / "_static" / "revealjs") as reveal:
        for name in NEEDED:
            target = options.into / "reveal" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(reveal / name, target)
    toc = yaml.safe_load(options.toc.read_text(encoding="utf-8"))
    names = [one["file"] for part in toc["parts"] for one in part["chapters"] if re.match(r"book/\d\d_", one["file"])]
    thread = "<p>L φ = λ M φ: only where (L, M) come from changes.</p>"
    tutorial, links = [slide("Spectral geometry in two hours", thread)], []
    for name in names:
        title, slides, shown = slides_of(options.html / f"{name}.html")
        stem = Path(name).stem
        write_deck(options.into / f"{stem}.html", title, slides)
        links.append(f'<li><a href="{stem}.html">{html.escape(title)}</a>, {len(slides)} slides</li>')
        if stem[:2] in TUTORIAL:
            tutorial += shown[:3]
        print(f"{stem}: {len(slides)} slides")
    write_deck(options.into / "tutorial.html", "Spectral geometry in two hours", tutorial)
    print(f"tutorial: {len(tutorial)} slides")
    listed = slide("Slides", f'<ul><li><a href="tutorial.html">The two-hour tutorial</a></li>{"".join(links)}</ul>')
    write_deck(options.into / "index.html", "Slides", [listed])
    downloads.offer(options.html)
    return 0


if __name__ == "__main__":
    sys.exit(main())
