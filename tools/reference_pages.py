"""Sphinx extension: the pages that are made from the library and from the build itself.

`api-reference` writes the reference of what `spectral_notes` offers from its docstrings, `api-rooms` a line for every
public name of every room, `build-status` the versions and the execution times of this build. Names of NumPy, SciPy,
PyVista and Python link to their documentation: the inventories for that are written here, from the names that the book
uses, so that no build asks another host.
"""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import platform
import re
import zlib
from collections.abc import Iterator
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.util.docutils import SphinxDirective

import spectral_notes

PACKAGES = ("numpy", "scipy", "matplotlib", "pyvista", "vtk", "libigl", "robust-laplacian", "DracoPy", "scikit-learn")
# Where each project documents a name; a test imports every one of them.
LINKED: dict[str, tuple[str, str, dict[str, tuple[str, ...]]]] = {
    "python": (
        "https://docs.python.org/3/",
        "library/exceptions.html#{name}",
        {
            "py:exception": (
                "ArithmeticError", "ConnectionError", "FileNotFoundError", "ImportError", "MemoryError",
                "ModuleNotFoundError", "OSError", "RuntimeError", "TypeError", "ValueError",
            )
        },
    ),
    "numpy": (
        "https://numpy.org/doc/stable/",
        "reference/generated/{name}.html#{name}",
        {"py:class": ("numpy.ndarray",), "py:function": ("numpy.fft.fft", "numpy.fft.rfft", "numpy.linalg.eigh")},
    ),
    "scipy": (
        "https://docs.scipy.org/doc/scipy/",
        "reference/generated/{name}.html#{name}",
        {
            "py:class": ("scipy.sparse.csr_array",),
            "py:function": ("scipy.fft.dct", "scipy.linalg.eigh", "scipy.sparse.linalg.eigsh"),
        },
    ),
    "pyvista": (
        "https://docs.pyvista.org/",
        "api/core/_autosummary/{name}.html#{name}",
        {"py:class": ("pyvista.PolyData",)},
    ),
}


def inventory(project: str) -> bytes:
    """Return the inventory, in Sphinx's format, of the names of one project that the book links to."""
    _, place, roles = LINKED[project]
    sorted_names = [(name, role) for role in sorted(roles) for name in sorted(roles[role])]
    lines = [f"{name} {role} 1 {place.format(name=name)} -\n" for name, role in sorted_names]
    header = f"# Sphinx inventory version 2\n# Project: {project}\n# Version:\n"
    header += "# The remainder of this file is compressed using zlib.\n"
    return header.encode() + zlib.compress("".join(lines).encode())


def write_inventories(app: Sphinx, config: Config) -> None:
    """Write the inventories and tell intersphinx where they are."""
    folder = Path(app.doctreedir) / "inventories"
    folder.mkdir(parents=True, exist_ok=True)
    for project, (base, _, _) in LINKED.items():
        (folder / f"{project}.inv").write_bytes(inventory(project))
        config.intersphinx_mapping[project] = (base, str(folder / f"{project}.inv"))


def reference(names: list[str]) -> Iterator[str]:
    """Yield the reference of public names as reStructuredText, grouped by the module that defines them."""
    yield ".. currentmodule:: spectral_notes"
    for module, group in groupby(names, key=lambda name: getattr(spectral_notes, name).__module__):
        members = list(group)
        sentence = (inspect.getmodule(getattr(spectral_notes, members[0])).__doc__ or "").split("\n\n")[0]
        yield from ("", f".. rubric:: {module.rpartition('.')[2]}", "", plain(sentence), "")
        yield from (".. autosummary::", "   :nosignatures:", "")
        yield from (f"   {name}" for name in members)
        for name in members:
            kind = "autoclass" if inspect.isclass(getattr(spectral_notes, name)) else "autofunction"
            yield from ("", f".. {kind}:: {name}", *(["   :members:"] if kind == "autoclass" else []))


