"""Files that were compressed: what is in a file whose name ends in .gz, .bz2 or .xz."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from collections.abc import Callable
from pathlib import Path

UNPACKERS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.decompress, ".bz2": bz2.decompress, ".xz": lzma.decompress,
}


def ending_of(name: str) -> str:
    """Return the ending of a file's name in lower case, together with that of a compression.

    >>> ending_of("Scan.PLY.gz"), ending_of("lh.pial"), ending_of(".obj")
    ('.ply.gz', '.pial', '.obj')
    """
    path = Path(f"_{name.lower()}")
    return Path(path.stem).suffix + path.suffix if path.suffix in UNPACKERS else path.suffix


def unpacked(data: bytes, ending: str) -> tuple[bytes, str]:
    """Return the bytes that were compressed, and the ending without that of the compression."""
    packing = Path(f"_{ending}").suffix
    if packing not in UNPACKERS:
        return data, ending
    try:
        return UNPACKERS[packing](data), ending.removesuffix(packing)
    except (OSError, EOFError, ValueError, zlib.error, lzma.LZMAError) as error:
        raise ValueError(f"it cannot be unpacked: {error}") from error
