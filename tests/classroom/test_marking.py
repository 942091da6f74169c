"""A classroom that holds: variants, the process that runs students' code, submissions, and the run from archive to grades."""

from __future__ import annotations

import contextlib
import csv
import re
import zipfile
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import course as course_tool
import judge
import mark
import nbformat
import notebooks
import numpy as np
import pytest
import scipy.sparse as sp
import submissions
import twenty
import variants
import worker

NOW = datetime(2026, 5, 1, 12, 0, 0)


def assignment(name: str, seed: int | None = None) -> judge.Assignment:
    """Return an assignment in a variant."""
    source = notebooks.read(next((course_tool.SOURCE / name).glob("*.ipynb")))
    return judge.Assignment(variants.variant(source, seed), variants.settings(source)["without"], seed or 0)


# --- variants -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_the_solutions_earn_all_points_in_every_variant(seed: int | None) -> None:
    assert course_tool.faults(seed) == []


def test_a_fault_of_a_variant_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "MARKERS", re.compile(r"k = k % N\n *|^ *### (?:BEGIN|END) SOLUTION\n?", re.MULTILINE))
    assert any("alias" in fault for fault in course_tool.faults(0))


def test_variants_differ_and_nothing_is_left_to_fill_in() -> None:
    for path in sorted(course_tool.SOURCE.glob("*/*.ipynb")):
        source = notebooks.read(path)
        made = [variants.variant(source, seed) for seed in range(4)]
        texts = ["\n".join(cell.source for cell in nb.cells) for nb in made]
        assert len(set(texts)) == 4
        assert not any("<<" in text for text in texts)
        assert notebooks.to_text(variants.variant(source, 3)) == notebooks.to_text(made[3])
        points = [sorted(judge.cell_settings(c).get("points", 0) for c in nb.cells) for nb in made]
        assert all(found == points[0] for found in points)


def test_questions_come_after_those_they_build_on() -> None:
    source = notebooks.read(next((course_tool.SOURCE / "2_curvature").glob("*.ipynb")))
    orders = []
    for seed in range(6):
        nb = variants.variant(source, seed)
        order = [judge.cell_settings(c)["grade_id"] for c in nb.cells if judge.cell_settings(c).get("solution")]
        assert order.index("angles") < order.index("defects") < order.index("gaussian")
        assert order[-1] == "written-dent"
        headings = [c.source.split()[1] for c in nb.cells if c.cell_type == "markdown" and c.source.startswith("## ")]
        assert headings == [f"2.{place}" for place in range(1, 9)]
        orders.append(tuple(order))
    assert len(set(orders)) > 3


# --- the other process ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value",
    [None, True, 3, 2.5, "word", 1 + 2j, np.float32(2), np.arange(6).reshape(2, 3), [1, [2, 3]], (np.eye(2), 4), ["a", None]],
    ids=str,
)
def test_values_come_back_as_they_were(value: object) -> None:
    back = worker.decode(worker.json.loads(worker.json.dumps(worker.encode(value))))
    assert str(back) == str(np.asarray(value) if isinstance(value, complex | np.generic) else value)


def test_sparse_matrices_come_back_and_strange_things_do_not() -> None:
    back = worker.decode(worker.encode(sp.csr_matrix(np.diag([1.0, 0, 2]))))
    assert back.toarray().tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 2]]
    assert worker.decode(worker.encode(...)) is Ellipsis
    assert worker.decode(worker.encode({1: 2})).name == "dict"
    pair = np.empty(2, dtype=object)
    pair[:] = [sp.eye_array(2), 3]
    assert worker.decode(worker.encode(pair))[0].shape == (2, 2)


@pytest.fixture(scope="module")
def template() -> Iterator[judge.Template]:
    """Return a process that has run the set-up of assignment 1."""
    made = judge.Template(assignment("1_fourier").setup)
    yield made
    made.close()


