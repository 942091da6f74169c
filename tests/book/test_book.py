"""The form of the book: what every chapter holds, what the contents page lists, what the pins say."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import build_book
import check_book
import exercises
import nbformat
import notebooks
import pytest
import yaml

ROOT = Path(notebooks.__file__).resolve().parents[1]
BOOK = ROOT / "book"
CHAPTERS = sorted(BOOK.glob("[0-9][0-9]_*.ipynb"))
NAMED_PAGES = {
    "book/index",
    "book/01_function_spaces",
    "book/02_fourier_basis",
    "book/03_differentiation",
    "book/04_manifolds",
    "book/05_discrete_geometries",
    "book/06_signals_on_surfaces",
    "book/07_laplacian",
    "book/08_eigenfunctions",
    "book/09_heat_waves_descriptors",
    "book/10_compression",
    "book/12_functional_maps",
    "book/labs",
    "book/11_clustering",
    "book/13_vectors",
    "book/14_graphs_and_learning",
    "book/15_brain",
    "book/16_outlook",
    "book/conventions",
    "book/large_meshes",
    "book/for_teachers",
    "book/setup_check",
    "book/your_own_shape",
    "book/bibliography",
    "book/where_we_differ",
    "book/troubleshooting",
    "book/status",
    "book/notation",
    "book/glossary",
    "book/changelog",
    "book/api",
}


def in_chapter(check: object) -> object:
    """Run a check on every chapter."""
    return pytest.mark.parametrize("path", CHAPTERS, ids=[path.stem for path in CHAPTERS])(check)


def prose(path: Path) -> list[nbformat.NotebookNode]:
    """Return the markdown cells of a chapter."""
    return [cell for cell in notebooks.read(path).cells if cell.cell_type == "markdown"]


def text(path: Path) -> str:
    """Return the markdown of a chapter as one text."""
    return "\n\n".join(cell.source for cell in prose(path))


# --- chapters -------------------------------------------------------------------------------------------------------


@in_chapter
def test_a_chapter_is_stored_as_it_was_run(path: Path) -> None:
    assert notebooks.faults(path) == []


@in_chapter
def test_a_chapter_opens_with_label_title_and_objectives(path: Path) -> None:
    assert re.match(r"\(ch-[a-z-]+\)=\n# \S", prose(path)[0].source)
    objectives = re.search(r"\{admonition\} You will be able to\n(.*?):::", text(path), re.DOTALL)
    assert objectives, "there is no list 'You will be able to'"
    numbers = re.findall(r"\*\*(\d+)\.(\d+)\*\*", objectives[1])
    assert 3 <= len(numbers) <= 5
    assert numbers == [(str(int(path.name[:2])), str(n)) for n in range(1, len(numbers) + 1)]


@in_chapter
def test_every_objective_has_an_exercise_and_every_exercise_a_solution(path: Path) -> None:
    exercises = re.findall(r"\{exercise-start\}[^\n]*\n:label: (ex-[a-z0-9-]+)", text(path))
    solutions = re.findall(r"\{solution-start\} (ex-[a-z0-9-]+)", text(path))
    assert len(exercises) >= 5
    assert len(set(exercises)) == len(exercises)
    assert sorted(solutions) == sorted(exercises)
    objectives = set(re.findall(r"\*\*(\d+\.\d+)\*\*", text(path).split(":::", 2)[1]))
    opening = [cell for cell in prose(path) if "{exercise-start}" in cell.source]
    tested = {tag.removeprefix("objective-") for cell in opening for tag in cell.metadata.get("tags", [])}
    assert objectives <= tested, f"no exercise tests {sorted(objectives - tested)}"
    assert all(re.search(r"Objectives? \d+\.\d+", cell.source) for cell in opening)


@in_chapter
def test_every_solution_is_folded_and_discussed(path: Path) -> None:
    starts = [cell.source for cell in prose(path) if "{solution-start}" in cell.source]
    assert starts
    assert all(":class: dropdown" in start for start in starts)
    assert len(re.findall(r"\{solution-end\}", text(path))) == len(starts)


@in_chapter
def test_every_exercise_has_a_check_and_every_solution_passes_it(path: Path) -> None:
    nb = notebooks.read(path)
    assert len(exercises.exercises(nb)) >= 6
    assert exercises.faults(nb) == []


def split_by_solution(path: Path) -> tuple[list[nbformat.NotebookNode], list[nbformat.NotebookNode]]:
    """Return the cells of a chapter that everybody sees, and those of its solutions."""
    cells = notebooks.read(path).cells
    marks = exercises.in_solution(cells)
    return [c for c, m in zip(cells, marks, strict=True) if not m], [c for c, m in zip(cells, marks, strict=True) if m]


def lines_of(cells: list[nbformat.NotebookNode]) -> set[str]:
    """Return the lines of the sources and of the printed outputs of cells, without indents."""
    sources = [line.strip() for cell in cells for line in cell.source.splitlines()]
    return {*sources, *(line.strip() for cell in cells if cell.cell_type == "code" for line in exercises.printed(cell))}


def test_the_students_edition_holds_no_solution(tmp_path: Path) -> None:
    build_book.twins(BOOK, tmp_path / "executed")
    build_book.stage(ROOT, tmp_path / "executed", tmp_path / "static", tmp_path / "source")
    staged = {path: path.read_bytes().decode(errors="ignore") for path in (tmp_path / "source").rglob("*") if path.is_file()}
    assert {path.name for path in CHAPTERS} <= {path.name for path in staged}
    seen = "\n".join(line for path in CHAPTERS for line in lines_of(split_by_solution(path)[0]))
    for chapter in CHAPTERS:
        telling = {line for line in lines_of(split_by_solution(chapter)[1]) if len(line) > 20 and line not in seen}
        assert len(telling) > 20
        spelled = telling | {json.dumps(line, ensure_ascii=False)[1:-1] for line in telling}
        assert not [(path.name, line) for path, content in staged.items() for line in spelled if line in content]


@in_chapter
def test_nothing_outside_a_solution_points_into_one(path: Path) -> None:
    seen, hidden = split_by_solution(path)
    labels = {cell.metadata["mystnb"]["figure"]["name"] for cell in hidden if "mystnb" in cell.metadata}
    labels |= {label for cell in hidden for label in re.findall(r"^:label: (\S+)|^\((\S+)\)=$", cell.source, re.MULTILINE) for label in label if label}
    assert len(labels) >= 5
    assert not [label for label in labels for cell in seen if f"`{label}`" in cell.source]


@in_chapter
def test_a_chapter_asks_for_predictions_and_shows_pitfalls(path: Path) -> None:
    assert len(re.findall(r"\{admonition\} Predict", text(path))) >= 2
    assert len(re.findall(r"\{admonition\} Pitfall", text(path))) >= 1


@in_chapter
def test_a_chapter_ends_with_summary_exercises_and_reading(path: Path) -> None:
    sections = re.findall(r"^## (.+)$", text(path), re.MULTILINE)
    assert sections[-3:] == ["Summary", "Exercises", "Further reading"]
    summary = re.search(r"^## Summary\s+(.*?)(?=^## |\Z)", text(path), re.MULTILINE | re.DOTALL)
    assert summary
    sentences = re.split(r"(?<=[.!?])\s+(?=[A-Z*$`])", summary[1].strip())
    assert len(sentences) == 3, sentences
    assert re.search(r"\{cite[a-z:]*\}`", text(path).split("## Further reading")[1])


@in_chapter
def test_imports_are_in_the_first_code_cell(path: Path) -> None:
    cells = notebooks.read(path).cells
    exercises = next(n for n, cell in enumerate(cells) if re.search(r"^## Exercises", cell.source, re.MULTILINE))
    first, *later = [cell.source for cell in cells[:exercises] if cell.cell_type == "code"]
    assert "import" in first
    assert not [source for source in later if re.search(r"^(import|from) ", source, re.MULTILINE)]


def test_labels_are_used_once_in_the_whole_book() -> None:
    labels = [label for path in CHAPTERS for label in re.findall(r"^\(([a-z0-9-]+)\)=$", text(path), re.MULTILINE)]
    labels += [label for path in CHAPTERS for label in re.findall(r":label: ([a-z0-9-]+)", text(path))]
    for path in CHAPTERS:
        for _, cell in notebooks.code_cells(notebooks.read(path)):
            labels += [cell.metadata["mystnb"]["figure"]["name"]] if "mystnb" in cell.metadata else []
    assert sorted(labels) == sorted(set(labels))


# --- contents -------------------------------------------------------------------------------------------------------


def test_the_contents_page_tells_the_truth() -> None:
    listed = check_book.named_pages(ROOT / "_toc.yml")
    written = {p.relative_to(ROOT).with_suffix("").as_posix() for p in [*BOOK.glob("*.md"), *BOOK.glob("*.ipynb")]}
    assert len(listed) == len(set(listed))
    assert set(listed) == written
    assert set(listed) >= NAMED_PAGES


def test_chapters_are_listed_in_order() -> None:
    numbered = [name for name in check_book.named_pages(ROOT / "_toc.yml") if re.match(r"book/\d\d_", name)]
    assert numbered == sorted(numbered)


def test_every_citation_is_in_the_bibliography() -> None:
    keys = re.findall(r"^@\w+\{(\w+),", (BOOK / "references.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(keys) == len(set(keys))
    pages = [*(text(path) for path in CHAPTERS), *(p.read_text(encoding="utf-8") for p in BOOK.glob("*.md"))]
    cited = {key.strip() for page in pages for group in re.findall(r"\{cite[a-z:]*\}`([^`]+)`", page) for key in group.split(",")}
    assert cited <= set(keys)


# --- the frame ------------------------------------------------------------------------------------------------------


def test_one_install_is_enough_and_names_no_host() -> None:
    lines = (ROOT / "requirements.txt").read_text(encoding="utf-8").splitlines()
    pins = {re.split(r"==", line)[0].lower() for line in lines if not line.startswith(("#", "-e"))}
    assert lines[-1] == "-e .", "the package itself comes last"
    assert not [line for line in lines if "://" in line or line.startswith("--")]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = project["dependencies"] + [d for x in ("run", "book", "test", "classroom", "dev") for d in project["optional-dependencies"][x]]
    assert {re.split(r"[<>=~!]", requirement)[0].lower() for requirement in wanted} <= pins


def test_the_book_asks_for_no_launch_service() -> None:
    config = yaml.safe_load((ROOT / "_config.yml").read_text(encoding="utf-8"))
    assert config["launch_buttons"]["thebe"] is False
    assert "sphinx_thebe" not in config["sphinx"]["config"]["extensions"]


def test_commands_in_the_readme_exist() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"make ([a-z]+)\b(?= |`|$)", readme)) - {"it"} <= targets
    scripts = re.findall(r"tools[\\/](\w+\.py)", readme)
    assert scripts
    assert all((ROOT / "tools" / script).exists() for script in scripts)
