"""The assignments: they mark right answers right and wrong ones wrong, and student copies hold no solution."""

from __future__ import annotations

import functools
import json
import re
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any

import build_book
import course as course_tool
import judge
import nbformat
import notebooks
import objectives
import pytest
import variants
import yaml
from jupyter_server.config_manager import BaseJSONConfigManager

ROOT = Path(notebooks.__file__).resolve().parents[1]
SOURCE = ROOT / "classroom" / "source"
SOURCES = sorted(SOURCE.glob("*/*.ipynb"))
ASSIGNMENTS = [path.parent.name for path in SOURCES]
BANKS = ROOT / "tests" / "classroom"


def in_assignment(check: object) -> object:
    """Run a check on every assignment."""
    return pytest.mark.parametrize("name", ASSIGNMENTS)(check)


@functools.cache
def source(name: str) -> nbformat.NotebookNode:
    """Return the one source of an assignment."""
    return notebooks.read(next((SOURCE / name).glob("*.ipynb")))


def graded_cells(nb: nbformat.NotebookNode) -> dict[str, nbformat.NotebookNode]:
    """Return the cells that nbgrader knows, by name."""
    return {cell.metadata.nbgrader.grade_id: cell for cell in nb.cells if "nbgrader" in cell.metadata}


@functools.cache
def bank(section: str) -> list[Any]:
    """Return (assignment, cell, law, code) of every answer in a section of the banks."""
    found = []
    for path in sorted(BANKS.glob("*.md")):
        part = re.search(rf"^## {section}$(.*?)(?=^## |\Z)", path.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        assert part, f"{path.name} has no section {section}"
        entries = re.findall(
            r"^### ([a-z-]+): ([^\n]+)\n(?:Law: ([^\n]+)\n)?\n*```python\n(.*?)^```$", part[1], re.MULTILINE | re.DOTALL
        )
        assert len(entries) == part[1].count("### "), f"{path.name}: an entry of {section} cannot be read"
        for cell, slip, law, code in entries:
            found.append(pytest.param(path.stem, cell, law, code, id=f"{path.stem}-{cell}-{slip.replace(' ', '_')}"))
    return found


@functools.cache
def assignment(name: str) -> judge.Assignment:
    """Return an assignment as it is without a seed."""
    return judge.Assignment(variants.variant(source(name)), variants.settings(source(name))["without"])


def marks(name: str, cell: str, code: str) -> judge.Mark:
    """Return what an answer earns by the hidden tests."""
    names = dict(assignment(name).names)
    exec(code, names)
    return assignment(name).judged(cell, names[assignment(name).function[cell]])


def marks_elsewhere(name: str, cell: str, code: str) -> judge.Mark:
    """Return what an answer earns in the other process, where it has to do without some modules."""
    with judge.Marker(assignment(name)) as marker:
        nb = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code, metadata={"nbgrader": {"grade_id": cell, "grade": False}})])
        return marker.marks(nb)[cell]


# --- form -----------------------------------------------------------------------------------------------------------


def test_there_are_six_assignments() -> None:
    assert len(ASSIGNMENTS) == 6
    assert sorted(path.stem for path in BANKS.glob("*.md")) == ASSIGNMENTS


@in_assignment
def test_a_source_is_in_normal_form_and_holds_no_outputs(name: str) -> None:
    path = next((SOURCE / name).glob("*.ipynb"))
    nb = notebooks.read(path)
    for _, cell in notebooks.code_cells(nb):
        assert cell.outputs == [] and cell.execution_count is None
        assert set(cell.metadata) <= {"nbgrader", "tags"}
    assert path.read_text(encoding="utf-8") == notebooks.to_text(nb)


@in_assignment
def test_points_add_up_and_every_answer_has_its_check(name: str) -> None:
    cells = graded_cells(source(name))
    settings = {gid: cell.metadata.nbgrader for gid, cell in cells.items()}
    answers = [gid for gid, s in settings.items() if s.solution and not s.grade]
    checks = [gid for gid, s in settings.items() if s.grade and not s.solution]
    written = [gid for gid, s in settings.items() if s.grade and s.solution]
    assert checks == [f"check-{gid}" for gid in answers]
    assert written
    assert sum(s.points for s in settings.values() if s.grade) == 40
    text = "\n".join(cell.source for cell in source(name).cells if cell.cell_type == "markdown")
    assert sum(int(points) for points in re.findall(r"^## .*\((\d+) points\)$", text, re.MULTILINE)) == 40
    for gid in checks:
        assert f"points={settings[gid].points})" in cells[gid].source
        assert "cases = [" in cells[gid].source.partition("### BEGIN HIDDEN TESTS")[2]
        assert "### BEGIN HIDDEN TESTS" in cells[gid].source
    for gid in written:
        assert f"**Marking ({settings[gid].points} points).**" in cells[gid].source
    assert all("### BEGIN SOLUTION" in cells[gid].source for gid in answers + written)


