"""The form of exercises, broken in every way once, and the edition without solutions down to its downloads."""

from __future__ import annotations

import copy
import shutil
from collections.abc import Callable
from pathlib import Path

import build_book
import exercises
import nbformat
import notebooks
import pytest
import scene_files

ROOT = Path(notebooks.__file__).resolve().parents[1]
CHECK = "print(check_number(my_order, 2))"
SECRET = "The order is two, since the first term cancels."
Cells = list[nbformat.NotebookNode]


def text(source: str, *tags: str) -> nbformat.NotebookNode:
    """A markdown cell."""
    return nbformat.v4.new_markdown_cell(source, metadata={"tags": list(tags)} if tags else {})


def code(source: str, *tags: str, said: str = "") -> nbformat.NotebookNode:
    """A code cell with what it printed."""
    outputs = [nbformat.v4.new_output("stream", name="stdout", text=said)] if said else []
    return nbformat.v4.new_code_cell(source, outputs=outputs, metadata={"tags": list(tags)} if tags else {})


def good() -> Cells:
    """The cells of a page with one exercise as it should be."""
    return [
        text("# Orders\n\nHow fast does an error fall?\n\n## Exercises"),
        code("from spectral_notes.checking import check_number"),
        text("```{exercise-start} Which order?\n:label: ex-orders-1\n```\n\nMeasure it.\n\n```{exercise-end}\n```", "objective-1.1"),
        code("my_order = ...", "answer"),
        code(CHECK, "hide-input", "check", said="Not attempted yet. Replace the dots, run that cell, then this one.\n"),
        text("```{solution-start} ex-orders-1\n:label: sol-orders-1\n:class: dropdown\n```", "solution"),
        code("my_order = 1 + 1", "solution"),
        text(SECRET, "solution"),
        code(CHECK, "solution", said="Right. The number is right.\n"),
        text("```{solution-end}\n```", "solution"),
        text("## Further reading"),
    ]


def faults(cells: Cells) -> str:
    """What is wrong with a page of the given cells, as one text."""
    return "\n".join(exercises.faults(nbformat.v4.new_notebook(cells=cells)))


def test_a_good_exercise_has_no_fault_and_all_its_parts() -> None:
    assert faults(good()) == ""
    (exercise,) = exercises.exercises(nbformat.v4.new_notebook(cells=good()))
    assert (exercise.label, exercise.title, exercise.objectives) == ("ex-orders-1", "Which order?", ("1.1",))
    assert [len(part) for part in (exercise.answers, exercise.checks, exercise.solution)] == [1, 1, 5]


def untag(n: int) -> Callable[[Cells], None]:
    """Take the tags off a cell."""
    return lambda cells: cells[n].metadata.update(tags=[])


def write(n: int, source: str, said: str | None = None) -> Callable[[Cells], None]:
    """Write something else into a cell, and as its output."""

    def change(cells: Cells) -> None:
        cells[n] = code(source, *exercises.tags(cells[n]), said=said or "")

    return change


BROKEN: list[tuple[Callable[[Cells], None], str]] = [
    (untag(2), "names no objective"),
    (untag(3), "has 0 answer cells and 1 check cells"),
    (untag(4), "has 1 answer cells and 0 check cells"),
    (lambda cells: cells[4].metadata.update(tags=["check"]), "shows the code of its check"),
    (write(3, "my_step = ..."), "asks for ['my_step'] and checks ['my_order']"),
    (write(3, "my_order = 2"), "without dots"),
    (write(4, CHECK, "Right. The number is right.\n"), "not told kindly"),
    (write(4, CHECK), "not told kindly"),
    (write(8, "print('Right.')", "Right.\n"), "word for word"),
    (write(8, CHECK, "Not right. Your number is 3.\n"), "its own check does not call right"),
    (lambda cells: cells.insert(9, code("more = 1", "solution")), "word for word"),
    (untag(7), "without the tag solution"),
    (lambda cells: cells.append(code("print(secret)")) or cells.insert(7, code("secret = 1", "solution")), "only a solution sets"),
]


@pytest.mark.parametrize(("damage", "named"), BROKEN, ids=[f"{n}-{case[1][:24]}" for n, case in enumerate(BROKEN)])
def test_what_is_wrong_with_an_exercise_is_named(damage: Callable[[Cells], None], named: str) -> None:
    cells = good()
    damage(cells)
    assert named in faults(cells)


def test_a_solution_is_left_out_by_its_marks_and_by_its_tag() -> None:
    cells = good()
    for cell in cells[6:9]:
        cell.metadata.pop("tags")
    stray = code("my_order = 2  # elsewhere", "solution")
    nb = nbformat.v4.new_notebook(cells=[*cells, stray])
    before = copy.deepcopy(nb)
    student = exercises.without_solutions(nb)
    assert [cell.source for cell in student.cells] == [cell.source for cell in [*good()[:5], good()[10]]]
    assert nb == before, "the notebook itself is left alone"


def test_the_rendered_students_edition_and_its_downloads_hold_no_solution(tmp_path: Path) -> None:
    root, executed = tmp_path / "root", tmp_path / "executed"
    notebooks.write(executed / "page.ipynb", notebooks.to_text(notebooks.normalise(nbformat.v4.new_notebook(cells=good()))))
    notebooks.write(root / "book" / "page.ipynb", notebooks.to_text(nbformat.v4.new_notebook(cells=good())))
    notebooks.write(root / "_toc.yml", "format: jb-book\nroot: book/page\n")
    shutil.copyfile(ROOT / "_config.yml", root / "_config.yml")
    for part in ("tools", "book/_static"):
        shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copyfile(ROOT / "book" / "references.bib", root / "book" / "references.bib")
    build_book.twins(executed, tmp_path / "student")
    scene_files.write_scenes(tmp_path / "student", tmp_path / "pages", tmp_path / "static")
    build_book.stage(root, tmp_path / "pages", tmp_path / "static", tmp_path / "source")
    assert build_book.render(tmp_path / "source", tmp_path) == 0
    html = tmp_path / "_build" / "html"
    page, download = (html / "book" / "page.html").read_text(), (html / "_sources" / "book" / "page.ipynb").read_text()
    assert "Which order?" in page and "Which order?" in download
    files = [path for path in html.rglob("*") if path.is_file()]
    assert not [path for path in files if SECRET[:30] in path.read_bytes().decode(errors="ignore")]
    assert "1 + 1" not in page and "my_order = 1" not in download
