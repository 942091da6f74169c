"""Sphinx extension: pages that load little, and that a screen reader reads well.

A page's first load stays within 1.5 MB. The stills of a chapter are 3 MB as PNG, a tenth of that as WebP, and those out
of sight are loaded later; their size is written beside them, so that the text does not move when they come. The theme
brings every icon twice, as a font (which its style sheet uses) and as a script of 1.5 MB; the script is left away.
Sphinx calls the bibliography a list without list items; the role is taken away.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image
from sphinx.application import Sphinx

PICTURE = re.compile(r'<img ([^>]*?)src="([^"]*_images/([^"/]+)\.png)"([^>]*)>')
QUALITY = 75
ICON_SCRIPT = "scripts/fontawesome.js"


def lighter_pictures(app: Sphinx) -> Callable[[re.Match[str]], str]:
    """Return the rewriting of one picture's tag."""
    sources = {name: Path(app.srcdir) / source for source, name in app.builder.images.items()}

    def rewritten(tag: re.Match[str]) -> str:
        before, address, name, after = tag.groups()
        if name + ".png" not in sources:
            return tag[0]
        with Image.open(sources[name + ".png"]) as picture:
            width, height = picture.size
        size = "" if "width" in before + after else f'width="{width}" height="{height}" '
        return f'<img {size}loading="lazy" decoding="async" {before}src="{address.removesuffix(".png")}.webp"{after}>'

    return rewritten


def finish_page(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """Rewrite the pictures and the bibliography of one page."""
    if app.builder.format == "html" and "body" in context:
        body = context["body"].replace('<div role="list" class="citation-list">', '<div class="citation-list">')
        context["body"] = PICTURE.sub(lighter_pictures(app), body)


def write_light_files(app: Sphinx, error: Exception | None) -> None:
    """Write the WebP pictures, and nothing in place of the theme's icon script."""
    if error is not None or app.builder.format != "html":
        return
    folder = Path(app.outdir)
    for source in (folder / "_images").glob("*.png"):
        light = source.with_suffix(".webp")
        if not light.exists() or light.stat().st_mtime < source.stat().st_mtime:
            with Image.open(source) as picture:
                picture.save(light, quality=QUALITY)
    (folder / "_static" / ICON_SCRIPT).write_text("/* Icons are drawn by the font of the style sheet. */\n")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("html-page-context", finish_page)
    app.connect("build-finished", write_light_files)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