# --- right and wrong answers, all tests in this process ---------------------------------------------------------------


@pytest.mark.parametrize(("name", "cell", "law", "code"), bank("Wrong"))
def test_a_wrong_answer_loses_points_and_names_its_law(name: str, cell: str, law: str, code: str) -> None:
    found = (marks_elsewhere if law.startswith("it calls") else marks)(name, cell, code)
    assert found.earned < found.points
    assert any(law in words and "Not right." in words for words in found.said), found.said


@pytest.mark.parametrize(("name", "cell", "law", "code"), bank("Right"))
def test_an_unusual_right_answer_earns_all_points(name: str, cell: str, law: str, code: str) -> None:
    found = marks(name, cell, code)
    assert found.earned == found.points, found.said


PRICES = {  # what fair marking by hand would give
    ("1_fourier", "coefficients", "exponent of the other sign"): 3,
    ("1_fourier", "coefficients", "not divided by N"): 3,
    ("1_fourier", "derivative", "ends of order one"): 2,
    ("3_laplacian", "laplacian", "the half is forgotten"): 5,
    ("3_laplacian", "laplacian", "wrong sign"): 5,
    ("3_laplacian", "plate", "forgotten mass matrix"): 3,
    ("4_heat", "modes", "the order is reversed"): 4,
    ("6_maps", "matrix", "transposed map"): 3,
    ("6_maps", "matrix", "forgotten mass matrix"): 2,
    ("6_maps", "matrix", "least squares without the mass"): 3,
}