def called(template: judge.Template, code: str, *inputs: object, without: tuple[str, ...] = ()) -> dict[str, object]:
    """Return what came of calling `f` of a cell, with limits of a second."""
    with contextlib.closing(judge.Reading(template, [code], {}, judge.Limits(1.0, 2.0))) as reading:
        return reading.call("f", inputs, list(without))


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        (f"def f(): return open({str(course_tool.SOURCE / '1_fourier' / 'fourier.ipynb')!r}).read()", "PermissionError"),
        (f"import os\ndef f(): return os.listdir({str(course_tool.ROOT / 'tests')!r})", "PermissionError"),
        ("import os\ndef f(): return os.listdir('..')", "PermissionError"),
        ("import subprocess\ndef f(): return subprocess.run(['ls'])", "PermissionError"),
        ("import os\ndef f(): return os.system('ls')", "PermissionError"),
        ("import os\ndef f(): return os.kill(os.getppid(), 9)", "PermissionError"),
        ("import socket\ndef f(): return socket.create_connection(('127.0.0.1', 9), 1)", "PermissionError"),
        ("def f():\n    while True: pass", "TimeoutError"),
        ("def f(): return np.empty(10**10)", "MemoryError"),
        ("import os\ndef f(): os._exit(0)", "NoAnswer"),
        ("import signal\ndef f():\n    signal.setitimer(0, 0)\n    while True: pass", "NoAnswer"),
        ("def f(): return input()", "EOFError"),
        ("def f(): return sp.csr_array(np.eye(2)) + 1e-9", "NotImplementedError"),
    ],
    ids=lambda value: value[-40:],
)
def test_what_is_refused_while_work_is_marked(template: judge.Template, code: str, kind: str) -> None:
    reply = called(template, code)
    assert reply["raised"][0] == kind, reply
    assert not reply["stub"]


def test_the_kernel_refuses_what_python_lets_pass(template: judge.Template) -> None:
    if not worker.landlock_version():
        pytest.skip("this kernel has no Landlock")
    path = str(course_tool.SOURCE / "1_fourier" / "fourier.ipynb")
    code = f"import ctypes\ndef f(): return ctypes.CDLL(None).open({path!r}.encode(), 0)"
    assert called(template, code)["value"] == -1
    assert called(template, code.replace(path, np.__file__))["value"] > 2


def test_a_function_may_write_and_read_beside_itself(template: judge.Template) -> None:
    assert called(template, "def f():\n    open('a.txt', 'w').write('b')\n    return open('a.txt').read()")["value"] == "b"


def test_modules_that_a_question_does_without(template: judge.Template) -> None:
    code = "from numpy.fft import fft as g\ndef f(x): return g(x)"
    assert "it calls numpy.fft" in called(template, code, np.ones(4), without=("numpy.fft",))["raised"][1]
    assert "value" in called(template, code, np.ones(4))


@pytest.fixture(scope="module")
def marker() -> Iterator[judge.Marker]:
    """Return what marks assignment 1."""
    with judge.Marker(assignment("1_fourier"), judge.Limits(2.0, 4.0)) as made:
        yield made


# --- fair marks -----------------------------------------------------------------------------------------------------


def earned(name: str, changes: dict[str, str], own: tuple[str, ...] = ()) -> dict[str, judge.Mark]:
    """Return the marks of a solved copy of an assignment, with some answers changed and cells put before all others."""
    marked = assignment(name)
    source = variants.variant(notebooks.read(next((course_tool.SOURCE / name).glob("*.ipynb"))))
    nb = twenty.solved(source, source)
    for cell in nb.cells:
        cell.source = changes.get(judge.cell_settings(cell).get("grade_id"), cell.source)
    nb.cells = [*map(twenty.own, own), *nb.cells]
    with judge.Marker(marked, judge.Limits(2.0, 4.0)) as marker:
        return marker.marks(nb)


