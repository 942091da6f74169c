"""Papers of a course: handouts hold no solution, the page on accessibility names tests that exist, the licence names all."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import course as course_tool
import handouts
import notebooks
import print_book
import pytest
import variants
import yaml
from pypdf import PdfReader

ROOT = course_tool.ROOT


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the pages of a course of one assignment; the student copy is the source without what nbgrader takes out."""
    course = tmp_path_factory.mktemp("course")
    nb = variants.variant(notebooks.read(ROOT / "classroom" / "source" / "1_fourier" / "fourier.ipynb"), 7)
    for kind in ("source", "release"):
        if kind == "release":
            for cell in nb.cells:
                cell.source = re.sub(r"### BEGIN (SOLUTION|HIDDEN TESTS)\n.*?### END \1", "...", cell.source, flags=re.DOTALL)
        notebooks.write(course / "teacher" / kind / "1_fourier" / "fourier.ipynb", notebooks.to_text(nb))
    return handouts.pages(course)


def test_a_handout_asks_all_and_its_solutions_answer(pages: dict[str, str]) -> None:
    assert list(pages) == ["1_fourier", "1_fourier-solutions"]
    texts = [re.sub("<[^>]+>", "", text) for text in pages.values()]
    for text in texts:
        assert re.findall(r"1\.(\d) .*?points\)", text) == list("12345678")
        assert "HIDDEN" not in text and "BEGIN" not in text and "check_result(" not in text
    assert "Marking (5 points)" in texts[1] and "weights[[0, -1]]" in texts[1]
    assert "Marking (5 points)" not in texts[0] and "weights[[0, -1]]" not in texts[0]


@pytest.mark.skipif(not any(map(shutil.which, print_book.BROWSERS)), reason="no browser to print with")
def test_a_handout_is_printed_with_its_formulas(pages: dict[str, str], tmp_path: Path) -> None:
    print_book.print_page(pages["1_fourier"], tmp_path / "a.pdf")
    text = "".join(page.extract_text() for page in PdfReader(tmp_path / "a.pdf").pages)
    assert "Which frequency does it look like?" in text and "\\frac" not in text


def test_the_page_on_accessibility_names_tests_that_exist() -> None:
    named = re.findall(r"`(test_\w+)`", (ROOT / "book" / "accessibility.md").read_text(encoding="utf-8"))
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests" / "browser").glob("*.py"))
    assert len(named) >= 10
    assert [name for name in named if f"def {name}(" not in tests] == []


def test_what_a_copy_fills_in_is_on_the_page() -> None:
    fields = yaml.safe_load((ROOT / "_config.yml").read_text(encoding="utf-8"))["parse"]["myst_substitutions"]
    page = (ROOT / "book" / "accessibility.md").read_text(encoding="utf-8")
    assert set(fields) == {"contact", "course"} == set(re.findall(r"{{ (\w+) }}", page))


def test_the_licence_names_every_folder_with_code_or_text() -> None:
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    ours = [path for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith((".", "_"))]
    holding = [path.name for path in ours if any(next(path.rglob(kind), None) for kind in ("*.py", "*.ipynb", "*.md"))]
    kept = set(holding) - {"course", "dist", "build"}
    assert {"classroom", "book", "tools"} <= kept
    assert [name for name in sorted(kept) if f"{name}/" not in licence] == []
