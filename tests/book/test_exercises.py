"""The checks of the book's exercises: run as they stand in the chapters, on wrong answers and on unusual right ones."""

from __future__ import annotations

import ast
import builtins
import contextlib
import io
from functools import lru_cache
from pathlib import Path

import exercises
import notebooks
import pytest
from exercise_answers import RIGHT, SETTING, WRONG

from spectral_notes import checking

BOOK = Path(notebooks.__file__).resolve().parents[1] / "book"
PARTS = {ex.label: (path, ex) for path in sorted(BOOK.glob("[0-9]*.ipynb")) for ex in exercises.exercises(notebooks.read(path))}
CHECKS = {label: ex.checks[0].source for label, (_, ex) in PARTS.items() if ex.checks}
NONSENSE = {"number": -123.456, "list": [7.5] * 7, "word": "umbrella", "function": lambda *_: -123.456}


@lru_cache
def imports_of(path: Path) -> str:
    """The import statements of a chapter."""
    cells = [cell.source for _, cell in notebooks.code_cells(notebooks.read(path))]
    nodes = [node for source in cells for node in ast.parse(source).body if isinstance(node, ast.Import | ast.ImportFrom)]
    return "\n".join(ast.unparse(node) for node in nodes)


def given_cells(label: str) -> str:
    """The cells that an exercise gives before its answer."""
    path, exercise = PARTS[label]
    cells = notebooks.read(path).cells
    start = next(n for n, cell in enumerate(cells) if f":label: {label}\n" in cell.source and "{exercise-start}" in cell.source)
    stop = next(n for n, cell in enumerate(cells) if cell.get("id") == exercise.answers[0].get("id"))
    return "\n".join(cell.source for cell in cells[start:stop] if cell.cell_type == "code")


def reads(label: str) -> set[str]:
    """The names that a check takes from its chapter, beside what is imported there."""
    known = {*checking.__all__, *exercises.names_set(imports_of(PARTS[label][0])), *exercises.names_set(CHECKS[label])}
    return {name for name in exercises.names_used(CHECKS[label]) - known if not name.startswith("my_")} - set(dir(builtins))


def verdicts(label: str, answer: str) -> str:
    """What the check of an exercise prints after an answer; parts that it does not set stay placeholders."""
    path, exercise = PARTS[label]
    names: dict[str, object] = {}
    given = [SETTING.get(label, ""), given_cells(label)] if reads(label) or label in SETTING else []
    told = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()):
        for source in [imports_of(path), *given, *(cell.source for cell in exercise.answers), answer]:
            exec(source, names)
    with contextlib.redirect_stdout(told):
        exec(CHECKS[label], names)
    return told.getvalue()


@pytest.mark.parametrize(("label", "answer", "named"), WRONG, ids=[f"{n}-{case[0]}" for n, case in enumerate(WRONG)])
def test_a_wrong_answer_is_told_its_law(label: str, answer: str, named: str) -> None:
    told = verdicts(label, answer)
    assert "Not right." in told and "The law: " in told
    assert named in told


@pytest.mark.parametrize(("label", "answer"), RIGHT, ids=[f"{n}-{case[0]}" for n, case in enumerate(RIGHT)])
def test_an_unusual_right_answer_passes(label: str, answer: str) -> None:
    told = verdicts(label, answer)
    assert all(line.startswith("Right.") for line in told.splitlines()), told


def test_the_banks_are_as_large_as_promised() -> None:
    assert len(WRONG) >= 40 and len(RIGHT) >= 20
    assert {case[0] for case in [*WRONG, *RIGHT]} <= set(CHECKS)


@pytest.mark.parametrize("kind", NONSENSE)
@pytest.mark.parametrize("label", [label for label in CHECKS if not reads(label)])
def test_nonsense_is_never_right(label: str, kind: str) -> None:
    names: dict[str, object] = {}
    exec(imports_of(PARTS[label][0]), names)
    names |= dict.fromkeys(exercises.answer_names(PARTS[label][1]), NONSENSE[kind])
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        exec(CHECKS[label], names)
    assert told.getvalue().count("Not right.") == CHECKS[label].count("print(")
