"""Meshes and point clouds as the bytes of OBJ, OFF, STL, PLY and VTP files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from spectral_notes.files.parsing import FACET, STL_HEADER
from spectral_notes.meshes import Shape, TriangleMesh, face_normals, positions

VTP_TYPES = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}
PLY_TYPES = {"f": ("<f8", "double"), "i": ("<i4", "int"), "u": ("u1", "uchar")}


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


def write_ply(place: Path, shape: Shape, functions: Mapping[str, NDArray[Any]]) -> None:
    """Write binary PLY in double precision, each function on the vertices, (n,), a property of its name.

    Floats are stored as double, integers as int where they fit, else as double, uint8 as uchar: `red`, `green`, `blue`
    are colours.
    """
    fields = dict(zip("xyz", positions(shape).T, strict=True)) | dict(functions)
    fields = {name: f.astype(np.float64) if _is_large(f) else f for name, f in fields.items()}
    rows = np.empty(len(positions(shape)), [(name, PLY_TYPES[f.dtype.kind][0]) for name, f in fields.items()])
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    for name, f in fields.items():
        rows[name] = f
        header.append(f"property {PLY_TYPES[f.dtype.kind][1]} {name}")
    body = rows.tobytes()
    if isinstance(shape, TriangleMesh):
        faces = np.zeros(shape.n_faces, [("size", "u1"), ("corners", "<i4", 3)])
        faces["size"], faces["corners"] = 3, shape.faces
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        body += faces.tobytes()
    place.write_bytes("\n".join([*header, "end_header\n"]).encode("ascii") + body)


def _is_large(values: NDArray[Any]) -> bool:
    """Whether integers do not fit into the 32 bits that PLY has for them."""
    return values.dtype.kind == "i" and bool((np.abs(values) > np.iinfo(np.int32).max).any())


def write_vtp(place: Path, shape: Shape, functions: Mapping[str, NDArray[Any]]) -> None:
    """Write VTP, each function on the vertices, (n,), an array of its name; VTK's own writer crashes on a full disk."""
    cells = shape.faces if isinstance(shape, TriangleMesh) else np.arange(shape.n_points)[:, None]
    tag = "Polys" if isinstance(shape, TriangleMesh) else "Verts"
    ends = np.arange(1, len(cells) + 1) * cells.shape[1]
    blocks: list[NDArray[Any]] = []

    def array(name: str, values: NDArray[Any], width: int = 1) -> str:
        kind = "|u1" if values.dtype.kind == "u" else f"<{values.dtype.kind}8"
        offset = sum(8 + block.nbytes for block in blocks)
        blocks.append(np.ascontiguousarray(values, dtype=kind))
        named = f'Name={quoteattr(name)} NumberOfComponents="{width}" format="appended" offset="{offset}"'
        return f'<DataArray type="{VTP_TYPES[kind]}" {named}/>'

    parts = [
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f'<PolyData><Piece NumberOfPoints="{len(positions(shape))}" NumberOf{tag}="{len(cells)}">',
        *["<PointData>", *(array(name, f) for name, f in functions.items()), "</PointData>"],
        *["<Points>", array("Points", positions(shape), 3), "</Points>"],
        *[f"<{tag}>", array("connectivity", cells), array("offsets", ends), f"</{tag}>"],
        '</Piece></PolyData><AppendedData encoding="raw">_',
    ]
    stored = b"".join(block.nbytes.to_bytes(8, "little") + block.tobytes() for block in blocks)
    place.write_bytes("\n".join(parts).encode() + stored + b"</AppendedData></VTKFile>\n")


WRITERS: dict[str, Callable[[Path, TriangleMesh], None]] = {
    ".obj": _write_obj,
    ".off": _write_off,
    ".stl": _write_stl,
    ".ply": lambda place, mesh: write_ply(place, mesh, {}),
    ".vtp": lambda place, mesh: write_vtp(place, mesh, {}),
}
