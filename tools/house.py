"""Draw the map of the house, `docs/house.svg`, from the import contract, and print how large the rooms are.

    python tools/house.py
    python tools/house.py 1c8c5a3    what it was at a commit, and is now

The layers are those of `[tool.importlinter]` in pyproject.toml, which `make lint` holds the code to; the words are the
first lines of the modules and of the rooms' doors. A test compares the stored picture with what this tool draws.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tarfile
import tempfile
import textwrap
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIBRARY = ROOT / "spectral_notes"
TARGET = ROOT / "docs" / "house.svg"
WIDTH, GAP, LINE, TOP = 1160, 12, 15, 40  # pixels: of the picture, between boxes, of a line of text, above the boxes


def layers() -> list[list[str]]:
    """Return the names in each layer of the contract, the highest first; what only starts the program is left out."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    names = [re.findall(r"\w+", layer) for layer in settings["contracts"][0]["layers"]]
    return [layer for layer in names if layer != ["__main__"]]


def sources(name: str) -> list[Path]:
    """Return the files of a module or a room."""
    return sorted((LIBRARY / name).rglob("*.py")) or [LIBRARY / f"{name}.py"]


def words(name: str) -> str:
    """Return what a module or a room says of itself in its first line."""
    door = LIBRARY / name / "__init__.py"
    text = (door if door.exists() else LIBRARY / f"{name}.py").read_text(encoding="utf-8")
    said = " ".join((ast.get_docstring(ast.parse(text)) or "").split("\n\n")[0].split())
    return re.sub(r"^\w+: ", "", re.split(r"\. |\.$", said)[0])


def picture() -> str:
    """Return the map as an SVG: one row a layer, rooms with a heavy frame; imports go downward only."""
    parts: list[str] = []

    def write(x: float, y: float, words: str, style: str) -> None:
        parts.append(f'<text x="{x:.1f}" y="{y}" {style}>{escape(words)}</text>')

    y = TOP
    for layer in layers():
        width = (WIDTH - GAP * (len(layer) + 1)) / len(layer)
        said = {name: textwrap.wrap(words(name), max(12, int(width / 6.6))) for name in layer}
        height = 26 + LINE * max(map(len, said.values()))
        for i, name in enumerate(layer):
            x, room = GAP + i * (width + GAP), (LIBRARY / name).is_dir()
            frame = 'fill="#e8eef5" stroke-width="2.5"' if room else 'fill="#ffffff" stroke-width="1"'
            box = f'x="{x:.1f}" y="{y}" width="{width:.1f}" height="{height}"'
            parts.append(f'<rect {box} rx="6" stroke="#1f3044" {frame}/>')
            write(x + 8, y + 17, name + "/" * room, 'font-weight="bold"')
            for j, line in enumerate(said[name], start=1):
                write(x + 8, y + 17 + LINE * j, line, 'font-size="11"')
        y += height + GAP
    title = "Rooms (heavy frame) and modules of spectral_notes. A box imports from lower rows only."
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" role="img" aria-label="{title}"'
    head += ' font-family="sans-serif" font-size="13" fill="#1f3044">'
    write(GAP, 24, title, 'font-size="14"')
    ground = f'<rect width="{WIDTH}" height="{y}" fill="#ffffff"/>'
    return "\n".join([head, ground, *parts, "</svg>"]) + "\n"


def docstring_lines(text: str) -> set[int]:
    """Return the numbers of a module's lines that are docstrings."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    first = [node.body[0] for node in ast.walk(ast.parse(text)) if isinstance(node, kinds) and ast.get_docstring(node)]
    return {line for node in first for line in range(node.lineno, (node.end_lineno or 0) + 1)}


def is_code(line: str) -> bool:
    """Say whether a line holds more than a comment."""
    return bool(line.strip()) and not line.lstrip().startswith("#")


def measured(root: Path) -> dict[str, int]:
    """Return how large the library of a checkout is, and how many modules it loads."""
    library = root / "spectral_notes"
    top = sorted(library.glob("*.py"))
    files = sorted(library.rglob("*.py"))
    texts = [path.read_text(encoding="utf-8") for path in files]
    told = [docstring_lines(text) for text in texts]
    code = [
        number not in words and is_code(line)
        for text, words in zip(texts, told, strict=True)
        for number, line in enumerate(text.splitlines(), start=1)
    ]
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    return {
        "files at the top": len(top),
        "of them modules without an underscore": len([path for path in top if not path.name.startswith("_")]),
        "rooms": len([path for path in library.iterdir() if (path / "__init__.py").exists()]),
        "lines": sum(text.count("\n") for text in texts),
        "lines of docstrings": sum(map(len, told)),
        "lines of code": sum(code),
        "lines of the files at the top": sum(path.read_text(encoding="utf-8").count("\n") for path in top),
        "layers of the import contract": len(settings["contracts"][0]["layers"]),
        "Python modules in memory after a bare import": loaded(root, "import spectral_notes"),
        "after importing plotting": loaded(root, "import spectral_notes.plotting"),
    }


def loaded(root: Path, statement: str) -> int:
    """Return how many modules are loaded in a fresh interpreter after a statement."""
    code = f"import sys; {statement}; print(len(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    return int(run.stdout)


def compare(revision: str) -> str:
    """Return a table in Markdown: the library at a commit, and as it stands here."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(["git", "archive", revision], cwd=ROOT, capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(folder, filter="data")
        before = measured(Path(folder))
    rows = [f"| {name} | {before[name]:,} | {count:,} |" for name, count in measured(ROOT).items()]
    return "\n".join([f"| | {revision} | here |", "|---|---|---|", *rows]) + "\n"


def main(arguments: list[str]) -> int:
    """Write the picture and print the sizes, of each room or beside those of a commit."""
    if arguments:
        sys.stdout.write(compare(arguments[0]))
        return 0
    TARGET.write_text(picture(), encoding="utf-8")
    total = [0, 0]
    for layer in layers():
        for name in layer:
            texts = [path.read_text(encoding="utf-8") for path in sources(name)]
            counts = sum(text.count("\n") for text in texts), sum(len(docstring_lines(text)) for text in texts)
            total = [a + b for a, b in zip(total, counts, strict=True)]
            sys.stdout.write(f"{name:20s} {len(texts):3d} files {counts[0]:6d} lines, {counts[1]:5d} of docstrings\n")
    sys.stdout.write(f"{'together':20s} {'':9s} {total[0]:6d} lines, {total[1]:5d} of docstrings\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
