"""What every command must not notice, or notice by a law: place, unit, numbering, a turned triangle, a vertex too many."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.command import jobs
from spectral_notes.files import write_mesh
from spectral_notes.meshes import PointCloud, TriangleMesh, clean_mesh
from spectral_notes.shapes import sphere

FEW = settings(max_examples=5)
SEEDS = st.integers(0, 2**32 - 1)
MOVES = st.sampled_from([(1.0, 1e6), (1e-6, 0.0), (1e6, 0.0), (1e-6, 1.0), (1e-7, 0.0)])  # scale, then shift
DIRECTION = np.array([1.0, -2.0, 0.5])


def bump(seed: int) -> TriangleMesh:
    """A lumpy ball without symmetry: three bumps of different heights where the seed says."""
    ball, rng = sphere(2), np.random.default_rng(seed)
    centres = rng.normal(size=(3, 3))
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    radius = 1 + np.exp(-3 * ((ball.vertices[:, None] - centres) ** 2).sum(axis=2)) @ [0.3, 0.6, 0.9]
    return TriangleMesh(radius[:, None] * ball.vertices * [1.0, 1.2, 1.5], ball.faces, "bump")


def moved(mesh: TriangleMesh, scale: float, shift: float) -> TriangleMesh:
    """Scaled, then moved."""
    return TriangleMesh(scale * mesh.vertices + shift * DIRECTION, mesh.faces, mesh.name)


def renumbered(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Other numbers of vertices, another order of faces, another first corner."""
    rng = np.random.default_rng(seed)
    number, order = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
    faces = np.roll(number[mesh.faces[order]], rng.integers(3), axis=1)
    return TriangleMesh(mesh.vertices[np.argsort(number)], faces, mesh.name)


def quiet(line: str) -> None:
    """Say nothing."""


def facts_of(command: str, shape) -> dict:
    """The facts that a command finds."""
    if command == "health":
        return jobs.examine_health(shape).facts
    if command == "modes":
        return jobs.find_modes(shape, 12, "", quiet).facts
    if command == "segment":
        return jobs.find_segments(shape, 4, None, "", quiet).facts
    return jobs.compress(shape, error=0.2)[0].facts


def same(command: str, facts: dict, others: dict, scale: float) -> None:
    """The facts of a shape and of its copy, by the law of each command."""
    if command == "health":
        keys = ("edges", "components", "boundary_loops", "euler_characteristic", "genus", "faults")
        assert {key: facts[key] for key in keys} == {key: others[key] for key in keys}
        assert others["volume"] == pytest.approx(scale**3 * facts["volume"], rel=1e-4, abs=0)
    elif command == "modes":
        evals = np.array(facts["eigenvalues"])
        assert np.array(others["eigenvalues"]) * scale**2 == pytest.approx(evals, rel=1e-4, abs=1e-9)
        assert others["area_of_mass"] == pytest.approx(scale**2 * facts["area_of_mass"], rel=1e-4, abs=0)
        assert others["zero_modes"] == facts["zero_modes"] == 1
    elif command == "segment":
        assert sorted(others["area_shares"]) == pytest.approx(sorted(facts["area_shares"]), abs=0.02)
    else:
        assert others["vertex_error_percent"] <= 0.2
        assert others["ratio"] == pytest.approx(facts["ratio"], rel=0.1)


@FEW
@pytest.mark.parametrize("command", ["health", "modes", "segment", "compress"])
@given(SEEDS, MOVES)
def test_place_and_unit(command, seed, move):
    scale, shift = move
    mesh = bump(seed)
    same(command, facts_of(command, mesh), facts_of(command, moved(mesh, scale, shift)), scale)


@FEW
@pytest.mark.parametrize("command", ["health", "modes", "segment", "compress"])
@given(SEEDS)
def test_numbering(command, seed):
    mesh = bump(seed)
    same(command, facts_of(command, mesh), facts_of(command, renumbered(mesh, seed)), 1.0)


@FEW
@pytest.mark.parametrize("command", ["health", "modes", "segment", "compress"])
@given(SEEDS)
def test_a_turned_triangle(command, seed):
    mesh = bump(seed)
    faces = mesh.faces.copy()
    faces[seed % len(faces)] = faces[seed % len(faces)][::-1]
    facts, others = facts_of(command, mesh), facts_of(command, TriangleMesh(mesh.vertices, faces, mesh.name))
    if command == "health":
        assert others["faults"] == {"misoriented_edges": 3}
        assert (others["genus"], others["volume"]) == (None, None)
    elif command == "compress":
        assert others["vertex_error_percent"] <= 0.2
    else:
        same(command, facts, others, 1.0)


