"""The pages behind the chapters: what they name exists, what they quote is said, and what they link to is there."""

from __future__ import annotations

import builtins
import importlib
import inspect
import re
import zlib
from pathlib import Path

import notebooks
import pytest
import reference_pages

import spectral_notes

ROOT = Path(notebooks.__file__).resolve().parents[1]
BOOK = ROOT / "book"
CHAPTERS = sorted(BOOK.glob("[0-9][0-9]_*.ipynb"))
PAGES = {path.stem: path.read_text(encoding="utf-8") for path in sorted(BOOK.glob("*.md"))}
PAGES |= {
    path.stem: "\n\n".join(c.source for c in notebooks.read(path).cells if c.cell_type == "markdown")
    for path in sorted(BOOK.glob("*.ipynb"))
}
SOURCES = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "spectral_notes").rglob("*.py")))
OF_OTHERS = {  # messages of git, pip and Python, which a page may quote too
    "No matching distribution found",
    "ModuleNotFoundError: No module named 'spectral_notes'",
    "git pull",
    "Your local changes ... would be overwritten by merge",
    "bad interpreter: /bin/sh^M",
}


# --- bibliography ----------------------------------------------------------------------------------------------------


def cited() -> set[str]:
    """Return the keys that the pages cite."""
    groups = re.findall(r"\{cite[a-z:]*\}`([^`]+)`", "\n".join(PAGES.values()))
    return {key.strip() for group in groups for key in group.split(",")}


