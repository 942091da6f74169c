"""Run, normalise and check the notebooks of the book.

    python tools/notebooks.py run [NOTEBOOK ...]      execute and store: text outputs, no images, one spelling
    python tools/notebooks.py check [NOTEBOOK ...]    prove that what is stored is what `run` would have written
    python tools/notebooks.py execute --into FOLDER   execute for the rendered book, images kept, cached on content

A notebook is stored with its text outputs, so that every printed number can be compared with a fresh run, and
without its images, so that the repository stays small and its differences readable.
"""

from __future__ import annotations

import argparse
import ast
import asyncio
import hashlib
import json
import os
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import nbformat
import nbformat.warnings
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError

from spectral_notes.files import write_whole

ROOT = Path(__file__).resolve().parents[1]
LANGUAGE = {"name": "python", "pygments_lexer": "ipython3"}
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}
KEPT_CELL_METADATA = ("deletable", "editable", "mystnb", "nbgrader", "reason", "slideshow", "tags")
MAX_LINES = 12
MAX_COLUMNS = 76  # a longer line is cut off on a page 1,200 px wide and on paper
CELL_TIMEOUT = 600  # seconds

# One thread a kernel: the sums of a threaded BLAS depend on the number of cores, and two notebooks run at once.
KERNEL_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "PYTHONHASHSEED": "0",
    "PYDEVD_DISABLE_FILE_VALIDATION": "1",
    "MPLBACKEND": "module://matplotlib_inline.backend_inline",
}
BOOK_ENVIRONMENT = KERNEL_ENVIRONMENT | {"SPECTRAL_NOTES_SCENES": "1"}  # figures bring their scenes
FORBIDDEN_CODE = {
    r"^\s*[%!]": "a shell or magic command",
    r"get_ipython": "a shell or magic command",
    r"sys\.path": "a change of sys.path",
    r"\b(urllib|requests|urlretrieve|urlopen|wget|pooch)\b": "a download",
    r";\s*\Z": "a trailing semicolon (bind the value to a name instead)",
}


class NotebookError(Exception):
    """A notebook that cannot go into the book; the message names the notebook, the cell and the fault."""


# --- reading and writing --------------------------------------------------------------------------------------------


def find_notebooks(paths: Iterable[str | Path]) -> list[Path]:
    """Return the notebooks named by files and folders, sorted; without any, those of the book."""
    found: set[Path] = set()
    for path in map(Path, list(paths) or [ROOT / "book"]):
        if path.is_dir():
            found.update(path.glob("*.ipynb"))
        elif path.is_file():
            found.add(path)
        else:
            raise NotebookError(f"{path}: there is no such notebook or folder")
    return sorted(found)


def read(path: Path) -> nbformat.NotebookNode:
    """Read a notebook; ids that are missing are made, as they are stored at the next run."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=nbformat.warnings.DuplicateCellId)  # `form_faults` says it better
        warnings.filterwarnings("ignore", category=nbformat.warnings.MissingIDFieldWarning)
        return nbformat.read(path, as_version=4)


def to_text(nb: nbformat.NotebookNode) -> str:
    """Return the one text that stands for a notebook: sorted keys, one space of indent, a final newline."""
    return json.dumps(_split_lines(nb), indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def _split_lines(nb: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return the notebook with its long strings as lists of lines, the form the file format asks for."""
    return nbformat.v4.rwbase.split_lines(nbformat.from_dict(json.loads(json.dumps(nb))))


def write(path: Path, text: str) -> bool:
    """Write a whole file or nothing, and say whether it changed."""
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda place: place.write_text(text, encoding="utf-8", newline="\n"))
    return True


# --- normal form ----------------------------------------------------------------------------------------------------


