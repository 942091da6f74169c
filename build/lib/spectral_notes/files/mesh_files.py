"""Read and write files of meshes and point clouds: OBJ, OFF, STL, PLY, VTP and XYZ.

No compiled reader or writer takes part: some end the interpreter on damaged files, some say nothing when the disk is
full. Nothing is allocated because a file announces it. All but STL, which has single precision, give every digit back.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spectral_notes._checks import FloatArray, as_choice, as_instance
from spectral_notes.files.parsing import parse_obj, parse_off, parse_stl, parse_xyz
from spectral_notes.files.ply import parse_ply
from spectral_notes.files.vtp import parse_vtp
from spectral_notes.files.writing import WRITERS
from spectral_notes.meshes import PointCloud, TriangleMesh, clean_mesh

PARSERS = {
    ".obj": parse_obj, ".off": parse_off, ".stl": parse_stl, ".ply": parse_ply, ".vtp": parse_vtp, ".xyz": parse_xyz,
}
FORMATS = tuple(PARSERS)


def read_mesh(path: str | os.PathLike[str], *, clean: bool = False) -> TriangleMesh:
    """Read a triangle mesh from an OBJ, OFF, STL, PLY or VTP file; polygons are cut into fans of triangles.

    Parameters
    ----------
    path : str or path
        The file; its ending names the format.
    clean : bool, optional
        Merge repeated vertices and drop broken faces and unused vertices, as `clean_mesh` does.

    Returns
    -------
    TriangleMesh
        The mesh, named after the file. The vertices of an STL file, which repeats them, are merged.

    Raises
    ------
    OSError
        If there is no such file, it may not be read, or the path names a folder or a pipe.
    ValueError
        If the ending is none that is known, the file cannot be read as that format, or it holds no valid mesh.

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


def read_shape(path: str | os.PathLike[str], *, clean: bool = False) -> TriangleMesh | PointCloud:
    r"""Read a triangle mesh, or a point cloud where the file holds points and no face.

    Parameters
    ----------
    path : str or path
        An OBJ, OFF, STL, PLY, VTP or XYZ file; its ending names the format. XYZ is text, one point a line.
    clean : bool, optional
        Merge repeated vertices or points, and drop broken faces and unused vertices.

    Returns
    -------
    TriangleMesh or PointCloud
        The shape, named after the file.

    Raises
    ------
    OSError, ValueError
        As `read_mesh`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "scan.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    ...     read_shape(folder + "/scan.xyz")
    PointCloud('scan', 3 points)
    """
    path = Path(path)
    suffix = as_choice("path's ending", path.suffix.lower(), FORMATS)
    return shape_from_bytes(read_whole(path), suffix, name=path.stem, clean=clean, where=str(path))


def shape_from_bytes(
    data: bytes, suffix: str, *, name: str = "", clean: bool = False, where: str = "the stream"
) -> TriangleMesh | PointCloud:
    r"""Return the shape that the bytes of a file hold; `where` is what messages call it.

    Parameters
    ----------
    data : bytes
        The whole file.
    suffix : {".obj", ".off", ".stl", ".ply", ".vtp", ".xyz"}
        Its format.
    name, where : str
        The name that the shape gets, and that of the file.
    clean : bool
        As for `read_shape`.

    Returns
    -------
    TriangleMesh or PointCloud
        The shape.

    Raises
    ------
    ValueError
        If the bytes cannot be read as that format, or hold no valid shape.

    Examples
    --------
    >>> shape_from_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj")
    TriangleMesh('', 3 vertices, 1 faces)
    """
    suffix = as_choice("suffix", suffix, FORMATS)
    try:
        vertices, faces = PARSERS[suffix](data)
    except ValueError as error:
        raise ValueError(f"path must be a readable {suffix[1:].upper()} file; {where} is not: {error}") from error
    if not len(vertices):
        raise ValueError(f"path must hold vertices; {where} has 0 vertices and no face")
    try:
        if not len(faces):
            return _cloud(vertices, name, clean)
        make = clean_mesh if clean or suffix == ".stl" else TriangleMesh
        return make(vertices, faces, name)
    except ValueError as error:
        remedy = "" if clean else "; read_mesh(path, clean=True) may mend it"
        raise ValueError(f"path must hold a valid mesh; {where}: {error}{remedy}") from error


def _cloud(points: FloatArray, name: str, clean: bool) -> PointCloud:
    """A point cloud, without its repeated points if wanted."""
    cloud = PointCloud(points, name)
    if not clean:
        return cloud
    _, first = np.unique(cloud.points + 0.0, axis=0, return_index=True)
    return PointCloud(cloud.points[np.sort(first)], name)


def write_mesh(path: str | os.PathLike[str], mesh: TriangleMesh) -> None:
    """Write a mesh to an OBJ, OFF, STL, PLY or VTP file, whole or not at all.

    The file is written beside its place under another name and then moved there, so that an interrupted write leaves
    what was there before. All but STL, which stores single precision, give every digit back.

    Parameters
    ----------
    path : str or path
        Where to; the ending names the format.
    mesh : TriangleMesh
        The mesh.

    Raises
    ------
    ValueError
        If the ending is not one of the five.
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


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Call `write` on a new file beside `path`, then move that file to `path`; on any error leave nothing behind."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"path must be in an existing folder; there is none at {path.parent}")
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    place = Path(name)
    try:
        write(place)
        mask = os.umask(0)
        os.umask(mask)
        place.chmod(0o666 & ~mask)
        place.replace(path)
    finally:
        place.unlink(missing_ok=True)


def read_whole(path: Path) -> bytes:
    """Return the bytes of an ordinary file; say what is in the way where that cannot be done."""
    if not path.exists():
        raise FileNotFoundError(f"path must name an existing file; there is none at {path}")
    if not path.is_file():  # opening a pipe would wait for somebody to write
        raise OSError(f"path must name a file; {path} is a {'folder' if path.is_dir() else 'pipe or device'}")
    try:
        return path.read_bytes()
    except OSError as error:
        raise type(error)(f"path must name a file that you may read; {path}: {error.strerror}") from error
