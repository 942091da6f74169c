"""The command line, as strangers use it: every command on their files, standard streams, exit codes, one line a fault."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import igl
import numpy as np
import pytest

from spectral_notes._checks import REMEDIES, Failure, Refusal, named
from spectral_notes.command import cli, jobs, streams
from spectral_notes.command.cli import main
from spectral_notes.files.eigenbasis_files import read_eigenbasis
from spectral_notes.files.mesh_files import read_mesh, read_shape, write_mesh
from spectral_notes.geometry.mesh_health import CONSEQUENCES
from spectral_notes.laplacians import mass_matrix
from spectral_notes.meshes import PointCloud, TriangleMesh, positions
from spectral_notes.plotting.rendering import load_pyvista
from spectral_notes.shapes import egg, potato, sample_points, torus

EGG = egg(subdivisions=2)


def write_stranger(folder: Path, name: str) -> Path:
    """A shape as other tools write it."""
    pv, path = load_pyvista(), folder / name
    ball = pv.Sphere(theta_resolution=14, phi_resolution=10)
    if name.startswith("bundled_"):
        path = Path(pv.examples.__file__).parent / name.removeprefix("bundled_")
    elif name == "windows.obj":  # Windows line ends, normals, texture coordinates, materials
        rows = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in EGG.vertices]
        rows += ["mtllib egg.mtl", "vt 0.5 0.5", "vn 0 0 1", "usemtl shell", "s off"]
        rows += ["f " + " ".join(f"{i + 1}/1/1" for i in face) for face in EGG.faces]
        path.write_bytes("\r\n".join(["# by a stranger", "o Egg", *rows, ""]).encode())
    elif name == "negative_quads.obj":
        cube = pv.Box(level=4, quads=True).clean()
        rows = ["v {} {} {}".format(*point) for point in cube.points]
        rows += ["f " + " ".join(str(i - cube.n_points) for i in face) for face in cube.regular_faces]
        path.write_text("\n".join(rows))
    elif name in ("ascii.stl", "binary.stl", "cells.vtp"):
        ball.save(path, binary=not name.startswith("ascii"))
    elif name == "igl.off":
        igl.write_triangle_mesh(str(path), EGG.vertices, EGG.faces)
    elif name == "scan.ply":
        cloud = pv.PolyData(sample_points(EGG, 400).points)
        cloud["colour"] = np.full((400, 3), 200, np.uint8)
        cloud.save(path, texture="colour")
    else:
        np.savetxt(path, np.c_[sample_points(EGG, 400).points, np.ones(400)], fmt="%.5f")
    return path


STRANGERS = (
    "bundled_airplane.ply", "bundled_ant.ply", "bundled_nut.ply", "bundled_sphere.ply", "windows.obj",
    "negative_quads.obj", "ascii.stl", "binary.stl", "cells.vtp", "igl.off", "scan.ply", "scan.xyz",
)


@pytest.fixture
def egg_file(tmp_path):
    write_mesh(tmp_path / "egg.obj", EGG)
    return tmp_path / "egg.obj"


def spoken(capsys, *words: object) -> tuple[int, str, str]:
    """Run a command; its exit code and what it said."""
    code = main([str(word) for word in words])
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return code, out, err


def refused(capsys, code: int, message: str, *words: object) -> None:
    """Run a command that must fail with a code and one line."""
    found, out, err = spoken(capsys, *words)
    assert (found, out) == (code, "")
    lines = [line for line in err.splitlines() if not line.startswith("spectral-notes: note: ")]
    assert len(lines) == 1
    assert lines[0].startswith("spectral-notes: ")
    assert re.search(message, err), err


# --- a stranger's files through every command -------------------------------------------------------------------------


@pytest.mark.parametrize("name", STRANGERS)
def test_every_command_on_a_strangers_file(tmp_path, capsys, name):
    path = write_stranger(tmp_path, name)
    code, out, _ = spoken(capsys, "health", path, "--json")
    facts = json.loads(out)
    assert code == (1 if facts["faults"] else 0)
    clean = ["--clean"] if facts["faults"] else []
    shape = read_shape(path, clean=bool(clean))
    robust = ["--laplacian", "robust"]
    n = len(positions(shape))
    code, out, _ = spoken(
        capsys, "modes", path, "-k", 9, "-o", tmp_path / "m.npz", "-o", tmp_path / "m.vtp", "--json", *clean, *robust
    )
    assert code == 0
    modes = json.loads(out)
    basis = read_eigenbasis(tmp_path / "m.npz")
    assert (basis.k, basis.n) == (9, n)
    assert modes["eigenvalues"] == basis.evals.tolist()
    assert load_pyvista().read(tmp_path / "m.vtp").n_points == n
    assert modes["zero_modes"] == min(9, facts["components"]) if "components" in facts else modes["zero_modes"] >= 1
    pieces = max(3, facts.get("components", 1))
    code, out, _ = spoken(
        capsys,
        "segment",
        path,
        "-n",
        pieces,
        "-o",
        tmp_path / "s.ply",
        "-o",
        tmp_path / "s.csv",
        "--json",
        *clean,
        *robust,
    )
    assert code == 0
    assert sum(json.loads(out)["area_shares"]) == pytest.approx(1)
    assert len((tmp_path / "s.csv").read_text().splitlines()) == n + 1
    if isinstance(shape, PointCloud):
        refused(capsys, 2, "FILE must hold a triangle mesh", "compress", path, "-o", tmp_path / "f.sgn")
        refused(capsys, 2, "must be triangle meshes", "map", path, path)
        return
    assert spoken(capsys, "compress", path, "-o", tmp_path / "f.sgn", "--error", 0.2, *clean)[0] == 0
    assert spoken(capsys, "decompress", tmp_path / "f.sgn", "-o", tmp_path / "f.stl")[0] == 0
    assert read_mesh(tmp_path / "f.stl").n_faces == shape.n_faces


def test_map_finds_a_shape_in_its_renumbered_copy(tmp_path, capsys):
    mesh = potato(subdivisions=3)
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    write_mesh(tmp_path / "a.off", mesh)
    write_mesh(tmp_path / "b.ply", TriangleMesh(2 * mesh.vertices[order], np.argsort(order)[mesh.faces]))
    code, out, _ = spoken(
        capsys, "map", tmp_path / "a.off", tmp_path / "b.ply", "-k", 60, "--landmark", f"3,{np.argsort(order)[3]}",
        "-o", tmp_path / "map.npz", "-o", tmp_path / "map.vtp", "-o", tmp_path / "map.png", "--json",
    )
    assert code == 0
    facts = json.loads(out)
    assert facts["sure"]
    assert facts["share_of_a_hit"] == 1.0
    with np.load(tmp_path / "map.npz") as arrays:
        np.testing.assert_array_equal(arrays["p2p_21"], order)
        assert arrays["C_12"].shape == (60, 60)
    data = load_pyvista().read(tmp_path / "map.vtp")
    np.testing.assert_array_equal(data["vertex_of_a"], order)
    np.testing.assert_allclose(data["x_of_a"], data.points[:, 0] / 2)
    assert (tmp_path / "map.png").stat().st_size > 10_000
    refused(
        capsys,
        2,
        r"--landmark must name .* as in 12,40; got '3-4'",
        "map",
        tmp_path / "a.off",
        tmp_path / "b.ply",
        "--landmark",
        "3-4",
    )
    refused(
        capsys,
        2,
        "landmarks must lie in 0 .. 641; found 9999",
        "map",
        tmp_path / "a.off",
        tmp_path / "b.ply",
        "--landmark",
        "9999,1",
        "-k",
        20,
    )


# --- what is said and written -----------------------------------------------------------------------------------------


def test_modes_says_what_the_library_computes(egg_file, tmp_path, capsys):
    code, out, err = spoken(
        capsys, "modes", egg_file, "-k", 5, "--show", 3, "-o", tmp_path / "out.png", "-o", tmp_path / "out.ply"
    )
    assert code == 0
    assert err == (
        "spectral-notes: note: z is taken to point upward, since the halves of the shape are left and right of y = 0; "
        "--up x, y or z says otherwise\n"
    )
    assert "cotan Laplacian, 5 modes, 1 with eigenvalue 0" in out
    assert re.search(r"mode   1   eigenvalue +[0-9.]+", out)
    assert out.splitlines()[-2:] == [f"wrote {tmp_path / 'out.png'}", f"wrote {tmp_path / 'out.ply'}"]
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    assert load_pyvista().read(tmp_path / "out.ply")["RGB"].shape == (EGG.n_vertices, 3)


@pytest.mark.parametrize("mass", ["lumped", "voronoi", "full"])
def test_modes_takes_each_mass(egg_file, tmp_path, capsys, mass):
    code, out, _ = spoken(capsys, "modes", egg_file, "-k", 5, "--mass", mass, "-o", tmp_path / "m.npz", "--json")
    assert (code, json.loads(out)["mass"]) == (0, mass)
    stored = read_eigenbasis(tmp_path / "m.npz").M
    np.testing.assert_allclose((stored - mass_matrix(read_mesh(egg_file), kind=mass)).toarray(), 0.0, atol=1e-15)


def test_a_small_shape_gives_all_its_modes_and_no_more(tmp_path, capsys):
    write_mesh(tmp_path / "small.off", torus(5, 4))
    assert json.loads(spoken(capsys, "modes", tmp_path / "small.off", "--json", "--certify")[1])["modes"] == 20
    refused(capsys, 2, "k must be between 1 and 20; got 21", "modes", tmp_path / "small.off", "-k", 21)


def test_several_pieces_give_as_many_zero_modes_and_say_so(tmp_path, capsys):
    two = TriangleMesh(np.r_[EGG.vertices, EGG.vertices + 9], np.r_[EGG.faces, EGG.faces + EGG.n_vertices])
    write_mesh(tmp_path / "two.obj", two)
    code, out, err = spoken(capsys, "modes", tmp_path / "two.obj", "-k", 6, "--json")
    assert json.loads(out)["zero_modes"] == 2
    assert "note: the shape falls into 2 pieces: the first 2 modes have eigenvalue 0" in err
    code, out, _ = spoken(capsys, "segment", tmp_path / "two.obj", "-n", 2, "-o", tmp_path / "two.npz", "--json")
    assert code == 0
    with np.load(tmp_path / "two.npz") as arrays:
        labels = arrays["segment"]
    assert labels.tolist() == [0] * EGG.n_vertices + [1] * EGG.n_vertices
    shares = json.loads(spoken(capsys, "segment", tmp_path / "two.obj", "-n", 5, "--json")[1])["area_shares"]
    assert 0.5 in [pytest.approx(sum(shares[:2])), pytest.approx(sum(shares[:3]))]
    refused(
        capsys,
        2,
        "n must be at least 2, the number of pieces of the shape, and at most 324, of its points; got 1",
        "segment",
        tmp_path / "two.obj",
        "-n",
        1,
    )


@pytest.mark.parametrize(
    ("faces", "vertices", "said", "remedy"),
    [
        (
            [[0, 1, 2], [0, 2, 3]],
            [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]],
            "no face without area",
            "--laplacian robust works",
        ),
        ([[0, 1, 2]], [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], "no vertex without a face", "--clean drops them"),
        ([[0, 1, 2], [1, 1, 2]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "line 5: a face names a vertex twice", "--clean drops such faces"),
    ],
)
def test_a_faulty_mesh_is_refused_with_the_option_that_helps(tmp_path, capsys, faces, vertices, said, remedy):
    path = tmp_path / "faulty.obj"
    rows = ["v {} {} {}".format(*v) for v in vertices] + ["f {} {} {}".format(*(i + 1 for i in f)) for f in faces]
    path.write_text("\n".join(rows))
    refused(capsys, 2, f"{said}.*{remedy}", "modes", path, "-k", 2)
    option = ["--laplacian", "robust"] if "robust" in remedy else ["--clean"]
    assert spoken(capsys, "modes", path, "-k", 2, *option)[0] == 0


def test_health_counts_says_what_to_do_and_tells_by_its_code(tmp_path, capsys, book_of_three):
    write_mesh(tmp_path / "book.obj", book_of_three)
    code, out, _ = spoken(capsys, "health", tmp_path / "book.obj")
    assert code == 1
    assert "nonmanifold edges: 1\n    More than two sheets meet" in out
    write_mesh(tmp_path / "open.obj", TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    code, out, _ = spoken(capsys, "health", tmp_path / "open.obj", "--json")
    assert (code, json.loads(out)["faults"], json.loads(out)["boundary_edges"]) == (0, {}, 3)
    (tmp_path / "cloud.xyz").write_text("0 0 0\n0 0 0\n1 0 0\n")
    code, out, _ = spoken(capsys, "health", tmp_path / "cloud.xyz")
    assert code == 1
    assert "duplicate points: 1; --clean drops them" in out
    assert spoken(capsys, "health", tmp_path / "cloud.xyz", "--clean")[0] == 0


def test_slivers_are_noted_and_robust_needs_no_note(tmp_path, capsys):
    thin = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0.001, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    write_mesh(tmp_path / "thin.obj", thin)
    assert "note: sliver faces: 1." in spoken(capsys, "modes", tmp_path / "thin.obj", "-k", 2)[2]
    assert spoken(capsys, "modes", tmp_path / "thin.obj", "-k", 2, "--laplacian", "robust")[2] == ""


def test_compression_meets_its_target_and_comes_back(egg_file, tmp_path, capsys):
    code, out, _ = spoken(capsys, "compress", egg_file, "-o", tmp_path / "egg.sgn", "--error", 0.1, "--json")
    facts = json.loads(out)
    assert code == 0
    assert facts["vertex_error_percent"] <= 0.1
    assert facts["bytes"] == (tmp_path / "egg.sgn").stat().st_size < facts["plain_bytes"]
    for ending in jobs.MESH_FORMATS:
        assert spoken(capsys, "decompress", tmp_path / "egg.sgn", "-o", tmp_path / f"back{ending}")[0] == 0
        assert read_mesh(tmp_path / f"back{ending}").n_faces == EGG.n_faces
    data = (tmp_path / "egg.sgn").read_bytes()
    (tmp_path / "cut.sgn").write_bytes(data[:-9])
    refused(capsys, 2, ".", "decompress", tmp_path / "cut.sgn", "-o", tmp_path / "cut.obj")
    refused(
        capsys,
        2,
        "give exactly one",
        "compress",
        egg_file,
        "-o",
        tmp_path / "x.sgn",
        "--error",
        1,
        "--bits-per-vertex",
        8,
    )
    assert not (tmp_path / "cut.obj").exists()


# --- standard streams -------------------------------------------------------------------------------------------------


@pytest.fixture
def streams_of(monkeypatch):
    """Standard input with given bytes, standard output as bytes."""

    def run(data: bytes, *words: object) -> tuple[int, bytes]:
        out = io.BytesIO()
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
        monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(out, write_through=True))
        code = main([str(word) for word in words])
        return code, out.getvalue()

    return run


def test_dash_reads_standard_input_and_writes_standard_output(streams_of, egg_file, tmp_path, capsys):
    text = egg_file.read_bytes()
    code, table = streams_of(text, "modes", "-", "--from", "obj", "-k", 3, "-o", "-", "--to", "csv")
    assert code == 0
    rows = np.genfromtxt(io.BytesIO(table), delimiter=",", names=True)
    assert rows.dtype.names == ("x", "y", "z", "mode_0", "mode_1", "mode_2")
    assert len(rows) == EGG.n_vertices
    code, small = streams_of(text, "compress", "-", "--from", "OBJ", "-o", "-")
    code, back = streams_of(small, "decompress", "-", "-o", "-", "--to", "off")
    assert back.startswith(f"OFF\n{EGG.n_vertices} {EGG.n_faces} 0\n".encode())
    code, out = streams_of(text, "health", "-", "--from", "obj", "--json")
    assert json.loads(out)["name"] == "stdin"
    assert list(tmp_path.iterdir()) == [egg_file]
    assert "wrote" not in capsys.readouterr().err


def test_formats_of_streams_must_be_named(egg_file, capsys):
    refused(capsys, 2, "standard input has no ending: name its format with --from", "health", "-")
    refused(capsys, 2, "standard output has no ending: name its format with --to", "modes", egg_file, "-o", "-")
    refused(capsys, 2, "can take one output", "modes", egg_file, "-o", "-", "-o", "-", "--to", "csv")
    refused(capsys, 2, "cannot both be standard input", "map", "-", "-", "--from", "obj")


def test_from_overrides_a_wrong_ending(egg_file, tmp_path, capsys):
    egg_file.rename(tmp_path / "egg.txt")
    refused(
        capsys, 2, "egg.txt must end in one of .obj.*; got '.txt'; other formats", "health", tmp_path / "egg.txt"
    )
    assert spoken(capsys, "health", tmp_path / "egg.txt", "--from", "obj")[0] == 0
    refused(capsys, 2, "FILE must be a readable PLY file", "health", tmp_path / "egg.txt", "--from", "ply")


# --- misuse and failure -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "Missing command; see spectral-notes --help"),
        (["mods"], "No such command 'mods'"),
        (["modes"], "Missing argument 'FILE'; see spectral-notes modes --help"),
        (["modes", "EGG", "--colour"], "No such option"),
        (["modes", "EGG", "-k", "0"], "'-k'"),
        (["modes", "EGG", "-k", "many"], "'-k'"),
        (["modes", "EGG", "-k", "9", "--show", "9"], "show must be between 0 and 8; got 9"),
        (["modes", "EGG", "--laplacian", "graph"], "laplacian must be one of 'cotan', 'robust'; got 'graph'"),
        (["modes", "EGG", "--mass", "thirds"], "mass must be one of 'lumped', 'voronoi', 'full'; got 'thirds'"),
        (["modes", "EGG", "--mass", "full", "--laplacian", "robust"], "mass must be 'lumped' with the robust Laplacian"),
        (["modes", "EGG", "-o", "egg.xls"], "output must end in one of .vtp.*; got 'egg.xls'"),
        (["modes", "EGG", "-o", "no folder/egg.vtp"], "output must be in an existing folder"),
        (["segment", "EGG", "-n", "200"], "n must be between 1 and 162; got 200"),
        (["compress", "EGG"], "Missing option"),
        (["compress", "EGG", "-o", "egg.obj"], "output must end in one of .sgn"),
        (["compress", "EGG", "-o", "x.sgn", "--error", "-1"], "error must be at least"),
        (["compress", "EGG", "-o", "x.sgn", "--codec", "zip"], "codec must be one of"),
        (["decompress", "EGG", "-o", "x.obj"], "."),
        (["health", "nowhere.obj"], "FILE must name an existing file; there is none at nowhere.obj"),
        (["health", "."], "must end in one of"),
        (["doctor", "-k", "0"], "'-k'"),
    ],
)
def test_misuse_is_code_2_and_one_line(egg_file, monkeypatch, capsys, words, message):
    monkeypatch.chdir(egg_file.parent)
    refused(capsys, 2, message, *(word.replace("EGG", "egg.obj") for word in words))
    assert [path.name for path in egg_file.parent.iterdir()] == ["egg.obj"]


def test_the_input_is_not_overwritten(tmp_path, capsys):
    write_mesh(tmp_path / "egg.ply", EGG)
    before = (tmp_path / "egg.ply").read_bytes()
    refused(capsys, 2, "output must not be the input", "modes", tmp_path / "egg.ply", "-o", tmp_path / "egg.ply")
    assert (tmp_path / "egg.ply").read_bytes() == before


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (MemoryError("7 modes take 8 GB"), 1, "7 modes take 8 GB"),
        (Failure("a mode has the residual 1: try $robust"), 1, "try --laplacian robust"),
        (OSError(28, "No space left on device"), 1, "No space left"),
        (RuntimeError("two\nlines"), 1, "two lines"),
        (KeyError("surprise"), 1, "KeyError: 'surprise'; please report this"),
        (KeyboardInterrupt(), 130, "interrupted; no file was left half written"),
    ],
)
def test_a_failure_is_one_line_and_its_code(egg_file, tmp_path, monkeypatch, capsys, error, code, message):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(jobs, "compute_eigenbasis", fail)
    refused(capsys, code, message, "modes", egg_file, "-o", tmp_path / "out.vtp")
    assert [path.name for path in tmp_path.iterdir()] == ["egg.obj"]


@pytest.mark.parametrize("ending", ["vtp", "npz", "csv", "ply", "png", "html"])
def test_a_failed_write_leaves_what_was_there(egg_file, tmp_path, monkeypatch, capsys, ending):
    (tmp_path / f"out.{ending}").write_text("old")

    def full(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    refused(capsys, 1, "No space left", "modes", egg_file, "-k", 3, "-o", tmp_path / f"out.{ending}")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["egg.obj", f"out.{ending}"]
    assert (tmp_path / f"out.{ending}").read_text() == "old"


@pytest.mark.skipif(os.name == "nt", reason="signals of other systems")
@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_a_process_that_is_interrupted_says_so_and_leaves_nothing(tmp_path, signal_number):
    write_mesh(tmp_path / "torus.ply", torus(300, 200))
    words = ["modes", "torus.ply", "-k", "400", "-o", "out.vtp", "--progress"]
    process = subprocess.Popen(
        [sys.executable, "-m", "spectral_notes", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # jobs in the background ignore it
    )
    assert process.stderr is not None
    assert "400 modes of 60,000 vertices" in process.stderr.readline()
    time.sleep(0.5)
    process.send_signal(signal_number)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "spectral-notes: interrupted; no file was left half written"
    assert [path.name for path in tmp_path.iterdir()] == ["torus.ply"]


def test_progress_shows_the_time_left_on_request_only(egg_file, tmp_path, capsys):
    write_mesh(tmp_path / "torus.ply", torus(40, 30))
    _, out, err = spoken(capsys, "modes", tmp_path / "torus.ply", "-k", 9, "--progress")
    assert "9 modes of 1,200 vertices: the basis takes" in err
    assert re.search(r"\d+/\d+ \[\d\d:\d\d<\d\d:\d\d", err)  # done/needed [elapsed<left
    assert "Lanczos" not in out
    assert spoken(capsys, "modes", tmp_path / "torus.ply", "-k", 9)[2] == ""


# --- help -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_has_help(capsys, command):
    code, out, err = spoken(capsys, command, "--help")
    assert (code, err) == (0, "")
    assert "Usage: spectral-notes" in out


def test_help_names_the_commands_and_the_exit_codes(capsys):
    code, out, _ = spoken(capsys, "--help")
    assert code == 0
    assert cli.COMMANDS == ("modes", "segment", "map", "compress", "decompress", "health", "doctor")
    assert all(f"  {command} " in out for command in cli.COMMANDS)
    assert "0 done; 1 failed, or a fault was found; 2 an option or an input is wrong" in " ".join(out.split())
    assert not [line for line in out.splitlines() if line.endswith("...") and "Usage" not in line]


def test_every_remedy_of_the_library_has_a_name_on_the_command_line():
    assert set(streams.OPTIONS) == set(REMEDIES)
    error = Refusal("$path {x} costs $5: $robust or $clean, then $weld")
    assert str(error) == (
        "path {x} costs $5: robust_mesh_laplacian(mesh) or clean_mesh, then weld_vertices(mesh, tolerance)"
    )
    assert named(error.text, streams.OPTIONS) == "FILE {x} costs $5: --laplacian robust or --clean, then --weld LENGTH"
    used = {option for text in CONSEQUENCES.values() for option in re.findall(r"[$](\w+)", text)}
    assert used <= set(REMEDIES)
