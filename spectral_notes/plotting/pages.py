"""A page of HTML with scripts and data inside, which a notebook shows in a frame: scenes to turn, and labs."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

SCRIPTS = Path(__file__).with_name("static")

DOCUMENT = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>:root {{ color-scheme: light dark; }} body {{ background: Canvas; font-family: sans-serif; }}
{style}</style></head>
<body>{body}
<script>
const given = new Map();
globalThis.spectralNotes = {{
  script: async () => {{}},
  register: (name, value) => given.set(name, value),
  data: async (name) => given.get(name),
}};
</script>
{scripts}
</body></html>"""

# A notebook that is not trusted loses the frame, and the sentence under it is seen.
FRAME = """<div style="position: relative; min-height: {height}px">
<p>This {title} is drawn by scripts, which a notebook runs only when it is trusted: choose File &gt; Trust Notebook
(in JupyterLab, the command "Trust Notebook"), or run this cell again.</p>
<iframe title="{title}" style="position: absolute; inset: 0; width: 100%; height: {height}px; border: 0"
srcdoc="{source}"></iframe>
</div>"""


@dataclass(frozen=True)
class Page:
    """Hold a page of its own: HTML that asks nobody for anything, because scripts and data are inside.

    Parameters
    ----------
    page : the HTML
    title : what it is, in a word or two
    height : pixels of the frame in a notebook
    """

    page: str = field(repr=False)
    title: str = "scene"
    height: int = 480

    def _repr_html_(self) -> str:
        """Return a frame with the page in it."""
        return FRAME.format(title=self.title, height=self.height, source=html.escape(self.page, quote=True))


def page(
    title: str, body: str, data: Sequence[str], names: Sequence[str], height: int = 480, folders: Sequence[Path] = ()
) -> Page:
    """Return a page from its body, its data, and the names of its scripts; styles of the folders come along."""
    folders = (SCRIPTS, *folders)
    found = {path.stem: path for folder in folders for path in folder.glob("*.js")}
    texts = [*data, *(found[name].read_text(encoding="utf-8") for name in names)]
    scripts = "\n".join("<script>" + text.replace("</script", "<\\/script") + "</script>" for text in texts)
    style = "\n".join(path.read_text(encoding="utf-8") for folder in folders for path in sorted(folder.glob("*.css")))
    return Page(DOCUMENT.format(title=title, body=body, style=style, scripts=scripts), title, height)
