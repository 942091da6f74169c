"""The benchmark of maps reads the public sets from a folder of the reader's: here made up, in the published layouts."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from spectral_notes import shapes
from spectral_notes.files import write_mesh
from spectral_notes.meshes import TriangleMesh

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "functional_maps.py"
BODY = shapes.potato(subdivisions=2)
ORDER = np.random.default_rng(0).permutation(BODY.n_vertices)
RENUMBERED = TriangleMesh(BODY.vertices[ORDER], np.argsort(ORDER)[BODY.faces])


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("maps_benchmark", SCRIPT)
    assert spec and spec.loader
    module = sys.modules["maps_benchmark"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def write_set(kind: str, folder: Path) -> None:
    """Two bodies, the second the first renumbered, as the set would keep them."""
    names = {"faust": ("tr_reg_080", "tr_reg_081"), "scape": ("mesh052", "mesh053"), "shrec19": ("1", "2"), "tosca": ("cat0", "cat1")}[kind]
    (folder / "off").mkdir()
    (folder / "corres").mkdir()
    for name, mesh in zip(names, (BODY, RENUMBERED), strict=True):
        if kind == "tosca":  # poses share their numbers
            np.savetxt(folder / f"{name}.vert", BODY.vertices * [1, 1, 1 + (name == names[1])])
            np.savetxt(folder / f"{name}.tri", BODY.faces + 1, fmt="%d")
        else:
            write_mesh(folder / "off" / f"{name}.off", mesh)
    if kind == "shrec19":
        np.savetxt(folder / "corres" / "1_2.map", np.argsort(ORDER) + 1, fmt="%d")
    elif kind != "tosca":
        some = np.arange(0, 162, 2)  # template points
        np.savetxt(folder / "corres" / f"{names[0]}.vts", some + 1, fmt="%d")
        np.savetxt(folder / "corres" / f"{names[1]}.vts", np.argsort(ORDER)[some] + 1, fmt="%d")


@pytest.mark.parametrize("kind", ["faust", "scape", "shrec19", "tosca"])
def test_a_folder_of_the_published_layout_is_read(benchmark: ModuleType, tmp_path: Path, kind: str) -> None:
    write_set(kind, tmp_path)
    [(name, build)] = benchmark.published_pairs(kind, tmp_path)
    pair = build()
    assert name.startswith(kind) and pair.mesh_1.n_vertices == pair.mesh_2.n_vertices == 162
    assert len(pair.at_2) == 40 and len(pair.landmarks) == 5
    stretch = [1, 1, 2] if kind == "tosca" else [1, 1, 1]
    for at_1, at_2 in [*zip(pair.true_21, pair.at_2, strict=True), *pair.landmarks]:
        np.testing.assert_allclose(pair.mesh_1.vertices[at_1] * stretch, pair.mesh_2.vertices[at_2], atol=1e-6)


def test_only_as_many_pairs_as_wanted_and_none_in_an_empty_folder(benchmark: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no pair of the set faust in"):
        list(benchmark.published_pairs("faust", tmp_path))
    for name in ("cat0", "cat1", "cat2", "cat10", "dog0"):
        (tmp_path / f"{name}.vert").touch()
    names = [name for name, _ in benchmark.published_pairs("tosca", tmp_path)]
    assert names == ["tosca cat0 -> cat1", "tosca cat1 -> cat2", "tosca cat2 -> cat10"]
    assert len(list(benchmark.published_pairs("tosca", tmp_path, 2))) == 2
