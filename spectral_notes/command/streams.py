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

from spectral_notes._checks import named
from spectral_notes.files.mesh_files import known_ending, polygons_from_bytes, read_whole, shape_name, shape_of
from spectral_notes.files.packed import ending_of
from spectral_notes.files.polygons import bent_polygons
from spectral_notes.geometry import keep_pieces, orient_faces, weld_vertices
from spectral_notes.meshes import PointCloud, Shape

STREAM = "-"  # standard input as a file's name, standard output as an output's

# The library names its functions as the remedy; at the command line the remedy is an option.
OPTIONS = {
    "clean": "--clean", "reclean": "--clean", "robust": "--laplacian robust", "weld": "--weld LENGTH",
    "orient": "--orient", "path": "FILE",
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


@dataclass(frozen=True)
class Mending:
    """What is mended on reading: as the options of the same names say."""

    clean: bool = False
    weld: float = 0.0
    largest: bool = False
    smallest: float = 0.0
    orient: bool = False

    def applied(self, shape: Shape) -> Shape:
        """Return the shape, mended beyond what `clean` does on reading."""
        if isinstance(shape, PointCloud):
            if self.weld or self.largest or self.smallest or self.orient:
                raise UsageError("--weld, --largest, --smallest and --orient mend triangles; FILE holds points only")
            return shape
        if self.weld:
            shape = weld_vertices(shape, self.weld)
        if self.largest or self.smallest:
            shape = keep_pieces(shape, smallest=self.smallest, largest_only=self.largest)
        return orient_faces(shape) if self.orient else shape


@dataclass(frozen=True)
class Opened:
    """A shape with what its file said of it: the format, and how many of its polygons are bent."""

    shape: Shape
    ending: str
    nonplanar_polygons: int


def open_shape(file: str, ending: str, mending: Mending) -> Opened:
    """Read a shape from a file, whose ending names the format unless one is given, or from standard input."""
    if file == STREAM and not ending:
        raise UsageError("standard input has no ending: name its format with --from, as in --from obj")
    given = f".{ending.lstrip('.').lower()}" if ending else ending_of(file)
    named_format = known_ending("--from" if ending else file, given)
    path = None if file == STREAM else Path(file)
    name = "stdin" if path is None else shape_name(path)
    polygons = polygons_from_bytes(open_bytes(file), named_format, where=file, path=None if ending else path)
    shape = shape_of(polygons, named_format, name, clean=mending.clean, where=file)
    return Opened(mending.applied(shape), named_format, bent_polygons(polygons))


def open_bytes(file: str) -> bytes:
    """Read a file, or standard input, whole."""
    return sys.stdin.buffer.read() if file == STREAM else read_whole(Path(file), "FILE")


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
    print(text.encode("utf-8", "replace").decode(), file=stream)


def remark(line: str) -> None:
    """Print one line on stderr."""
    text = " ".join(named(line, OPTIONS).split())
    print(f"spectral-notes: {text}".encode("utf-8", "replace").decode(), file=sys.stderr)
