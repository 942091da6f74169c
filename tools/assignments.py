"""Make the student copies of the assignments, `classroom/release`, and the marking guide for the written answers.

    python tools/assignments.py

Both come from `classroom/source`. The work is done by nbgrader, with the settings in `classroom/nbgrader_config.py`, so
that its other commands (autograde, formgrader, feedback) go on from there in the same folder.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import notebooks

ROOT = Path(__file__).resolve().parents[1]
GUIDE = "marking_guide.md"
MARKERS = re.compile(r"^### (?:BEGIN|END) SOLUTION\n?", re.MULTILINE)


def generate(course: Path) -> int:
    """Make the student copies of all assignments of a course folder, and return nbgrader's exit status."""
    tools = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])  # nbgrader calls alembic
    command = [sys.executable, "-m", "nbgrader", "generate_assignment", "*", "--create", "--force"]
    return subprocess.run(command, cwd=course, env={**os.environ, "PATH": tools}, check=False).returncode


def written_answers(path: Path) -> list[str]:
    """Return, for each written answer of a source, its question, a good answer and how it is marked."""
    cells = notebooks.read(path).cells
    return [
        f"{question.source}\n\n{MARKERS.sub('', answer.source).strip()}"
        for question, answer in itertools.pairwise(cells)
        if answer.cell_type == "markdown" and answer.metadata.get("nbgrader", {}).get("grade")
    ]


def marking_guide(course: Path) -> str:
    """Return the guide to the written answers of all assignments."""
    parts = ["# Marking guide for the written answers\n\nFor teachers only. Made by `make assignments`; do not edit."]
    for path in sorted(course.glob("source/*/*.ipynb")):
        parts += [answer.replace("## ", f"## {path.parent.name}: ", 1) for answer in written_answers(path)]
    return "\n\n".join(parts) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--course", type=Path, default=ROOT / "classroom", help="the folder with nbgrader_config.py")
    course = parser.parse_args(arguments).course.resolve()
    if status := generate(course):
        return status
    notebooks.write(course / GUIDE, marking_guide(course))
    sys.stderr.write(f"assignments: student copies are in {course / 'release'}, beside them {GUIDE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
