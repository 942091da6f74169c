"""What strangers bring: every dialect that public reports name, read as its author meant it, or refused by line and word."""

from __future__ import annotations

import bz2
import codecs
import gzip
import lzma
import struct
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spectral_notes.files import foreign
from spectral_notes.files.mesh_files import polygons_from_bytes, read_mesh, read_shape, shape_from_bytes, write_mesh
from spectral_notes.files.polygons import Polygons, bent_polygons, ears, strips, triangles_of
from spectral_notes.meshes import PointCloud, TriangleMesh, face_normals
from spectral_notes.shapes import sphere, torus

SQUARE = {
    ".obj": "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nf 1 2 3 4\n",
    ".off": "OFF\n5 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n5 5 5\n4 0 1 2 3\n",
    ".ply": "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n5 5 5\n4 0 1 2 3\n",
    ".vtp": '<?xml version="1.0"?><VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="5" NumberOfPolys="1"><Points>'
    '<DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0 5 5 5</DataArray></Points><Polys>'
    '<DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray><DataArray type="Int32" Name="offsets" '
    'format="ascii">4</DataArray></Polys></Piece></PolyData></VTKFile>',
    ".stl": "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n",
}
MARKS = {"utf-8": codecs.BOM_UTF8, "utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE, "utf-32-le": codecs.BOM_UTF32_LE}


@pytest.mark.parametrize("encoding", MARKS)
@pytest.mark.parametrize("ending", SQUARE)
def test_a_byte_order_mark_loses_nothing_in_any_text_format(ending, encoding):
    data = MARKS[encoding] + SQUARE[ending].encode(encoding)
    mesh = shape_from_bytes(data, ending)
    assert (mesh.n_vertices, mesh.area) == (4 if ending == ".stl" else 5, 1.0)
    np.testing.assert_array_equal(mesh.vertices, shape_from_bytes(SQUARE[ending].encode(), ending).vertices)


def test_a_mark_before_points_and_one_that_lies():
    assert shape_from_bytes(codecs.BOM_UTF8 + b"0 0 0\n1 0 0\n", ".xyz").n_points == 2
    with pytest.raises(ValueError, match="its byte order mark announces UTF-16, which it is not"):
        shape_from_bytes(codecs.BOM_UTF16_LE + b"v 0 0 0\n1", ".obj")


@pytest.mark.parametrize(
    ("ending", "text", "line", "word"),
    [
        (".obj", "v 0,0 0,0 0,0\nv 1,5 0 0\nv 0 1,5 0\nf 1 2 3\n", 1, "0,0"),
        (".obj", "# made here\nv 0 0 0\nv 1 -1,5e2 0\nv 0 1 0\nf 1 2 3\n", 3, "-1,5e2"),
        (".off", "OFF\n3 1 0\n0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n", 4, "1,5"),
        (".ply", SQUARE[".ply"].replace("1 1 0\n", "1 ,5 0\n"), 12, ",5"),
        (".stl", SQUARE[".stl"].replace("vertex 1 0 0", "vertex 1,5 0 0"), 5, "1,5"),
        (".xyz", "0,5;0,25;0,75\n1,5;0,5;0,5\n", 1, "0,5"),
        (".xyz", "0 0 0\n0.5\t0,25\t0\n", 2, "0,25"),
    ],
)
def test_a_decimal_comma_is_refused_by_line_and_word(ending, text, line, word):
    with pytest.raises(ValueError, match=f"is not: line {line}: '{word}' stands where a number should be; it has a decimal comma"):
        shape_from_bytes(text.encode(), ending)


@pytest.mark.parametrize(
    "text",
    ["3\n0 0 0\n1 0 0\n0 1 0\n", '"X","Y","Z","Intensity[0]"\n0,0,0,1\n1,0,0,1\n0,1,0,2\n', "0, 0, 0\n1, 0, 0\n0, 1, 0\n", "0;0;0\n1;0;0\n0;1;0\n"],
)
def test_headings_and_separators_of_points(text):
    assert shape_from_bytes(text.encode(), ".xyz").points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("ending", "text", "message"),
    [
        (".obj", "v 0 0 0\n\nv 1 0\n", "line 3: a vertex has fewer than three coordinates: '1 0'"),
        (".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 x\n", "line 4: 'x' stands where an integer should be"),
        (".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", "line 4: a face names vertex -5; the file's vertices are 1 .. 3"),
        (".off", "OFF 3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n", r"line 6: a face names vertex 3; the file's vertices are 0 .. 2"),
        (".off", "OFF\n3 two 0\n", "line 2: 'two' stands where an integer should be"),
        (".ply", SQUARE[".ply"].replace("1 1 0\n", "1 one 0\n"), "line 12: 'one' stands where a number should be"),
        (".ply", SQUARE[".ply"].replace("5 5 5\n", "5 inf 5\n"), "line 14: 'inf' is no position"),
        (".ply", SQUARE[".ply"].replace("4 0 1 2 3\n", "4 0 1 2 7\n"), "line 15: a face names vertex 7; the file's vertices are 0 .. 4"),
        (".vtp", SQUARE[".vtp"].replace("5 5 5", "5 five 5"), "array Points/DataArray: 'five' stands where a number should be"),
        (".vtp", SQUARE[".vtp"].replace('NumberOfPolys="1"', 'NumberOfPolys="one"'), "its NumberOfPolys is no number: 'one'"),
        (".xyz", "0 0 0\nC 0 0\n", "line 2: 'C' stands where a number should be"),
    ],
)
def test_what_is_refused_is_named_by_line_and_word(ending, text, message):
    with pytest.raises(ValueError, match=message):
        shape_from_bytes(text.encode(), ending, clean=True)


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (".obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2\nf 1 2 3\n"),
        (".obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 1\nf 1 2 3\n"),
        (".off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n"),
    ],
)
def test_the_remedy_that_is_named_works(ending, text):
    with pytest.raises(ValueError, match=r"; read_mesh\(path, clean=True\) drops such faces$"):
        shape_from_bytes(text.encode(), ending)
    assert shape_from_bytes(text.encode(), ending, clean=True).n_faces == 1