def test_one_slip_is_paid_once() -> None:
    angles = "def corner_angles(vertices, faces):\n    c = vertices[faces]\n    u, w = np.roll(c, -1, 1) - c, np.roll(c, 1, 1) - c\n"
    angles += "    s = np.linalg.norm(np.cross(u, w), axis=2)\n    return np.degrees(np.arctan2(s, (u * w).sum(axis=2)))"
    marks = earned("2_curvature", {"angles": angles})
    assert {name: mark.points - mark.earned for name, mark in marks.items() if mark.earned < mark.points} == {"angles": 2}
    assert any("degrees" in words for words in marks["angles"].said)
    assert any("right answers to the other questions" in words for words in marks["defects"].said)


def test_what_the_set_up_holds_earns_nothing() -> None:
    returns = {
        "matrix": "def functional_map(*_): return C_12",
        "round": "def zoomout_round(*_): return p2p_21",
        "fit": "def fitted_map(*_): return exact",
        "points": "def point_map(*_): return truth",
    }
    marks = earned("6_maps", returns)
    assert [marks[name].earned for name in returns] == [0, 0, 0, 0]
    assert sum(mark.earned for name, mark in marks.items() if name not in returns) == 12


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("def alias(k, N):\n    # your code here\n    ...", "Not attempted yet."),
        ("def alias(k, N):\n    k = k % N\n    min(k, N - k)", "Is a return missing?"),
        ("def alias(k, N):\n    return np.array(k).no_such", "It raises AttributeError"),
        ("def alias(k, N)\n    return 1", "The cell of the answer does not run."),
        ("def other(k, N):\n    return 1", "there is no function alias"),
        ("def alias(k, N):\n    return k % N", "For 7, 8: Your number is 7."),
    ],
)
def test_what_is_said_of_an_answer(marker: judge.Marker, code: str, says: str) -> None:
    cell = nbformat.v4.new_code_cell(code, metadata={"nbgrader": {"grade_id": "alias", "grade": False}})
    mark = marker.marks(nbformat.v4.new_notebook(cells=[cell]))["alias"]
    assert mark.earned < mark.points
    assert any(says in words for words in mark.said), mark.said


# --- submissions ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("file", "student", "platform"),
    [
        ("Ann Bee_1234567_assignsubmission_file_/fourier.ipynb", "1234567", "Moodle"),
        ("Ann Bee_1234567_assignsubmission_file_fourier.ipynb", "1234567", "Moodle"),
        ("course-1/Ann_B_1234567_assignsubmission_file_/sub/fourier (2).ipynb", "1234567", "Moodle"),
        ("beeann_LATE_4711_998_fourier-2.ipynb", "4711", "Canvas"),
        ("beeann_4711_998_fourier.ipynb", "4711", "Canvas"),
        ("gradebook_MA1_Sheet20one_abee12_attempt_2026-05-01-10-00-00_fourier.ipynb", "abee12", "Blackboard"),
        ("Sheet one_abee12_attempt_2026-05-01-10-00-00_fourier.ipynb", "abee12", "Blackboard"),
        ("S07/fourier.ipynb", "S07", "folder"),
        ("all/S07/fourier.ipynb", "S07", "folder"),
        ("../../S07/fourier.ipynb", "S07", "folder"),
        ("a;b c/fourier.ipynb", "a_b_c", "folder"),
    ],
)
def test_whose_file_it_is(file: str, student: str, platform: str) -> None:
    found = submissions.parsed(file, NOW, b"")
    assert found is not None
    assert (found.student, found.platform) == (student, platform)


@pytest.mark.parametrize("file", ["fourier.ipynb", "__MACOSX/S1/fourier.ipynb", "S1/.ipynb_checkpoints/fourier.ipynb", "S1/.hidden"])
def test_a_file_of_nobody(file: str) -> None:
    assert submissions.parsed(file, NOW, b"") is None


