"""The labs of the book on a mesh of your own, in a running notebook."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from spectral_notes._checks import as_choice, as_count
from spectral_notes.functional_maps import as_point_map
from spectral_notes.labs.data import LabData, modes_data, surface_data
from spectral_notes.labs.recipes import arrows_data, cap_data, filter_data, map_data, parts_data
from spectral_notes.meshes import TriangleMesh
from spectral_notes.plotting.pages import Page, page
from spectral_notes.shapes import coarse_copy

SCRIPTS = Path(__file__).with_name("static")
HEIGHT = 900  # pixels of the frame in a notebook
N_LAB = 4500  # vertices of a surface in a lab that needs many modes
N_FIELD = 2500  # of one whose tangent fields are solved for in the page


def lab(name: str, *meshes: TriangleMesh, k: int | None = None, p2p_21: ArrayLike | None = None) -> Page:
    """Return a lab of the book on meshes of your own; as the last line of a notebook's cell it starts.

    The meshes are simplified to a few thousand vertices first. All numbers are computed here, and the page is whole:
    it asks nobody for anything.

    Parameters
    ----------
    name : {"eigenfunctions", "reconstruction", "heat", "arrows", "functional-map", "clusters", "fourier", "ends",
        "bump-dent", "filter"}; the cortex is the book's alone, as its data are nilearn's
    *meshes : one for "reconstruction", "heat" and "arrows"; one or more for "eigenfunctions"; two for
        "functional-map"; poses with the same faces for "clusters"; none for the other four
    k : how many modes; by default what the lab of the book has, or as many as there are vertices
    p2p_21 : (n_2,) int, for "functional-map": vertex of 2 -> vertex of 1; not needed when the two share their faces

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> page = lab("heat", egg(2), k=20).page
    >>> "spectralNotes.register" in page, "http-equiv" in page
    (True, False)
    """
    as_choice("name", name, tuple(RECIPES))
    k = None if k is None else as_count("k", k, 1)
    for mesh in meshes:
        if not isinstance(mesh, TriangleMesh):
            raise TypeError(f"meshes must be TriangleMesh; got {type(mesh).__name__}")
    few, many, recipe = RECIPES[name]
    as_count("the number of meshes", len(meshes), few, many)
    data = recipe(meshes, k, p2p_21)
    named = {f"{name}-{i}-{_plain(part.facts)}": part for i, part in enumerate(data)}
    texts = [part.script(f"labs/data/{key}") for key, part in named.items()]
    body = f'<spectral-lab name="{name}" data="{" ".join(named)}" started></spectral-lab>'
    scripts = ("arrays", "viewer", "frame", "numerics", "drawing", name)
    return page(f"lab {name}", body, texts, scripts, HEIGHT, [SCRIPTS])


def _plain(facts: object) -> str:
    """The name of a shape as one word."""
    name = facts.get("name", "") if isinstance(facts, dict) else ""
    return re.sub(r"\W+", "_", str(name)) or "shape"


def _modes(meshes: Sequence[TriangleMesh], k: int | None, _: ArrayLike | None) -> list[LabData]:
    """Return every mesh with its modes and their nodal domains."""
    coarse = [coarse_copy(mesh, 15_000)[0] for mesh in meshes]
    return [modes_data(mesh, k or min(101, mesh.n_vertices)) for mesh in coarse]


def _surface(meshes: Sequence[TriangleMesh], k: int | None, usual: int) -> list[LabData]:
    """Return one mesh with its modes."""
    coarse, _ = coarse_copy(meshes[0], N_LAB)
    return [surface_data(coarse, k or min(usual, coarse.n_vertices), in_bytes=True)]


def _map(meshes: Sequence[TriangleMesh], k: int | None, p2p_21: ArrayLike | None) -> list[LabData]:
    """Return two meshes and the map between their coarse copies."""
    one, two = meshes
    if p2p_21 is None:
        if not np.array_equal(one.faces, two.faces):
            raise ValueError("p2p_21 must be given, vertex of 2 -> vertex of 1, where the meshes share no faces")
        p2p_21 = np.arange(two.n_vertices)
    p2p_21 = as_point_map(p2p_21, one.n_vertices, two.n_vertices)
    (coarse_1, _), (coarse_2, P_2) = coarse_copy(one, N_LAB), coarse_copy(two, N_LAB)
    truth = one.vertices[p2p_21[np.asarray(P_2.argmax(axis=1)).ravel()]]
    nearest = cKDTree(coarse_1.vertices).query(truth)[1]
    return [map_data(coarse_1, coarse_2, nearest, k or min(60, coarse_1.n_vertices, coarse_2.n_vertices))]


def _parts(meshes: Sequence[TriangleMesh], k: int | None, p2p_21: ArrayLike | None) -> list[LabData]:
    """Return the poses with their parts; `k` is the number of coordinates of the embedding."""
    coarse, P = coarse_copy(meshes[0], N_LAB)
    if any(not np.array_equal(mesh.faces, meshes[0].faces) for mesh in meshes):
        raise ValueError("meshes must share their faces: poses of one mesh, the same vertices in the same order")
    names = [mesh.name or f"pose {i + 1}" for i, mesh in enumerate(meshes)]
    poses = [TriangleMesh(P @ mesh.vertices, coarse.faces, name) for mesh, name in zip(meshes, names, strict=True)]
    return [parts_data(poses, range(2, 13), d=k or 8)]


Recipe = Callable[[Sequence[TriangleMesh], int | None, ArrayLike | None], list[LabData]]
RECIPES: dict[str, tuple[int, int, Recipe]] = {  # name -> least and most meshes, and what makes the data
    "eigenfunctions": (1, 12, _modes),
    "reconstruction": (1, 1, lambda meshes, k, _: _surface(meshes, k, 500)),
    "heat": (1, 1, lambda meshes, k, _: _surface(meshes, k, 300)),
    "arrows": (1, 1, lambda meshes, *_: [arrows_data(coarse_copy(meshes[0], N_FIELD)[0])]),
    "functional-map": (2, 2, _map),
    "clusters": (1, 12, _parts),
    "fourier": (0, 0, lambda *_: []),
    "ends": (0, 0, lambda *_: []),
    "bump-dent": (0, 0, lambda *_: [cap_data()]),
    "filter": (0, 0, lambda *_: [filter_data()]),
}
