"""Twenty submissions to assignment 1, of all the kinds that a teacher meets: S01 to S20.

python tests/classroom/twenty.py FOLDER      make a course, an archive, a list of students, and mark them
"""

from __future__ import annotations

import copy
import os
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import nbformat

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

import course as course_tool
import mark
import notebooks
from judge import MARKERS, cell_settings

ASSIGNMENT = "1_fourier"
KINDS = {  # student: (what is odd about the work, automatic points, None where it cannot be marked)
    "S01": ("solved", 35.0),
    "S02": ("untouched", 0.0),
    "S03": ("functions at the end, the stubs kept", 35.0),
    "S04": ("cells of checks deleted", 35.0),
    "S05": ("each answer's cell there twice, the second time as the stub", 35.0),
    "S06": ("no cell has metadata", 35.0),
    "S07": ("another kernel, and an import added to the locked set-up", 35.0),
    "S08": ("Marks and check_result redefined, the library patched", 0.0),
    "S09": ("reads sources, gradebook and solutions, if it can", 0.0),
    "S10": ("1.3 never ends", 31.0),
    "S11": ("1.4 takes all memory", 30.0),
    "S12": ("its own cells end the process and start others", 35.0),
    "S13": ("prints, warns, plots, writes to stderr", 35.0),
    "S14": ("its own cells break names, NumPy and later answers", 35.0),
    "S15": ("1.2 by numpy.fft, 1.3 asks for input, 1.5 adds a number to a sparse matrix", 19.0),
    "S16": ("sign of b, order one at the ends", 28.0),
    "S17": ("the file is cut off", None),
    "S18": ("a PDF instead of a notebook", None),
    "S19": ("on the list, but nothing handed in", None),
    "S20": ("two attempts, 'fourier (1).ipynb', metadata of the old format", 35.0),
}
CHEATS = """import spectral_notes.checking as checking
class Marks:
    earned = points = 35
    def __init__(self, *a, **k): pass
    def __repr__(self): return "35"
def check_result(*a, **k): return True
checking.check_result = check_result
checking.Marks = Marks
checking.check_values = checking.check_number = check_result
np.testing.assert_allclose = check_result
np.asarray = lambda *a, **k: 0
"""
BREAKS = """np = None
sp = 3
def alias(k, N): return 0
def low_pass(f, m): return f
import numpy
numpy.cos = numpy.sin = numpy.outer = None
raise SystemExit("gone")
"""
NOISE = """import sys, warnings, matplotlib.pyplot as plt
%matplotlib inline
print("x" * 100000)
print("alarm", file=sys.stderr)
warnings.warn("careful")
plt.plot([1, 2]); plt.show()
!ls
"""
ENDS = """import os, subprocess
try:
    subprocess.run(["sleep", "100"])
except Exception as error:
    print(error)
os._exit(0)
"""


def thief(places: list[str]) -> str:
    """Return a cell that looks for the solutions in the given places, and uses what it finds."""
    return f"""import glob, json, re, os
for place in {places!r}:
    for top in (place, "..", "../..", "../../.."):
        try:
            for path in glob.glob(os.path.join(top, "**", "fourier.ipynb"), recursive=True):
                for cell in json.load(open(path))["cells"]:
                    if "BEGIN SOLUTION" in "".join(cell["source"]):
                        exec("".join(cell["source"]), globals())
        except Exception:
            pass
"""


