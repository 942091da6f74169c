"""Meshes as small files: spectral coefficients of the positions, Draco's connectivity, one format, `.sgn`.

The decoder knows the faces first. From them alone it rebuilds the bases, eigenvectors of graph Laplacians, in which the
positions were written as integers; so no basis is sent. `encode` compares the result with Draco's own geometry and
keeps the smaller file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spectral_notes._checks import as_choice, as_count, as_number
from spectral_notes.compression.bases import Domain
from spectral_notes.compression.connectivity import (
    MAX_VERTICES,
    NONE,
    decode_connectivity,
    encode_connectivity,
    size_of,
)
from spectral_notes.compression.file_format import Place, front, unpack
from spectral_notes.compression.positions import decode_positions
from spectral_notes.compression.range_coder import Coder, CorruptStreamError
from spectral_notes.compression.search import QUALITIES, Job, draco_files, spectral_files
from spectral_notes.meshes import TriangleMesh, as_mesh

FINEST_ERROR, COARSEST_ERROR = 1e-6, 100.0  # percent of the diagonal; a coarser target is met by what meets this one
LOWEST_RATE, HIGHEST_RATE = 0.1, 64.0


@dataclass(frozen=True)
class FileSummary:
    """Hold what a `.sgn` file spends its bytes on.

    Parameters
    ----------
    codec : "spectral" or "draco"
    n_vertices, n_faces : size of the mesh
    total_bytes : length of the file
    connectivity_bytes : bytes that a file of the faces alone takes, as coded by Draco
    """

    codec: str
    n_vertices: int
    n_faces: int
    total_bytes: int
    connectivity_bytes: int

    @property
    def geometry_bits_per_vertex(self) -> float:
        """Everything that is not connectivity (positions, header, checksums), in bits a vertex."""
        return 8 * (self.total_bytes - self.connectivity_bytes) / self.n_vertices


def encode(
    mesh: TriangleMesh, *, error: float | None = None, bits_per_vertex: float | None = None, quality: str = "vertex",
    codec: str = "auto", max_error: float | None = None,
) -> bytes:
    """Encode a mesh as the bytes of a `.sgn` file whose error, or size, is the one asked for.

    The faces come back exactly, numbered anew with the vertices (see `renumbered`). The file is decoded and compared
    with the mesh before it is returned.

    Parameters
    ----------
    mesh : any mesh: open, in several pieces, not manifold, wound either way, of any unit and at any place
    error : root mean square distance between original and decoded mesh, in percent of the bounding-box diagonal: of
        vertices (quality "vertex") or of surfaces (quality "surface", the larger of both directions). Met from below.
    bits_per_vertex : instead of `error`: bits a vertex that may be spent on positions
    quality : {"vertex", "surface"}, "surface" lets vertices slide along the surface, which saves bits
    codec : {"auto", "spectral", "draco"}, "auto" takes whichever is better
    max_error : largest distance of any vertex from where it should be, in percent of the diagonal; further ones are
        corrected. By default surfaces are kept within 1.45 times what Draco's grid of about the same error does.

    Returns
    -------
    bytes: the file. `decode` reads it.

    Raises
    ------
    ValueError
        If no file of the codec meets the target: Draco merges vertices that coincide, and carries 22 bits.

    References
    ----------
    Karni and Gotsman, "Spectral compression of mesh geometry" (2000).

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> mesh = egg(subdivisions=3)
    >>> data = encode(mesh, error=0.1)
    >>> describe(data).codec, len(data) < 24 * mesh.n_vertices / 10
    ('spectral', True)
    """
    mesh = as_mesh(mesh)
    as_choice("quality", quality, QUALITIES)
    as_choice("codec", codec, ("auto", "spectral", "draco"))
    if (error is None) == (bits_per_vertex is None):
        raise ValueError("give exactly one of error and bits_per_vertex")
    error = None if error is None else min(as_number("error", error, low=FINEST_ERROR), COARSEST_ERROR)
    bound = None if max_error is None else min(as_number("max_error", max_error, low=FINEST_ERROR), COARSEST_ERROR)
    rate = as_number("bits_per_vertex", LOWEST_RATE if bits_per_vertex is None else bits_per_vertex, low=LOWEST_RATE)
    job = Job(mesh, QUALITIES.index(quality), error, min(rate, HIGHEST_RATE), bound)
    files = spectral_files(job) if codec != "draco" else []
    files += draco_files(job) if codec != "spectral" else []
    for data, _ in sorted(files, key=lambda file: (0.0 if error else file[1], len(file[0]))):
        if _reads_back(data, job):
            return data
    wish, remedy = ("bits_per_vertex", "allow more, or give an error") if error is None else ("error", "ask for less")
    other = "" if codec == "auto" else ", or take 'auto'"
    raise ValueError(
        f"codec {codec!r} cannot meet {wish} on this mesh: {remedy}{other} "
        "(Draco merges vertices that coincide, drops those without a face, and keeps 22 bits a coordinate)"
    )


def _reads_back(data: bytes, job: Job) -> bool:
    """Whether a file that was written decodes to the faces and within the errors."""
    mesh = _decode(data, False, MAX_VERTICES, job.domain)[0]
    if not np.array_equal(mesh.faces, job.connectivity.faces) or mesh.n_vertices != len(job.x):  # Draco merged some
        return False
    x = job.place.shrink(mesh.vertices)
    near = job.bound is None or 100 * float(np.linalg.norm(x - job.x, axis=1).max()) <= job.bound * job.diagonal
    return near and (job.goal is None or job.error(x) <= job.goal * (1 + 1e-6))


def decode(data: bytes, *, progressive: bool = False, max_vertices: int = MAX_VERTICES) -> TriangleMesh:
    """Decode the bytes of a `.sgn` file into a mesh.

    Parameters
    ----------
    data : bytes, what `encode` returned
    progressive : accept a spectral file whose end is missing and return a smoother mesh with the same faces. Bytes that
        were changed rather than cut off are then noticed only before the first coefficient.
    max_vertices : refuse to build a larger mesh, before anything of its size is allocated

    Returns
    -------
    With the faces that were encoded, numbered as `renumbered` says.

    Raises
    ------
    ValueError
        If the bytes are not a whole, unchanged file of this format, or hold more vertices than allowed.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> data = encode(egg(subdivisions=3), error=0.05, codec="spectral")
    >>> decode(data[: len(data) - 200], progressive=True)
    TriangleMesh('', 642 vertices, 1280 faces)
    """
    return _decode(data, progressive, as_count("max_vertices", max_vertices, 1, MAX_VERTICES))[0]


def _decode(data: bytes, progressive: bool, limit: int, domain: Domain | None = None) -> tuple[TriangleMesh, str]:
    """The mesh of a file and its codec; `domain` saves the work of deriving it from the faces again."""
    if not isinstance(data, bytes | bytearray | memoryview):
        raise TypeError(f"data must be bytes; got {type(data).__name__}")
    stream, payload, whole = unpack(bytes(data), progressive=progressive)
    coder = Coder(payload, cut=not whole)
    place, mends, spectral = front(coder, Place(), NONE, False, limit)
    if coder.ended:
        raise CorruptStreamError("data ends before the first coefficient")
    x, faces = decode_connectivity(stream, mends, limit)
    if spectral:
        x = decode_positions(coder, domain or Domain(faces, len(x) + mends.lone))
    X = place.restore(x)
    if not (np.abs(X) < 1e50).all() or (mends.lone and not spectral):
        raise CorruptStreamError("the file places vertices further away than any encoder does, or not at all")
    return TriangleMesh(X, faces), "spectral" if spectral else "draco"


def renumbered(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with its vertices and faces numbered as `decode` will number them, positions unchanged.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> mesh = egg(subdivisions=2)
    >>> bool((renumbered(mesh).faces == decode(encode(mesh, error=1)).faces).all())
    True
    """
    mesh = as_mesh(mesh)
    c = encode_connectivity(mesh.faces, mesh.n_vertices)
    return TriangleMesh(mesh.vertices[c.order], c.faces, name=mesh.name)


def describe(data: bytes) -> FileSummary:
    """Return what a `.sgn` file spends its bytes on.

    Parameters
    ----------
    data : bytes, what `encode` returned

    Returns
    -------
    FileSummary: codec, sizes, and how many bytes are connectivity.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> summary = describe(encode(egg(subdivisions=3), error=0.1))
    >>> summary.codec, summary.n_vertices, summary.total_bytes > summary.connectivity_bytes
    ('spectral', 642, True)
    """
    mesh, codec = _decode(data, False, MAX_VERTICES)
    size = size_of(encode_connectivity(mesh.faces, mesh.n_vertices))
    return FileSummary(codec, mesh.n_vertices, mesh.n_faces, len(data), size)