def test_the_newest_attempt_counts(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as packed:
        for name in ("x_7_31_a-1.ipynb", "x_7_31_a-2.ipynb", "x_7_30_a.ipynb"):
            packed.writestr(name, name)
        packed.writestr("S_8_attempt_2026-05-02-10-00-00_a.ipynb", "new")
        packed.writestr("S_8_attempt_2026-05-01-10-00-00_a.ipynb", "old")
        packed.writestr("S_8_attempt_2026-05-01-10-00-00.txt", "slip")
    newest, said = submissions.collected(tmp_path / "a.zip")
    assert newest["7"].data == b"x_7_31_a-2.ipynb"
    assert newest["8"].data == b"new"
    assert len(said["8"]) == 1


def test_an_archive_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_text("no")
    with pytest.raises(ValueError, match=r"a\.zip must be a zip archive or a folder"):
        submissions.collected(tmp_path / "a.zip")


@pytest.mark.parametrize(("data", "says"), [(b"", "no notebook"), (b"{", "no notebook"), (b"\xff\xfe", "no notebook"), (b"[1]", "cannot be read")])
def test_a_file_that_is_no_notebook(data: bytes, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        submissions.read(data)


def test_a_notebook_of_something_else() -> None:
    release = variants.variant(notebooks.read(next((course_tool.SOURCE / "1_fourier").glob("*.ipynb"))))
    other = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("1 + 1")])
    with pytest.raises(ValueError, match="no cell of this assignment"):
        submissions.mended(other, release)


# --- from the archive to the table ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def marked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, str]]]:
    """Return a course in which twenty submissions were marked, and the lines of the table."""
    folder = tmp_path_factory.mktemp("course")
    assert course_tool.write_teacher(folder / "teacher", 7, only=twenty.ASSIGNMENT) == 0
    archive, students = twenty.make(folder)
    arguments = [twenty.ASSIGNMENT, str(archive), "--course", str(folder), "--students", str(students), "--seconds", "2"]
    assert mark.main(arguments) == 0
    return folder, read(folder)


def read(folder: Path) -> list[dict[str, str]]:
    """Return the lines of the table."""
    with (folder / "teacher" / f"grades_{twenty.ASSIGNMENT}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
@pytest.mark.parametrize("student", twenty.KINDS)
def test_each_kind_of_submission_gets_what_it_is_worth(marked: tuple[Path, list[dict[str, str]]], student: str) -> None:
    row = next(row for row in marked[1] if row["Full name"] == student)
    points = twenty.KINDS[student][1]
    assert row["automatic"] == ("" if points is None else f"{points:g}"), row
    assert (row["status"] in ("marked", "mark the words by hand")) == (points is not None)
    assert points is not None or row["status"] == "not handed in" or row["notes"]


@pytest.mark.slow
def test_the_table_has_the_columns_of_the_platform(marked: tuple[Path, list[dict[str, str]]]) -> None:
    assert list(marked[1][0])[:4] == ["Identifier", "Full name", "Email address", twenty.ASSIGNMENT]
    assert [row["Full name"] for row in marked[1]] == list(twenty.KINDS)
    assert next(row for row in marked[1] if row["Full name"] == "S02")[twenty.ASSIGNMENT] == "0"
    assert next(row for row in marked[1] if row["Full name"] == "S01")[twenty.ASSIGNMENT] == ""


@pytest.mark.slow
def test_the_pages_need_no_network_and_show_no_hidden_test(marked: tuple[Path, list[dict[str, str]]]) -> None:
    pages = sorted((marked[0] / "teacher" / "feedback").glob("*/*/*.html"))
    assert len(pages) == 17
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert "HIDDEN" not in text
        assert not re.findall(r'(?:src|href)="(?:https?:)?//[^"]+\.(?:js|css)', text)
        assert (page.parent / mark.MATHJAX).exists()
        assert "points." in text


@pytest.mark.slow
def test_marking_again_takes_the_newest_and_gives_marks_by_hand(
    marked: tuple[Path, list[dict[str, str]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, rows = marked
    give_back = mark.give_back
    monkeypatch.setattr(mark, "give_back", lambda *given: give_back(*given[:2], ["1001"]))  # one page for all
    release = notebooks.read(next((folder / "teacher" / "release" / twenty.ASSIGNMENT).glob("*.ipynb")))
    source = notebooks.read(next((folder / "teacher" / "source" / twenty.ASSIGNMENT).glob("*.ipynb")))
    for student, text in (("1002", notebooks.to_text(twenty.solved(source, release))), ("1010", "{")):
        (tmp_path / "again" / student).mkdir(parents=True)
        (tmp_path / "again" / student / "fourier.ipynb").write_text(text, encoding="utf-8")
    with mark.Gradebook(f"sqlite:///{folder / 'teacher' / 'gradebook.db'}") as book:
        grade = book.find_grade("written-noise", "fourier", twenty.ASSIGNMENT, "1001")
        grade.manual_score, grade.needs_manual_grade = 4, False
        book.db.commit()
    list_of = ["--students", str(folder / "students.csv")]
    assert mark.main([twenty.ASSIGNMENT, str(tmp_path / "again"), "--course", str(folder), *list_of]) == 0
    after = {row["Full name"]: row for row in read(folder)}
    assert after["S02"]["automatic"] == "35"
    assert (after["S10"]["automatic"], after["S10"]["status"]) == ("31", "mark the words by hand")
    assert "handed in before were kept" in after["S10"]["notes"]
    assert (after["S01"]["by hand"], after["S01"][twenty.ASSIGNMENT]) == ("4", "39")
    page = next((folder / "teacher" / "feedback" / "1001").glob("*/*.html")).read_text(encoding="utf-8")
    assert "(Score: 39.0 / 40.0)" in page
    untouched = {"S03", "S16", "S17", "S19"}
    assert {s: after[s]["automatic"] for s in untouched} == {r["Full name"]: r["automatic"] for r in rows if r["Full name"] in untouched}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["9_none", "x.zip"], "there is no assignment '9_none'"),
        (["1_fourier", "nowhere.zip", "--students", "nowhere.csv"], "list of students must be a CSV file"),
    ],
)
def test_what_cannot_be_marked_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str) -> None:
    assert mark.main([*arguments, "--course", str(tmp_path)]) == 2
    assert says in capsys.readouterr().err