def solved(source: nbformat.NotebookNode, release: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return the student copy with every answer filled in."""
    answers = {
        cell_settings(c)["grade_id"]: MARKERS.sub("", c.source)
        for c in source.cells
        if cell_settings(c).get("solution")
    }
    nb = copy.deepcopy(release)
    for cell in nb.cells:
        cell.source = answers.get(cell_settings(cell).get("grade_id"), cell.source)
    return nb


def answer(nb: nbformat.NotebookNode, name: str) -> nbformat.NotebookNode:
    """Return the cell of an answer."""
    return next(cell for cell in nb.cells if cell_settings(cell).get("grade_id") == name)


def own(source: str) -> nbformat.NotebookNode:
    """Return a cell of the student's own."""
    return nbformat.v4.new_code_cell(source)


def submissions(source: nbformat.NotebookNode, release: nbformat.NotebookNode, places: list[str]) -> dict[str, str]:
    """Return the text of each notebook that is one."""
    full = solved(source, release)
    coded = [
        cell_settings(c)["grade_id"] for c in full.cells if cell_settings(c).get("solution") and c.cell_type == "code"
    ]

    def made(change: Callable[[nbformat.NotebookNode], None], start: nbformat.NotebookNode = full) -> str:
        nb = copy.deepcopy(start)
        change(nb)
        return notebooks.to_text(nb)

    def at_the_end(nb: nbformat.NotebookNode) -> None:
        nb.cells.append(own("\n\n".join(answer(full, name).source for name in coded)))

    def twice(nb: nbformat.NotebookNode) -> None:
        for name in coded:
            nb.cells.insert(nb.cells.index(answer(nb, name)) + 1, copy.deepcopy(answer(release, name)))

    def bare(nb: nbformat.NotebookNode) -> None:
        for cell in nb.cells:
            cell.metadata = nbformat.from_dict({})

    def other_kernel(nb: nbformat.NotebookNode) -> None:
        nb.metadata.kernelspec = nbformat.from_dict({"name": "ir", "display_name": "R", "language": "R"})
        setup = next(cell for cell in nb.cells if cell_settings(cell).get("grade_id", "").startswith("setup"))
        setup.source += "\nfrom math import pi as my_pi"
        answer(nb, "spectral-derivative").source = answer(nb, "spectral-derivative").source.replace("np.pi", "my_pi")

    def put(place: int, text: str) -> Callable[[nbformat.NotebookNode], None]:
        return lambda nb: nb.cells.insert(place if place >= 0 else len(nb.cells), own(text))

    def replaced(**texts: str) -> Callable[[nbformat.NotebookNode], None]:
        def change(nb: nbformat.NotebookNode) -> None:
            for name, text in texts.items():
                answer(nb, name.replace("_", "-")).source = text

        return change

    def old_format(nb: nbformat.NotebookNode) -> None:
        for cell in nb.cells:
            if cell_settings(cell):
                cell.metadata.nbgrader.schema_version = 1
                cell.metadata.nbgrader.pop("cell_type", None)

    def without_checks(nb: nbformat.NotebookNode) -> None:
        nb.cells = [cell for cell in nb.cells if not cell_settings(cell).get("grade_id", "").startswith("check-")]

    sign = answer(full, "coefficients").source.replace("np.sin(angles)", "-np.sin(angles)")
    ends = "def derivative_matrix(n, h):\n    D = (np.eye(n, k=1) - np.eye(n, k=-1)) / (2 * h)\n"
    ends += "    D[0, :2] = D[-1, -2:] = np.array([-1, 1]) / h\n    return D"
    loop = "def alias(k, N):\n    while True:\n        pass"
    bomb = "def low_pass(f, m):\n    held = [np.ones(10**8) for _ in range(100)]\n    return held"
    bomb += "\n\nhigh_pass = low_pass"
    fft = "def cosine_sine_coefficients(f):\n    F = np.fft.fft(f) / len(f)\n    return F.real, -F.imag"
    adds = "def derivative_matrix(n, h):\n    return sp.csr_array(np.eye(n)) + 1e-9"
    asks = "def alias(k, N):\n    return int(input())"
    return {
        "S01": made(lambda nb: None),
        "S02": made(lambda nb: None, release),
        "S03": made(at_the_end, release),
        "S04": made(without_checks),
        "S05": made(twice),
        "S06": made(bare),
        "S07": made(other_kernel),
        "S08": made(put(3, CHEATS), release),
        "S09": made(put(-1, thief(places)), release),
        "S10": made(replaced(alias=loop)),
        "S11": made(replaced(low_pass=bomb)),
        "S12": made(put(3, ENDS)),
        "S13": made(put(3, NOISE)),
        "S14": made(put(3, BREAKS)),
        "S15": made(replaced(coefficients=fft, alias=asks, derivative=adds)),
        "S16": made(replaced(coefficients=sign, derivative=ends)),
        "S17": made(lambda nb: None)[:3000],
        "S20": made(old_format),
    }


def make(folder: Path) -> tuple[Path, Path]:
    """Write the archive, as Moodle packs it, and the list of students; the course is in `folder` already."""
    teacher = folder / "teacher"
    source, release = (
        notebooks.read(next((teacher / kind / ASSIGNMENT).glob("*.ipynb"))) for kind in ("source", "release")
    )
    places = [str(teacher), str(course_tool.SOURCE), str(teacher / "source" / ASSIGNMENT)]
    texts = submissions(source, release, places)
    archive, students = folder / "submissions.zip", folder / "students.csv"
    numbers = {student: 1000 + int(student[1:]) for student in KINDS}
    with zipfile.ZipFile(archive, "w") as packed:
        for student, text in texts.items():
            top = f"{student}_{numbers[student]}_assignsubmission_file_"
            packed.writestr(f"{top}/fourier{' (1)' if student == 'S20' else ''}.ipynb", text)
            if student == "S20":
                entry = zipfile.ZipInfo(f"{top}/fourier.ipynb", (2020, 1, 1, 0, 0, 0))
                packed.writestr(entry, notebooks.to_text(release))
        packed.writestr(f"S18_{numbers['S18']}_assignsubmission_file_/fourier.pdf", b"%PDF-1.4")
    lines = [f'Participant {number},{student},"{student}@example.org"' for student, number in numbers.items()]
    students.write_text("\n".join(["Identifier,Full name,Email address", *lines]) + "\n", encoding="utf-8")
    return archive, students


def main() -> int:
    """Make a course, twenty submissions, and mark them."""
    folder = Path(sys.argv[1]).resolve()
    if status := course_tool.main([str(folder), "--seed", "7"]):
        return status
    archive, students = make(folder)
    start, clock = sum(os.times()[:4]), time.monotonic()
    status = mark.main([ASSIGNMENT, str(archive), "--course", str(folder), "--students", str(students)])
    spent, waited = sum(os.times()[:4]) - start, time.monotonic() - clock  # of this process and those it started
    sys.stderr.write(f"twenty: {spent:.0f} s of processor time, {waited:.0f} s in all, from the archive to grades and pages\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
