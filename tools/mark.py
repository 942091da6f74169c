"""Mark an assignment: from the archive of a learning platform to one table of grades, and a page for each student.

    python tools/mark.py 1_fourier submissions.zip --course course --students students.csv

Students are marked one by one, each in a process of its own, and a failure is a line in the table. Marks in words are
given in nbgrader's Formgrader, on the same folder; run the command without an archive afterwards, and the table and
the pages hold them. Run it with a newer archive, and the newest work of each student counts.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import json
import logging
import os
import re
import shutil
import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import nbformat
import notebooks
import offline_mathjax
import submissions
from judge import HIDDEN, Assignment, Limits, Marker, cell_settings
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.apps import NbGraderAPI
from nbgrader.coursedir import CourseDirectory
from nbgrader.preprocessors import (
    AssignLatePenalties,
    CheckCellMetadata,
    NbGraderPreprocessor,
    OverwriteCells,
    OverwriteKernelspec,
    SaveAutoGrades,
)
from traitlets.config import Config, PyFileConfigLoader

from spectral_notes.files import write_whole

ROOT = Path(__file__).resolve().parents[1]
IDENTITIES = ("Identifier", "ID", "ID number", "SIS User ID", "Username", "SIS Login ID", "Email address", "Student")
MATHJAX = "mathjax.js"
ELSEWHERE = re.compile(r"<script[^>]*src=\"https?://[^>]*mathjax[^>]*>\s*</script>", re.IGNORECASE)
LOCAL = f"<script>MathJax = {{tex: {{inlineMath: [['$', '$']]}}}};</script><script src='{MATHJAX}'></script>"


class Judge(NbGraderPreprocessor):
    """Stands where nbgrader would run the notebook: it writes the points and words of the judge under each question."""

    marker: ClassVar[Marker]

    def preprocess(self, nb: nbformat.NotebookNode, resources: Any) -> Any:
        """Mark a notebook."""
        marks = self.marker.marks(nb)
        for cell in nb.cells:
            name = cell_settings(cell).get("grade_id", "").removeprefix("check-")
            if cell.cell_type == "code" and cell_settings(cell).get("grade") and name in marks:
                cell.source = HIDDEN.sub("", cell.source)
                data = {"text/plain": f"{marks[name].earned:g}", "text/markdown": marks[name].markdown()}
                cell.outputs = [nbformat.v4.new_output("execute_result", data=data, execution_count=1)]
        return nb, resources


@dataclass
class Row:
    """A line of the table."""

    student: str
    status: str = "not handed in"
    notes: list[str] = field(default_factory=list)
    points: dict[str, float | None] = field(default_factory=dict)
    late: float = 0.0

    def cells(self, questions: list[str], assignment: str, by_hand: set[str]) -> dict[str, str]:
        """Return the columns of this line; the grade is empty until every question is marked."""
        automatic = [self.points.get(q) for q in questions if q not in by_hand]
        manual = [self.points.get(q) for q in questions if q in by_hand]
        done = self.status == "marked"
        whole = done and None not in manual
        total = max(0.0, sum(p or 0 for p in [*automatic, *manual]) - self.late)
        columns = {
            assignment: f"{total:g}" if whole else "",
            "automatic": f"{sum(p or 0 for p in automatic):g}" if done else "",
            "by hand": f"{sum(p or 0 for p in manual):g}" if whole else "",
            "late penalty": f"{self.late:g}" if done else "",
            "status": "mark the words by hand" if done and not whole else self.status,
            "notes": "; ".join(self.notes),
        }
        return columns | {q: "" if (p := self.points.get(q)) is None else f"{p:g}" for q in questions}


# --- one student after the other ------------------------------------------------------------------------------------


def settings(course: Path) -> Config:
    """Return the configuration of nbgrader for a course, with the judge in place of its own execution."""
    config = PyFileConfigLoader("nbgrader_config.py", path=str(course)).load_config()
    config.CourseDirectory.root = str(course)
    config.Autograde.sanitize_preprocessors = [OverwriteKernelspec, OverwriteCells, CheckCellMetadata]
    config.Autograde.autograde_preprocessors = [Judge, SaveAutoGrades, AssignLatePenalties, CheckCellMetadata]
    for library in ("jquery_url", "require_js_url", "mermaid_js_url", "jupyter_widgets_base_url"):
        config.HTMLExporter[library] = ""
    config.NbGrader.logfile = ""
    return config


def api(course: Path) -> NbGraderAPI:
    """Return nbgrader's interface to a course."""
    config = settings(course)
    made = NbGraderAPI(coursedir=CourseDirectory(config=config), config=config)
    made.log.setLevel(logging.CRITICAL)
    return made


