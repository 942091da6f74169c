"""The house is as its map and its rules say."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys

import house
import pytest

HEAVY = {"pyvista", "vtkmodules", "matplotlib", "sklearn", "igl", "scipy", "robust_laplacian", "DracoPy"}


def loaded_by(statement: str) -> set[str]:
    """The packages that a statement loads in a fresh interpreter."""
    code = f"import json, sys; {statement}; print(json.dumps(sorted({{name.split('.')[0] for name in sys.modules}})))"
    return set(json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout))


def test_the_map_is_drawn_from_the_contract() -> None:
    assert house.TARGET.read_text(encoding="utf-8") == house.picture(), "python tools/house.py draws it anew"


def test_every_module_and_room_is_on_the_map() -> None:
    drawn = {name for layer in house.layers() for name in layer}
    there = {path.stem for path in house.LIBRARY.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    assert drawn == there - {"__init__", "__main__"}


def test_the_top_of_the_library_stays_small() -> None:
    files = [path for path in house.LIBRARY.iterdir() if path.is_file()]
    assert len(files) <= 25
    assert len([path for path in files if path.suffix == ".py" and not path.name.startswith("_")]) <= 13


def test_a_bare_import_is_light() -> None:
    assert not loaded_by("import spectral_notes") & HEAVY
    assert not loaded_by("from spectral_notes import cotan_laplacian, compute_eigenbasis") & HEAVY - {
        "scipy", "robust_laplacian"
    }


@pytest.mark.parametrize("name", [path.name for path in house.LIBRARY.iterdir() if (path / "__init__.py").exists()])
def test_a_door_opens_what_it_names(name: str) -> None:
    room = importlib.import_module(f"spectral_notes.{name}")
    assert room.__all__ and all(hasattr(room, public) for public in room.__all__)