@pytest.mark.parametrize(("key", "points"), PRICES.items(), ids=["-".join(key) for key in PRICES])
def test_a_slip_that_has_a_name_has_a_price(key: tuple[str, str, str], points: float) -> None:
    name, cell, slip = key
    text = (BANKS / f"{name}.md").read_text(encoding="utf-8")
    entry = re.search(rf"^### {cell}: {slip}\nLaw: [^\n]*\n\n```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert entry, slip
    assert marks(name, cell, entry[1]).earned == points


def test_the_banks_are_large() -> None:
    assert len(bank("Wrong")) >= 40
    assert len(bank("Right")) >= 20


# --- nbgrader itself ------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a teacher's folder, with the student copies of every assignment."""
    folder = tmp_path_factory.mktemp("course")
    assert course_tool.write_teacher(folder, None) == 0
    return folder


@in_assignment
def test_a_student_copy_holds_no_solution_and_no_hidden_test(name: str, course: Path) -> None:
    copy = next((course / "release" / name).glob("*.ipynb")).read_text(encoding="utf-8")
    assert not re.search("BEGIN|END|SOLUTION|HIDDEN|Marking \\(", copy)
    shown = {line.strip() for cell in nbformat.reads(copy, as_version=4).cells for line in cell.source.splitlines()}
    hidden = [line for text in secrets(name) for line in text.splitlines() if len(line.strip()) > 6]
    assert len(hidden) > 30
    common = {"return ...", "]", ")", "}", ""}
    assert not {line.strip() for line in hidden} & shown - common - also_shown(name)


def secrets(name: str) -> list[str]:
    """Return the regions of a source that no student may see: solutions, and tests that run when work is marked."""
    between = r"### BEGIN {0}\n(.*?)\s*### END {0}"
    kinds = [between.format("SOLUTION"), between.format("HIDDEN TESTS")]
    return [text for cell in variants.variant(source(name)).cells for kind in kinds for text in re.findall(kind, cell.source, re.DOTALL)]


def also_shown(name: str) -> set[str]:
    """Return the lines of a source that stand outside its secret regions as well."""
    cells = [re.sub(r"### BEGIN (.*?)\n.*?### END \1", "", cell.source, flags=re.DOTALL) for cell in variants.variant(source(name)).cells]
    return {line.strip() for text in cells for line in text.splitlines()}


@in_assignment
def test_the_book_offers_no_solution_of_an_assignment(name: str, tmp_path: Path) -> None:
    build_book.stage(ROOT, tmp_path / "executed", tmp_path / "static", tmp_path / "source")
    offered = [*(tmp_path / "source").rglob("*"), *(ROOT / "_build" / "html").rglob("*")]
    assert not [path for path in offered if "nbgrader" in path.name or path.parent.name in ASSIGNMENTS]
    kinds = {".ipynb", ".md", ".txt", ".html"}
    texts = {path: squeezed(path.read_text(encoding="utf-8")) for path in offered if path.is_file() and path.suffix in kinds}
    assert len(texts) > 10
    long_ones = [squeezed(json.dumps(text)[1:-1]) for text in secrets(name) if len(text) > 120]
    assert len(long_ones) > 5
    for secret in long_ones:
        assert not [path for path, text in texts.items() if secret in text]


def squeezed(text: str) -> str:
    """Return a text without blanks, quotes and line breaks, in which code is found however a notebook splits it."""
    return re.sub(r"\\n|[\s\"',]", "", text)


def test_the_marking_guide_holds_every_written_question(course: Path) -> None:
    guide = (course / course_tool.GUIDE).read_text(encoding="utf-8")
    written = [cell for name in ASSIGNMENTS for gid, cell in graded_cells(source(name)).items() if gid.startswith("written-")]
    assert len(written) >= 6
    assert len(re.findall(r"^\*\*Marking \(\d points\)\.\*\*", guide, re.MULTILINE)) == len(written)
    assert len(re.findall(r"^## \d_\w+: \d\.\d In words", guide, re.MULTILINE)) == len(written)
    assert "SOLUTION" not in guide


def test_the_recipe_for_a_hub_names_what_is_there() -> None:
    recipe = (ROOT / "classroom" / "Dockerfile").read_text(encoding="utf-8")
    copied = [word for line in re.findall(r"^COPY (.*) \S+$", recipe, re.MULTILINE) for word in line.split()]
    assert copied and all((ROOT / name).exists() for name in copied)
    assert not any(name.startswith(("classroom", ".", "tests")) for name in copied), "solutions in the image"
    sent = (ROOT / "classroom" / "Dockerfile.dockerignore").read_text(encoding="utf-8").split("*\n")[1].split()
    assert sorted(sent) == sorted(f"!{name}" for name in copied)
    image = yaml.safe_load((ROOT / "classroom" / "jupyterhub" / "values.yaml").read_text(encoding="utf-8"))["singleuser"]["image"]
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert image["tag"] == version
    assert f"--tag {image['name']}:{version}" in recipe


def test_the_hub_asks_for_https_keeps_its_secret_and_shows_nothing_of_nbgrader(tmp_path: Path) -> None:
    values = yaml.safe_load((ROOT / "classroom" / "jupyterhub" / "values.yaml").read_text(encoding="utf-8"))
    assert values["proxy"]["https"]["enabled"] and values["proxy"]["https"]["hosts"]
    settings = [key for part in values["hub"]["config"].values() for key in part]
    assert not [key for key in settings if "secret" in key or "password" in key]
    assert "secretKeyRef" in values["hub"]["extraEnv"]["OAUTH_CLIENT_SECRET"]["valueFrom"]
    (tmp_path / "config.d").mkdir()
    files = {Path(file["mountPath"]).name: file["data"] for file in values["singleuser"]["extraFiles"].values()}
    shutil.copy(Path(sys.prefix) / "etc/jupyter/jupyter_server_config.d/nbgrader.json", tmp_path / "config.d" / "nbgrader.json")
    (tmp_path / "config.d" / "students.json").write_text(json.dumps(files["students.json"]))
    extensions = BaseJSONConfigManager(config_dir=str(tmp_path), read_directory=True).get("config")["ServerApp"]["jpserver_extensions"]
    assert len(extensions) >= 4 and not any(extensions.values())
    package = json.loads((Path(sys.prefix) / "share/jupyter/labextensions/@jupyter/nbgrader/package.json").read_text())
    assert files["page_config.json"] == {"disabledExtensions": {package["name"]: True}}


# --- the teacher's page ---------------------------------------------------------------------------------------------

CHAPTERS = sorted((ROOT / "book").glob("[0-9][0-9]_*.ipynb"))


def teachers_page() -> str:
    """Return the teacher's page as it is stored."""
    return (ROOT / objectives.PAGE).read_text(encoding="utf-8")


def test_the_page_has_a_place_for_every_chapter() -> None:
    places = [int(number) for number in objectives.MARKER.findall(teachers_page())]
    assert places == [int(path.name[:2]) for path in CHAPTERS]


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.stem for path in CHAPTERS])
def test_the_built_page_maps_every_objective_to_its_exercises(path: Path, tmp_path: Path) -> None:
    (tmp_path / "book").mkdir()
    shutil.copy(ROOT / objectives.PAGE, tmp_path / "book")
    shutil.copy(path, tmp_path / "book")
    objectives.fill(tmp_path)
    page = (tmp_path / objectives.PAGE).read_text(encoding="utf-8")
    assert page.count(objectives.MISSING) == len(CHAPTERS) - 1
    text = "\n\n".join(cell.source for cell in notebooks.read(path).cells)
    numbers = re.findall(r"^- \*\*(\d+\.\d+)\*\*", text, re.MULTILINE)
    assert 3 <= len(numbers) == len(objectives.objectives(text))
    assert re.findall(r"^\* - \*\*(\d+\.\d+)\*\* \S", page, re.MULTILINE) == numbers
    read, exercises = map(int, re.search(r"^\*\*Time:\*\* about (\d+) minutes to read and run, (\d+) for", page, re.MULTILINE).groups())
    assert exercises == 10 * text.count("{exercise-start}") and 25 <= read <= 100
    assert set(re.findall(r"\{ref\}`(ex-[a-z0-9-]+)`", page)) == set(re.findall(r":label: (ex-[a-z0-9-]+)", text))


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.stem for path in CHAPTERS])
def test_a_chapter_says_the_time_that_the_teachers_page_says(path: Path, tmp_path: Path) -> None:
    shutil.copy(path, tmp_path)
    objectives.say_times(tmp_path)
    text = "\n\n".join(cell.source for cell in notebooks.read(tmp_path / path.name).cells)
    said = re.search(r"^\*About (\d+) minutes to read and run, (\d+) for its (\d+) exercises\.\*$", text, re.MULTILINE)
    assert said and f"**Time:** about {said[1]} minutes to read and run, {said[2]} for its {said[3]} exercises." in objectives.filled(
        f"% objectives of chapter {int(path.name[:2])}\n", path.parent
    )