@pytest.mark.parametrize("text", ["v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "v 0 0 0\nv 1 0 0\nf 1 2\n", "v 0 0 0\nv 1 0 0\nf 1 2 9\n"])
@pytest.mark.parametrize("clean", [False, True])
def test_no_remedy_is_named_where_none_works(text, clean):
    with pytest.raises(ValueError, match="line|at least one") as refusal:
        shape_from_bytes(text.encode(), ".obj", clean=clean)
    assert "clean" not in str(refusal.value)


# --- STL --------------------------------------------------------------------------------------------------------------


def binary_stl(header: bytes, announced: int) -> bytes:
    """The unit square as two facets."""
    facets = [(0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0), (0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 1, 0)]
    return header.ljust(80, b"\0") + struct.pack("<I", announced) + b"".join(struct.pack("<12fH", *row, 0) for row in facets)


@pytest.mark.parametrize(
    "data",
    [
        SQUARE[".stl"].upper().encode(),
        SQUARE[".stl"].encode().replace(b"\n", b"\r\n"),
        b"  " + SQUARE[".stl"].encode(),
        SQUARE[".stl"].encode().replace(b"\n", b" "),
        binary_stl(b"solid made by a CAD program", 2),
        binary_stl(b"solid made by a CAD program", 2) + b"\0\0",
        binary_stl(b"SOLID facet normal", 1),
        binary_stl(b"streamed, the number was never filled in", 0),
        binary_stl(codecs.BOM_UTF8 + b"solid", 2),
    ],
)
def test_every_stl_gives_the_unit_square(data):
    mesh = shape_from_bytes(data, ".stl")
    assert (mesh.n_vertices, mesh.n_faces, mesh.area) == (4, 2, 1.0)


# --- polygons ---------------------------------------------------------------------------------------------------------


def polygon_file(ending: str, points: list[list[float]], loop: list[int]) -> bytes:
    """One polygon as each format with polygons writes it."""
    text = ["{} {} {}".format(*point) for point in points]
    if ending == ".obj":
        return "\n".join([*(f"v {row}" for row in text), "f " + " ".join(str(i + 1) for i in loop)]).encode()
    count, row = len(loop), " ".join(map(str, loop))
    if ending == ".off":
        return "\n".join(["OFF", f"{len(points)} 1 0", *text, f"{count} {row}"]).encode()
    if ending == ".ply":
        head = SQUARE[".ply"].split("end_header")[0].replace("vertex 5", f"vertex {len(points)}")
        return "\n".join([head + "end_header", *text, f"{count} {row}"]).encode()
    xml = SQUARE[".vtp"].replace('Points="5"', f'Points="{len(points)}"').replace("0 0 0 1 0 0 1 1 0 0 1 0 5 5 5", " ".join(text))
    return xml.replace(">0 1 2 3<", f">{row}<").replace(">4<", f">{count}<").encode()


@pytest.mark.parametrize("ending", [".obj", ".off", ".ply", ".vtp"])
@pytest.mark.parametrize(
    ("outline", "area"),
    [
        ([[0, 4], [0, 0], [4, 0], [4, 4], [2, 1]], 10.0),  # an arrow; a fan about its first corner folds
        ([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], 3.0),  # an L
        ([[0, 0], [1, 0], [2, 0], [2, 2], [0, 2]], 4.0),  # a straight corner
        ([[0, 0], [3, 0], [3, 3], [0, 3], [0, 0], [1, 1], [1, 2], [2, 2], [2, 1], [1, 1]], 8.0),  # a hole and its bridge
    ],
)
@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0.0), (1e-7, 0.0), (1e-3, 1e7)])
def test_a_concave_polygon_is_cut_in_its_plane(ending, outline, area, scale, shift):
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    points = shift + scale * np.c_[outline, np.zeros(len(outline))] @ turn.T
    for turned in range(len(points)):
        loop = np.roll(np.arange(len(points)), turned).tolist()
        mesh = shape_from_bytes(polygon_file(ending, points.tolist(), loop), ending)
        assert mesh.area == pytest.approx(scale**2 * area, rel=1e-4, abs=0)
        normals = face_normals(mesh)
        assert (normals @ normals[0] > 0.9).all()  # no triangle is turned over


