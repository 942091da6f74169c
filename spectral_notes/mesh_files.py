"""Read and write mesh files: OBJ, OFF, STL and PLY.

No compiled reader or writer takes part: some end the interpreter on damaged files, some say nothing when the disk is
full. Nothing is allocated because a file announces it. OBJ, OFF and PLY give every digit back, STL single precision.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from spectral_notes._checks import as_choice, as_instance
from spectral_notes._mesh_parsing import FACET, STL_HEADER, parse_obj, parse_off, parse_stl
from spectral_notes._ply_parsing import parse_ply
from spectral_notes.meshes import TriangleMesh, clean_mesh, face_normals

PARSERS = {".obj": parse_obj, ".off": parse_off, ".stl": parse_stl, ".ply": parse_ply}
FORMATS = tuple(PARSERS)


def read_mesh(path: str | os.PathLike[str], *, clean: bool = False) -> TriangleMesh:
    """Read a triangle mesh from an OBJ, OFF, STL or PLY file; polygons are cut into fans of triangles.

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
        If the ending is not one of the four, the file cannot be read as that format, or it holds no valid mesh.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mesh(folder + "/one.obj", TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    ...     read_mesh(folder + "/one.obj")
    TriangleMesh('one', 3 vertices, 1 faces)
    """
    path = Path(path)
    suffix = as_choice("path's ending", path.suffix.lower(), FORMATS)
    try:
        vertices, faces = PARSERS[suffix](read_whole(path))
    except ValueError as error:
        raise ValueError(f"path must be a readable {suffix[1:].upper()} file; {path} is not: {error}") from error
    if not len(faces):
        raise ValueError(f"path must hold triangles; {path} has {len(vertices)} vertices and no face")
    try:
        make = clean_mesh if clean or suffix == ".stl" else TriangleMesh
        return make(vertices, faces, path.stem)
    except ValueError as error:
        remedy = "" if clean else "; read_mesh(path, clean=True) may mend it"
        raise ValueError(f"path must hold a valid mesh; {path}: {error}{remedy}") from error


def write_mesh(path: str | os.PathLike[str], mesh: TriangleMesh) -> None:
    """Write a mesh to an OBJ, OFF, STL or PLY file, whole or not at all.

    The file is written beside its place under another name and then moved there, so that an interrupted write leaves
    what was there before. OBJ, OFF and PLY give every digit back; STL stores single precision.

    Parameters
    ----------
    path : str or path
        Where to; the ending names the format.
    mesh : TriangleMesh
        The mesh.

    Raises
    ------
    ValueError
        If the ending is not one of the four.
    OSError
        If the folder does not exist or cannot be written to.
    """
    path = Path(path)
    mesh = as_instance("mesh", mesh, TriangleMesh)
    suffix = as_choice("path's ending", path.suffix.lower(), FORMATS)
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


def _write_obj(place: Path, mesh: TriangleMesh) -> None:
    """OBJ, with the 17 digits that give every float64 back."""
    with place.open("w") as file:
        np.savetxt(file, mesh.vertices, "v %.17g %.17g %.17g")
        np.savetxt(file, mesh.faces + 1, "f %d %d %d")


def _write_off(place: Path, mesh: TriangleMesh) -> None:
    """OFF, with the 17 digits that give every float64 back."""
    with place.open("w") as file:
        file.write(f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0\n")
        np.savetxt(file, mesh.vertices, "%.17g")
        np.savetxt(file, mesh.faces, "3 %d %d %d")


def _write_stl(place: Path, mesh: TriangleMesh) -> None:
    """Binary STL, which holds single precision."""
    facets = np.zeros(mesh.n_faces, FACET)
    facets["normal"] = face_normals(mesh)
    facets["corners"] = mesh.vertices[mesh.faces]
    place.write_bytes(b"".ljust(STL_HEADER - 4) + mesh.n_faces.to_bytes(4, "little") + facets.tobytes())


def _write_ply(place: Path, mesh: TriangleMesh) -> None:
    """Binary PLY in double precision."""
    axes = "".join(f"property double {axis}\n" for axis in "xyz")
    faces = np.zeros(mesh.n_faces, [("size", "u1"), ("corners", "<i4", 3)])
    faces["size"], faces["corners"] = 3, mesh.faces
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {mesh.n_vertices}\n{axes}element face {mesh.n_faces}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    place.write_bytes(header.encode() + mesh.vertices.astype("<f8").tobytes() + faces.tobytes())


WRITERS = {".obj": _write_obj, ".off": _write_off, ".stl": _write_stl, ".ply": _write_ply}
