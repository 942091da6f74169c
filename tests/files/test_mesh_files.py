"""Mesh files: what is written comes back, strangers' dialects are read, broken files give one clear error."""

from __future__ import annotations

import os
import subprocess
import sys

import igl
import numpy as np
import pytest
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from spectral_notes.files import mesh_files
from spectral_notes.files.mesh_files import read_mesh, read_shape, write_mesh
from spectral_notes.meshes import PointCloud, TriangleMesh
from spectral_notes.plotting.rendering import load_pyvista
from spectral_notes.shapes import torus


@pytest.mark.parametrize(("ending", "tolerance"), [("obj", 0.0), ("off", 0.0), ("ply", 0.0), ("vtp", 0.0), ("stl", 1e-6), ("OFF", 0.0)])
def test_round_trip(tetrahedron, tmp_path, ending, tolerance):
    mesh = TriangleMesh(tetrahedron.vertices / 3.0, tetrahedron.faces)
    path = tmp_path / f"shape.{ending}"
    write_mesh(path, mesh)
    back = read_mesh(path)
    assert back.name == "shape"
    corners, corners_back = mesh.vertices[mesh.faces], back.vertices[back.faces]
    np.testing.assert_allclose(corners_back, corners, rtol=0, atol=tolerance)
    assert back.n_vertices == 4
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"),
        ("textured.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\n"),
        ("backwards.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2\nf -4 -2 -1\n"),
        ("quad.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"),
        ("coloured.off", "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n1 2 0 1 1 1 1\n3 0 1 2\n"),
        (
            "mixed.ply",
            ("ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n"
            "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            "0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n4 0 1 2 3\n"),
        ),
        (
            "ascii.stl",
            ("solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
            "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n"),
        ),
    ],
)
def test_dialects_give_the_unit_square(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    mesh = read_mesh(tmp_path / name)
    assert mesh.area == pytest.approx(1.0)
    assert mesh.n_vertices in (3, 4)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("sizes", [(4,), (3, 3), (3, 4)])
def test_binary_ply_of_either_byte_order_with_other_elements_and_polygons(tmp_path, order, sizes):
    """The unit square, as a quadrilateral, as two triangles, and as a triangle beside a quadrilateral of its own."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=f"{order}f8")
    name = {"<": "little", ">": "big"}[order]
    polygons = {(4,): [[0, 1, 2, 3]], (3, 3): [[0, 1, 2], [0, 2, 3]], (3, 4): [[0, 1, 2], [0, 1, 2, 3]]}[sizes]
    header = (
        f"ply\nformat binary_{name}_endian 1.0\ncomment made here\nelement material 1\nproperty list uchar uchar name\n"
        f"element vertex 4\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n"
        f"element face {len(sizes)}\nproperty list uchar int vertex_indices\nproperty ushort group\nend_header\n"
    )
    body = b"\x05brass" + b"".join(row.tobytes() + b"\x07" for row in vertices)
    for polygon in polygons:
        body += bytes([len(polygon)]) + np.array(polygon, dtype=f"{order}i4").tobytes() + b"\0\1"
    (tmp_path / "made.ply").write_bytes(header.encode() + body)
    mesh = read_mesh(tmp_path / "made.ply")
    assert mesh.area == pytest.approx(1.5 if sizes == (3, 4) else 1.0)
    np.testing.assert_array_equal(mesh.vertices, vertices)


@pytest.mark.parametrize("ending", ["obj", "off", "ply", "stl", "vtp"])
def test_other_readers_read_the_same_mesh(tmp_path, ending):
    path = tmp_path / f"shape.{ending}"
    write_mesh(path, torus(9, 7))
    mesh = read_mesh(path)
    if ending in ("obj", "off"):
        vertices, faces = igl.read_triangle_mesh(str(path))
    else:
        other = load_pyvista().read(path)
        vertices, faces = other.points, other.regular_faces
    np.testing.assert_allclose(mesh.vertices[mesh.faces], np.asarray(vertices)[faces], rtol=0, atol=1e-7)


@pytest.mark.parametrize("writer", ["ply", "stl"])
def test_text_and_binary_files_hold_the_same_mesh(tmp_path, writer):
    write_mesh(tmp_path / f"binary.{writer}", torus(9, 7))
    load_pyvista().read(tmp_path / f"binary.{writer}").save(tmp_path / f"text.{writer}", binary=False)
    binary, text = (read_mesh(tmp_path / f"{name}.{writer}") for name in ("binary", "text"))
    np.testing.assert_allclose(text.vertices[text.faces], binary.vertices[binary.faces], rtol=0, atol=1e-5)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("text", [0, 1])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZMA"])
@pytest.mark.parametrize(("header", "order"), [(32, "LittleEndian"), (64, "BigEndian")])
def test_every_way_in_which_vtk_writes_vtp_is_read(tmp_path, mode, text, compressor, header, order):
    mesh, path = torus(9, 7), tmp_path / "vtk.vtp"
    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(load_pyvista().PolyData.from_regular_faces(mesh.vertices, mesh.faces))
    writer.SetFileName(str(path))
    for setting, value in (("EncodeAppendedData", text), ("HeaderType", header)):
        getattr(writer, f"Set{setting}")(value)
    for setting in (f"DataModeTo{mode}", f"CompressorTypeTo{compressor}", f"ByteOrderTo{order}"):
        getattr(writer, f"Set{setting}")()
    assert writer.Write()
    back = read_mesh(path)
    np.testing.assert_array_equal(back.faces, mesh.faces)
    np.testing.assert_allclose(back.vertices, mesh.vertices, rtol=0, atol=1e-10 if mode == "Ascii" else 0)


def test_vtp_of_two_pieces_and_polygons(tmp_path):
    piece = (
        '<Piece NumberOfPoints="4" NumberOfPolys="1"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">'
        '0 0 {z} 1 0 {z} 1 1 {z} 0 1 {z}</DataArray></Points><Polys><DataArray type="Int32" Name="connectivity" format="ascii">'
        '0 1 2 3</DataArray><DataArray type="Int32" Name="offsets" format="ascii">4</DataArray></Polys></Piece>'
    )
    pieces = piece.format(z=0) + piece.format(z=1)
    (tmp_path / "two.vtp").write_text(f'<VTKFile type="PolyData"><PolyData>{pieces}</PolyData></VTKFile>')
    mesh = read_mesh(tmp_path / "two.vtp")
    assert (mesh.n_vertices, mesh.n_faces, mesh.area) == (8, 4, 2.0)


def test_damaged_vtp_gives_a_mesh_or_one_clear_error(tmp_path):
    mesh, path = torus(9, 7), tmp_path / "shape.vtp"
    load_pyvista().PolyData.from_regular_faces(mesh.vertices, mesh.faces).save(path)
    whole, rng, refused = path.read_bytes(), np.random.default_rng(0), 0
    for _ in range(300):
        data = bytearray(whole[: rng.integers(len(whole))] if rng.random() < 0.3 else whole)
        for place in rng.integers(len(data), size=rng.integers(1, 6)) if data else []:
            data[place] = rng.integers(256)
        path.write_bytes(data)
        try:
            shape = read_shape(path)
        except ValueError:
            refused += 1
        else:
            assert isinstance(shape, TriangleMesh | PointCloud)
    assert 0 < refused < 300


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("plain.xyz", "0 0 0\n1 0 0\n1 1 0.5\n"),
        ("coloured.xyz", "# x y z r g b\r\n0 0 0 255 0 0\r\n1 0 0 0 0 0\r\n\r\n1 1 .5 1 2 3\r\n"),
        ("commas.xyz", "x,y,z,red\n0,0,0,1\n1,0,0,1\n1;1;5e-1;2\n"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0.5\n"),
        ("points.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n1 1 0.5\n"),
        (
            "points.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
            "property uchar green\nproperty uchar blue\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n1 1 0.5 7 8 9\n",
        ),
    ],
)
def test_files_without_faces_are_point_clouds(tmp_path, name, text):
    (tmp_path / name).write_bytes(text.encode())
    cloud = read_shape(tmp_path / name)
    assert isinstance(cloud, PointCloud)
    assert cloud.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0.5]]
    with pytest.raises(ValueError, match="path must hold triangles; .* has 3 vertices and no face"):
        read_mesh(tmp_path / name)


def test_a_vtp_file_of_points_and_repeated_points(tmp_path):
    load_pyvista().PolyData(np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])).save(tmp_path / "points.vtp")
    assert read_shape(tmp_path / "points.vtp").n_points == 3
    assert read_shape(tmp_path / "points.vtp", clean=True).points.tolist() == [[0, 0, 0], [1, 0, 0]]


PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
)
VTP = (
    b'<VTKFile type="PolyData" compressor="%s"><PolyData><Piece NumberOfPoints="2"><Points>'
    b'<DataArray type="Float32" format="%s">%s</DataArray></Points></Piece></PolyData></VTKFile>'
)
CORNERS = b"0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("cut.off", b"OFF\n3 1 0\n0 0 0\n1 0", "OFF file"),
        ("huge.off", b"OFF\n300000000000 1 0\n0 0 0\n", "OFF file"),
        ("flat.obj", b"v 0 0\nf 1 2 3\n", "OBJ file"),
        ("words.obj", b"hello\n\x00\x01", "0 vertices and no face"),
        ("nothing.obj", b"", "0 vertices and no face"),
        ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4: a face names vertex 9; the file's vertices are 1 .. 3$"),
        ("twice.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n", r"line 5: a face names a vertex twice: \[1, 1, 2\]; read_mesh\(path, clean=True\) drops such faces"),
        ("zero.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "OBJ file.*line 4: a face names vertex 0, and OBJ files count from 1"),
        ("word.obj", b"v 0 0 zero\nf 1 2 3\n", "OBJ file.*line 1: 'zero' stands where a number should be"),
        ("half.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2.5\n", "OBJ file.*line 4: '2.5' stands where an integer should be"),
        ("line.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", r"line 4: a face has fewer than three corners: \[1, 2\]$"),
        ("four.off", b"4OFF\n1 0 0\n0 0 0 1\n", "does not begin with OFF, or is of a kind that is not read"),
        ("face.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "a face names fewer vertices than it announces"),
        ("inf.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 inf\n", "line 6: a number stands where an integer should be: '3 0 1 inf'"),
        ("short.stl", b"solid" + bytes(75) + b"\x02\0\0\0" + bytes(50), "134 bytes where 2 triangles take 184"),
        ("short2.stl", bytes(80) + b"\x02\0\0\0" + bytes(50), "134 bytes where 2 triangles take 184"),
        ("cut.stl", b"solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", "it ends early, after 2"),
        ("noise.ply", b"\x89ply nonsense", "PLY file"),
        ("order.ply", b"ply\nelement vertex 1\nend_header\n", "its header names no format"),
        ("kind.ply", PLY + b"property list float int vertex_indices\nend_header\n", "a line that is not understood"),
        ("lack.ply", PLY + b"property list uchar int indices\nend_header\n" + CORNERS + b"3 0 1 2", "lacks the property"),
        ("ends.ply", PLY + b"property list uchar int vertex_index\nend_header\n0 0 0\n", "announces 3 rows of 'vertex' and has 1"),
        ("thin.ply", PLY + b"property list uchar int vertex_index\nend_header\n" + CORNERS + b"4 0 1 2", "row of 'face' is too short"),
        (
            "crash.ply",  # found by fuzzing: VTK's reader ends the interpreter
            (b"ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\nproperty uchar red\n"
            b"element face 1\nproperty list vertex 4\nproperty double end_head,r\n0 0 0 1\n1 0 0\nelement vertex044\n4 0 1 2 3\n"),
            "no header from 'ply' to 'end_header'",
        ),
        (
            "memory.off",  # found by fuzzing: libigl allocates for a polygon of a billion corners
            b"COFF\n1 1 0\n0 0 0~255 0 0 255\n1 0    0111 1\n1 2 0 1 1 1 1\n3 0 1 2\n",
            "OFF file",
        ),
        ("noise.stl", b"\x00\x01\x02", "STL file|no face"),
        ("noise.xyz", b"1 2 3\n\xff\x00", "XYZ file"),
        ("flat.xyz", b"1 2\n3 4\n", "fewer than three coordinates"),
        ("infinite.xyz", b"0 0 0\n1 nan 0\n", "line 2: 'nan' is no position"),
        ("noise.vtp", b"\x00\x01<nonsense", "VTP file.*XML is broken"),
        ("grid.vtp", b'<VTKFile type="ImageData"/>', "not a surface: it holds 'ImageData'"),
        ("bomb.vtp", b'<!DOCTYPE a [<!ENTITY b "bb">]><VTKFile type="PolyData">&b;</VTKFile>', "declares entities"),
        ("lz4.vtp", VTP % (b"vtkLZ4DataCompressor", b"binary", b"AQAAAAAAAAAAAAAAAAAAAA=="), "compressed by vtkLZ4.*zlib"),
        ("short.vtp", VTP % (b"", b"ascii", b"0 0 0 1 1"), "has 5 numbers where 6 are announced"),
        ("ends.vtp", VTP % (b"", b"binary", b"AAA="), "ends inside an array"),
    ],
)
def test_broken_files_give_one_clear_error(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=f"(?s)path must .*{message}"):
        read_shape(tmp_path / name)


def test_cleaning_on_request(tmp_path):
    (tmp_path / "twice.obj").write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\nf 2 2 3\n")
    mesh = read_mesh(tmp_path / "twice.obj", clean=True)
    assert (mesh.n_vertices, mesh.n_faces) == (3, 1)


def test_paths_are_checked(tmp_path, tetrahedron):
    with pytest.raises(FileNotFoundError, match="path must name an existing file"):
        read_mesh(tmp_path / "none.obj")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(OSError, match="path must name a file; .* is a folder"):
        read_mesh(tmp_path / "folder.obj")
    with pytest.raises(ValueError, match=r"path must end in one of .obj, .off, .stl, .ply, .vtp, .xyz, .gltf.*; got '.blend'; .* save PLY"):
        read_mesh(tmp_path / "none.blend")
    with pytest.raises(ValueError, match="path's ending must be one of"):
        write_mesh(tmp_path / "none", tetrahedron)
    with pytest.raises(FileNotFoundError, match="path must be in an existing folder"):
        write_mesh(tmp_path / "no" / "folder.obj", tetrahedron)


def test_an_interrupted_write_leaves_the_old_file(tmp_path, tetrahedron, monkeypatch):
    path = tmp_path / "shape.obj"
    path.write_text("old")

    def half(place, mesh):
        place.write_text("v 0 0 0\nv 1")
        raise KeyboardInterrupt

    monkeypatch.setitem(mesh_files.WRITERS, ".obj", half)
    with pytest.raises(KeyboardInterrupt):
        write_mesh(path, tetrahedron)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["shape.obj"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(OSError, match="path must name a file; .* is a pipe or device"):
        read_mesh(tmp_path / "pipe.obj")


def test_a_file_that_may_not_be_read_is_named(tmp_path, monkeypatch):
    """The superuser may read everything, so the refusal of the system is played."""
    (tmp_path / "secret.obj").write_text("v 0 0 0\n")

    def refuse(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.read_bytes", refuse)
    with pytest.raises(PermissionError, match=r"path must name a file that you may read; .*secret.obj: Permission denied"):
        read_mesh(tmp_path / "secret.obj")


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of files as Linux does")
@pytest.mark.parametrize("ending", ["obj", "off", "ply", "stl", "vtp"])
def test_a_full_disk_leaves_the_old_file_and_no_other(tmp_path, ending):
    """Files of the process may have 4096 bytes; the write fails half way, as on a full disk."""
    path = tmp_path / f"shape.{ending}"
    path.write_text("old")
    code = (
        "import resource, signal, sys\n"
        "from spectral_notes.files.mesh_files import write_mesh\n"
        "from spectral_notes.shapes import torus\n"
        "mesh = torus(40, 30)\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "write_mesh(sys.argv[1], mesh)\n"
    )
    result = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=False)
    assert result.returncode == 1, result
    assert "OSError: " in result.stderr
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
