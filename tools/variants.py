"""Variants of an assignment: the choices that a seed makes in the numbers, shapes, tasks and order of its questions.

A source keeps its choices in its first cell, which is raw and goes into no copy: YAML with `choices` (a list of groups;
of each group one member is taken, and its words stand where `<<name>>` stands), and `after` (questions that come after
others). `<<no:answer>>` is the number of a question. Without a seed the first of everything is taken.
"""

from __future__ import annotations

import copy
import re
from typing import Any

import nbformat
import numpy as np
import yaml

PLACE = re.compile(r"<<(no:)?([A-Za-z0-9_-]+)>>")
HEADING = re.compile(r"^## (\d+)\.(\d+) ", re.MULTILINE)


def settings(nb: nbformat.NotebookNode) -> dict[str, Any]:
    """Return the choices of a source, and what its answers must do without."""
    return {"choices": [], "after": {}, "without": {}} | yaml.safe_load(nb.cells[0].source)


def blocks(cells: list[nbformat.NotebookNode]) -> tuple[list[Any], list[list[Any]]]:
    """Return the opening cells, and the cells of each question."""
    opening: list[Any] = []
    questions: list[list[Any]] = []
    for cell in cells:
        if cell.cell_type == "markdown" and HEADING.match(cell.source):
            questions.append([])
        (questions[-1] if questions else opening).append(cell)
    return opening, questions


def name_of(block: list[Any]) -> str:
    """Return the name of the answer of a question."""
    return next(c.metadata.nbgrader.grade_id for c in block if c.metadata.get("nbgrader", {}).get("solution"))


def in_order(
    questions: list[list[Any]], after: dict[str, list[str]], rng: np.random.Generator | None
) -> list[list[Any]]:
    """Return the questions in an order that their dependences allow; the last one, in words, stays last."""
    if rng is None:
        return questions
    *left, last = questions
    done: list[list[Any]] = []
    while left:
        names = {name_of(block) for block in done}
        ready = [block for block in left if set(after.get(name_of(block), [])) <= names]
        done.append(ready[int(rng.integers(len(ready)))])
        left = [block for block in left if block is not done[-1]]
    return [*done, last]


def variant(source: nbformat.NotebookNode, seed: int | None = None) -> nbformat.NotebookNode:
    """Return the assignment that a seed makes of a source, solutions and hidden tests included."""
    nb = copy.deepcopy(source)
    chosen = settings(nb)
    rng = None if seed is None else np.random.default_rng(seed)
    words: dict[str, str] = {}
    for group in chosen["choices"]:
        member = group[0] if rng is None else group[int(rng.integers(len(group)))]
        words |= {key: str(value) for key, value in member.items()}
    opening, questions = blocks(nb.cells[1:])
    questions = in_order(questions, chosen["after"], rng)
    numbers = {}
    for place, block in enumerate(questions, start=1):
        block[0].source = HEADING.sub(lambda match, place=place: f"## {match[1]}.{place} ", block[0].source)
        match = HEADING.match(block[0].source)
        numbers[name_of(block)] = f"{match[1]}.{match[2]}" if match else ""
    nb.cells = [*opening, *(cell for block in questions for cell in block)]
    for cell in nb.cells:
        cell.source = PLACE.sub(lambda match: (numbers if match[1] else words)[match[2]], cell.source)
    return nb