def test_quads_and_triangles_keep_their_order_and_convex_ones_are_fans():
    file = Polygons(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([0, 1, 2, 3, 0, 1, 2]), np.array([4, 3]))
    assert triangles_of(file).tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


@settings(max_examples=60)
@given(st.integers(3, 40), st.integers(0, 2**32 - 1))
def test_ears_of_any_star_fill_it_without_overlap(n, seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    if np.diff(angle, append=angle[0] + 2 * np.pi).max() > 3 or np.diff(angle).min() < 1e-4:
        return
    flat = rng.uniform(0.2, 1, n)[:, None] * np.c_[np.cos(angle), np.sin(angle)]
    cut = flat[ears(flat)]
    u, v = cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0]
    areas = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    after = np.roll(flat, -1, axis=0)
    assert areas.min() > 0
    assert areas.sum() == pytest.approx((flat[:, 0] * after[:, 1] - flat[:, 1] * after[:, 0]).sum() / 2)


def test_a_polygon_that_is_not_planar_is_counted_and_cut_all_the_same():
    bent = "v 0 0 0\nv 1 0 0\nv 1 1 0.2\nv 0 1 0\nf 1 2 3 4\n"
    assert bent_polygons(polygons_from_bytes(bent.encode(), ".obj")) == 1
    assert bent_polygons(polygons_from_bytes(bent.replace("0.2", "1e-4").encode(), ".obj")) == 0
    assert shape_from_bytes(bent.encode(), ".obj").n_faces == 2


@pytest.mark.parametrize("loop", [[0, 2, 1, 3], [0, 0, 1, 1, 2], [0, 1, 2, 3, 0, 1, 2, 3]])
def test_a_polygon_that_crosses_itself_gives_a_mesh(loop):
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    mesh = shape_from_bytes(polygon_file(".obj", points, loop), ".obj")
    assert 0 < mesh.n_faces <= len(loop) - 2


@pytest.mark.parametrize("rows", ["4 0 1 3 2\n", "8 0 1 3 2 -1 4 4 4\n", "6 0 0 0 1 3 2\n"])
def test_strips_of_triangles_are_read(rows):
    text = SQUARE[".ply"].replace("element face 1\nproperty list uchar", "element tristrips 1\nproperty list int")
    mesh = shape_from_bytes(text.replace("4 0 1 2 3\n", rows).encode(), ".ply")
    assert (mesh.n_faces, mesh.area) == (2, 1.0)
    assert (face_normals(mesh) == [0, 0, 1]).all()
    vtp = SQUARE[".vtp"].replace("Polys", "Strips").replace(">0 1 2 3<", ">0 1 3 2<")
    assert shape_from_bytes(vtp.encode(), ".vtp").area == 1.0


