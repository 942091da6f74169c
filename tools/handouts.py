"""Print the assignments of a course: a handout for each, and its solutions.

    python tools/handouts.py course

The PDFs go into `course/teacher/handouts`, in the variant of the course. Checks are left away: they need a computer.
"""

from __future__ import annotations

import copy
import html
import sys
from pathlib import Path

import nbformat
import notebooks
import offline_mathjax
import print_book
from judge import MARKERS, cell_settings
from nbconvert import HTMLExporter

TEX = 'tex: {inlineMath: [["$", "$"]]}, options: {enableMenu: false}'
READY = "startup: {pageReady: () => MathJax.startup.defaultPageReady().then(() => (window.ready = true))}"
PYGMENTS = ".highlight .k, .highlight .kn { font-weight: bold; } .highlight .c1, .highlight .sd { color: #555; }"
OWN = ".jp-InputPrompt, .anchor-link, .prompt { display: none; } h2 { margin-top: 8mm; } pre { break-inside: avoid; }"


def page(nb: nbformat.NotebookNode, title: str) -> str:
    """Return a notebook without its checks as a page of HTML for paper."""
    shown = copy.deepcopy(nb)
    shown.cells = [cell for cell in shown.cells if not cell_settings(cell).get("grade_id", "").startswith("check-")]
    for cell in shown.cells:
        cell.source = MARKERS.sub("", cell.source)
    body, _ = HTMLExporter(template_name="basic", exclude_anchor_links=True).from_notebook_node(shown)
    script = (offline_mathjax.mathjax_folder() / offline_mathjax.COMPONENT).as_uri()
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{print_book.STYLE}{PYGMENTS}{OWN}</style><script>window.MathJax = {{{TEX}, {READY}}}</script>"
        f'<script defer src="{script}"></script></head><body>{body}</body></html>'
    )


def pages(course: Path) -> dict[str, str]:
    """Return the pages of a course by the names of their files, solutions beside handouts."""
    found = {}
    for folder in sorted((course / "teacher" / "release").glob("[0-9]_*")):
        for kind, ending in (("release", ""), ("source", "-solutions")):
            path = next((course / "teacher" / kind / folder.name).glob("*.ipynb"))
            title = f"Assignment {folder.name[0]}" + (", solutions" if ending else "")
            found[folder.name + ending] = page(notebooks.read(path), title)
    return found


def main(arguments: list[str]) -> int:
    """Print all assignments of a course."""
    course = Path(arguments[0] if arguments else "course").resolve()
    target = course / "teacher" / "handouts"
    target.mkdir(parents=True, exist_ok=True)
    made = pages(course)
    for name, text in made.items():
        print_book.print_page(text, target / f"{name}.pdf")
    sys.stderr.write(f"handouts: {len(made)} in {target}\n" if made else "handouts: run make course first\n")
    return int(not made)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