def join_streams(outputs: list[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """Join neighbouring pieces of one stream: where a kernel cuts its output depends on timing."""
    joined: list[nbformat.NotebookNode] = []
    for output in outputs:
        last = joined[-1] if joined else None
        if last and output.output_type == last.output_type == "stream" and output.name == last.name:
            last["text"] += output["text"]
        else:
            joined.append(nbformat.from_dict(output))
    return joined


def strip_images(output: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return an output without its images and its metadata; the text beside an image stays."""
    kept = nbformat.from_dict(output)
    if "data" in kept:
        kept["data"] = {kind: value for kind, value in kept["data"].items() if not kind.startswith("image/")}
        kept["metadata"] = {}
    return kept


def normalise(nb: nbformat.NotebookNode, *, images: bool = False) -> nbformat.NotebookNode:
    """Return the notebook in normal form: one kernel name, counts 1..n, no timestamps, no images unless asked."""
    nb = nbformat.from_dict(json.loads(json.dumps(nb)))
    nb.metadata = nbformat.from_dict({"kernelspec": KERNEL, "language_info": LANGUAGE})
    nb.nbformat, nb.nbformat_minor = 4, 5
    count = 0
    for cell in nb.cells:
        cell.metadata = nbformat.from_dict({k: v for k, v in cell.metadata.items() if k in KEPT_CELL_METADATA})
        if cell.cell_type != "code":
            continue
        count += 1
        cell.execution_count = count
        outputs = join_streams(cell.outputs)
        cell.outputs = outputs if images else [strip_images(output) for output in outputs]
        for output in cell.outputs:
            if output.output_type == "execute_result":
                output.execution_count = count
    return nb


# --- checks ---------------------------------------------------------------------------------------------------------


def code_cells(nb: nbformat.NotebookNode) -> Iterator[tuple[int, nbformat.NotebookNode]]:
    """Yield the code cells with their numbers, counted from 1."""
    yield from enumerate((cell for cell in nb.cells if cell.cell_type == "code"), start=1)


def _tags(cell: nbformat.NotebookNode) -> list[str]:
    """Return the tags of a cell."""
    return list(cell.metadata.get("tags", []))


def output_faults(cell: nbformat.NotebookNode) -> Iterator[str]:
    """Yield what is wrong with the outputs of one cell, fresh or stored."""
    for output in cell.outputs:
        text = json.dumps(output.get("text", output.get("data", {}).get("text/plain", "")))
        if output.output_type == "error":
            yield f"raises {output.get('ename')}: {output.get('evalue')}"
        elif output.output_type == "stream" and output.name == "stderr":
            yield f"writes to stderr: {output['text'].strip()[:300]}"
        elif output.output_type == "execute_result" and output["data"].get("text/plain", "").startswith("<"):
            yield f"ends in the repr of an object ({text[:60]}): bind it to a name"
        elif re.search(r"\b0x[0-9a-f]{6,}\b", text):
            yield f"prints a memory address: {text[:80]}"
        elif re.search(r"(/home/|/tmp/|/Users/|[A-Z]:\\\\Users)", text):
            yield f"prints a path of this machine: {text[:80]}"


def figure_faults(cell: nbformat.NotebookNode) -> Iterator[str]:
    """Yield what is missing from the caption, the label and the alternative text of a cell's figure."""
    drawn = sum(output.output_type == "display_data" for output in cell.outputs)
    mystnb = cell.metadata.get("mystnb", {})
    figure, alt = mystnb.get("figure", {}), mystnb.get("image", {}).get("alt", "")
    if not drawn and not mystnb:
        return
    if drawn != 1:
        yield f"shows {drawn} figures; a cell with a caption shows exactly one"
    if not figure.get("caption", "").strip():
        yield "its figure has no caption (metadata mystnb.figure.caption)"
    if not re.fullmatch(r"fig-[a-z0-9-]+", figure.get("name", "")):
        yield "its figure has no label of the form fig-... (metadata mystnb.figure.name)"
    if not alt.strip() or alt.strip() == figure.get("caption", "").strip():
        yield "its figure has no alternative text of its own (metadata mystnb.image.alt)"


def code_faults(cell: nbformat.NotebookNode) -> Iterator[str]:
    """Yield what is wrong with the source of one code cell."""
    lines = [line for line in cell.source.splitlines() if line.strip()]
    if not lines:
        yield "is empty"
    if "hide-input" not in _tags(cell):  # a folded cell holds what only draws, and checks
        if len(lines) > MAX_LINES:
            yield f"has {len(lines)} lines; at most {MAX_LINES} (plotting cells may carry the tag hide-input)"
        for line in lines:
            if len(line) > MAX_COLUMNS:
                yield f"has a line of {len(line)} characters; at most {MAX_COLUMNS}: {line.strip()[:60]!r}"
    bad = [what for pattern, what in FORBIDDEN_CODE.items() if re.search(pattern, cell.source, re.MULTILINE)]
    yield from (f"holds {what}" for what in bad)
    if not bad and _prints(cell.source) and not cell.outputs:
        yield "prints, but no output is stored"


def _prints(source: str) -> bool:
    """Say whether a top-level statement of the source is a call of print."""
    calls = (node.value for node in ast.parse(source).body if isinstance(node, ast.Expr))
    return any(isinstance(c, ast.Call) and isinstance(c.func, ast.Name) and c.func.id == "print" for c in calls)


def ignored_faults(nb: nbformat.NotebookNode) -> Iterator[str]:
    """Yield what is wrong with the cells whose outputs are not compared."""
    ignored = [(n, cell) for n, cell in code_cells(nb) if "nbval-ignore-output" in _tags(cell)]
    if len(ignored) > 1:
        yield f"{len(ignored)} cells carry nbval-ignore-output; at most one may"
    for n, cell in code_cells(nb):
        if (n, cell) in ignored and not cell.metadata.get("reason"):
            yield f"cell {n}: ignores its output without a reason"
        skipping = {"nbval-skip", "raises-exception", "skip-execution"} & set(_tags(cell))
        yield from (f"cell {n}: carries the tag {tag}" for tag in sorted(skipping))


def form_faults(nb: nbformat.NotebookNode, text: str) -> Iterator[str]:
    """Yield how a stored notebook differs from its normal form."""
    counts = [cell.execution_count for _, cell in code_cells(nb)]
    if counts != list(range(1, len(counts) + 1)):
        yield f"was not executed from top to bottom: counts are {counts}"
    elif any(kind.startswith("image/") for _, c in code_cells(nb) for o in c.outputs for kind in o.get("data", {})):
        yield "holds images"
    elif text != to_text(normalise(nb)):
        yield "is not in normal form (metadata, streams or spelling)"
    ids = [cell.get("id") for cell in json.loads(text)["cells"]]
    yield from (f"has two cells with the id {name}" for name in sorted({str(i) for i in ids if ids.count(i) > 1}))


def faults(path: Path) -> list[str]:
    """Return everything that is wrong with a stored notebook, one sentence each."""
    nb, text = read(path), path.read_text(encoding="utf-8")
    found = [*form_faults(nb, text), *ignored_faults(nb)]
    for n, cell in code_cells(nb):
        wrong = [*code_faults(cell), *output_faults(cell), *figure_faults(cell)]
        found += [f"cell {n} {fault} -- it begins: {cell.source.strip()[:60]!r}" for fault in wrong]
    return [f"{path.name}: {fault}" for fault in found]


# --- execution ------------------------------------------------------------------------------------------------------


class Progress:
    """A bar of executed cells: one moving line on a terminal, one line a finished notebook elsewhere."""

    def __init__(self, total: int) -> None:
        self.total, self.done, self.terminal = total, 0, sys.stderr.isatty()

    def step(self, name: str) -> None:
        """Count one executed cell."""
        self.done += 1
        if self.terminal:
            filled = 30 * self.done // max(self.total, 1)
            bar = "#" * filled + "." * (30 - filled)
            sys.stderr.write(f"\r[{bar}] {self.done}/{self.total} cells  {name:<32.32}")
            sys.stderr.flush()

    def line(self, text: str) -> None:
        """Write one lasting line above the bar."""
        sys.stderr.write(("\r\033[K" if self.terminal else "") + text + "\n")
        sys.stderr.flush()


async def execute_one(
    path: Path, folder: Path, step: Callable[[str], None], environment: dict[str, str]
) -> nbformat.NotebookNode:
    """Execute one notebook in a kernel of its own, started in `folder`; raise a NotebookError for its first fault."""
    nb = normalise(read(path))
    number = {id(cell): n for n, cell in code_cells(nb)}
    last = 0

    def count(cell: nbformat.NotebookNode, **_: object) -> None:
        nonlocal last
        if cell.cell_type == "code":
            last = number.get(id(cell), last + 1)
            step(path.stem)

    client = NotebookClient(
        nb,
        timeout=CELL_TIMEOUT,
        kernel_name="python3",
        extra_arguments=["--IPKernelApp.log_level=40"],  # kernels are local: no advice about encrypting their sockets
        resources={"metadata": {"path": str(folder)}},
        on_cell_executed=count,
    )
    try:
        await client.async_execute(env={**os.environ, **environment})
    except CellExecutionError as error:
        trace = re.sub(r"\x1b\[[0-9;]*m", "", error.traceback)  # without the colours of a terminal
        raise NotebookError(f"{path.name}: cell {last} raises {error.ename}: {error.evalue}\n{trace}") from error
    except (CellTimeoutError, DeadKernelError) as error:
        raise NotebookError(f"{path.name}: cell {last + 1} did not finish: {error}") from error
    nb = normalise(nb, images=True)
    wrong = [f"{path.name}: cell {n} {fault}" for n, cell in code_cells(nb) for fault in output_faults(cell)]
    if wrong:
        raise NotebookError("\n".join(wrong))
    return nb


async def execute_all(
    paths: list[Path],
    jobs: int,
    keep: Callable[[Path, nbformat.NotebookNode, float], None],
    folder: Path | None = None,
    environment: dict[str, str] = KERNEL_ENVIRONMENT,
) -> list[str]:
    """Execute notebooks, `jobs` at a time, hand each result with its seconds to `keep`, and return the faults."""
    progress = Progress(sum(sum(1 for _ in code_cells(read(path))) for path in paths))
    gate, wrong = asyncio.Semaphore(jobs), []

    async def one(path: Path) -> None:
        async with gate:
            try:
                start = time.monotonic()
                nb = await execute_one(path, folder or path.resolve().parent, progress.step, environment)
                keep(path, nb, time.monotonic() - start)
                progress.line(f"executed {path.name}")
            except NotebookError as error:
                progress.line(f"FAILED   {path.name}")
                wrong.append(str(error))

    # The first chapters take the least: they come last, so that no process is left alone with a long one.
    await asyncio.gather(*(one(path) for path in sorted(paths, reverse=True)))
    return wrong


# --- execution for the rendered book, cached on content -------------------------------------------------------------


def surroundings_digest(root: Path) -> str:
    """Return a digest of what every notebook depends on: library, measured numbers, pins, this tool, Python version.

    This tool names the environment of the kernels, and so whether figures bring their scenes; so does its plugin.
    """
    files = [p for p in (root / "spectral_notes").rglob("*") if p.is_file() and "__pycache__" not in p.parts]
    digest = hashlib.sha256(repr(sys.version_info[:2]).encode())
    tools = (Path(__file__), Path(__file__).with_name("executed_once.py"))
    measured = sorted((root / "benchmarks").glob("*.json"))
    for path in [*sorted(files), *measured, root / "requirements.txt", *tools]:
        if path.exists():
            digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def once(record: Path, sources: Iterable[Path], root: Path, make: Callable[[], None]) -> None:
    """Call `make` unless the library, the pins and the sources are what the record says, and note them."""
    ours = b"".join(path.read_bytes() for path in sources)
    digest = hashlib.sha256(surroundings_digest(root).encode() + ours).hexdigest()
    if not record.exists() or record.read_text(encoding="utf-8") != digest:
        make()
        write(record, digest)


def code_digest(nb: nbformat.NotebookNode, surroundings: str) -> str:
    """Return a digest of a notebook's code cells and their surroundings; its prose does not count."""
    return hashlib.sha256(json.dumps([surroundings, [cell.source for _, cell in code_cells(nb)]]).encode()).hexdigest()


def remember(cache: Path, path: Path, nb: nbformat.NotebookNode, surroundings: str, seconds: float) -> None:
    """Keep the outputs of an executed notebook under the digest of its code."""
    outputs = [cell.outputs for _, cell in code_cells(nb)]
    memory = {"digest": code_digest(nb, surroundings), "seconds": seconds, "outputs": outputs}
    write(cache / f"{path.stem}.json", json.dumps(memory))


def with_outputs(nb: nbformat.NotebookNode, outputs: list[list[nbformat.NotebookNode]]) -> nbformat.NotebookNode:
    """Return the notebook as it is now with the outputs of an earlier execution of the same code."""
    nb = normalise(nb)
    for (_, cell), kept in zip(code_cells(nb), outputs, strict=True):
        cell.outputs = [nbformat.from_dict(output) for output in kept]
    return nb


def execute_into(target: Path, paths: list[Path], jobs: int, root: Path) -> list[str]:
    """Write executed copies of the notebooks into `target`, running only those whose content changed."""
    surroundings, todo = surroundings_digest(root), []
    cache = target.parent / "executed-outputs"
    for path in paths:
        nb, kept = read(path), cache / f"{path.stem}.json"
        memory = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
        if memory.get("digest") == code_digest(nb, surroundings):
            write(target / path.name, to_text(with_outputs(nb, memory["outputs"])))
        else:
            todo.append(path)

    def keep(path: Path, nb: nbformat.NotebookNode, seconds: float) -> None:
        remember(cache, path, nb, surroundings, seconds)
        write(target / path.name, to_text(nb))

    sys.stderr.write(f"{len(paths) - len(todo)} of {len(paths)} notebooks are unchanged, {len(todo)} to execute\n")
    for stale in set(target.glob("*.ipynb")) - {target / path.name for path in paths}:
        stale.unlink()
    return asyncio.run(execute_all(todo, jobs, keep, environment=BOOK_ENVIRONMENT)) if todo else []


# --- command line ---------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("command", choices=("run", "check", "execute"))
    parser.add_argument("paths", nargs="*", help="notebooks or folders (default: book/)")
    parser.add_argument("--jobs", type=int, default=min(4, os.cpu_count() or 1), help="notebooks executed at once")
    parser.add_argument("--into", type=Path, default=ROOT / "_build" / "executed", help="where `execute` writes")
    parser.add_argument("--root", type=Path, default=ROOT, help="the project whose library and pins count")
    options = parser.parse_intermixed_args(arguments)
    try:
        paths = find_notebooks(options.paths)
        if options.command == "check":
            wrong = [fault for path in paths for fault in faults(path)]
        elif options.command == "execute":
            wrong = execute_into(options.into.resolve(), paths, options.jobs, options.root)
        else:
            wrong = asyncio.run(execute_all(paths, options.jobs, lambda p, nb, _: _store(p, nb)))
    except NotebookError as error:
        wrong = [str(error)]
    for fault in wrong:
        sys.stderr.write(f"\n{fault}\n")
    verdict = f"{len(wrong)} fault(s)" if wrong else "no fault"
    sys.stderr.write(f"notebooks {options.command}: {verdict}\n")
    return 1 if wrong else 0


def _store(path: Path, nb: nbformat.NotebookNode) -> None:
    """Write an executed notebook back in its stored form."""
    write(path, to_text(normalise(nb)))


if __name__ == "__main__":
    sys.exit(main())
