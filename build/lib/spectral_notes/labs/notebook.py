"""The labs of the book on a mesh of your own, in a running notebook."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from spectral_notes._checks import as_choice, as_count
from spectral_notes.functional_maps import as_point_map
from spectral_notes.labs.data import LabData, coarse_copy, surface_data
from spectral_notes.labs.recipes import map_data, parts_data
from spectral_notes.meshes import TriangleMesh

SCRIPTS = Path(__file__).with_name("static")
HEIGHT = 900  # pixels of the frame in a notebook

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif; color-scheme: light dark; }}\n{style}</style></head>
<body><spectral-lab name="{name}" data="{data}"></spectral-lab>
<script>
const given = new Map();
globalThis.spectralNotes = {{
  script: async () => {{}},
  plotly: async () => globalThis.Plotly,
  register: (name, value) => given.set(name, value),
  data: async (name) => given.get(name),
}};
</script>
{scripts}
<script>addEventListener("load", () => document.querySelector("spectral-lab").start());</script>
</body></html>"""


@dataclass(frozen=True)
class Lab:
    """Hold one lab as a page of its own; a notebook shows it.

    Parameters
    ----------
    page : str
        HTML that asks nobody for anything: scripts and data are inside.
    """

    page: str

    def _repr_html_(self) -> str:
        """Return a frame with the page in it."""
        source = html.escape(self.page, quote=True)
        return f'<iframe title="lab" srcdoc="{source}" style="width: 100%; height: {HEIGHT}px; border: 0"></iframe>'


def lab(name: str, *meshes: TriangleMesh, k: int | None = None, p2p_21: ArrayLike | None = None) -> Lab:
    """Return a lab of the book on meshes of your own; as the last line of a notebook's cell it starts.

    The meshes are simplified to a few thousand vertices first. All numbers are computed here, and the page is whole:
    it asks nobody for anything.

    Parameters
    ----------
    name : {"eigenfunctions", "reconstruction", "heat", "functional-map", "clusters", "fourier"}
        Which lab.
    *meshes : TriangleMesh
        One for "reconstruction" and "heat"; one or more for "eigenfunctions"; two for "functional-map"; poses with the
        same faces for "clusters"; none for "fourier".
    k : int, optional
        How many modes; by default what the lab of the book has, or as many as there are vertices.
    p2p_21 : array_like of int, shape (n_2,), optional
        For "functional-map": vertex of 2 -> vertex of 1; not needed when the two share their faces.

    Returns
    -------
    Lab
        The page.

    Raises
    ------
    TypeError, ValueError
        If the name is none of these, the meshes are not as many as the lab needs, or cannot be simplified.
    FileNotFoundError
        If the scripts of the labs are not there, because the library was installed without the book.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> page = lab("heat", egg(2), k=20).page
    >>> "spectralNotes.register" in page, "http-equiv" in page
    (True, False)
    """
    as_choice("name", name, tuple(RECIPES))
    for mesh in meshes:
        if not isinstance(mesh, TriangleMesh):
            raise TypeError(f"meshes must be TriangleMesh; got {type(mesh).__name__}")
    few, many, recipe = RECIPES[name]
    as_count("the number of meshes", len(meshes), few, many)
    if not SCRIPTS.exists():
        raise FileNotFoundError("the scripts of the labs come with the book: install the library from its repository")
    data = recipe(meshes, k, p2p_21)
    named = {f"{name}-{i}-{_plain(part.facts)}": part for i, part in enumerate(data)}
    texts = [part.script(f"labs/data/{key}") for key, part in named.items()]
    texts += [(SCRIPTS / f"{file}.js").read_text(encoding="utf-8") for file in ("frame", "numerics", "drawing", name)]
    if data:
        texts.insert(0, (files("plotly") / "package_data" / "plotly.min.js").read_text(encoding="utf-8"))
    scripts = "\n".join("<script>" + text.replace("</script", "<\\/script") + "</script>" for text in texts)
    style = (SCRIPTS / "labs.css").read_text(encoding="utf-8")
    return Lab(PAGE.format(title=name, name=name, data=" ".join(named), style=style, scripts=scripts))


def _plain(facts: object) -> str:
    """The name of a shape as one word."""
    name = facts.get("name", "") if isinstance(facts, dict) else ""
    return re.sub(r"\W+", "_", str(name)) or "shape"


def _surfaces(meshes: Sequence[TriangleMesh], k: int | None, n: int, usual: int, in_bytes: bool) -> list[LabData]:
    """Return every mesh with its modes."""
    coarse = [coarse_copy(mesh, n)[0] for mesh in meshes]
    return [surface_data(mesh, k or min(usual, mesh.n_vertices), in_bytes=in_bytes) for mesh in coarse]


def _map(meshes: Sequence[TriangleMesh], k: int | None, p2p_21: ArrayLike | None) -> list[LabData]:
    """Return two meshes and the map between their coarse copies."""
    one, two = meshes
    if p2p_21 is None:
        if not np.array_equal(one.faces, two.faces):
            raise ValueError("p2p_21 must be given, vertex of 2 -> vertex of 1, where the meshes share no faces")
        p2p_21 = np.arange(two.n_vertices)
    p2p_21 = as_point_map(p2p_21, one.n_vertices, two.n_vertices)
    (coarse_1, _), (coarse_2, P_2) = coarse_copy(one, 2500), coarse_copy(two, 2500)
    truth = one.vertices[p2p_21[np.asarray(P_2.argmax(axis=1)).ravel()]]
    nearest = cKDTree(coarse_1.vertices).query(truth)[1]
    return [map_data(coarse_1, coarse_2, nearest, k or min(60, coarse_1.n_vertices, coarse_2.n_vertices))]


def _parts(meshes: Sequence[TriangleMesh], k: int | None, p2p_21: ArrayLike | None) -> list[LabData]:
    """Return the poses with their parts; `k` is the number of coordinates of the embedding."""
    coarse, P = coarse_copy(meshes[0], 5000)
    if any(not np.array_equal(mesh.faces, meshes[0].faces) for mesh in meshes):
        raise ValueError("meshes must share their faces: poses of one mesh, the same vertices in the same order")
    names = [mesh.name or f"pose {i + 1}" for i, mesh in enumerate(meshes)]
    poses = [TriangleMesh(P @ mesh.vertices, coarse.faces, name) for mesh, name in zip(meshes, names, strict=True)]
    return [parts_data(poses, range(2, 13), d=k or 8)]


Recipe = Callable[[Sequence[TriangleMesh], int | None, ArrayLike | None], list[LabData]]
RECIPES: dict[str, tuple[int, int, Recipe]] = {  # name -> least and most meshes, and what makes the data
    "eigenfunctions": (1, 12, lambda meshes, k, _: _surfaces(meshes, k, 2500, 101, False)),
    "reconstruction": (1, 1, lambda meshes, k, _: _surfaces(meshes, k, 4500, 500, True)),
    "heat": (1, 1, lambda meshes, k, _: _surfaces(meshes, k, 3000, 300, False)),
    "functional-map": (2, 2, _map),
    "clusters": (1, 12, _parts),
    "fourier": (0, 0, lambda *_: []),
}