def rooms() -> dict[str, dict[str, str]]:
    """Return every public name of every room, with the sentence that its docstring opens with, "" for a constant."""
    found = {}
    for room in sorted(m.name for m in pkgutil.iter_modules(spectral_notes.__path__) if not m.name.startswith("_")):
        module = importlib.import_module(f"spectral_notes.{room}")
        defined = [name for name, thing in vars(module).items() if getattr(thing, "__module__", "") == module.__name__]
        names = getattr(module, "__all__", [name for name in defined if not name.startswith("_")])
        things = {name: getattr(module, name) for name in names}
        found[room] = {name: first_sentence(thing) for name, thing in things.items()}
    return found


def first_sentence(thing: object) -> str:
    """Return what a docstring opens with, in one line; "" for what is no function and no class."""
    written = inspect.getdoc(thing) if inspect.isclass(thing) or callable(thing) or inspect.ismodule(thing) else ""
    return " ".join((written or "").split("\n\n")[0].replace("`", "").split())


def list_of_rooms() -> list[nodes.Node]:
    """Return the rooms as definition lists that the search of the pages finds."""
    made: list[nodes.Node] = []
    for room, names in rooms().items():
        place = f"spectral_notes.{room}"
        made += [nodes.rubric("", place), nodes.paragraph(text=first_sentence(importlib.import_module(place)))]
        entries = nodes.definition_list()
        for name, sentence in names.items():
            term = nodes.term("", "", nodes.literal(text=f"{room}.{name}"))
            entries += nodes.definition_list_item(
                "", term, nodes.definition("", nodes.paragraph(text=sentence or "A constant or a type."))
            )
        made.append(entries)
    return made


def plain(text: str) -> str:
    """Return prose in which the bars of an absolute value do not begin a substitution."""
    return re.sub(r"(?<!\\)\|", r"\\|", " ".join(text.split("\n")))


def escape_bars(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Escape the bars of absolute values in docstrings; examples are code and stay."""
    for number, line in enumerate(lines):
        if "|" in line and not line.lstrip().startswith((">>>", "...")) and "``" not in line:
            lines[number] = re.sub(r"(?<!\\)\|", r"\\|", line)


class ApiReference(SphinxDirective):
    """What `spectral_notes` offers, from its docstrings, in the order of the data flow."""

    def run(self) -> list[nodes.Node]:
        """Parse the reference in place."""
        container = nodes.container()
        lines = StringList(list(reference(spectral_notes.__all__)), "spectral_notes")
        self.state.nested_parse(lines, self.content_offset, container)
        return container.children


class ApiRooms(SphinxDirective):
    """Every public name of every room, with the sentence that its docstring opens with."""

    def run(self) -> list[nodes.Node]:
        """Return the lists."""
        return list_of_rooms()


class BuildStatus(SphinxDirective):
    """The versions and the execution times of this build, as two tables."""

    def run(self) -> list[nodes.Node]:
        """Return the tables."""
        versions = [("Python", platform.python_version()), *((name, version(name)) for name in PACKAGES)]
        memories = sorted(Path(self.env.srcdir).parent.glob("executed-outputs/*.json"))
        for memory in memories:
            self.env.note_dependency(str(memory))
        times = [(path.stem, json.loads(path.read_text(encoding="utf-8")).get("seconds")) for path in memories]
        seconds = [(name, f"{time:.0f} s") for name, time in times if time is not None]
        ran = (
            table(("Notebook", "Executed in"), seconds) if seconds else nodes.paragraph(text="No times were recorded.")
        )
        return [table(("Package", "Version"), versions), ran]


def table(head: tuple[str, str], rows: list[tuple[str, str]]) -> nodes.table:
    """Return a table of two columns of text."""
    group = nodes.tgroup("", *(nodes.colspec(colwidth=1) for _ in head), cols=len(head))
    made = [[nodes.entry("", nodes.paragraph(text=cell)) for cell in row] for row in (head, *rows)]
    group += nodes.thead("", nodes.row("", *made[0]))
    group += nodes.tbody("", *(nodes.row("", *row) for row in made[1:]))
    return nodes.table("", group)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.setup_extension("sphinx.ext.intersphinx")
    app.setup_extension("sphinx.ext.autodoc")
    app.connect("config-inited", write_inventories)
    app.connect("autodoc-process-docstring", escape_bars, priority=400)
    app.add_directive("api-reference", ApiReference)
    app.add_directive("api-rooms", ApiRooms)
    app.add_directive("build-status", BuildStatus)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