@FEW
@pytest.mark.parametrize("command", ["health", "modes", "segment", "compress"])
@given(SEEDS)
def test_a_vertex_too_many(command, seed):
    mesh = bump(seed)
    more = TriangleMesh(np.insert(mesh.vertices, 7, [9.0, 9, 9], axis=0), mesh.faces + (mesh.faces >= 7), mesh.name)
    if command == "health":
        assert facts_of(command, more)["faults"] == {"unreferenced_vertices": 1}
    elif command in ("modes", "segment"):
        with pytest.raises(ValueError, match="no vertex without a face; 1 have none, the first is vertex 7"):
            facts_of(command, more)
    else:
        assert facts_of(command, more)["vertex_error_percent"] <= 0.2
    same(command, facts_of(command, mesh), facts_of(command, clean_mesh(more.vertices, more.faces)), 1.0)


@FEW
@given(SEEDS, MOVES)
def test_a_map_does_not_depend_on_place_unit_or_numbering(seed, move):
    mesh = bump(seed)
    rng = np.random.default_rng(seed)
    number = rng.permutation(mesh.n_vertices)
    other = TriangleMesh(moved(mesh, *move).vertices[np.argsort(number)], number[mesh.faces])
    arrays = jobs.find_map(mesh, other, [], 20, "", quiet).functions
    assert (arrays["vertex_of_a"] == np.argsort(number)).mean() > 0.95


def test_an_inside_out_shape_is_turned_and_named_before_it_is_mapped():
    mesh, said = bump(3), []
    inside_out = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    result = jobs.find_map(mesh, inside_out, [], 20, "", said.append)
    assert (result.functions["vertex_of_a"] == np.arange(mesh.n_vertices)).mean() > 0.95
    assert any("B is inside out, of volume -" in line for line in said)
    mixed = mesh.faces.copy()
    mixed[::2] = mixed[::2, ::-1]
    jobs.find_map(TriangleMesh(mesh.vertices, mixed), mesh, [], 20, "", said.append)
    assert any("A has misoriented edges" in line for line in said)


@FEW
@given(SEEDS, MOVES)
def test_clouds(seed, move):
    scale, shift = move
    points = bump(seed).vertices
    here, there = PointCloud(points), PointCloud(scale * points + shift * DIRECTION)
    assert facts_of("health", there)["faults"] == {}
    same("modes", facts_of("modes", here), facts_of("modes", there), scale)
    same("segment", facts_of("segment", here), facts_of("segment", there), scale)


ALL = """
import contextlib, io, json, sys
from spectral_notes.command.cli import main
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()) as said:
        code = main(words)
    print(json.dumps([words, code, said.getvalue()]), flush=True)
"""


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 1e7), (1e-7, 0.0), (1e7, -1e9)])
def test_no_command_dies_on_a_far_or_tiny_shape(tmp_path, scale, shift):
    """All commands in a process of their own: one that ends in a library gives a negative code, and says no more."""
    for name in "ab":
        mesh = bump(ord(name))
        write_mesh(tmp_path / f"{name}.ply", TriangleMesh(scale * mesh.vertices + shift, mesh.faces))
    lines = [
        ["health", "a.ply", "--json"],
        ["modes", "a.ply", "-k", "8", "-o", "modes.html", "-o", "modes.vtp", "--json"],
        ["segment", "a.ply", "-n", "3", "-o", "parts.ply", "--json"],
        ["map", "a.ply", "b.ply", "-k", "12", "-o", "map.npz", "--json"],
        ["compress", "a.ply", "-o", "a.sgn", "--json"],
        ["decompress", "a.sgn", "-o", "back.ply", "--json"],
    ]
    run = subprocess.run([sys.executable, "-c", ALL, json.dumps(lines)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, (run.returncode, run.stdout, run.stderr)
    said = [json.loads(line) for line in run.stdout.splitlines()]
    assert [words for words, *_ in said] == lines
    for words, code, text in said:
        assert code == 0, (words, code, run.stderr)
        assert json.loads(text)["outputs"] == [word for word in words if "." in word and words[words.index(word) - 1] == "-o"]
