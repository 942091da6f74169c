"""Sphinx extension: a part of the book alone, in which chapters keep their numbers and absent ones are named.

`build_book.py --parts 2` says in `part_edition` which pages are absent and what they define. A reference to one of
them becomes its name, and a link where the address of the whole book is known; any other broken reference still fails
the build.
"""

from __future__ import annotations

import json
import posixpath
import re
from pathlib import Path
from typing import Any

import yaml
from docutils import nodes
from sphinx.application import Sphinx
from sphinx_external_toc.collectors import TocTreeCollectorWithStyles as Counting

LABEL = re.compile(r"^\(([\w-]+)\)=|^:(?:label|name): *([\w-]+)|\$\$ *\(([\w-]+)\)", re.MULTILINE)
KINDS = {"fig": "a figure", "eq": "an equation", "ex": "an exercise", "sol": "a solution", "tab": "a table"}


def of_parts(toc: dict[str, Any], parts: list[int]) -> dict[str, Any]:
    """Return a table of contents with these of the numbered parts, counted from 1, and all that is not numbered."""
    numbered = [part for part in toc["parts"] if part.get("numbered")]
    if not parts or not set(parts) <= set(range(1, len(numbered) + 1)):
        raise ValueError(f"parts must be numbers from 1 to {len(numbered)}; got {parts}")
    kept = [numbered[number - 1] for number in parts]
    return toc | {"parts": [part for part in toc["parts"] if part in kept or not part.get("numbered")]}


def pages(toc: dict[str, Any], numbered: bool = False) -> list[str]:
    """Return the pages of a table of contents, or those of its numbered parts."""
    return [c["file"] for part in toc["parts"] if part.get("numbered") or not numbered for c in part["chapters"]]


def described(root: Path, toc: dict[str, Any], kept: dict[str, Any], address: str = "") -> dict[str, Any]:
    """Return what the extension is told: numbers of chapters, and titles and labels of those that are left out."""
    found: dict[str, Any] = {"numbers": {}, "titles": {}, "labels": {}, "address": address.rstrip("/")}
    for number, page in enumerate(pages(toc, numbered=True), start=1):
        found["numbers"][page] = number
        if page not in pages(kept):
            text, names = words(next(root.glob(f"{page}.*")))
            found["titles"][page] = text
            found["labels"] |= dict.fromkeys(names, page)
    return found


def words(path: Path) -> tuple[str, list[str]]:
    """Return the title of a page, and the labels that it defines."""
    text, names = path.read_text(encoding="utf-8"), []
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        figures = (cell["metadata"].get("mystnb", {}).get("figure") for cell in cells)
        names = [figure["name"] for figure in figures if figure]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    title = re.search(r"^# (.+)$", text, re.MULTILINE)
    return title[1] if title else path.stem, [*names, *(next(filter(None, found)) for found in LABEL.findall(text))]


def absent(root: Path, parts: list[int]) -> set[str]:
    """Return the names of the pages that are left out."""
    toc = yaml.safe_load((root / "_toc.yml").read_text(encoding="utf-8"))
    return {Path(page).name for page in set(pages(toc)) - set(pages(of_parts(toc, parts)))}


def cut(root: Path, source: Path, parts: list[int], address: str = "") -> dict[str, Any]:
    """Cut a staged copy of the book down to some of its parts, and return the setting of the extension."""
    toc = yaml.safe_load((root / "_toc.yml").read_text(encoding="utf-8"))
    kept = of_parts(toc, parts)
    told = described(root, toc, kept, address)
    for page in told["titles"]:
        for path in source.glob(f"{page}.*"):
            path.unlink()
    (source / "_toc.yml").write_text(yaml.safe_dump(kept, sort_keys=False), encoding="utf-8")
    return {"part_edition": told}


def name_what_is_absent(app: Sphinx, env: Any, node: Any, content: nodes.Element) -> nodes.Element | None:
    """Return the name of what a reference into an absent page means."""
    told, target = app.config.part_edition, node["reftarget"]
    page = posixpath.normpath(posixpath.join(posixpath.dirname(node.get("refdoc", "")), target))
    page = page if node["reftype"] == "doc" else told["labels"].get(target)
    if page not in told["titles"]:
        return None
    chapter = f"chapter {told['numbers'][page]}"
    kind = KINDS.get(target.split("-")[0])
    text = f"{kind} of {chapter}" if kind else f"{chapter}, {told['titles'][page]}"
    name = content if node.get("refexplicit") else nodes.inline("", text)
    if not told["address"]:
        return name
    place = "" if node["reftype"] == "doc" else f"#{target}"
    return nodes.reference("", "", name, internal=False, refuri=f"{told['address']}/{page}.html{place}")


def keep_numbers(app: Sphinx) -> None:
    """Give each chapter the number that it has in the whole book."""
    numbered, count = app.config.part_edition["numbers"], Counting.assign_section_numbers

    def assign(self: Counting, env: Any) -> list[str]:
        changed = count(self, env)
        for page in set(numbered) & set(env.toc_secnumbers):
            own, first = env.toc_secnumbers[page], numbered[page]
            env.toc_secnumbers[page] = {name: n and (first, *n[1:]) for name, n in own.items()}
            for entry in [env.titles[page], *env.tocs[page].findall(nodes.reference)]:
                if entry.get("secnumber"):
                    entry["secnumber"] = [first, *entry["secnumber"][1:]]
        return changed

    Counting.assign_section_numbers = assign


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.add_config_value("part_edition", {}, "env")
    app.connect("missing-reference", name_what_is_absent)
    app.connect("builder-inited", keep_numbers)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
