"""Meshes as small files: spectral coefficients of the positions, Draco's connectivity, one format, `.sgn`.

The decoder knows the faces first. From them alone it rebuilds the bases, eigenvectors of graph Laplacians, in which the
positions were written as integers; so no basis is sent. `encode` compares the result with Draco's own geometry and
keeps the smaller file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spectral_notes._checks import FloatArray, IntArray, as_choice, as_count, as_number
from spectral_notes.compression import sgn_format as sgn
from spectral_notes.compression.coefficients import Head, Shape, decode_base, decode_detail
from spectral_notes.compression.connectivity import DRACO_HEADER, MAX_VERTICES, decode_connectivity, encode_connectivity
from spectral_notes.compression.corrections import decode_corrections
from spectral_notes.compression.range_coder import CorruptStreamError
from spectral_notes.compression.search import TANGENTIAL, Job, Target, draco_files, spectral_files
from spectral_notes.meshes import TriangleMesh, as_mesh

SMALLEST_ERROR = 1e-6  # percent of the diagonal; finer than that, float32 files are the better answer
SMALLEST_RATE = 0.1


@dataclass(frozen=True)
class FileSummary:
    """Hold what a `.sgn` file spends its bytes on.

    Parameters
    ----------
    codec : str
        "spectral" or "draco".
    n_vertices, n_faces : int
        Size of the mesh.
    total_bytes : int
        Length of the file.
    connectivity_bytes : int
        Bytes that a file of the faces alone takes, as coded by Draco.
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

    The faces come back exactly; vertices and faces are renumbered (see `transmission_order`).

    Parameters
    ----------
    mesh : TriangleMesh
        Any mesh: open, in several pieces, not manifold.
    error : float, optional
        Root mean square distance between original and decoded mesh, in percent of the bounding-box diagonal: of
        vertices (quality "vertex") or of surfaces (quality "surface", the larger of both directions). Met from below,
        by the spectral codec within one percent.
    bits_per_vertex : float, optional
        Instead of `error`: bits a vertex that may be spent on positions.
    quality : {"vertex", "surface"}
        "surface" lets vertices slide along the surface, which costs the shape little and saves bits.
    codec : {"auto", "spectral", "draco"}
        "auto" takes whichever is better.
    max_error : float, optional
        Largest distance of any vertex from where it should be, in percent of the diagonal; further ones are corrected.

    Returns
    -------
    bytes
        The file. `decode` reads it.

    Raises
    ------
    TypeError, ValueError
        If not exactly one of `error` and `bits_per_vertex` is given, a number is out of range, the mesh has no extent,
        or "draco" is asked for and would merge vertices that coincide.

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
    >>> decode(data).n_faces == mesh.n_faces
    True
    """
    mesh = as_mesh(mesh)
    target = _as_target(error, bits_per_vertex, max_error)
    as_choice("quality", quality, tuple(TANGENTIAL))
    as_choice("codec", codec, ("auto", "spectral", "draco"))
    job = Job(mesh, quality, target)
    files = []
    if codec != "draco":
        files += spectral_files(job)
    if codec != "spectral":
        files += draco_files(job)
    if not files:
        raise ValueError(
            f"codec {codec!r} cannot meet {'error' if target.rate is None else 'bits_per_vertex'} on this mesh: "
            "ask for less, or for 'auto' (Draco merges vertices that coincide and drops those without a face)"
        )
    if target.error is not None:
        return min((data for data, _ in files), key=len)
    return min(files, key=lambda f: f[1])[0]


def _as_target(error: float | None, rate: float | None, bound: float | None) -> Target:
    """Check the three numbers."""
    if (error is None) == (rate is None):
        raise ValueError("give exactly one of error and bits_per_vertex")
    if error is not None:
        error = as_number("error", error, low=SMALLEST_ERROR)
    if rate is not None:
        rate = as_number("bits_per_vertex", rate, low=SMALLEST_RATE)
    if bound is not None:
        bound = as_number("max_error", bound, low=SMALLEST_ERROR)
    return Target(error, rate, bound)


def decode(data: bytes, *, progressive: bool = False, max_vertices: int = MAX_VERTICES) -> TriangleMesh:
    """Decode the bytes of a `.sgn` file into a mesh.

    Parameters
    ----------
    data : bytes
        What `encode` returned.
    progressive : bool
        Accept a spectral file whose end is missing and return a smoother mesh with the same faces. Bytes that were
        changed rather than cut off are then noticed only up to the base.
    max_vertices : int
        Refuse to build a larger mesh, before anything of its size is allocated.

    Returns
    -------
    TriangleMesh
        With the faces that were encoded, numbered as `transmission_order` says.

    Raises
    ------
    TypeError
        If `data` is not bytes.
    ValueError
        If they are not a whole, unchanged file of this format, or hold more vertices than allowed.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> data = encode(egg(subdivisions=3), error=0.05, codec="spectral")
    >>> decode(data[: len(data) - 200], progressive=True)
    TriangleMesh('', 642 vertices, 1280 faces)
    """
    sections, whole, rest, faces, lone = _open(data, progressive, max_vertices)
    n = len(rest) + lone
    if sections.kind == sgn.DRACO:
        return TriangleMesh(rest, faces)
    head = Head.unpack(sections.head)
    shape = Shape(faces, n)
    surface = decode_base(sections.base, shape, head)
    X = decode_detail(sections.detail, shape, head, surface, partial=not whole)
    X = decode_corrections(sections.corrections, X) if whole else X
    if not (np.abs(X) < 1e30).all():
        raise CorruptStreamError("the file places vertices further away than any encoder does")
    return TriangleMesh(X, faces)


def transmission_order(mesh: TriangleMesh) -> IntArray:
    """Return, for each vertex that `decode` will return, which vertex of the mesh it was, shape (n,).

    Parameters
    ----------
    mesh : TriangleMesh
        The mesh that is encoded.

    Returns
    -------
    (n,) int array
        A permutation: `decode(encode(mesh, ...)).vertices` approximates `mesh.vertices[order]`.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> order = transmission_order(egg(subdivisions=2))
    >>> bool((np.sort(order) == np.arange(162)).all())
    True
    """
    mesh = as_mesh(mesh)
    return encode_connectivity(mesh.faces, mesh.n_vertices).order


def renumbered(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with its vertices and faces numbered as `decode` will number them, positions unchanged.

    Parameters
    ----------
    mesh : TriangleMesh
        Any mesh.

    Returns
    -------
    TriangleMesh
        The same surface, to compare with a decoded one vertex by vertex and face by face.

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
    data : bytes
        What `encode` returned.

    Returns
    -------
    FileSummary
        Codec, sizes, and how many bytes are connectivity.

    Raises
    ------
    TypeError, ValueError
        As `decode`.

    Examples
    --------
    >>> from spectral_notes.shapes import egg
    >>> summary = describe(encode(egg(subdivisions=3), error=0.1))
    >>> summary.codec, summary.n_vertices, summary.total_bytes > summary.connectivity_bytes
    ('spectral', 642, True)
    """
    sections, _, points, faces, lone = _open(data, False, MAX_VERTICES)
    stream = sections.stream
    if sections.kind == sgn.DRACO:
        stream = encode_connectivity(faces, len(points) + lone).stream
    size = len(stream) + len(sections.mends) + len(DRACO_HEADER)
    codec = "draco" if sections.kind == sgn.DRACO else "spectral"
    return FileSummary(codec, len(points) + lone, len(faces), len(data), size)


def _open(data: bytes, progressive: bool, limit: int) -> tuple[sgn.Sections, bool, FloatArray, IntArray, int]:
    """Check a file and read its connectivity: sections, whether whole, stream positions, faces, lone vertices."""
    if not isinstance(data, bytes | bytearray | memoryview):
        raise TypeError(f"data must be bytes; got {type(data).__name__}")
    limit = as_count("max_vertices", limit, 1, MAX_VERTICES)
    sections, whole = sgn.unpack(bytes(data), progressive=progressive)
    return sections, whole, *decode_connectivity(sections.stream, sections.mends, limit)
