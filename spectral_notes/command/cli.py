"""The command line: what the library does, for a shape file of your own.

Exit codes: 0 the work is done; 1 it failed, or `health` or `doctor` found a fault; 2 an option or an input is wrong;
130 interrupted. Whatever happens, a fault is one line on stderr, and a file is written whole or not at all.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from spectral_notes.command import doctor as checks
from spectral_notes.command import jobs, streams
from spectral_notes.command.own_shape import upward
from spectral_notes.files import write_whole
from spectral_notes.files.mesh_files import write_mesh
from spectral_notes.plotting.cameras import Camera, camera_of
from spectral_notes.plotting.rendering import choose_gl_window

PROGRAM = "spectral-notes"
FINE, FAILED, MISUSED, INTERRUPTED = 0, 1, 2, 130
BAD_INPUT = (ValueError, TypeError, FileNotFoundError, PermissionError, IsADirectoryError, ModuleNotFoundError)
FAILURE = (MemoryError, ArithmeticError, RuntimeError, OSError)
INTERRUPTION = "interrupted; no file was left half written"
CLICK_ERROR: Any = typer.BadParameter.__mro__[2]  # ClickException, wherever this version of Typer keeps it
EPILOG = """Exit codes: 0 done; 1 failed, or a fault was found; 2 an option or an input is wrong; 130 interrupted.
Reads OBJ, OFF, STL, PLY and VTP meshes, and PLY, OBJ, OFF, VTP and XYZ point clouds, plain or as .gz, .bz2, .xz; with
spectral-notes[formats] glTF, 3MF, VTK, VTU, GIFTI and FreeSurfer as well; - is standard input."""

File = Annotated[str, typer.Argument(metavar="FILE", help="The shape; - is standard input.")]
Format = Annotated[str, typer.Option("--from", metavar="FORMAT", help="Format of the input, whatever its name.")]
To = Annotated[str, typer.Option("--to", metavar="FORMAT", help="Format of what goes to standard output.")]
Outputs = Annotated[
    list[str] | None, typer.Option("--output", "-o", metavar="FILE", help="Where to write; several may be given.")
]
OneOutput = Annotated[str, typer.Option("--output", "-o", metavar="FILE", help="Where to write; - is standard output.")]
Clean = Annotated[bool, typer.Option("--clean", help="Merge repeated vertices; drop broken faces, unused vertices.")]
Weld = Annotated[float, typer.Option("--weld", metavar="LENGTH", help="Join vertices that are no farther apart.")]
Largest = Annotated[bool, typer.Option("--largest", help="Keep the piece of the largest area alone.")]
Smallest = Annotated[
    float, typer.Option("--smallest", metavar="SHARE", help="Drop pieces of less than this share of the largest.")
]
Orient = Annotated[bool, typer.Option("--orient", help="Turn faces until neighbours agree, and closed pieces outward.")]
Up = Annotated[str, typer.Option("--up", metavar="x|y|z", help="Which axis points upward in pictures; else a guess.")]
Laplacian = Annotated[
    str, typer.Option(metavar="cotan|robust", help="Which one; default: cotan for meshes, robust for point clouds.")
]
Mass = Annotated[str, typer.Option(metavar="lumped|voronoi|full", help="Which mass matrix; robust has lumped only.")]
Modes = Annotated[int, typer.Option("-k", min=1, metavar="K", help="How many eigenfunctions.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Progress = Annotated[
    bool | None, typer.Option("--progress/--no-progress", help="Time left, on stderr; default: on a terminal.")
]

app = typer.Typer(
    name=PROGRAM, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]}, epilog=EPILOG,
    help="Spectral geometry for a shape file of your own.",
)


@app.command()
def modes(
    file: File, k: Annotated[int | None, typer.Option("-k", min=1, metavar="K", help="How many; default: 100.")] = None,
    output: Outputs = None, laplacian: Laplacian = "", mass: Mass = "lumped", clean: Clean = False, weld: Weld = 0.0,
    largest: Largest = False, smallest: Smallest = 0.0, orient: Orient = False, up: Up = "", certify: Annotated[
        bool, typer.Option("--certify", help="Prove by one more factorization that no mode is missing.")
    ] = False, show: Annotated[
        list[int] | None, typer.Option("--show", metavar="MODE", help="Mode to draw; several may be given.")
    ] = None, source: Format = "", target: To = "", progress: Progress = None, as_json: Json = False,
) -> None:
    """Compute the eigenfunctions of a shape.

    Writes modes, eigenvalues and mass as NPZ; the shape with a column a mode as VTP, PLY or CSV; a still picture as
    PNG; a page with scenes to turn as HTML.
    """
    outputs = _planned(output, target, [file])
    opened = streams.open_shape(file, source, streams.Mending(clean, weld, largest, smallest, orient))
    result = jobs.find_modes(
        opened.shape, k, laplacian, streams.remark, mass=mass, show=show or (), progress=_shown(progress),
        certify=certify, camera=_camera(opened, up, outputs),
    )
    _finish(result, outputs, as_json)


@app.command()
def segment(
    file: File, n: Annotated[int, typer.Option("-n", min=1, metavar="N", help="How many segments.")] = 7,
    k: Annotated[int | None, typer.Option("-k", min=2, metavar="K", help="From so many modes; default: N + 1.")] = None,
    output: Outputs = None, laplacian: Laplacian = "", clean: Clean = False, weld: Weld = 0.0,
    largest: Largest = False, smallest: Smallest = 0.0, orient: Orient = False, up: Up = "", source: Format = "",
    target: To = "",
    progress: Progress = None, as_json: Json = False,
) -> None:
    """Cut a shape into segments.

    By k-means in the embedding by its first modes. Writes the shape with its labels as VTP, PLY, CSV or NPZ, a still
    picture as PNG, a page with a scene to turn as HTML.
    """
    outputs = _planned(output, target, [file])
    opened = streams.open_shape(file, source, streams.Mending(clean, weld, largest, smallest, orient))
    result = jobs.find_segments(
        opened.shape, n, k, laplacian, streams.remark, progress=_shown(progress), camera=_camera(opened, up, outputs)
    )
    _finish(result, outputs, as_json)


@app.command("map")
def match(
    a: Annotated[str, typer.Argument(metavar="A", help="The shape that is mapped to.")],
    b: Annotated[str, typer.Argument(metavar="B", help="The shape whose vertices are mapped; one of both may be -.")],
    landmark: Annotated[
        list[str] | None, typer.Option("--landmark", metavar="A,B", help="Vertices of the same point; several.")
    ] = None,
    k: Annotated[int | None, typer.Option("-k", min=3, metavar="K", help="From so many modes; default: 200.")] = None,
    output: Outputs = None, laplacian: Laplacian = "", clean: Clean = False, weld: Weld = 0.0,
    largest: Largest = False, smallest: Smallest = 0.0, orient: Orient = False, up: Up = "", source: Format = "",
    target: To = "",
    progress: Progress = None, as_json: Json = False,
) -> None:
    """Map the vertices of B to those of A.

    For shapes that are bent copies of each other. Writes B with its vertices of A as VTP, PLY or CSV, the map and its
    matrix as NPZ, pictures of both as PNG or HTML.
    """
    if a == b == streams.STREAM:
        raise streams.UsageError("A and B cannot both be standard input")
    outputs = _planned(output, target, [a, b])
    mending = streams.Mending(clean, weld, largest, smallest, orient)
    first, second = (streams.open_shape(file, source, mending) for file in (a, b))
    cameras = (_camera(first, up, outputs), _camera(second, up, outputs))
    result = jobs.find_map(
        first.shape, second.shape, landmark or (), k, laplacian, streams.remark, progress=_shown(progress),
        cameras=cameras,
    )
    _finish(result, outputs, as_json)


@app.command()
def compress(
    file: File, output: OneOutput,
    error: Annotated[float | None, typer.Option(help="Error in percent of the diagonal; default: 0.05.")] = None,
    bits_per_vertex: Annotated[float | None, typer.Option(help="Instead: bits a vertex for positions.")] = None,
    max_error: Annotated[float | None, typer.Option(help="Largest error of any vertex, in percent.")] = None,
    quality: Annotated[str, typer.Option(metavar="vertex|surface", help="Which error counts.")] = "vertex",
    codec: Annotated[str, typer.Option(metavar="auto|spectral|draco", help="Which codec.")] = "auto",
    clean: Clean = False, weld: Weld = 0.0, largest: Largest = False, smallest: Smallest = 0.0,
    orient: Orient = False, source: Format = "", as_json: Json = False,
) -> None:
    """Compress a mesh to a .sgn file."""
    outputs = streams.plan_outputs([output], "sgn", (".sgn",), [file])
    shape = streams.open_shape(file, source, streams.Mending(clean, weld, largest, smallest, orient)).shape
    result, data = jobs.compress(
        shape, error=error, bits_per_vertex=bits_per_vertex, max_error=max_error, quality=quality, codec=codec
    )
    streams.deliver(outputs[0], lambda path: write_whole(path, lambda place: place.write_bytes(data)))
    streams.tell(result.facts, result.lines, as_json=as_json, outputs=outputs)


@app.command()
def decompress(
    file: Annotated[str, typer.Argument(metavar="FILE.sgn", help="The file; - is standard input.")], output: OneOutput,
    progressive: Annotated[bool, typer.Option("--progressive", help="Accept a file whose end is missing.")] = False,
    target: To = "", as_json: Json = False,
) -> None:
    """Decompress a .sgn file to a mesh file."""
    outputs = streams.plan_outputs([output], target, jobs.MESH_FORMATS, [file])
    result, mesh = jobs.decompress(streams.open_bytes(file), progressive=progressive)
    streams.deliver(outputs[0], lambda path: write_mesh(path, mesh))
    streams.tell(result.facts, result.lines, as_json=as_json, outputs=outputs)


@app.command()
def health(
    file: File, clean: Clean = False, weld: Weld = 0.0, largest: Largest = False, smallest: Smallest = 0.0,
    orient: Orient = False, source: Format = "", as_json: Json = False,
) -> None:
    """Say what is wrong with a mesh.

    And what each fault does to what follows. The exit code is 1 if there is a fault; a boundary is none.
    """
    opened = streams.open_shape(file, source, streams.Mending(clean, weld, largest, smallest, orient))
    result = jobs.examine_health(opened.shape, opened.nonplanar_polygons)
    streams.tell(result.facts, result.lines, as_json=as_json)
    if result.facts["faults"]:
        raise typer.Exit(FAILED)


@app.command()
def doctor(
    vertices: Annotated[int, typer.Option(min=1, help="Weigh the memory for a mesh of so many vertices,")] = 100_000,
    k: Annotated[int, typer.Option("-k", min=1, metavar="K", help="and so many modes.")] = 100, as_json: Json = False,
) -> None:
    """Say whether the set-up works.

    Tries out every part that the course needs, and says how to mend what is missing. The exit code is 1 if anything is
    broken.
    """
    findings = checks.examine(vertices, k)
    broken = [finding.name for finding in findings if finding.status == "broken"]
    verdict = f"broken: {', '.join(broken)}" if broken else "the set-up works"
    facts = {"works": not broken, "findings": [vars(finding) for finding in findings]}
    streams.tell(facts, [*map(str, findings), verdict], as_json=as_json)
    if broken:
        raise typer.Exit(FAILED)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 done, 1 failed or fault found, 2 misused, 130 interrupted.

    Parameters
    ----------
    arguments : what stands after the program's name; by default what this process was started with

    Examples
    --------
    >>> main(["doctor", "--vertices", "0"])
    2
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = typer.main.get_command(app).main(words, prog_name=PROGRAM, standalone_mode=False)
    except CLICK_ERROR as error:
        named = " ".join([PROGRAM, *(word for word in words[:1] if word in COMMANDS)])
        return _refuse(f"{error.format_message().rstrip('.')}; see {named} --help", MISUSED)
    except typer.Exit as stop:
        return stop.exit_code
    except (typer.Abort, KeyboardInterrupt):
        return _refuse(INTERRUPTION, INTERRUPTED)
    except BAD_INPUT as error:
        return _refuse(_text(error), MISUSED)
    except Exception as error:
        kind = type(error).__name__
        said = _text(error) or kind
        said = said if isinstance(error, FAILURE) else f"{kind}: {said}; please report this, with the file"
        return _refuse(said, FAILED)
    return int(code or FINE) if code != INTERRUPTED else _refuse(INTERRUPTION, INTERRUPTED)


def run() -> None:
    """Run the command line and end the process with its exit code."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # to be ended is to be interrupted: nothing half done
    sys.exit(main())