@contextlib.contextmanager
def inside(course: Path) -> Iterator[None]:
    """Work in the folder of the course, quietly."""
    before, level = Path.cwd(), logging.root.manager.disable
    os.chdir(course)
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of SQLAlchemy about nbgrader, and of nbformat about ids
            yield
    finally:
        os.chdir(before)
        logging.disable(level)


def take(course: Path, assignment: str, submission: submissions.Submission) -> list[str]:
    """Store a submission, mended, where nbgrader looks for it, and return what is to be said; older work stays away."""
    release = next((course / "release" / assignment).glob("*.ipynb"))
    folder = course / "submitted" / submission.student / assignment
    stamp = folder / "timestamp.txt"
    if stamp.exists() and stamp.read_text().strip() > f"{submission.time} UTC":
        return ["what was marked before is newer: it counts"]
    nb, notes = submissions.mended(submissions.read(submission.data), notebooks.read(release))
    notebooks.write(folder / release.name, notebooks.to_text(nb))
    write_whole(stamp, lambda place: place.write_text(f"{submission.time} UTC\n", encoding="utf-8"))
    (folder / "notes.json").write_text(json.dumps(notes), encoding="utf-8")
    return notes


def mark(course: Path, assignment: str, archive: Path | None, limits: Limits | None = None) -> dict[str, Row]:
    """Mark all that is in an archive, and return the lines of everybody who ever handed in."""
    if not (course / "source" / assignment).is_dir():
        known = ", ".join(sorted(path.name for path in (course / "source").glob("*")))
        raise ValueError(
            f"there is no assignment {assignment!r} in {course}; there are: {known or 'none, run make course'}"
        )
    made = json.loads((course / "course.json").read_text(encoding="utf-8"))
    newest, said = submissions.collected(archive) if archive else ({}, {})
    if archive and not said:
        raise ValueError(
            f"no file in {archive} is named as Moodle, Canvas or Blackboard name them, nor lies in a folder"
        )
    rows = {student: Row(student, "failed", list(notes)) for student, notes in said.items()}
    source = notebooks.read(next((course / "source" / assignment).glob("*.ipynb")))
    if newest:
        with (
            Marker(Assignment(source, made["without"][assignment], made["seed"] or 0), limits) as marker,
            inside(course),
        ):
            Judge.marker = marker
            grader = api(course)
            for student in sorted(newest):
                start = time.monotonic()
                row = rows[student]
                try:
                    row.notes += take(course, assignment, newest[student])
                    result = grader.autograde(assignment, student, force=True, create=True)
                    if not result["success"]:
                        raise ValueError(f"nbgrader: {result.get('error', '').strip().splitlines()[-1:]}")
                    row.status = "marked"
                except Exception as error:
                    row.notes.append(" ".join(str(error).split())[:300] or type(error).__name__)
                sys.stderr.write(f"{student}: {row.status}, {time.monotonic() - start:.1f} s\n")
    for student, row in rows.items():
        if row.status == "failed" and not row.notes:
            row.notes.append("no notebook")
        if row.status == "failed" and (course / "submitted" / student / assignment).exists():
            row.notes.append("the marks of the work handed in before were kept")
            row.status = "marked"
    for folder in sorted(course.glob(f"submitted/*/{assignment}")):
        notes = json.loads((folder / "notes.json").read_text()) if (folder / "notes.json").exists() else []
        rows.setdefault(folder.parent.name, Row(folder.parent.name, "marked", notes))
    return read_scores(course, assignment, rows)


def read_scores(course: Path, assignment: str, rows: dict[str, Row]) -> dict[str, Row]:
    """Fill in what the gradebook knows."""
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        for row in rows.values():
            with contextlib.suppress(MissingEntry):
                submission = book.find_submission(assignment, row.student)
                grades = [grade for notebook in submission.notebooks for grade in notebook.grades]
                row.points = {g.name: None if g.needs_manual_grade and g.manual_score is None and g.auto_score is None
                              else g.score for g in grades}
                row.late = float(submission.late_submission_penalty or 0)
    return rows


