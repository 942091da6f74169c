"""Sphinx extension: pages that load little, read well on a phone, in the dark and with a screen reader.

A page's first load stays within 1.5 MB. The stills of a chapter are 3 MB as PNG, a tenth of that as WebP, and those out
of sight are loaded later; their size is written beside them, so that the text does not move when they come. Each has a
twin for the dark theme (`figure_twins`), and one with its panels stacked for a narrow window where it has many. The
theme brings every icon twice, as a font (which its style sheet uses) and as a script of 1.5 MB, which is left away.
Sphinx calls the bibliography a list without list items; the role is taken away. Links to headings are reached by a
pointer, not by every press of Tab. Without a script, the page is light.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import figure_twins
from PIL import Image
from sphinx.application import Sphinx

FIGURE = r'(?:<figure[^>]*id="(fig-[\w-]+)"[^>]*>\s*)?'
PICTURE = re.compile(FIGURE + r'<img ([^>]*?)src="([^"]*_images/([^"/]+)\.png)"([^>]*)>')
QUALITY = 75
NARROW = "(max-width: 576px)"
ICON_SCRIPT = "scripts/fontawesome.js"
# Figures that show colours themselves: no twin may change them.
COLOURS = re.compile(r"colou?r|lamps?|light|metamer|matching|spectra")


def boxes_of(app: Sphinx, label: str | None) -> list[list[float]]:
    """Return where the surfaces of a figure lie in its picture, as shares; none where it has no scene and no loop."""
    static = Path(app.srcdir) / "book" / "_static"
    path = static / "scenes" / f"{label}.js"
    if not path.exists():
        path = static / "loops" / f"{label}.js"
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    scene = json.loads(text[text.index("{") : text.rindex(")")])
    return [picture["box"] for picture in scene["pictures"]]


def finished_pictures(app: Sphinx, page: str) -> Callable[[re.Match[str]], str]:
    """Return the rewriting of one picture's tag; the twins are written when the build ends."""
    sources = {name: Path(app.srcdir) / source for source, name in app.builder.images.items()}
    wanted = app.__dict__.setdefault("figure_twins", {})

    def rewritten(tag: re.Match[str]) -> str:
        label, before, address, name, after = tag.groups()
        if name + ".png" not in sources:
            return tag[0]
        head = tag[0][: tag[0].index("<img")]
        with Image.open(sources[name + ".png"]) as picture:
            width, height = picture.size
        boxes, colours = boxes_of(app, label), bool(label and COLOURS.search(label))
        stacked = figure_twins.columns_when_narrow(width, boxes) is not None
        wanted[name] = (boxes, colours, stacked)
        base = address.removesuffix(".png")
        size = "" if "width" in before + after else f'width="{width}" height="{height}" '

        def image(twin: str, theme: str) -> str:
            source = f'<source media="{NARROW}" srcset="{base}{twin}-narrow.webp">' if stacked else ""
            classes = " ".join(filter(None, [theme, "" if stacked or width < 1.6 * height else "wide-figure"]))
            given = f'loading="lazy" decoding="async" {before}src="{base}{twin}.webp"{after}'
            tag = f'<img {size}class="{classes}" {given}>'
            return f'<picture class="{theme}">{source}{tag}</picture>' if source else tag

        if colours or "class=" in before + after:
            return head + f'<img {size}loading="lazy" decoding="async" {before}src="{base}.webp"{after}>'
        return head + image("", "only-light") + image("-dark", "only-dark")

    return rewritten


def finish_page(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """Rewrite the pictures, the bibliography and the links to headings of one page."""
    if app.builder.format == "html" and app.builder.name == "html" and "body" in context:
        body = context["body"].replace('<div role="list" class="citation-list">', '<div class="citation-list">')
        body = body.replace('<a class="headerlink"', '<a tabindex="-1" class="headerlink"')
        context["body"] = PICTURE.sub(finished_pictures(app, page), body)


def write_light_files(app: Sphinx, error: Exception | None) -> None:
    """Write the pictures and their twins, nothing in place of the theme's icons, and pages light without a script."""
    if error is not None or app.builder.name != "html":
        return
    folder = Path(app.outdir)
    for source in (folder / "_images").glob("*.png"):
        light = source.with_suffix(".webp")
        boxes, colours, stacked = app.__dict__.get("figure_twins", {}).get(source.stem, ([], True, False))
        if light.exists() and light.stat().st_mtime >= max(map(os.path.getmtime, (source, figure_twins.__file__))):
            continue
        with Image.open(source) as opened:
            picture = opened.convert("RGB")
        picture.save(light, quality=QUALITY)
        twins = {"": picture} if colours else {"": picture, "-dark": figure_twins.dark(picture, boxes)}
        for ending, twin in twins.items():
            if ending:
                twin.save(light.with_stem(light.stem + ending), quality=QUALITY)
            if stacked:
                figure_twins.stacked(twin, boxes).save(light.with_stem(f"{light.stem}{ending}-narrow"), quality=QUALITY)
    (folder / "_static" / ICON_SCRIPT).write_text("/* Icons are drawn by the font of the style sheet. */\n")
    for page in folder.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        if 'data-theme="auto">' in text:
            page.write_text(text.replace('data-theme="auto">', 'data-theme="light">', 1), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("html-page-context", finish_page)
    app.connect("build-finished", write_light_files)
    return {"parallel_read_safe": True, "parallel_write_safe": False}