# --- the folders ----------------------------------------------------------------------------------------------------


def test_the_students_folder_holds_no_solution(tmp_path: Path) -> None:
    release = tmp_path / "release" / "1_fourier"
    release.mkdir(parents=True)
    (release / "fourier.ipynb").write_text("{}")
    for name in (".git/config", "book/old.ipynb", "old.md"):
        notebooks.write(tmp_path / "students" / name, "old")
    course_tool.write_students(tmp_path / "students", tmp_path / "release")
    assert (tmp_path / "students" / ".git" / "config").exists() and not (tmp_path / "students" / "book" / "old.ipynb").exists()
    names = {path.name for path in (tmp_path / "students").iterdir()}
    assert names == {".git", "LICENSE", "README.md", "assignments", "book", "pyproject.toml", "requirements.txt", "spectral_notes"}
    chapters = sorted((tmp_path / "students" / "book").glob("*.ipynb"))
    assert len(chapters) >= 12
    for path in chapters:
        assert "{solution-start}" not in path.read_text(encoding="utf-8")


def test_sources_are_in_normal_form_and_the_command_brings_them_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(course_tool, "SOURCE", tmp_path)
    path = next((twenty.course_tool.ROOT / "classroom" / "source").glob("1*/*.ipynb"))
    nb = notebooks.read(path)
    for _, cell in notebooks.code_cells(nb):
        cell.execution_count, cell.metadata["collapsed"] = 3, True
        cell.outputs = [nbformat.v4.new_output("stream", text="x")]
    notebooks.write(tmp_path / "1_fourier" / path.name, notebooks.to_text(nb))
    assert len(course_tool.normal_form()) == 1
    assert (tmp_path / "1_fourier" / path.name).read_text(encoding="utf-8") == path.read_text(encoding="utf-8")
    assert course_tool.normal_form() == []
