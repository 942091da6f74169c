"""Draw the map of the house, `docs/house.svg`, from the import contract, and print how large the rooms are.

    python tools/house.py

The layers are those of `[tool.importlinter]` in pyproject.toml, which `make lint` holds the code to; the words are the
first lines of the modules and of the rooms' doors. A test compares the stored picture with what this tool draws.
"""

from __future__ import annotations

import ast
import re
import sys
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


def docstring_lines(text: str) -> int:
    """Return how many lines of a module are docstrings."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    first = [node.body[0] for node in ast.walk(ast.parse(text)) if isinstance(node, kinds) and ast.get_docstring(node)]
    return sum((node.end_lineno or 0) - node.lineno + 1 for node in first)


def main() -> int:
    """Write the picture and print the sizes."""
    TARGET.write_text(picture(), encoding="utf-8")
    total = [0, 0]
    for layer in layers():
        for name in layer:
            texts = [path.read_text(encoding="utf-8") for path in sources(name)]
            counts = sum(text.count("\n") for text in texts), sum(map(docstring_lines, texts))
            total = [a + b for a, b in zip(total, counts, strict=True)]
            sys.stdout.write(f"{name:20s} {len(texts):3d} files {counts[0]:6d} lines, {counts[1]:5d} of docstrings\n")
    sys.stdout.write(f"{'together':20s} {'':9s} {total[0]:6d} lines, {total[1]:5d} of docstrings\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