def test_every_entry_is_cited_and_every_citation_has_an_entry() -> None:
    entries = re.findall(r"^@\w+\{(\w+),", (BOOK / "references.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(entries) == cited()


# --- reference -------------------------------------------------------------------------------------------------------


def test_the_reference_holds_what_the_package_offers_and_nothing_else() -> None:
    lines = "\n".join(reference_pages.reference(spectral_notes.__all__))
    assert re.findall(r"^\.\. auto(?:class|function):: (\w+)$", lines, re.MULTILINE) == spectral_notes.__all__
    assert re.findall(r"^   (\w+)$", lines, re.MULTILINE) == spectral_notes.__all__


def test_the_rooms_hold_every_public_name_with_a_sentence() -> None:
    rooms = reference_pages.rooms()
    folder = ROOT / "spectral_notes"
    assert set(rooms) == {p.stem for p in [*folder.glob("[a-z]*.py"), *(q.parent for q in folder.glob("[a-z]*/__init__.py"))]}
    for room, names in rooms.items():
        module = importlib.import_module(f"spectral_notes.{room}")
        assert names and set(getattr(module, "__all__", names)) == set(names)
        said = {n: words for n, words in names.items() if inspect.isfunction(getattr(module, n)) or inspect.isclass(getattr(module, n))}
        assert all(len(words) > 10 for words in said.values()), said
    held = {name for names in rooms.values() for name in names}
    assert set(spectral_notes.__all__) <= held and {"heat_kernel_signature", "conformal_map", "voxel_shell", "goat"} <= held
    text = " ".join(node.astext() for node in reference_pages.list_of_rooms())
    assert "shapes.goat" in text and rooms["shapes"]["goat"] in text


@pytest.mark.parametrize("name", spectral_notes.__all__)
def test_every_entry_of_the_reference_has_an_example(name: str) -> None:
    assert ">>>" in inspect.getdoc(getattr(spectral_notes, name)), "doctest runs it with the tests"


def test_bars_of_absolute_values_are_escaped_but_for_code() -> None:
    lines = ["exp(-|x - y|)", ">>> a | b", "``a | b``"]
    reference_pages.escape_bars(None, "function", "f", None, None, lines)
    assert lines == [r"exp(-\|x - y\|)", ">>> a | b", "``a | b``"]
    assert reference_pages.plain("|x|") == r"\|x\|"


# --- links to other projects -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("project", reference_pages.LINKED)
def test_names_that_are_linked_exist(project: str) -> None:
    _, _, roles = reference_pages.LINKED[project]
    for names in roles.values():
        for name in names:
            module, _, last = name.rpartition(".")
            assert hasattr(importlib.import_module(module) if module else builtins, last), name


def test_inventories_are_in_the_format_that_sphinx_reads() -> None:
    header, packed = reference_pages.inventory("numpy").split(b"using zlib.\n")
    assert header.startswith(b"# Sphinx inventory version 2\n# Project: numpy\n")
    line = "numpy.ndarray py:class 1 reference/generated/numpy.ndarray.html#numpy.ndarray -\n"
    assert line in zlib.decompress(packed).decode()


def test_names_that_pages_link_to_are_in_an_inventory_or_the_reference() -> None:
    known = {n for _, _, roles in reference_pages.LINKED.values() for names in roles.values() for n in names}
    known |= {f"spectral_notes.{name}" for name in spectral_notes.__all__}
    used = {name for text in PAGES.values() for name in re.findall(r"\{py:\w+\}`([^`<]+)`", text)}
    assert used
    assert used <= known


# --- glossary and notation -------------------------------------------------------------------------------------------


def glossary() -> list[str]:
    """Return the terms of the glossary."""
    block = re.search(r":::\{glossary\}\n(.*?)\n:::", PAGES["glossary"], re.DOTALL)[1]
    return re.findall(r"^(\S.*)$", re.sub(r"^:sorted:$", "", block, flags=re.MULTILINE), re.MULTILINE)


def test_the_glossary_is_in_order_and_says_each_word_once() -> None:
    terms = glossary()
    assert len(terms) == len(set(terms)) >= 50
    assert terms == sorted(terms, key=str.lower)


@pytest.mark.parametrize("path", CHAPTERS, ids=[path.stem for path in CHAPTERS])
def test_a_chapter_links_its_words_to_the_glossary(path: Path) -> None:
    linked = re.findall(r"\{term\}`(?:[^`<]+<)?([^`<>]+)>?`", PAGES[path.stem])
    assert len(linked) >= 2 or path.stem > "11", "the chapters of the first three parts introduce the words"
    assert len(linked) == len(set(linked)), "each word once a chapter"
    assert set(linked) <= set(glossary())


def test_code_in_the_notation_is_code_of_the_library() -> None:
    rows = re.findall(r"^\| [^|]+ \| ([^|]+) \| [^|]* \|", PAGES["notation"], re.MULTILINE)
    names = {name for row in rows for name in re.findall(r"`(\w{4,})", row)}
    assert {"evals", "vertices", "gradient_matrix"} <= names
    assert not [name for name in names if not re.search(rf"\b{name}\b", SOURCES)]


# --- corrections and troubleshooting ---------------------------------------------------------------------------------


def test_every_correction_is_decided_by_a_cell() -> None:
    cells = notebooks.read(BOOK / "where_we_differ.ipynb").cells
    kinds = [(c.cell_type, c.source) for c in cells if c.source.startswith("## ") or c.cell_type == "code"]
    sections = [at for at, (kind, text) in enumerate(kinds) if kind == "markdown" and "Further reading" not in text]
    assert len(sections) == 10
    for at in sections:
        claim, _, truth = kinds[at][1].partition("\n*True:* ")
        said = "*Said:* " in claim
        assert truth and said != ("*Easily believed:* " in claim)
        assert not said or re.search(r"\]\(https://|\{cite:|docstring in \w+ [\d.]+", claim), "whose sentence is it?"
        assert kinds[at + 1][0] == "code"


def test_messages_in_the_troubleshooting_page_are_those_of_the_library() -> None:
    quoted = re.findall(r"`([^`]+)`", " ".join(re.findall(r"^\*\*(.*?)\*\*", PAGES["troubleshooting"], re.MULTILINE)))
    said = re.sub(r'"\s*\n\s*f?"', "", SOURCES)  # a message may go on in the next line
    said = re.sub(r"\{suffix\[1:\]\.upper\(\)\}", "PLY", said)
    said += said.replace("_", " ")  # `health` prints the names of its fields with blanks
    messages = [text for text in quoted if " " in text and text not in OF_OTHERS]
    assert len(messages) >= 10
    assert not [text for text in messages if text not in said]


def test_the_changelog_for_readers_is_the_one_of_the_repository() -> None:
    assert PAGES["changelog"].split() == ["```{include}", "../CHANGELOG.md", "```"]
