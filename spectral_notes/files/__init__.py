"""Reading and writing: meshes and clouds, arrays on them, eigenbases. Files are written whole or not at all."""

from spectral_notes.files.arrays import write_arrays
from spectral_notes.files.eigenbasis_files import read_eigenbasis, read_problem, write_eigenbasis, write_problem
from spectral_notes.files.mesh_files import FORMATS, read_mesh, read_shape, write_mesh
from spectral_notes.files.whole import write_whole

__all__ = [
    "FORMATS",
    "read_mesh",
    "read_shape",
    "write_mesh",
    "write_arrays",
    "write_problem",
    "read_problem",
    "write_eigenbasis",
    "read_eigenbasis",
    "write_whole",
]
