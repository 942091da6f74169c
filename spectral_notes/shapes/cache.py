"""Arrays that take seconds to build, kept in the user's cache and found again by what they are made from.

The key of an entry is a SHA-256 digest of the recipe's name, its parameters, the text of the modules that hold the
recipe and the versions of the libraries that run it: whatever changes the result changes the key, so an entry never
goes stale. Entries live in the user's cache directory, or where the environment variable SPECTRAL_NOTES_CACHE says;
deleting them is always safe.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from spectral_notes._whole import write_whole

Arrays = dict[str, NDArray[Any]]

PLACE_VARIABLE = "SPECTRAL_NOTES_CACHE"
LIBRARIES = ("numpy", "scipy", "libigl")


def cache_directory() -> Path:
    """Return the directory of the cache; the environment variable SPECTRAL_NOTES_CACHE overrides the user's default."""
    place = os.environ.get(PLACE_VARIABLE)
    return Path(place).expanduser() if place else Path(platformdirs.user_cache_dir("spectral_notes", appauthor=False))


def cache_key(recipe: str, parameters: Mapping[str, object], sources: Sequence[ModuleType]) -> str:
    """Return the hexadecimal digest of everything that decides the result of a recipe."""
    versions = {name: version(name) for name in LIBRARIES}
    digest = hashlib.sha256(json.dumps([recipe, dict(parameters), versions], sort_keys=True).encode())
    for module in sources:
        digest.update(Path(str(module.__file__)).read_bytes())
    return digest.hexdigest()


def cached_arrays(
    recipe: str, parameters: Mapping[str, object], sources: Sequence[ModuleType], build: Callable[[], Arrays]
) -> Arrays:
    """Return the arrays that `build` makes, from the cache if they are there.

    A damaged entry is built again and replaced. A directory that cannot be written is no error: the arrays are
    then built on every call.

    Parameters
    ----------
    recipe : str
        Name of the recipe; it opens the file name.
    parameters : mapping of str to JSON values
        What the recipe depends on.
    sources : sequence of modules
        The modules that hold the recipe: their text is part of the key.
    build : callable
        Takes nothing, returns a dict of named arrays.

    Returns
    -------
    dict of str to ndarray
        The arrays of `build`, bit by bit.
    """
    path = cache_directory() / f"{recipe}-{cache_key(recipe, parameters, sources)[:32]}.npz"
    arrays = _load(path)
    if arrays is None:
        arrays = build()
        with suppress(OSError):
            _store(path, arrays)
    return arrays


def _load(path: Path) -> Arrays | None:
    """Return the arrays of an entry, or None when it is missing or damaged (every member carries a CRC-32)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as entry:
            return {name: entry[name] for name in entry.files}
    except (OSError, ValueError, EOFError, KeyError, NotImplementedError, zipfile.BadZipFile, zlib.error):
        return None


def _store(path: Path, arrays: Arrays) -> None:
    """Write an entry, whole or not at all: a reader never sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda place: np.savez(place, **arrays))  # type: ignore[arg-type]
