"""Exports: what is written for ParaView, Blender, spreadsheets and NumPy comes back equal."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes.files.arrays import ARRAY_FORMATS, shades, write_arrays
from spectral_notes.files.mesh_files import read_shape
from spectral_notes.files.ply import parse_ply
from spectral_notes.meshes import PointCloud, TriangleMesh, positions
from spectral_notes.plotting.rendering import LABEL_COLORS, load_pyvista
from spectral_notes.shapes import sphere

BALL = sphere(1)
CLOUD = PointCloud(BALL.vertices / 3, "cloud")
MODES = np.random.default_rng(0).standard_normal((42, 11))
LABELS = np.arange(42) % 5
FUNCTIONS = {"mode": MODES, "label": LABELS, "height": BALL.vertices[:, 2]}
NAMES = [*(f"mode_{i:02d}" for i in range(11)), "label", "height"]


@pytest.fixture(params=[BALL, CLOUD], ids=["mesh", "cloud"])
def shape(request):
    return request.param


def test_vtp_is_read_back_equal_by_pyvista(shape, tmp_path):
    write_arrays(tmp_path / "out.vtp", shape, FUNCTIONS)
    data = load_pyvista().read(tmp_path / "out.vtp")
    assert data.array_names == NAMES
    np.testing.assert_array_equal(data.points, positions(shape))
    for i in range(11):
        np.testing.assert_array_equal(data[f"mode_{i:02d}"], MODES[:, i])
    np.testing.assert_array_equal(data["label"], LABELS)
    if isinstance(shape, TriangleMesh):
        np.testing.assert_array_equal(data.regular_faces, shape.faces)
    else:
        assert data.n_verts == 42  # points without a cell would be invisible in ParaView


def test_ply_is_read_back_equal(shape, tmp_path):
    """VTK reads the shape and the colours; the functions are read by their place in a row."""
    write_arrays(tmp_path / "out.ply", shape, FUNCTIONS, colors="mode_03")
    data = load_pyvista().read(tmp_path / "out.ply")
    np.testing.assert_array_equal(data.points, positions(shape).astype(np.float32))
    np.testing.assert_array_equal(data["RGB"], shades(shape, MODES[:, 3], "signed"))
    header, _, body = (tmp_path / "out.ply").read_bytes().partition(b"end_header\n")
    kinds = {"double": "<f8", "int": "<i4", "uchar": "u1"}
    words = [line.split() for line in header.decode().splitlines() if line.startswith("property") and "list" not in line]
    rows = np.frombuffer(body, [(name, kinds[kind]) for _, kind, name in words], 42)
    assert list(rows.dtype.names) == ["x", "y", "z", *NAMES, "red", "green", "blue"]
    np.testing.assert_array_equal(np.stack([rows[name] for name in NAMES[:11]], axis=1), MODES)
    np.testing.assert_array_equal(rows["label"], LABELS)
    file = parse_ply((tmp_path / "out.ply").read_bytes())
    np.testing.assert_array_equal(file.vertices, positions(shape))
    assert len(file.sizes) == (80 if isinstance(shape, TriangleMesh) else 0)


def test_csv_and_npz_are_read_back_equal(shape, tmp_path):
    for ending in ("csv", "npz"):
        write_arrays(tmp_path / f"out.{ending}", shape, FUNCTIONS)
    table = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)
    assert list(table.dtype.names) == ["x", "y", "z", *NAMES]
    np.testing.assert_array_equal(np.stack([table[axis] for axis in "xyz"], axis=1), positions(shape))
    np.testing.assert_array_equal(np.stack([table[name] for name in NAMES[:11]], axis=1), MODES)
    with np.load(tmp_path / "out.npz", allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["mode"], MODES)
        assert arrays["label"].dtype == np.int64
        np.testing.assert_array_equal(arrays["vertices" if isinstance(shape, TriangleMesh) else "points"], positions(shape))


@pytest.mark.parametrize("ending", ARRAY_FORMATS)
def test_large_integers_survive_in_every_format(tmp_path, ending):
    ids = 3_000_000_000 + np.arange(42)
    ids[0] = -(2**53)
    write_arrays(tmp_path / f"out{ending}", BALL, {"id": ids})
    if ending == ".csv":
        back = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True)["id"]
    elif ending == ".npz":
        back = np.load(tmp_path / "out.npz")["id"]
    elif ending == ".ply":
        trimesh = pytest.importorskip("trimesh")
        back = trimesh.load(tmp_path / "out.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]["id"].ravel()
    else:
        back = load_pyvista().read(tmp_path / "out.vtp")["id"]
    np.testing.assert_array_equal(back, ids)


@pytest.mark.parametrize("ending", ["vtp", "ply"])
def test_an_export_is_a_shape_file_again(shape, tmp_path, ending):
    write_arrays(tmp_path / f"out.{ending}", shape, FUNCTIONS, colors="label", kind="labels")
    back = read_shape(tmp_path / f"out.{ending}")
    assert type(back) is type(shape)
    np.testing.assert_array_equal(positions(back), positions(shape))


def test_colors_are_those_of_pictures():
    assert shades(BALL, np.array([0, 1, 12]), "labels").tolist()[0] == shades(BALL, np.array([12]), "labels").tolist()[0]
    assert "#{:02x}{:02x}{:02x}".format(*shades(BALL, np.array([1]), "labels")[0]) == LABEL_COLORS[1]
    signed = shades(BALL, BALL.vertices[:, 2], "signed").astype(int)
    assert signed[np.argmax(BALL.vertices[:, 2]), 0] > signed[np.argmax(BALL.vertices[:, 2]), 2]  # red above
    assert len(np.unique(shades(BALL, np.ones(42), "positive"), axis=0)) == 1


@pytest.mark.parametrize("ending", ARRAY_FORMATS)
def test_an_interrupted_export_leaves_the_old_file_and_no_other(tmp_path, monkeypatch, ending):
    path = tmp_path / f"out{ending}"
    path.write_text("old")

    def interrupt(self, target):
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_arrays(path, BALL, FUNCTIONS)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("functions", "options", "message"),
    [
        ({"short": np.ones(3)}, {}, r"short must have shape \(42,\); got \(3,\)"),
        ({"bad": np.full(42, np.nan)}, {}, "bad must hold finite numbers"),
        ({"two words": np.ones(42)}, {}, "arrays must have names of letters, digits and _"),
        ({"x": np.ones(42)}, {}, "none of .*; got 'x'"),
        ({"a": np.ones(42)}, {"colors": "b"}, "colors must be one of 'a'; got 'b'"),
        ({"allow_pickle": np.ones(42)}, {}, "none of .*; got 'allow_pickle'"),
        ({"a": np.ones((42, 2)), "a_1": np.ones(42)}, {}, "names that differ once columns are numbered; 'a_1' comes twice"),
        ({"a_1": np.ones(42), "a": np.ones((42, 2))}, {}, "names that differ once columns are numbered; 'a_1' comes twice"),
        ({"id": np.full(42, 2**60)}, {}, "id must hold integers within 2\\^53, which files keep; found 1152921504606846976"),
        ({"id": np.full(42, 2**63, dtype=np.uint64)}, {}, "id must hold integers within 2\\^53"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, functions, options, message):
    with pytest.raises(ValueError, match=message):
        write_arrays(tmp_path / "out.ply", BALL, functions, **options)
    with pytest.raises(ValueError, match="path's ending must be one of '.vtp', '.ply', '.npz', '.csv'; got '.xls'"):
        write_arrays(tmp_path / "out.xls", BALL, {})
    assert list(tmp_path.iterdir()) == []


