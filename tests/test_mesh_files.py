"""Mesh files: what is written comes back, strangers' dialects are read, broken files give one clear error."""

from __future__ import annotations

import numpy as np
import pytest

from spectral_notes import mesh_files
from spectral_notes.mesh_files import read_mesh, write_mesh
from spectral_notes.meshes import TriangleMesh


@pytest.mark.parametrize(("ending", "tolerance"), [("obj", 0.0), ("off", 0.0), ("ply", 1e-6), ("stl", 1e-6), ("OFF", 0.0)])
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


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("cut.off", b"OFF\n3 1 0\n0 0 0\n1 0", "OFF file"),
        ("huge.off", b"OFF\n300000000000 1 0\n0 0 0\n", "OFF file"),
        ("flat.obj", b"v 0 0\nf 1 2 3\n", "OBJ file"),
        ("words.obj", b"hello\n\x00\x01", "0 vertices and no face"),
        ("nothing.obj", b"", "0 vertices and no face"),
        ("points.off", b"OFF\n1 0 0\n0 0 0\n", "1 vertices and no face"),
        ("range.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "faces must lie in 0 .. 2; found 8.*clean=True"),
        ("twice.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n", "1 do not.*clean=True"),
        ("noise.ply", b"\x89ply nonsense", "PLY file"),
        ("noise.stl", b"\x00\x01\x02", "STL file|no face"),
    ],
)
def test_broken_files_give_one_clear_error(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=f"(?s)path must .*{message}"):
        read_mesh(tmp_path / name)


def test_cleaning_on_request(tmp_path):
    (tmp_path / "twice.obj").write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\nf 2 2 3\n")
    mesh = read_mesh(tmp_path / "twice.obj", clean=True)
    assert (mesh.n_vertices, mesh.n_faces) == (3, 1)


def test_paths_are_checked(tmp_path, tetrahedron):
    with pytest.raises(FileNotFoundError, match="path must name an existing file"):
        read_mesh(tmp_path / "none.obj")
    with pytest.raises(ValueError, match="path's ending must be one of '.obj', '.off', '.stl', '.ply'; got '.gltf'"):
        read_mesh(tmp_path / "none.gltf")
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

    monkeypatch.setattr(mesh_files, "_write_text", half)
    with pytest.raises(KeyboardInterrupt):
        write_mesh(path, tetrahedron)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["shape.obj"]