def _refuse(line: str, code: int) -> int:
    """Say why on stderr, and return the code."""
    streams.remark(line)
    return code


def _text(error: BaseException) -> str:
    """What an error says, its remedies still to be named."""
    return str(getattr(error, "text", "") or error)


def _camera(opened: streams.Opened, up: str, outputs: Sequence[streams.Output]) -> Camera:
    """From where a shape is drawn; where its upward axis is a guess, and something is drawn, that is said."""
    axis, why = upward(opened.shape, opened.ending, up)
    if not up and {".png", ".html"} & {output.ending for output in outputs}:
        streams.remark(f"note: {axis} is taken to point upward, since {why}; --up x, y or z says otherwise")
    return camera_of(opened.shape, axis)


def _shown(progress: bool | None) -> bool:
    """Whether progress is shown: as asked for, else where somebody looks."""
    return sys.stderr.isatty() if progress is None else progress


def _planned(outputs: Sequence[str] | None, ending: str, inputs: Sequence[str]) -> list[streams.Output]:
    """The outputs of a command that writes functions on a shape, checked before any work."""
    planned = streams.plan_outputs(outputs or (), ending, jobs.FORMATS, inputs)
    if {".png", ".html"} & {output.ending for output in planned}:
        choose_gl_window()  # which raises, before any work, where nothing can draw
    return planned


def _finish(result: jobs.Result, outputs: Sequence[streams.Output], as_json: bool) -> None:
    """Write every output and say what was found."""
    for output in outputs:
        streams.deliver(output, lambda path: jobs.write_result(Path(path), result))
    streams.tell(result.facts, result.lines, as_json=as_json, outputs=outputs)


COMMANDS = tuple(command.name or getattr(command.callback, "__name__", "") for command in app.registered_commands)