def test_time_grows_with_words_figures_and_cells(tmp_path: Path) -> None:
    def minutes(words: int, figures: int, cells: int, folded: int) -> int:
        made = [nbformat.v4.new_markdown_cell("word " * words), nbformat.v4.new_markdown_cell("## Exercises")]
        drawn = {"tags": ["hide-input"], "mystnb": {}}
        made[1:1] = [nbformat.v4.new_code_cell("x = 1", metadata=drawn) for _ in range(figures)]
        made[1:1] = [nbformat.v4.new_code_cell("x = 1") for _ in range(cells)]
        made[1:1] = [nbformat.v4.new_code_cell("x = 1", metadata={"tags": ["hide-input"]}) for _ in range(folded)]
        notebooks.write(tmp_path / "01_page.ipynb", notebooks.to_text(nbformat.v4.new_notebook(cells=made)))
        return objectives.lengths(tmp_path / "01_page.ipynb")["minutes"]

    assert [minutes(1500, 0, 0, 9), minutes(0, 20, 0, 0), minutes(0, 0, 40, 0)] == [10, 20, 30]


def test_an_objective_without_an_exercise_is_refused(tmp_path: Path) -> None:
    nb = notebooks.read(CHAPTERS[0])
    for cell in nb.cells:
        cell.metadata["tags"] = [tag for tag in cell.metadata.get("tags", []) if tag != "objective-1.2"]
    notebooks.write(tmp_path / CHAPTERS[0].name, notebooks.to_text(nb))
    with pytest.raises(notebooks.NotebookError, match="no exercise tests objective 1.2"):
        objectives.filled("% objectives of chapter 1\n", tmp_path)


def test_every_chapter_has_a_sketch_three_beliefs_and_words_for_marking() -> None:
    sections = re.split(r"^### (?=\d+ · )", teachers_page(), flags=re.MULTILINE)[1:]
    assert [int(section.split()[0]) for section in sections] == [int(path.name[:2]) for path in CHAPTERS]
    for path, section in zip(CHAPTERS, sections, strict=True):
        number = int(path.name[:2])
        assert (ROOT / "book" / "_static" / "board" / f"{number:02d}.svg").exists()
        assert f"_static/board/{number:02d}.svg" in section and ":alt: " in section
        assert len(re.findall(r'^- "[^\n]+" Ask: [^\n]+\([^\n]+\)$', section, re.MULTILINE)) == 3
        assert all(word in section for word in ("**Before it:**", "**Assignment:**", "*In words.*"))
