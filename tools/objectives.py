"""Fill the teacher's page with what the notebooks say: each chapter's time, objectives, and the exercises for them.

    python tools/objectives.py        print the tables

`make book` calls `fill` on its staged copy, so that no table can be older than the notebooks. A line
`% objectives of chapter N` stands where the table goes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import notebooks

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path("book") / "for_teachers.md"
MARKER = re.compile(r"^% objectives of chapter (\d+)$", re.MULTILINE)
MISSING = "*This edition leaves the chapter out.*"


def objectives(text: str) -> dict[str, str]:
    """Return the objectives that a chapter opens with, by number."""
    opening = re.search(r"\{admonition\} You will be able to\n(.*?)^:::", text, re.DOTALL | re.MULTILINE)
    items = re.split(r"^- ", opening[1] if opening else "", flags=re.MULTILINE)[1:]
    found = (re.fullmatch(r"\*\*(\d+\.\d+)\*\* (.*?)[;.]?", " ".join(item.split())) for item in items)
    return {match[1]: match[2] for match in found if match}


def exercises(path: Path) -> dict[str, list[str]]:
    """Return the labels of the exercises that test each objective of a chapter."""
    tests: dict[str, list[str]] = {}
    for cell in notebooks.read(path).cells:
        label = re.search(r"\{exercise-start\}[^\n]*\n:label: (\S+)", cell.source)
        for tag in cell.metadata.get("tags", []) if label else []:
            if tag.startswith("objective-"):
                tests.setdefault(tag.removeprefix("objective-"), []).append(label[1])
    return tests


def lengths(path: Path) -> dict[str, int]:
    """Return how long a chapter is: words, sections, figures, cells to read, exercises, and minutes to read and run.

    A minute for 150 words, one for a figure, three quarters of one for a cell that is not folded.
    """
    cells = notebooks.read(path).cells
    end = next(n for n, cell in enumerate(cells) if re.search(r"^## Exercises", cell.source, re.M))
    words = sum(len(cell.source.split()) for cell in cells[:end] if cell.cell_type == "markdown")
    figures = sum("mystnb" in cell.metadata for cell in cells[:end])
    shown = sum(cell.cell_type == "code" and "hide-input" not in cell.metadata.get("tags", []) for cell in cells[:end])
    return {
        "words": words,
        "sections": sum(len(re.findall(r"^## ", cell.source, re.M)) for cell in cells if cell.cell_type == "markdown"),
        "figures": figures,
        "cells": shown,
        "exercises": sum("{exercise-start}" in cell.source for cell in cells[end:]),
        "minutes": 5 * round((words / 150 + figures + 0.75 * shown) / 5),
    }


def time(path: Path) -> str:
    """Return how long a chapter takes: as `lengths` says, and ten minutes an exercise."""
    found = lengths(path)
    count = found["exercises"]
    return f"about {found['minutes']} minutes to read and run, {10 * count} for its {count} exercises."


def say_times(folder: Path) -> None:
    """Write under the objectives of each chapter in a folder how long it takes."""
    for path in sorted(folder.glob("[0-9][0-9]_*.ipynb")):
        nb, words = notebooks.read(path), time(path)
        for cell in nb.cells:
            if "{admonition} You will be able to\n" in cell.source:
                cell.source += f"\n\n*{words[0].upper()}{words[1:]}*"
        notebooks.write(path, notebooks.to_text(nb))


def table(path: Path) -> str:
    """Return the table of one chapter; raise a NotebookError for an objective that no exercise tests."""
    text = "\n\n".join(cell.source for cell in notebooks.read(path).cells if cell.cell_type == "markdown")
    tests, rows = exercises(path), []
    for number, words in objectives(text).items():
        if number not in tests:
            raise notebooks.NotebookError(f"{path.name}: no exercise tests objective {number}")
        rows.append(f"* - **{number}** {words}\n  - " + ", ".join(f"{{ref}}`{label}`" for label in tests[number]))
    head = "```{list-table}\n:header-rows: 1\n:widths: 55 45\n\n* - You will be able to\n  - Tested by\n"
    return head + "\n".join(rows) + "\n```"


def filled(page: str, book: Path) -> str:
    """Return the teacher's page with a table in place of each marker."""

    def chapter(match: re.Match[str]) -> str:
        path = next(iter(book.glob(f"{int(match[1]):02d}_*.ipynb")), None)
        return f"**Time:** {time(path)}\n\n{table(path)}" if path else MISSING

    return MARKER.sub(chapter, page)


def fill(root: Path) -> None:
    """Fill the teacher's page of a folder in place."""
    notebooks.write(root / PAGE, filled((root / PAGE).read_text(encoding="utf-8"), root / "book"))


if __name__ == "__main__":
    sys.stdout.write(filled((ROOT / PAGE).read_text(encoding="utf-8"), ROOT / "book"))
