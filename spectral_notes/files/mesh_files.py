"""Read and write files of meshes and point clouds: OBJ, OFF, STL, PLY, VTP and XYZ; others by well-kept libraries.

For these six no compiled reader or writer takes part: some end the interpreter on damaged files, some say nothing when
the disk is full. Nothing is allocated because a file announces it. All but STL, which has single precision, give every
digit back.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from spectral_notes._checks import Refusal, as_choice, as_instance
from spectral_notes.files.foreign import MODULES, read_foreign
from spectral_notes.files.packed import UNPACKERS, ending_of, unpacked
from spectral_notes.files.parsing import parse_obj, parse_off, parse_stl, parse_xyz
from spectral_notes.files.ply import parse_ply
from spectral_notes.files.polygons import Polygons, checked_polygons, mesh_of
from spectral_notes.files.vtp import parse_vtp
from spectral_notes.files.whole import write_whole
from spectral_notes.files.writing import WRITERS
from spectral_notes.meshes import PointCloud, Shape, TriangleMesh, clean_mesh

PARSERS = {
    ".obj": parse_obj, ".off": parse_off, ".stl": parse_stl, ".ply": parse_ply, ".vtp": parse_vtp, ".xyz": parse_xyz,
}
FORMATS = (*PARSERS, *MODULES)
REPEATING = (".stl", ".gltf", ".glb", ".3mf")  # formats whose files repeat a vertex where faces meet
CONVERT = "other formats: MeshLab, Blender or ParaView open most, and save PLY"


def read_mesh(path: str | os.PathLike[str], *, clean: bool = False) -> TriangleMesh:
    """Read a triangle mesh from a file; polygons are cut into triangles in their plane.

    The mesh is named after the file. The vertices of STL, glTF and 3MF files, which repeat them, are merged.

    Parameters
    ----------
    path : the file; its ending names the format, one of `FORMATS`, and .gz, .bz2 or .xz after it a compression
    clean : merge repeated vertices and drop broken faces and unused vertices, as `clean_mesh` does

    Raises
    ------
    OSError
        If there is no such file, it may not be read, or the path names a folder or a pipe.
    ValueError
        If the ending is not known, the file cannot be read as that format, or it holds no valid mesh.
    ModuleNotFoundError
        If the format is read by a library that is missing, part of ``pip install "spectral-notes[formats]"``.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mesh(folder + "/one.obj", TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    ...     read_mesh(folder + "/one.obj")
    TriangleMesh('one', 3 vertices, 1 faces)
    """
    shape = read_shape(path, clean=clean)
    if isinstance(shape, PointCloud):
        raise ValueError(f"path must hold triangles; {path} has {shape.n_points} vertices and no face")
    return shape


def read_shape(path: str | os.PathLike[str], *, clean: bool = False) -> Shape:
    r"""Read a triangle mesh, or a point cloud where the file holds points and no face; it raises as `read_mesh` does.

    Parameters
    ----------
    path : the file, as for `read_mesh`; XYZ is text, one point a line
    clean : merge repeated vertices or points, and drop broken faces and unused vertices

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "scan.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    ...     read_shape(folder + "/scan.xyz")
    PointCloud('scan', 3 points)
    """
    path = Path(path)
    ending = known_ending("path", path.name)
    return shape_from_bytes(read_whole(path), ending, name=shape_name(path), clean=clean, where=str(path), path=path)


def known_ending(what: str, name: str) -> str:
    """Return the ending of a file's name if it is one that is read."""
    ending = ending_of(name)
    packing = Path(ending).suffix if Path(ending).suffix in UNPACKERS else ending
    if ending not in FORMATS and ending.removesuffix(packing) not in FORMATS:
        shown = ", ".join(FORMATS)
        raise ValueError(f"{what} must end in one of {shown}, or in .gz, .bz2, .xz after it; got {ending!r}; {CONVERT}")
    return ending


def shape_name(path: Path) -> str:
    """Return the name that a shape gets after its file; what is no text in it, is replaced."""
    name = path.name[: len(path.name) - len(ending_of(path.name))] or path.name
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def shape_from_bytes(
    data: bytes, suffix: str, *, name: str = "", clean: bool = False, where: str = "the stream",
    path: Path | None = None,
) -> Shape:
    r"""Return the shape that the bytes of a whole file hold; `where` is what messages call it, `path` where it lies.

    >>> shape_from_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj")
    TriangleMesh('', 3 vertices, 1 faces)
    """
    return shape_of(polygons_from_bytes(data, suffix, where=where, path=path), suffix, name, clean=clean, where=where)


def polygons_from_bytes(data: bytes, suffix: str, *, where: str = "the stream", path: Path | None = None) -> Polygons:
    """Return the vertices and polygons that the bytes of a file hold, before anything is cut or checked."""
    suffix = known_ending("suffix", suffix)
    try:
        data, plain = unpacked(data, suffix)
        beside = path if plain == suffix else None  # what was compressed lies nowhere
        polygons = PARSERS[plain](data) if plain in PARSERS else read_foreign(data, plain, beside)
    except ValueError as error:
        raise Refusal(f"$path must be a readable {suffix[1:].upper()} file; {where} is not: {error}") from error
    if not len(polygons.vertices):
        raise Refusal(f"$path must hold vertices; {where} has 0 vertices and no face")
    return polygons


def shape_of(polygons: Polygons, suffix: str, name: str, *, clean: bool, where: str = "the stream") -> Shape:
    """Return the mesh of polygons, or the cloud where there are none."""
    try:
        polygons = checked_polygons(polygons, clean=clean)
        if not len(polygons.sizes):
            points = polygons.vertices
            if clean:
                points = points[np.sort(np.unique(points + 0.0, axis=0, return_index=True)[1])]
            return PointCloud(points, name)
        mesh = mesh_of(polygons, name)
        return clean_mesh(mesh.vertices, mesh.faces, name) if clean or ending_of(suffix) in REPEATING else mesh
    except ValueError as error:
        raise Refusal(f"$path must hold a valid mesh; {where}: {getattr(error, 'text', error)}") from error


def write_mesh(path: str | os.PathLike[str], mesh: TriangleMesh) -> None:
    """Write a mesh to an OBJ, OFF, STL, PLY or VTP file, whole or not at all.

    The file is written beside its place under another name and then moved there, so that an interrupted write leaves
    what was there before. All but STL, which stores single precision, give every digit back.

    Parameters
    ----------
    path : where to; the ending names the format
    mesh : what to write

    Raises
    ------
    OSError
        If the folder does not exist or cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> mesh = TriangleMesh([[0, 0, 0], [1 / 3, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mesh(folder + "/one.ply", mesh)
    ...     float(read_mesh(folder + "/one.ply").vertices[1, 0]) == 1 / 3
    True
    """
    path = Path(path)
    mesh = as_instance("mesh", mesh, TriangleMesh)
    suffix = as_choice("path's ending", path.suffix.lower(), tuple(WRITERS))
    write_whole(path, lambda place: WRITERS[suffix](place, mesh))


def read_whole(path: Path, what: str = "path") -> bytes:
    """Return the bytes of an ordinary file; say what is in the way where that cannot be done."""
    if not path.exists():
        raise FileNotFoundError(f"{what} must name an existing file; there is none at {path}")
    if not path.is_file():  # opening a pipe would wait for somebody to write
        raise OSError(f"{what} must name a file; {path} is a {'folder' if path.is_dir() else 'pipe or device'}")
    try:
        return path.read_bytes()
    except OSError as error:
        raise type(error)(f"{what} must name a file that you may read; {path}: {error.strerror}") from error
