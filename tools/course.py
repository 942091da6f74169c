"""Make a course: a folder for students, without solutions, and one for the teacher.

    python tools/course.py course --seed 7

`course/students` can be given away as it is, as a repository or a zip. `course/teacher` is a course of nbgrader: the
sources in the variant that the seed makes, the student copies, the guide for marking. Made again, the questions change
only with the seed, and what was collected and marked stays.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import exercises
import nbformat
import notebooks
import question_bank
import variants
from judge import MARKERS, Assignment

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "classroom" / "source"
GUIDE = "marking_guide.md"
SETTINGS = "course.json"
FOR_STUDENTS = ("LICENSE", "pyproject.toml", "requirements.txt")
README = """# The course

Run `pip install -r requirements.txt`, then `pip install .` and `jupyter lab`, in this folder.

- `book/` holds the chapters as notebooks, their exercises without solutions.
- `assignments/` holds what is to be handed in. Give in the notebook alone, under its own name.

Change only the cells that say *your code here* or *your answer here*, and add cells of your own wherever you like. The
checks under a question show what is wrong; they earn no points themselves.
"""


def generate(course: Path, only: str) -> int:
    """Make the student copies of the assignments of a course folder, and return nbgrader's exit status."""
    tools = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])  # nbgrader calls alembic
    command = [sys.executable, "-m", "nbgrader", "generate_assignment", only, "--create", "--force"]
    return subprocess.run(command, cwd=course, env={**os.environ, "PATH": tools}, check=False).returncode


def written_answers(nb: nbformat.NotebookNode) -> list[str]:
    """Return, for each written answer of a source, its question, a good answer and how it is marked."""
    return [
        f"{question.source}\n\n{MARKERS.sub('', answer.source).strip()}"
        for question, answer in itertools.pairwise(nb.cells)
        if answer.cell_type == "markdown" and answer.metadata.get("nbgrader", {}).get("grade")
    ]


def write_teacher(course: Path, seed: int | None, only: str = "*") -> int:
    """Write the teacher's folder, with all assignments or one, and return nbgrader's exit status."""
    course.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / "classroom" / "nbgrader_config.py", course)
    guide = ["# Marking guide for the written answers\n\nFor teachers only. Made by `make course`; do not edit."]
    without = {}
    for path in sorted(SOURCE.glob(f"{only}/*.ipynb")):
        source = notebooks.read(path)
        nb = variants.variant(source, seed)
        without[path.parent.name] = variants.settings(source)["without"]
        notebooks.write(course / "source" / path.parent.name / path.name, notebooks.to_text(nb))
        guide += [text.replace("## ", f"## {path.parent.name}: ", 1) for text in written_answers(nb)]
    notebooks.write(course / GUIDE, "\n\n".join(guide) + "\n")
    notebooks.write(course / SETTINGS, json.dumps({"seed": seed, "without": without}, indent=1) + "\n")
    return generate(course, only)


def write_students(target: Path, release: Path) -> None:
    """Write the students' folder anew; that it is a repository stays."""
    for path in target.glob("*"):
        if path.name != ".git":
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    for path in sorted((ROOT / "book").glob("[0-9]*.ipynb")):
        nb = exercises.without_solutions(notebooks.read(path))
        notebooks.write(target / "book" / path.name, notebooks.to_text(nb))
    shutil.copytree(release, target / "assignments", ignore=shutil.ignore_patterns(".*"))
    for name in FOR_STUDENTS:
        shutil.copy(ROOT / name, target / name)
    shutil.copytree(ROOT / "spectral_notes", target / "spectral_notes", ignore=shutil.ignore_patterns("__pycache__"))
    notebooks.write(target / "README.md", README)


def normal_form() -> list[Path]:
    """Bring the sources into normal form (no outputs, one spelling), and return those that changed."""
    changed = []
    for path in sorted(SOURCE.glob("*/*.ipynb")):
        nb = notebooks.read(path)
        for cell in nb.cells:
            cell.metadata = nbformat.from_dict({k: v for k, v in cell.metadata.items() if k in ("nbgrader", "tags")})
            if cell.cell_type == "code":
                cell.outputs, cell.execution_count = [], None
            if name := cell.metadata.get("nbgrader", {}).get("grade_id"):
                cell.id = re.sub(r"[^A-Za-z0-9_-]", "-", name)[:64]
        nb.metadata = nbformat.from_dict({"kernelspec": notebooks.KERNEL, "language_info": notebooks.LANGUAGE})
        changed += [path] if notebooks.write(path, notebooks.to_text(nb)) else []
    return changed


def faults(seed: int | None) -> list[str]:
    """Return the questions whose solution loses points in the variant of a seed, or fails a shown check."""
    found = []
    for path in sorted(SOURCE.glob("*/*.ipynb")):
        source = notebooks.read(path)
        assignment = Assignment(variants.variant(source, seed), variants.settings(source)["without"], seed or 0)
        for name, function in assignment.function.items():
            mark = assignment.judged(name, assignment.names[function])
            if mark.earned != mark.points or any("Not right" in words for words in mark.said):
                found.append(f"{path.stem}, seed {seed}, {name}: {mark.earned:g} of {mark.points:g}; {mark.said}")
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("course", type=Path, nargs="?", default=ROOT / "course", help="where the two folders go")
    parser.add_argument("--seed", type=int, help="which variant; without it, the questions as the book has them")
    parser.add_argument("--normal-form", action="store_true", help="only bring classroom/source into normal form")
    parser.add_argument("--prove", type=int, metavar="N", help="only prove N seeds: full marks for the solutions")
    options = parser.parse_args(arguments)
    if options.prove is not None:
        found = [fault for seed in range(options.prove) for fault in faults(seed)]
        sys.stderr.write("\n".join([*found, f"course: {options.prove} seeds, {len(found)} faults"]) + "\n")
        return int(bool(found))
    if options.normal_form:
        for path in normal_form():
            sys.stderr.write(f"course: {path.relative_to(ROOT)} is in normal form now\n")
        return 0
    course = options.course.resolve()
    if status := write_teacher(course / "teacher", options.seed):
        return status
    write_students(course / "students", course / "teacher" / "release")
    question_bank.write(course / "teacher" / "questions")
    sys.stderr.write(f"course: give {course / 'students'} away, and keep {course / 'teacher'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
