"""Formats that well-kept libraries read: glTF and 3MF (trimesh), VTK and VTU (PyVista), GIFTI and FreeSurfer (nibabel).

They are the extras `formats` and `pictures`. VTK, which is compiled, reads in a process of its own: some files end it.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from spectral_notes._checks import IntArray
from spectral_notes.files.polygons import Polygons, no_polygons

FREESURFER = (".white", ".pial", ".inflated", ".orig", ".smoothwm", ".sphere")
MODULES = {
    ".gltf": "trimesh", ".glb": "trimesh", ".3mf": "trimesh", ".vtk": "pyvista", ".vtu": "pyvista", ".gii": "nibabel",
    **dict.fromkeys(FREESURFER, "nibabel"),
}
CHILD = Path(__file__).with_name("vtk_child.py")
PATIENCE = 300  # seconds that VTK may take for a file


def read_foreign(data: bytes, ending: str, path: Path | None) -> Polygons:
    """Return vertices and polygons of a file that a library reads."""
    name = MODULES[ending]
    try:
        if importlib.util.find_spec(name) is None:  # VTK is never loaded here
            raise ModuleNotFoundError(name=name)
        module = importlib.import_module(name) if name != "pyvista" else None
    except ModuleNotFoundError as error:
        what = f"{ending} files are read by {name}, and {error.name} is missing"
        extra = "pictures" if name == "pyvista" else "formats"
        raise ModuleNotFoundError(f'{what}; pip install "spectral-notes[{extra}]" brings it') from error
    with tempfile.TemporaryDirectory() as folder:
        if path is None:
            path = Path(folder, f"shape{ending}")
            path.write_bytes(data)
        if name == "pyvista":
            if ending == ".vtk":
                _refuse_cut_points(data)
            return _by_vtk(path, Path(folder))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return _by_trimesh(module, path) if name == "trimesh" else _by_nibabel(module, data, ending, path)
        except (ImportError, MemoryError):
            raise
        except Exception as error:  # whatever a library says of a damaged file
            says = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            raise ValueError(f"{name} does not read it: {says}") from error


def _by_trimesh(trimesh: Any, path: Path) -> Polygons:
    """The triangles of all parts of a scene, each in its place."""
    scene = trimesh.load_scene(str(path), process=False)
    mesh = scene.to_mesh()
    if len(mesh.faces):
        return _triangles(mesh.vertices, mesh.faces)
    clouds = [part.vertices for part in scene.dump() if hasattr(part, "vertices")]
    return no_polygons(np.asarray(np.vstack([np.zeros((0, 3)), *clouds]), dtype=np.float64))


def _by_nibabel(nibabel: Any, data: bytes, ending: str, path: Path) -> Polygons:
    """The surface of a GIFTI or FreeSurfer file, in the coordinates that it stores."""
    if ending == ".gii":
        image = nibabel.GiftiImage.from_bytes(data)
        vertices, faces = image.agg_data("pointset"), image.agg_data("triangle")
        return no_polygons(np.asarray(vertices, dtype=np.float64)) if not len(faces) else _triangles(vertices, faces)
    return _triangles(*nibabel.freesurfer.read_geometry(str(path))[:2])


def _triangles(vertices: Any, faces: Any) -> Polygons:
    """Arrays (n, 3) and (m, 3) as polygons."""
    corners: IntArray = np.asarray(faces, dtype=np.int64)
    return Polygons(np.asarray(vertices, dtype=np.float64), corners.ravel(), np.full(len(corners), 3))


def _refuse_cut_points(data: bytes) -> None:
    """Refuse a legacy VTK file that ends inside its points: VTK fills up with what lies in memory."""
    found = re.search(rb"^\s*POINTS\s+(\d+)\s+(\w+)[ \t]*\r?\n", data, re.MULTILINE | re.IGNORECASE)
    if found is None:
        return
    count, rest = 3 * int(found[1]), data[found.end() :]
    is_text = re.search(rb"^\s*ASCII\s*$", data[: found.start()], re.MULTILINE | re.IGNORECASE) is not None
    width = 8 if found[2].lower() in (b"double", b"long", b"vtkidtype") else 4
    held = len(re.findall(rb"\S+", rest)) if is_text else len(rest) // width
    if held < count:
        raise ValueError(f"it announces {count // 3} points and ends before them")


def _by_vtk(path: Path, folder: Path) -> Polygons:
    """The surface of a VTK or VTU file; of cells that fill space, their boundary."""
    target = folder / "arrays.npz"
    words = [sys.executable, str(CHILD), str(path), str(target)]
    try:
        run = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f"VTK has not read it after {PATIENCE} seconds") from None
    if run.returncode or not target.exists():
        last = (run.stderr.strip() or f"its reader ended with code {run.returncode}").splitlines()[-1]
        raise ValueError(f"VTK does not read it: {last[:200]}")
    with np.load(target) as arrays:
        return Polygons(arrays["vertices"], arrays["corners"], arrays["sizes"])
