"""The exercises of a chapter: their parts, what is wrong with them, and the notebook without their solutions.

An exercise is a run of cells:

    {exercise-start}        markdown, tagged objective-N.M; perhaps code that gives data
    answer                  code: names that begin with my_, each set to `...` or a function whose body is `...`
    check                   code, folded by hide-input: prints the verdicts on these names
    {solution-start}        markdown; from here to {solution-end} every cell is tagged solution
    solution                code that sets the same names, discussion, and last the check once more, word for word
"""

from __future__ import annotations

import ast
import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass

import nbformat

SOLUTION_START, SOLUTION_END = "{solution-start}", "{solution-end}"


@dataclass(frozen=True)
class Exercise:
    """One exercise: its label, title and objectives, and its cells."""

    label: str
    title: str
    objectives: tuple[str, ...]
    answers: tuple[nbformat.NotebookNode, ...]
    checks: tuple[nbformat.NotebookNode, ...]
    solution: tuple[nbformat.NotebookNode, ...]


def tags(cell: nbformat.NotebookNode) -> list[str]:
    """Return the tags of a cell."""
    return list(cell.metadata.get("tags", []))


def in_solution(cells: list[nbformat.NotebookNode]) -> list[bool]:
    """Say of each cell whether it belongs to a solution: it stands between the two marks, or carries the tag."""
    inside, marks = False, []
    for cell in cells:
        inside = inside or (cell.cell_type == "markdown" and SOLUTION_START in cell.source)
        marks.append(inside or "solution" in tags(cell))
        inside = inside and not (cell.cell_type == "markdown" and SOLUTION_END in cell.source)
    return marks


def without_solutions(nb: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return a copy of a notebook without its solutions."""
    student = copy.deepcopy(nb)
    student.cells = [cell for cell, hidden in zip(student.cells, in_solution(nb.cells), strict=True) if not hidden]
    return student


def exercises(nb: nbformat.NotebookNode) -> list[Exercise]:
    """Return the exercises of a notebook in their order."""
    starts = [n for n, cell in enumerate(nb.cells) if "{exercise-start}" in cell.source]
    last = next((n for n, cell in enumerate(nb.cells) if re.search(r"^## Further reading", cell.source, re.M)), None)
    solved = in_solution(nb.cells)
    found = []
    for start, stop in zip(starts, [*starts[1:], last], strict=True):
        opening, cells = nb.cells[start], list(zip(nb.cells[start:stop], solved[start:stop], strict=True))
        title = re.search(r"\{exercise-start\} *(.*)\n:label: (\S+)", opening.source)
        found.append(Exercise(
            label=title[2] if title else "",
            title=title[1] if title else "",
            objectives=tuple(t.removeprefix("objective-") for t in tags(opening) if t.startswith("objective-")),
            answers=tuple(cell for cell, hidden in cells if not hidden and "answer" in tags(cell)),
            checks=tuple(cell for cell, hidden in cells if not hidden and "check" in tags(cell)),
            solution=tuple(cell for cell, hidden in cells if hidden),
        ))
    return found


# --- what is wrong --------------------------------------------------------------------------------------------------


def names_set(source: str) -> set[str]:
    """Return the names that a cell sets at its top level or in a loop there."""
    nodes = list(ast.walk(ast.parse(source)))
    stored = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    defined = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    imported = (alias for node in nodes if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names)
    return stored | defined | {(alias.asname or alias.name).split(".")[0] for alias in imported}


def names_used(source: str) -> set[str]:
    """Return the names that a cell reads, without the arguments of its functions."""
    nodes = list(ast.walk(ast.parse(source)))
    loaded = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    return loaded - {node.arg for node in nodes if isinstance(node, ast.arg)}


def answer_names(exercise: Exercise) -> set[str]:
    """Return the names that a student is asked to set."""
    return {name for cell in exercise.answers for name in names_set(cell.source) if name.startswith("my_")}


def printed(cell: nbformat.NotebookNode) -> list[str]:
    """Return the lines that a cell printed."""
    return "".join(output.get("text", "") for output in cell.outputs if output.output_type == "stream").splitlines()


def exercise_faults(exercise: Exercise) -> Iterator[str]:
    """Yield what is wrong with one exercise."""
    if not exercise.objectives:
        yield "names no objective in its tags"
    if not exercise.answers or len(exercise.checks) != 1:
        yield f"has {len(exercise.answers)} answer cells and {len(exercise.checks)} check cells; one check is asked for"
        return
    check, asked = exercise.checks[0], answer_names(exercise)
    if "hide-input" not in tags(check):
        yield "shows the code of its check; the tag hide-input folds it"
    used = {name for name in names_used(check.source) if name.startswith("my_")}
    if not asked or used != asked:
        yield f"asks for {sorted(asked)} and checks {sorted(used)}"
    if any("..." not in cell.source for cell in exercise.answers):
        yield "has an answer cell without dots to be replaced"
    if not printed(check) or not all(line.startswith("Not attempted yet.") for line in printed(check)):
        yield f"is not told kindly that it was not attempted: {printed(check)}"
    code = [cell for cell in exercise.solution if cell.cell_type == "code"]
    if not code or code[-1].source != check.source:
        yield "does not end its solution with the check, word for word"
    elif not printed(code[-1]) or not all(line.startswith("Right.") for line in printed(code[-1])):
        yield f"has a solution that its own check does not call right: {printed(code[-1])}"
    if any("solution" not in tags(cell) for cell in exercise.solution):
        yield "has a cell in its solution without the tag solution"


def faults(nb: nbformat.NotebookNode) -> list[str]:
    """Return everything that is wrong with the exercises of a notebook, one sentence each."""
    found = [f"{ex.label} {fault}" for ex in exercises(nb) for fault in exercise_faults(ex)]
    hidden = in_solution(nb.cells)
    known: set[str] = set()
    secret: set[str] = set()
    for cell, in_one in zip(nb.cells, hidden, strict=True):
        if cell.cell_type != "code":
            continue
        if in_one:
            secret |= names_set(cell.source)
            continue
        missing = (names_used(cell.source) - names_set(cell.source) - known) & secret
        found += [f"{cell.source[:40]!r} reads {name}, which only a solution sets" for name in sorted(missing)]
        known |= names_set(cell.source)
    return found
