"""The benchmark of maps reads the public sets from a folder of the reader's: here made up, in the published layouts."""

from __future__ import annotations

import importlib.util
import itertools
import json
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


def write_set(kind: str, folder: Path, places: tuple[str, str, str] = ("off", "corres", "off")) -> None:
    """Two bodies, the second the first renumbered, as the set would keep them: folders, and how shapes' files end."""
    shapes_in, maps_in, ending = places
    names = {"faust": ("tr_reg_080", "tr_reg_081"), "scape": ("mesh052", "mesh053"), "shrec19": ("1", "2"), "tosca": ("cat0", "cat1")}[kind]
    (folder / shapes_in).mkdir()
    (folder / maps_in).mkdir()
    for name, mesh in zip(names, (BODY, RENUMBERED), strict=True):
        if kind == "tosca":  # poses share their numbers
            np.savetxt(folder / f"{name}.vert", BODY.vertices * [1, 1, 1 + (name == names[1])])
            np.savetxt(folder / f"{name}.tri", BODY.faces + 1, fmt="%d")
        else:
            write_mesh(folder / shapes_in / f"{name}.{ending}", mesh)
    if kind == "shrec19":
        np.savetxt(folder / maps_in / "1_2.map", np.argsort(ORDER) + 1, fmt="%d")
    elif kind != "tosca":
        some = np.arange(0, 162, 2)  # template points
        np.savetxt(folder / maps_in / f"{names[0]}.vts", some + 1, fmt="%d")
        np.savetxt(folder / maps_in / f"{names[1]}.vts", np.argsort(ORDER)[some] + 1, fmt="%d")


@pytest.mark.parametrize("kind", ["faust", "scape", "shrec19", "tosca"])
def test_a_folder_of_the_published_layout_is_read(benchmark: ModuleType, tmp_path: Path, kind: str) -> None:
    write_set(kind, tmp_path)
    [(name, build)] = benchmark.published_pairs(kind, tmp_path)
    pair = build()
    assert name.startswith(kind) and pair.mesh_1.n_vertices == pair.mesh_2.n_vertices == 162
    assert len(pair.at_2) == (81 if kind in ("faust", "scape") else benchmark.N_SAMPLES) and len(pair.landmarks) == 5
    stretch = [1, 1, 2] if kind == "tosca" else [1, 1, 1]
    for at_1, at_2 in [*zip(pair.true_21, pair.at_2, strict=True), *pair.landmarks]:
        np.testing.assert_allclose(pair.mesh_1.vertices[at_1] * stretch, pair.mesh_2.vertices[at_2], atol=1e-6)


@pytest.mark.parametrize("kind", ["faust", "scape", "shrec19"])
@pytest.mark.parametrize("places", [("off_2", "corres", "off"), ("shapes", "correspondences", "ply"), ("off", "corres", "OFF")])
def test_copies_of_a_set_in_other_folders_are_read(benchmark: ModuleType, tmp_path: Path, kind: str, places: tuple[str, str, str]) -> None:
    write_set(kind, tmp_path, places)
    [(_, build)] = benchmark.published_pairs(kind, tmp_path)
    pair = build()
    np.testing.assert_allclose(pair.mesh_1.vertices[pair.true_21], pair.mesh_2.vertices[pair.at_2], atol=1e-6)


def test_a_set_is_matched_by_the_same_methods_and_kept(benchmark: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_set("faust", tmp_path)
    result = tmp_path / "result.json"
    monkeypatch.setattr(sys, "argv", ["maps", "--set", "faust", "--folder", str(tmp_path), "--methods", "ours 5", "--result", str(result)])
    monkeypatch.setattr(benchmark, "K", 60)
    benchmark.main()
    [(name, row)] = json.loads(result.read_text())["faust"].items()
    assert name == "faust tr_reg_080 -> tr_reg_081" and row["ours 5"]["error"] == 0.0 and row["ours 5"]["far"] == 0.0


def test_only_as_many_pairs_as_wanted_and_none_in_an_empty_folder(benchmark: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="no pair of the set faust in"):
        list(benchmark.published_pairs("faust", tmp_path))
    for name in ("cat0", "cat1", "cat2", "cat10", "dog0"):
        (tmp_path / f"{name}.vert").touch()
    names = [name for name, _ in benchmark.published_pairs("tosca", tmp_path)]
    assert names == ["tosca cat0 -> cat1", "tosca cat1 -> cat2", "tosca cat2 -> cat10"]
    assert len(list(benchmark.published_pairs("tosca", tmp_path, 2))) == 2


def test_the_page_says_what_the_benchmark_kept(benchmark: ModuleType) -> None:
    page = (SCRIPT.parents[1] / "docs/decisions/0103-maps-beside-pyfm.md").read_text().replace("\n", " ")
    five, rest = (json.loads((SCRIPT.parent / f"functional_maps{more}.json").read_text()) for more in ("_more", ""))
    rows = {name: row | rest["reported"][name] for name, row in five["reported"].items()}
    lines = benchmark.beside_pyfm(rows)
    assert len(rows) == 10 and all(line in page for line in lines)
    assert sum(row["ours 3"]["error"] > 1.1 * row["ours 5"]["error"] for row in rows.values()) == 5 and "missed** on five of ten" in page
    assert [float(line.split("|")[5]) > 1.05 for line in lines].count(True) == 2 and "Above 1.05 on two pairs" in page
    assert not any(benchmark.is_wrong(row[f"ours {n}"]) for row in rows.values() for n in (0, 3, 5))
    maps = [(half, found) for half, pairs in (*rest.items(), ("reported", five["reported"])) for row in pairs.values()
            for method, found in row.items() if "doubt" in found]
    assert {key: sum(found["doubt"] >= 0.5 for half, found in maps if (half, benchmark.is_wrong(found)) == key)
            for key in itertools.product(("tuned", "reported"), (True, False))} == {
        ("tuned", True): 10, ("tuned", False): 0, ("reported", True): 10, ("reported", False): 1}
    assert all(words in page for words in ("tuned 10 of 10 doubted", "reported 10 of 10", "tuned 0 of 20", "reported 1 of 30"))


def test_eight_persons_at_once_agree_better_than_each_alone() -> None:
    found = json.loads((SCRIPT.parent / "functional_maps_more.json").read_text())["together"]
    page = (SCRIPT.parents[1] / "docs/decisions/0103-maps-beside-pyfm.md").read_text()
    told = [f"{found[name]:.4f}".lstrip("0") for name in ("agreement_alone", "agreement_jointly", "cycle_error", "error_matched", "error_consistent")]
    assert found["persons"] == 8 and all(number in page for number in told)
    assert found["agreement_jointly"] > 0.95 > found["agreement_alone"] and found["cycle_error"] < 0.02
