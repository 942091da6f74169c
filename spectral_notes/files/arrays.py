"""Write a shape with the functions on it: VTP and PLY for ParaView and Blender, CSV and NPZ for everything else.

Every file is written whole or not at all and gives every digit back. PLY holds one function a second time, as colours
for viewers that know no functions.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike, NDArray

from spectral_notes._checks import as_choice, as_floats
from spectral_notes.files.whole import write_whole
from spectral_notes.files.writing import write_ply, write_vtp
from spectral_notes.meshes import PointCloud, Shape, positions
from spectral_notes.plotting.rendering import LABEL_COLORS, SurfaceView

ARRAY_FORMATS = (".vtp", ".ply", ".npz", ".csv")
RESERVED = ("x", "y", "z", "red", "green", "blue", "vertices", "faces", "points")  # what the files call the shape
TAKEN = ("file", "allow_pickle")  # what `np.savez` calls its own arguments
WHOLE = 2**53  # integers up to there survive in every format

Columns = dict[str, NDArray[Any]]


def write_arrays(
    path: str | os.PathLike[str], shape: Shape, arrays: Mapping[str, ArrayLike], *, colors: str = "",
    kind: str = "signed",
) -> None:
    """Write a shape and the functions on its vertices to a VTP, PLY, CSV or NPZ file, whole or not at all.

    Parameters
    ----------
    path : where to; the ending names the format
        CSV has one row a vertex: x, y, z, then the functions.
    shape : with n vertices or points
    arrays : functions (n,) or (n, d) by name, pointwise values
        The d columns of `name` become `name_0`, `name_1`, ... (in NPZ they stay together).
    colors : the function that a PLY file shows as colours; by default none
    kind : {"signed", "positive", "labels"}, how its values become colours, as in pictures

    Raises
    ------
    OSError
        If the folder does not exist or cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> from spectral_notes.meshes import TriangleMesh
    >>> square = TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_arrays(folder + "/square.csv", square, {"height": [0, 1, 2, 3]})
    ...     print(Path(folder, "square.csv").read_text().splitlines()[:2])
    ['x,y,z,height', '0,0,0,0']
    """
    path = Path(path)
    suffix = as_choice("path's ending", path.suffix.lower(), ARRAY_FORMATS)
    n = len(positions(shape))
    fitting = {name: _as_function(name, values, n) for name, values in arrays.items()}
    flat = columns(fitting)
    tints: Columns = {}
    if colors:
        shown = flat[as_choice("colors", colors, tuple(flat))]
        tints = dict(zip(("red", "green", "blue"), shades(shape, shown, kind).T, strict=True))
    writers = {
        ".vtp": lambda place: write_vtp(place, shape, flat),
        ".ply": lambda place: write_ply(place, shape, flat | tints),
        ".csv": lambda place: _write_csv(place, shape, flat),
        ".npz": lambda place: np.savez(place, **named_arrays(shape), **fitting),  # type: ignore[arg-type]
    }
    write_whole(path, writers[suffix])


def named_arrays(shape: Shape) -> Columns:
    """Return the arrays that make a shape, by name: vertices and faces, or points."""
    if isinstance(shape, PointCloud):
        return {"points": shape.points}
    return {"vertices": shape.vertices, "faces": shape.faces}


def columns(arrays: Mapping[str, NDArray[Any]]) -> Columns:
    """Return each column of each array under a name of its own; raise where two would have the same.

    >>> list(columns({"height": np.zeros(4), "mode": np.zeros((4, 2))}))
    ['height', 'mode_0', 'mode_1']
    """
    flat: Columns = {}
    for name, values in arrays.items():
        numbered = {name: values}
        if values.ndim == 2:
            width = len(str(values.shape[1] - 1))
            numbered = {f"{name}_{i:0{width}d}": column for i, column in enumerate(values.T)}
        twice = sorted(flat.keys() & numbered.keys())
        if twice:
            raise ValueError(f"arrays must have names that differ once columns are numbered; {twice[0]!r} comes twice")
        flat |= numbered
    return flat


def shades(shape: Shape, values: NDArray[Any], kind: str) -> NDArray[np.uint8]:
    """Return the colours that a picture gives to the values of a function, shape (n, 3), 0 to 255."""
    if kind == "labels":
        table = np.array([to_rgb(color) for color in LABEL_COLORS])
        rgb = table[values.astype(np.int64) % len(table)]
    else:
        view = SurfaceView(shape, values, kind=kind)
        low, high = view.color_limits
        share = (values - low) / ((high - low) or 1.0)
        rgb = colormaps[str(view.color_map)](np.clip(share, 0.0, 1.0))[:, :3]
    return np.rint(255 * rgb).astype(np.uint8)


def _as_function(name: str, values: ArrayLike, n: int) -> NDArray[Any]:
    """The values, checked; whole numbers stay whole."""
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or name in RESERVED + TAKEN:
        taken = RESERVED + TAKEN
        raise ValueError(f"arrays must have names of letters, digits and _, and none of {taken}; got {name!r}")
    array = np.asarray(values)
    as_floats(name, array, (n, "d") if array.ndim == 2 else (n,))
    if array.dtype.kind not in "biu":
        return array.astype(np.float64)
    if array.size and (int(array.max()) > WHOLE or int(array.min()) < -WHOLE):
        raise ValueError(f"{name} must hold integers within 2^53, which files keep; found {int(np.abs(array).max())}")
    return array.astype(np.int64)


def _write_csv(place: Path, shape: Shape, arrays: Columns) -> None:
    """CSV, one row a vertex, with the 17 digits that give every float64 back."""
    table = np.column_stack([positions(shape), *arrays.values()])
    with place.open("w", encoding="utf-8", newline="\n") as file:
        np.savetxt(file, table, "%.17g", delimiter=",", header=",".join(["x", "y", "z", *arrays]), comments="")