def test_faces_and_strips_in_one_file():
    text = SQUARE[".ply"].replace("end_header", "element tristrips 1\nproperty list int int vertex_indices\nend_header") + "3 0 1 4\n"
    assert shape_from_bytes(text.encode(), ".ply").faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 4]]
    assert strips(np.array([0, 1, 2, 3, 4]), np.array([5]))[0].reshape(-1, 3).tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4]]


@pytest.mark.parametrize("header", ["OFF5 1 0\n", "OFF 5 1 0\n", "OFF\n5 1 0\n", "COFF5 1 0\n", "OFF # glued\n\n5 1 0\n"])
def test_the_glued_header_of_modelnet(header):
    assert shape_from_bytes((header + SQUARE[".off"].split("0\n", 1)[1]).encode(), ".off").area == 1.0


# --- formats that libraries read, and files that were compressed ------------------------------------------------------


@pytest.mark.parametrize(("ending", "pack"), [("gz", gzip.compress), ("bz2", bz2.compress), ("xz", lzma.compress)])
def test_compressed_files(tmp_path, ending, pack):
    write_mesh(tmp_path / "plain.ply", torus(9, 7))
    data = pack((tmp_path / "plain.ply").read_bytes())
    (tmp_path / f"Scan.PLY.{ending}").write_bytes(data)
    mesh = read_mesh(tmp_path / f"Scan.PLY.{ending}")
    assert (mesh.name, mesh.n_vertices) == ("Scan", 63)
    with pytest.raises(ValueError, match=f"a readable PLY.{ending.upper()} file; .*it cannot be unpacked"):
        shape_from_bytes(data[: len(data) // 2], f".ply.{ending}")
    with pytest.raises(ValueError, match="suffix must end in one of"):
        shape_from_bytes(data, f".{ending}")


def same_surface(mesh: TriangleMesh, other: TriangleMesh) -> None:
    """Both have the same triangles, up to the order of vertices, in single precision."""
    np.testing.assert_allclose(mesh.vertices[mesh.faces], other.vertices[other.faces], atol=1e-6)


@pytest.mark.parametrize("ending", ["glb", "gltf", "3mf"])
def test_formats_of_trimesh(tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    mesh = torus(9, 7)
    scene = trimesh.Scene()
    half = len(mesh.faces) // 2
    for k, faces in enumerate((mesh.faces[:half], mesh.faces[half:])):
        part = trimesh.Trimesh(mesh.vertices / 2**k, faces, process=False)
        scene.add_geometry(part, transform=trimesh.transformations.scale_matrix(2**k))
    scene.export(str(tmp_path / f"shape.{ending}"))
    read = read_mesh(tmp_path / f"shape.{ending}")
    assert (read.n_vertices, read.n_faces) == (63, 126)  # both parts in their places, sewn up where they meet
    assert read.area == pytest.approx(mesh.area, rel=1e-5)
    if ending != "gltf":  # which lies in several files
        assert shape_from_bytes((tmp_path / f"shape.{ending}").read_bytes(), f".{ending}").n_faces == 126
    (tmp_path / f"cut.{ending}").write_bytes((tmp_path / f"shape.{ending}").read_bytes()[:99])
    with pytest.raises(ValueError, match=f"a readable {ending.upper()} file; .*trimesh does not read it"):
        read_mesh(tmp_path / f"cut.{ending}")


@pytest.mark.parametrize("binary", [True, False])
def test_vtk_and_vtu(tmp_path, binary):
    import pyvista as pv

    mesh = torus(9, 7)
    pv.PolyData.from_regular_faces(mesh.vertices, mesh.faces).save(tmp_path / "shape.vtk", binary=binary)
    same_surface(read_mesh(tmp_path / "shape.vtk"), mesh)
    ball = pv.Box(level=2).triangulate().delaunay_3d()
    ball.save(tmp_path / "solid.vtu", binary=binary)
    assert read_mesh(tmp_path / "solid.vtu", clean=True).area == pytest.approx(24.0)  # the boundary of a cube of side 2
    pv.PolyData(mesh.vertices).save(tmp_path / "points.vtk", binary=binary)
    assert read_shape(tmp_path / "points.vtk").n_points == 63
    (tmp_path / "noise.vtk").write_bytes(b"# vtk DataFile Version 3.0\nnoise\nASCII\nDATASET POLYDATA\nPOINTS 99 float\n1 2")
    with pytest.raises(ValueError, match="a readable VTK file; .* is not: it announces 99 points and ends before them"):
        read_shape(tmp_path / "noise.vtk")


def test_a_reader_that_ends_its_process_is_a_refusal(tmp_path, monkeypatch):
    (tmp_path / "child.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setattr(foreign, "CHILD", tmp_path / "child.py")
    with pytest.raises(ValueError, match="VTK does not read it: its reader ended with code -11"):
        shape_from_bytes(b"anything", ".vtk")
    (tmp_path / "child.py").write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(foreign, "PATIENCE", 1)
    with pytest.raises(ValueError, match="VTK has not read it after 1 seconds"):
        shape_from_bytes(b"anything", ".vtk")


def test_surfaces_of_brains(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    mesh = sphere(2)
    nibabel.freesurfer.write_geometry(str(tmp_path / "lh.pial"), mesh.vertices, mesh.faces)
    same_surface(read_mesh(tmp_path / "lh.pial"), mesh)
    arrays = [
        nibabel.gifti.GiftiDataArray(mesh.vertices.astype(np.float32), intent="NIFTI_INTENT_POINTSET"),
        nibabel.gifti.GiftiDataArray(mesh.faces.astype(np.int32), intent="NIFTI_INTENT_TRIANGLE"),
    ]
    nibabel.save(nibabel.GiftiImage(darrays=arrays), str(tmp_path / "lh.pial.gii"))
    same_surface(read_mesh(tmp_path / "lh.pial.gii"), mesh)
    packed = gzip.compress((tmp_path / "lh.pial.gii").read_bytes())
    same_surface(shape_from_bytes(packed, ".gii.gz"), mesh)
    for name in ("lh.white", "lh.white.gii"):
        (tmp_path / name).write_bytes(b"noise")
        with pytest.raises(ValueError, match="nibabel does not read it"):
            read_mesh(tmp_path / name)


@pytest.mark.parametrize(("ending", "library", "extra"), [(".glb", "trimesh", "formats"), (".vtk", "pyvista", "pictures")])
def test_a_format_whose_library_is_missing_names_the_extra(monkeypatch, ending, library, extra):
    monkeypatch.setattr(foreign.importlib.util, "find_spec", {}.get)
    with pytest.raises(ModuleNotFoundError, match=rf'{ending} files are read by {library}, .*"spectral-notes\[{extra}\]" brings it'):
        shape_from_bytes(b"glTF", ending)


def test_one_line_in_and_out_of_other_libraries():
    import pyvista as pv

    trimesh = pytest.importorskip("trimesh")
    mesh = torus(9, 7)
    theirs = trimesh.Trimesh(mesh.vertices, mesh.faces)
    same_surface(TriangleMesh(theirs.vertices, theirs.faces), mesh)
    assert theirs.area == pytest.approx(mesh.area)
    poly = pv.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    same_surface(TriangleMesh(poly.points, poly.regular_faces), mesh)
    V, F = mesh.vertices, mesh.faces
    same_surface(TriangleMesh(V, F), mesh)


# --- names, and what a process survives -------------------------------------------------------------------------------


@pytest.mark.skipif(sys.platform != "linux", reason="file names of bytes")
def test_a_file_name_that_is_no_text(tmp_path):
    import os

    path = os.fsdecode(os.fsencode(tmp_path) + b"/sh\xe4pe.off")
    with open(path, "w") as file:
        file.write(SQUARE[".off"])
    assert read_mesh(path).name == "sh\ufffdpe"
    run = subprocess.run(
        [sys.executable, "-m", "spectral_notes", "modes", os.fsencode(path), "-k", "3", "--clean", "-o", tmp_path / "out.html", "--json"],
        capture_output=True, check=False, env=os.environ | {"PYTHONIOENCODING": "utf-8"},
    )
    assert run.returncode == 0, run.stderr
    assert "sh\ufffdpe" in (tmp_path / "out.html").read_text(encoding="utf-8")


def test_arrays_of_a_mesh_stay_read_only_after_pickling():
    import copy
    import pickle

    for shape in (torus(9, 7), PointCloud(np.eye(3))):
        for other in (pickle.loads(pickle.dumps(shape)), copy.deepcopy(shape), copy.copy(shape)):
            array = other.points if isinstance(other, PointCloud) else other.vertices
            with pytest.raises(ValueError, match="read-only"):
                array[0, 0] = 7.0
            np.testing.assert_array_equal(array, shape.points if isinstance(shape, PointCloud) else shape.vertices)
