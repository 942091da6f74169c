"""Read and write mesh files: OBJ, OFF, STL and PLY.

libigl reads OBJ and OFF, which are written here with every digit. STL and PLY go through PyVista and hold single
precision; libigl's own PLY reader ends the interpreter on some files, so it is not used.
"""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import igl
import numpy as np

from spectral_notes._checks import as_choice
from spectral_notes._pyvista import load_pyvista
from spectral_notes.meshes import TriangleMesh, clean_mesh

FORMATS = (".obj", ".off", ".stl", ".ply")


def read_mesh(path: str | os.PathLike[str], *, clean: bool = False) -> TriangleMesh:
    """Read a triangle mesh from an OBJ, OFF, STL or PLY file; polygons are cut into triangles.

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
    FileNotFoundError
        If there is no such file.
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
    if not path.is_file():
        raise FileNotFoundError(f"path must name an existing file; there is none at {path}")
    reader = _read_with_igl if suffix in (".obj", ".off") else _read_with_pyvista
    try:
        vertices, faces = reader(path)
    except Exception as error:
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
    what was there before. STL and PLY store single precision.

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
    suffix = as_choice("path's ending", path.suffix.lower(), FORMATS)
    write = _write_text if suffix in (".obj", ".off") else _write_with_pyvista
    write_whole(path, lambda place: write(place, mesh))


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


def _read_with_igl(path: Path) -> tuple[Any, Any]:
    """Vertices and faces by libigl."""
    vertices, faces = igl.read_triangle_mesh(str(path))
    return np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)


def _read_with_pyvista(path: Path) -> tuple[Any, Any]:
    """Vertices and faces by PyVista."""
    pv = load_pyvista()

    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # how PyVista reports that VTK's reader failed
        surface = pv.read(path).extract_surface(algorithm=None).triangulate()
    return np.asarray(surface.points, dtype=np.float64), surface.regular_faces.astype(np.int64)


def _write_text(place: Path, mesh: TriangleMesh) -> None:
    """OBJ or OFF, with the 17 digits that give every float64 back."""
    with place.open("w") as file:
        if place.suffix.lower() == ".off":
            file.write(f"OFF\n{mesh.n_vertices} {mesh.n_faces} 0\n")
            np.savetxt(file, mesh.vertices, "%.17g")
            np.savetxt(file, mesh.faces, "3 %d %d %d")
        else:
            np.savetxt(file, mesh.vertices, "v %.17g %.17g %.17g")
            np.savetxt(file, mesh.faces + 1, "f %d %d %d")


def _write_with_pyvista(path: Path, mesh: TriangleMesh) -> None:
    """STL or PLY by PyVista, in single precision."""
    pv = load_pyvista()

    pv.PolyData.from_regular_faces(mesh.vertices, mesh.faces).save(path)
