"""A part of the book alone, and a page in German: absent chapters are named, numbers stay."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import build_book
import notebooks
import part_edition
import pytest
import translation
import yaml

ROOT = build_book.ROOT
TOC = yaml.safe_load((ROOT / "_toc.yml").read_text(encoding="utf-8"))
GERMAN = "book/translations/de/LC_MESSAGES/book/setup_check.po"
SMALL = {
    "_config.yml": (
        "title: T\nexecute: {}\nhtml: {}\nparse: {myst_enable_extensions: [dollarmath]}\n"
        "sphinx: {local_extensions: {offline_mathjax: tools}, config: {numfig: true, numfig_secnum_depth: 1, extensions: [myst_nb,"
        " sphinx_external_toc, sphinx_book_theme, sphinx_multitoc_numbering, sphinx.ext.mathjax, offline_mathjax]}}\n"
    ),
    "_toc.yml": (
        "format: jb-book\nroot: book/index\nparts:\n- {caption: A, numbered: 1, chapters: [{file: book/01_function_spaces}]}\n"
        "- {caption: B, numbered: 1, chapters: [{file: book/02_b}]}\n- {caption: C, chapters: [{file: book/end}, {file: book/setup_check},"
        " {file: book/large_meshes}, {file: book/your_own_shape}]}\n"
    ),
    "book/index.md": "# Start\n\nRead {doc}`01_function_spaces`, then {doc}`the second <02_b>`.\n",
    "book/01_function_spaces.md": "(ch-a)=\n# Alpha\n\n$$ x $$ (eq-a)\n\n```{table} T\n:name: fig-01-a\n\n| a |\n|---|\n| 1 |\n```\n",
    "book/02_b.md": (
        "# Beta\n\nOf {eq}`eq-a`, {numref}`fig-01-a`, {ref}`ch-a` and {ref}`that <ch-a>`; own {numref}`tab-b`.\n\n"
        "```{table} T\n:name: tab-b\n\n| a |\n|---|\n| 1 |\n```\n"
    ),
    "book/large_meshes.md": "# Large\n",
    "book/your_own_shape.md": "# Own\n",
    **{name: (ROOT / name).read_text(encoding="utf-8") for name in (GERMAN, "book/setup_check.ipynb")},
    "book/end.md": "# End\n\n{eq}`eq-typo`\n",
    **{f"tools/{name}.py": (ROOT / f"tools/{name}.py").read_text(encoding="utf-8") for name in ("part_edition", "offline_mathjax", "translated_pages")},
}


def prose(page: str) -> str:
    """Return the paragraphs and headings of a page, as text."""
    article = page[page.index("<article") : page.index("</article")]
    return " ".join(re.sub("<[^>]+>", "", text) for text in re.findall(r"<(?:p|h1|h2)>(.*?)</(?:p|h1|h2)>", article, re.DOTALL))


def test_a_part_alone_names_what_is_absent_and_a_typo_still_fails(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name, text in SMALL.items():
        notebooks.write(tmp_path / name, text)
    build_book.stage(tmp_path, tmp_path / "executed", tmp_path / "static", tmp_path / "source")
    told = part_edition.cut(tmp_path, tmp_path / "source", [2], "https://example.org/notes/")
    build_book.extend(tmp_path / "source", "part_edition", told)
    build_book.extend(tmp_path / "source", "translated_pages", {"language": "de"} | build_book.TRANSLATIONS)
    assert build_book.render(tmp_path / "source", tmp_path) != 0
    warnings = [line for line in capfd.readouterr().err.splitlines() if "WARNING" in line]
    assert len(warnings) == 1 and "equation not found: eq-typo" in warnings[0]
    page = (tmp_path / "_build" / "html" / "book" / "02_b.html").read_text(encoding="utf-8")
    text = re.sub(r"\s+", " ", re.sub("<[^>]+>", "", page))
    assert "Of an equation of chapter 1, a figure of chapter 1, chapter 1, Alpha and that; own Tab. 2.1." in text
    assert 'href="https://example.org/notes/book/01_function_spaces.html#eq-a"' in page
    assert re.search(r"<h1>(<span[^>]*>)?2\. ?(</span>)?Beta", page), "the chapter keeps its number"
    page = (tmp_path / "_build" / "html" / "book" / "setup_check.html").read_text(encoding="utf-8")
    assert "Funktioniert meine Einrichtung?" in prose(page) and '<html lang="de"' in page
    words = [re.sub("[^\\w ]", "", one.string)[:25] for one in translation.read(ROOT / GERMAN) if one.id and "$" not in one.string]
    shown = re.sub("[^\\w ]", "", prose(page))
    assert sum(start in shown for start in words) >= 8, "most paragraphs are German; one that changed is English again"
    assert not (tmp_path / "_build" / "html" / "book" / "01_function_spaces.html").exists()


@pytest.mark.parametrize("part", [1, 2, 3, 4])
def test_every_reference_of_a_part_is_kept_or_can_be_named(part: int) -> None:
    kept = part_edition.of_parts(TOC, [part])
    told = part_edition.described(ROOT, TOC, kept)
    assert 2 <= len(part_edition.pages(kept, numbered=True)) < len(told["numbers"])
    here = [next(ROOT.glob(f"{page}.*")) for page in [kept["root"], *part_edition.pages(kept)]]
    known = {label for path in here for label in part_edition.words(path)[1]} | set(told["labels"])
    asked = {(path.name, label) for path in here for label in re.findall(r"\{(?:eq|numref)\}`([\w-]+)`", path.read_text(encoding="utf-8"))}
    assert len(asked) > 3
    assert not [one for one in asked if one[1] not in known]


@pytest.mark.parametrize("parts", [[], [0], [5], [1, 9]])
def test_parts_that_are_not_there(parts: list[int]) -> None:
    with pytest.raises(ValueError, match=r"parts must be numbers from 1 to 4"):
        part_edition.of_parts(TOC, parts)


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_make_names_an_edition_by_its_parts() -> None:
    command = ["make", "-n", "pdf", "EDITION=student", "IN=de", "PARTS=1 3", f"VIRTUAL_ENV={sys.prefix}"]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "--edition student --language de --parts 1 --parts 3" in re.sub(r"[\\\s]+", " ", lines)
    assert "_build/student-de-1-3/_build/html" in lines
