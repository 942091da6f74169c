"""Fuzz what reads strangers' bytes, guided by coverage, for a bounded time: the `.sgn` decoder and the mesh readers.

    python tools/fuzz.py decode --seconds 300
    python tools/fuzz.py meshes --seconds 300

Bytes must give a finite mesh or a ValueError, in less than `TIMEOUT` seconds and with less than `MEMORY` bytes more
than the interpreter already has. Anything else stops the run, and the bytes that did it are in `_build/fuzz`; they
become a case of the tests. Needs the extra `fuzz` (atheris, Linux).
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import atheris

ROOT = Path(__file__).resolve().parents[1]
TIMEOUT = 20  # seconds one input may take, coverage counted
MEMORY = 1 << 30  # bytes that one input may allocate
MAX_VERTICES = 2000  # of a decoded mesh: larger ones only cost time
MAX_BYTES = 4096  # of an input

with atheris.instrument_imports(include=["spectral_notes"]):
    from spectral_notes.compression import decode, encode, file_format
    from spectral_notes.files.mesh_files import PARSERS, WRITERS, read_shape, write_mesh
    from spectral_notes.meshes import PointCloud, TriangleMesh, positions
    from spectral_notes.shapes import egg, torus

FORMATS = tuple(PARSERS)  # those that are read here; others are read by their libraries


def check(make: Callable[[], TriangleMesh | PointCloud]) -> None:
    """Make a shape from hostile bytes; only a ValueError that is not about memory may stop it."""
    try:
        shape = make()
    except ValueError as error:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, MemoryError) or "bad_alloc" in str(cause):
                raise MemoryError(f"an input asks for more than {MEMORY} bytes") from error
            cause = cause.__cause__
    else:
        assert abs(positions(shape)).max() < float("inf")
        if isinstance(shape, TriangleMesh):
            assert 0 <= shape.faces.min() <= shape.faces.max() < shape.n_vertices


def open_meshes() -> list[TriangleMesh]:
    """Small meshes of every kind: closed, with a handle, with three sheets on an edge and a lone vertex."""
    book = TriangleMesh(
        [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0], [5, 5, 5]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]]
    )
    return [egg(subdivisions=1), torus(8, 6), book]


def decoder() -> tuple[Callable[[bytes], None], list[bytes]]:
    """The target and the seeds of `decode`. Checksums count as right: they stop accidents, not intent."""
    file_format.zlib = SimpleNamespace(crc32=lambda _: 0)

    def target(data: bytes) -> None:
        for progressive in (False, True):
            check(lambda: decode(data, progressive=progressive, max_vertices=MAX_VERTICES))  # noqa: B023

    codecs = [{"codec": "spectral"}, {"codec": "auto"}, {"codec": "spectral", "max_error": 0.5}]
    return target, [encode(mesh, error=0.5, **options) for mesh in open_meshes() for options in codecs]


def readers() -> tuple[Callable[[bytes], None], list[bytes]]:
    """The target and the seeds of `read_shape`; the first byte of an input chooses the format."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))

    def target(data: bytes) -> None:
        if data:
            path = folder / f"mesh{FORMATS[data[0] % len(FORMATS)]}"
            path.write_bytes(data[1:])
            check(lambda: read_shape(path))

    seeds = [
        b"\0v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf -4//1 -2//1 -1//1\n",
        b"\1COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n1 2 0 1 1 1 1\n3 0 1 2\n",
        b"\2solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
        b"endsolid s\n",
        b"\3ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n"
        b"property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        b"0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n4 0 1 2 3\n",
        b"\0\xef\xbb\xbfv 0 4 0\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nf 1 2 3 4 5\n",
        b"\3ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n"
        b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
        b"4 0 1 3 2\n",
        b"\5x y z red\n0,0,0,1\n1;0;0;2\n0 1 0 3 # a comment\n",
    ]
    for number, suffix in enumerate(FORMATS):
        if suffix not in WRITERS:
            continue
        path = folder / f"seed{suffix}"
        write_mesh(path, open_meshes()[1])
        seeds.append(bytes([number]) + path.read_bytes())
    return target, seeds


def main() -> None:
    """Run one target; libFuzzer ends the process."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("target", choices=("decode", "meshes"))
    parser.add_argument("--seconds", type=int, default=300, help="how long to look")
    options = parser.parse_args()
    target, seeds = decoder() if options.target == "decode" else readers()
    for seed in seeds:
        target(seed)
    corpus = ROOT / "_build" / "fuzz" / options.target
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    present = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    warnings.simplefilter("error")
    resource.setrlimit(resource.RLIMIT_AS, (present + MEMORY, resource.RLIM_INFINITY))
    limits = [f"-max_total_time={options.seconds}", f"-timeout={TIMEOUT}", f"-max_len={MAX_BYTES}", "-rss_limit_mb=0"]
    atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={corpus}-", "-print_final_stats=1", str(corpus)], target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
