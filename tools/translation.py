"""Translate pages and verdicts: catalogues of gettext, one a page, and the build of a book from them.

    python tools/translation.py de setup_check          write or update the catalogues of these pages, and of verdicts

Catalogues are `book/translations/de/LC_MESSAGES/book/setup_check.po` and, beside that folder, `verdicts.po`; any editor
of PO files fills them in. Sphinx reads the first (`build_book.py --language de`), the library the second, as the table
that is written here into `spectral_notes/checking/data/de.json`. What is not translated stays English.
"""

from __future__ import annotations

import argparse
import ast
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import notebooks
import yaml
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po, write_po

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "book" / "translations"
CHECKING = ROOT / "spectral_notes" / "checking"


# --- verdicts -------------------------------------------------------------------------------------------------------


def texts(module: str) -> Iterator[str]:
    """Yield the texts of a module, with {} where a value stands; no docstrings, no errors about arguments."""
    tree, left = ast.parse(module), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef) and isinstance(node.body[0], ast.Expr):
            left |= set(map(id, ast.walk(node.body[0])))
        if isinstance(node, ast.Raise) and "Error" in ast.unparse(node):
            left |= set(map(id, ast.walk(node)))
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            left |= set(map(id, node.values))
    for node in ast.walk(tree):
        if id(node) not in left and isinstance(node, ast.JoinedStr | ast.Constant):
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in parts)
            if isinstance(getattr(node, "value", ""), str) and " " in text.strip().replace("{}", ""):
                yield text.strip("\n")


def verdict_texts() -> Catalog:
    """Return the catalogue of everything that a verdict may say."""
    found = Catalog(project="Spectral Geometry Notes", fuzzy=False)
    for path in sorted(CHECKING.glob("*.py")):
        for text in texts(path.read_text(encoding="utf-8")):
            found.add(text, locations=[(f"checking/{path.name}", None)])
    for opening in ("Right.", "Not right.", "Not attempted yet."):
        found.add(opening)
    return found


# --- catalogues -----------------------------------------------------------------------------------------------------


def page_texts(pages: list[str]) -> dict[str, Catalog]:
    """Return the catalogues of pages, as Sphinx extracts them."""
    with tempfile.TemporaryDirectory() as folder:
        source, out = Path(folder) / "source", Path(folder) / "out"
        for page in pages:
            path = next((ROOT / "book").glob(f"{page}.*"))
            notebooks.write(source / "book" / path.name, path.read_text(encoding="utf-8"))
        parse = yaml.safe_load((ROOT / "_config.yml").read_text(encoding="utf-8"))["parse"]
        settings = {"extensions": ["myst_nb", "sphinx_exercise"], "nb_execution_mode": "off", "gettext_compact": False,
                    "root_doc": f"book/{pages[0]}", **parse}
        notebooks.write(source / "conf.py", "\n".join(f"{name} = {value!r}" for name, value in settings.items()))
        command = [sys.executable, "-m", "sphinx", "-b", "gettext", "-q", str(source), str(out)]
        subprocess.run(command, check=True, capture_output=True)
        return {page: read(out / "book" / f"{page}.pot") for page in pages}


def read(path: Path, language: str | None = None) -> Catalog:
    """Return a catalogue; an empty one where there is no file."""
    if not path.exists():
        return Catalog(locale=language, project="Spectral Geometry Notes", fuzzy=False)
    with path.open("rb") as file:
        return read_po(file, locale=language)


def update(path: Path, template: Catalog, language: str) -> Catalog:
    """Bring a catalogue up to date with the texts that there are, and return it; translations are kept."""
    catalog = read(path, language)
    catalog.update(template, no_fuzzy_matching=True)
    catalog.obsolete.clear()
    catalog.revision_date = catalog.creation_date = template.creation_date.replace(2026, 1, 1, 0, 0, 0, 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        write_po(file, catalog, width=100, no_location=True, omit_header=True)
    return catalog


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("language", help="a code such as de")
    parser.add_argument("pages", nargs="*", help="names of pages, such as setup_check or 08_eigenfunctions")
    options = parser.parse_args(arguments)
    folder = PLACE / options.language / "LC_MESSAGES"
    catalogues = {f"book/{page}": one for page, one in page_texts(options.pages).items()} if options.pages else {}
    for name, template in {**catalogues, "verdicts": verdict_texts()}.items():
        catalog = update(folder / f"{name}.po", template, options.language)
        done = {message.id: message.string for message in catalog if message.id and message.string}
        sys.stderr.write(f"{name}: {len(done)} of {len(catalog)} texts are translated\n")
    table = json.dumps(done, indent=0, ensure_ascii=False, sort_keys=True)
    notebooks.write(CHECKING / "data" / f"{options.language}.json", table + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
