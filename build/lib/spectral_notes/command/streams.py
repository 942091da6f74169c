"""What comes in and goes out of the command line: files, standard streams, one line a fault, one object of JSON."""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spectral_notes.files.mesh_files import FORMATS, read_whole, shape_from_bytes
from spectral_notes.meshes import PointCloud, TriangleMesh

STREAM = "-"  # standard input as a file's name, standard output as an output's

# The library names its functions as the remedy; at the command line the remedy is an option.
OPTIONS = {
    "robust_mesh_laplacian(mesh)": "--laplacian robust",
    "try robust_mesh_laplacian": "try --laplacian robust",
    "clean_mesh(mesh.vertices, mesh.faces)": "--clean",
    "clean_mesh(vertices, faces)": "--clean",
    "read_mesh(path, clean=True)": "--clean",
    "clean_mesh": "--clean",
    "path must": "FILE must",
}


class UsageError(ValueError):
    """A combination of options that cannot be; the message says which and what to do."""


@dataclass(frozen=True)
class Output:
    """One place to write to: a file, or standard output."""

    place: str
    ending: str

    @property
    def is_stream(self) -> bool:
        """Whether this is standard output."""
        return self.place == STREAM


def open_shape(file: str, ending: str, clean: bool) -> TriangleMesh | PointCloud:
    """Read a shape from a file, whose ending names the format unless one is given, or from standard input."""
    named = f".{ending.lstrip('.').lower()}" if ending else Path(file).suffix.lower()
    if file == STREAM and not ending:
        known = ", ".join(known[1:] for known in FORMATS)
        raise UsageError(f"standard input has no ending: name its format with --from, one of {known}")
    if named not in FORMATS:
        raise UsageError(f"{file} must end in one of {', '.join(FORMATS)}, or --from name the format; got {named!r}")
    name = "stdin" if file == STREAM else Path(file).stem
    return shape_from_bytes(open_bytes(file), named, name=name, clean=clean, where=file)


def open_bytes(file: str) -> bytes:
    """Read a file, or standard input, whole."""
    return sys.stdin.buffer.read() if file == STREAM else read_whole(Path(file))


def plan_outputs(outputs: Sequence[str], ending: str, endings: Sequence[str], inputs: Sequence[str]) -> list[Output]:
    """Check, before any work is done, that every output can be written in one of the formats."""
    planned = [_plan(output, ending, endings) for output in outputs]
    if sum(output.is_stream for output in planned) > 1:
        raise UsageError("standard output can take one output; write the others to files")
    for output in planned:
        place = Path(output.place)
        if output.is_stream:
            continue
        if not place.parent.is_dir():
            raise UsageError(f"output must be in an existing folder; there is none at {place.parent}")
        if place.is_dir() or not os.access(place.parent, os.W_OK):
            raise UsageError(f"output must be a file that you may write to; {place} is not")
        if place.exists() and any(file != STREAM and Path(file).exists() and place.samefile(file) for file in inputs):
            raise UsageError(f"output must not be the input; both are {place}: choose another name")
    return planned


def _plan(output: str, ending: str, endings: Sequence[str]) -> Output:
    """One output with its format."""
    known = ", ".join(endings)
    if output == STREAM and not ending:
        raise UsageError(f"standard output has no ending: name its format with --to, one of {known}")
    named = ending if output == STREAM else Path(output).suffix
    named = f".{named.lstrip('.').lower()}"
    if named not in endings:
        raise UsageError(f"output must end in one of {known}; got {output if output != STREAM else ending!r}")
    return Output(output, named)


def deliver(output: Output, write: Callable[[Path], Any]) -> None:
    """Have an output written, whole or not at all; one for standard output is written to a file first."""
    if not output.is_stream:
        write(Path(output.place))
        return
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder, f"output{output.ending}")
        write(place)
        with place.open("rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)
    sys.stdout.buffer.flush()


def tell(facts: Mapping[str, Any], lines: Sequence[str], *, as_json: bool, outputs: Sequence[Output] = ()) -> None:
    """Print the result: one object of JSON, or lines for people; on stderr where stdout carries a file."""
    stream = sys.stderr if any(output.is_stream for output in outputs) else sys.stdout
    places = [output.place for output in outputs]
    if as_json:
        text = json.dumps({**facts, "outputs": places}, allow_nan=False, indent=1)
    else:
        text = "\n".join([*lines, *(f"wrote {place}" for place in places if place != STREAM)])
    print(text, file=stream)


def remark(line: str) -> None:
    """Print one line on stderr."""
    print(f"spectral-notes: {in_words_of_the_command_line(line)}", file=sys.stderr)


def in_words_of_the_command_line(text: str, *, keep_spaces: bool = False) -> str:
    """Return a text as one line that names options where the library names functions.

    Examples
    --------
    >>> in_words_of_the_command_line("it has slivers: robust_mesh_laplacian(mesh)   works")
    'it has slivers: --laplacian robust works'
    """
    for function, option in OPTIONS.items():
        text = text.replace(function, option)
    return text if keep_spaces else " ".join(text.split())