# --- the table and the pages ----------------------------------------------------------------------------------------


def roster(path: Path | None) -> tuple[list[str], list[dict[str, str]]]:
    """Return the columns and lines of a list of students, as a platform exports it."""
    if path is None:
        return [], []
    try:
        lines = list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8-sig"))))
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"the list of students must be a CSV file in UTF-8; {error}") from None
    columns = [name for name in (lines[0] if lines else {}) if name]
    if not set(columns) & set(IDENTITIES):
        raise ValueError(f"the list of students must have one of the columns {', '.join(IDENTITIES)}; it has {columns}")
    return columns, lines


def table(rows: dict[str, Row], assignment: str, course: Path, students: Path | None) -> str:
    """Return the table of grades: what identifies a student on the platforms, the grade, and all behind it."""
    source = notebooks.read(next((course / "source" / assignment).glob("*.ipynb")))
    graded = [cell for cell in source.cells if cell_settings(cell).get("grade")]
    questions = [cell_settings(cell)["grade_id"] for cell in graded]
    by_hand = {cell_settings(cell)["grade_id"] for cell in graded if cell.cell_type == "markdown"}
    columns, lines = roster(students)
    columns = columns or ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Identifier"]
    left = dict(rows)
    found = []
    for line in lines:
        names = [line.get(name, "") for name in IDENTITIES if line.get(name)]
        keys = [submissions.UNSAFE.sub("_", name.removeprefix("Participant ").strip()) for name in names]
        row = next((left.pop(key) for key in keys if key in left), Row(keys[0] if keys else ""))
        found.append((line, row))
    for row in left.values():
        number = row.student if row.student.isdigit() else ""
        line = dict.fromkeys(columns, "") | {columns[0]: row.student}
        filled = {
            "Student": row.student,
            "ID": number,
            "Identifier": f"Participant {number}" if number else row.student,
        }
        if students is not None:
            row.notes.append("not on the list of students")
        found.append((line | {key: value for key, value in filled.items() if key in columns}, row))
    own = list(Row("").cells(questions, assignment, by_hand))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns + [name for name in own if name not in columns], lineterminator="\n")
    writer.writeheader()
    for line, row in found:
        safe = {key: value for key, value in line.items() if key in columns}
        writer.writerow(safe | {k: _plain(v) for k, v in row.cells(questions, assignment, by_hand).items()})
    return text.getvalue()


def _plain(value: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{value}" if value.startswith(("=", "+", "@")) else value


def give_back(course: Path, assignment: str, students: list[str]) -> list[str]:
    """Make a page for each student, which needs no network, and return whose could not be made."""
    failed = []
    with inside(course):
        grader = api(course)
        for student in students:
            result = grader.generate_feedback(assignment, student, force=True)
            folder = course / "feedback" / student / assignment
            if not result["success"] or not folder.is_dir():
                failed.append(student)
            else:
                for page in folder.glob("*.html"):
                    notebooks.write(page, ELSEWHERE.sub(LOCAL, page.read_text(encoding="utf-8")))
                shutil.copy(offline_mathjax.mathjax_folder() / "tex-svg-full.js", folder / MATHJAX)
    return failed


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("assignment", help="its name, such as 1_fourier")
    parser.add_argument(
        "archive", type=Path, nargs="?", help="a zip archive or a folder; without it, only table and pages"
    )
    parser.add_argument("--course", type=Path, default=ROOT / "course", help="the folder that make course made")
    parser.add_argument("--students", type=Path, help="a CSV file, as the platform exports it: who should hand in")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long one call of a function may take")
    options = parser.parse_args(arguments)
    course = options.course.resolve() / "teacher"
    try:
        roster(options.students)
        archive = options.archive.resolve() if options.archive else None
        rows = mark(course, options.assignment, archive, Limits(options.seconds, 2 * options.seconds))
        text = table(rows, options.assignment, course, options.students)
    except ValueError as error:
        sys.stderr.write(f"mark: {error}\n")
        return 2
    target = course / f"grades_{options.assignment}.csv"
    notebooks.write(target, text)
    marked = sorted(row.student for row in rows.values() if row.status == "marked")
    failed = give_back(course, options.assignment, marked)
    for student in failed:
        sys.stderr.write(f"mark: no page for {student}\n")
    sys.stderr.write(f"mark: {len(marked)} marked, {len(rows) - len(marked)} failed; {target}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
