"""Read submissions as learning platforms pack them, and mend their notebooks.

Moodle, Canvas and Blackboard each put the student into the name of a file or folder of the archive; a folder of a
student's name holds good as well. Nothing is unpacked to the disk, so a name in an archive leads nowhere.
"""

from __future__ import annotations

import copy
import json
import re
import warnings
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path, PurePosixPath

import nbformat
from judge import cell_settings, functions_of

LARGEST = 50 * 2**20  # bytes of a file
NAMES = {
    "Moodle": r"(?P<name>[^/]+)_(?P<student>\d+)_assignsubmission_file(?:_[^/]*)?(?:/.*)?",
    "Blackboard": r"[^/]*?_(?P<student>[^/_]+)_attempt_(?P<time>\d{4}(?:-\d{2}){5})(?:_[^/]*)?(?:\.txt)?",
    "Canvas": r"(?P<name>[^/_]+)_(?:LATE_)?(?P<student>\d+)_(?P<attempt>\d+)_[^/]+",
    "folder": r"(?P<student>[^/]+)/.*",
}
UNSAFE = re.compile(r"[^\w.-]+")


@dataclass(frozen=True)
class Submission:
    """A file as it was handed in."""

    student: str  # the platform's number, or the name of a folder
    name: str
    platform: str
    file: str
    time: datetime
    data: bytes
    order: tuple[int, int] = (0, 0)  # of attempts, where the platform counts them


def files(source: Path) -> Iterator[tuple[str, datetime, bytes]]:
    """Yield name, time and content of every file of an archive or a folder."""
    if source.is_dir():
        for path in sorted(source.rglob("*")):
            if path.is_file() and path.stat().st_size <= LARGEST and not path.is_symlink():
                yield (
                    path.relative_to(source).as_posix(),
                    datetime.fromtimestamp(path.stat().st_mtime),
                    path.read_bytes(),
                )
        return
    try:
        with zipfile.ZipFile(source) as archive:
            for entry in archive.infolist():
                if not entry.is_dir():
                    data = archive.read(entry) if entry.file_size <= LARGEST else b""
                    yield entry.filename.replace("\\", "/"), datetime(*entry.date_time), data
    except (OSError, zipfile.BadZipFile) as error:
        raise ValueError(f"{source} must be a zip archive or a folder; {error}") from None


def parsed(file: str, time: datetime, data: bytes) -> Submission | None:
    """Return whose file it is, by its name; None if no platform names files so."""
    parts = PurePosixPath(file).parts
    if not parts or "__MACOSX" in parts or parts[-1].startswith(".") or ".ipynb_checkpoints" in parts:
        return None
    for platform, pattern in NAMES.items():
        for start in range(len(parts)):
            match = re.fullmatch(pattern, "/".join(parts[start:]))
            if match:
                found = match.groupdict()
                if platform == "folder":
                    found["student"] = parts[-2]
                student = UNSAFE.sub("_", found["student"]).strip(".") or "_"
                if found.get("time"):
                    time = datetime.strptime(found["time"], "%Y-%m-%d-%H-%M-%S")
                copy_number = re.search(r"[-(](\d+)\)?\.ipynb$", parts[-1])
                order = (int(found.get("attempt") or 0), int(copy_number[1]) if copy_number else 0)
                return Submission(student, found.get("name") or student, platform, file, time, data, order)
    return None


def collected(source: Path) -> tuple[dict[str, Submission], dict[str, list[str]]]:
    """Return the newest notebook of each student, and what is to be said about each student's files."""
    newest: dict[str, Submission] = {}
    said: dict[str, list[str]] = {}
    for found in (parsed(*file) for file in files(source)):
        if found is None:
            continue
        notes = said.setdefault(found.student, [])
        if not found.file.lower().endswith(".ipynb"):
            if not re.search(r"_attempt_[\d-]+\.txt$", found.file):  # Blackboard's own slip
                notes.append(f"{PurePosixPath(found.file).name} is no notebook")
            continue
        other = newest.get(found.student)
        if other is None or (found.order, found.time) >= (other.order, other.time):
            newest[found.student] = found
        if other is not None:
            notes.append(f"several notebooks: {PurePosixPath(newest[found.student].file).name} is the newest")
    return newest, said


# --- mending --------------------------------------------------------------------------------------------------------


def read(data: bytes) -> nbformat.NotebookNode:
    """Return a notebook of any version; ValueError says what else it is."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about ids that are there twice: they are given anew
            nb = nbformat.reads(data.decode("utf-8-sig"), as_version=4)
        cells = [nbformat.from_dict(cell) for cell in nb.cells]
        for cell in cells:
            cell.source = "".join(cell.source)
            cell.metadata = nbformat.from_dict(cell.get("metadata") or {})
            if not isinstance(cell.metadata.get("nbgrader", {}), dict):
                del cell.metadata["nbgrader"]
    except (UnicodeDecodeError, json.JSONDecodeError, nbformat.reader.NotJSONError):
        raise ValueError("the file is no notebook: empty, cut off, or something else under its name") from None
    except Exception as error:
        raise ValueError(f"the notebook cannot be read: {type(error).__name__}") from None
    nb.cells = cells
    return nb


def mended(nb: nbformat.NotebookNode, release: nbformat.NotebookNode) -> tuple[nbformat.NotebookNode, list[str]]:
    """Return a submission with every cell of the student copy once, and what had to be mended.

    The answers and the student's own cells are theirs; everything else is as in the copy that was given out.
    """
    notes: list[str] = []
    asked = {cell_settings(cell)["grade_id"]: cell for cell in release.cells if cell_settings(cell)}
    given = nb.cells
    names = [str(cell_settings(cell).get("grade_id", "")) for cell in given]
    if not any(name in asked for name in names) and _recognised(given, names, asked):
        notes.append("no cell has its metadata: cells were known by what they define")
    if not any(name in asked for name in names):
        raise ValueError("no cell of this assignment is in the notebook")
    place = {name: _chosen(name, names, given, asked[name], notes) for name in asked}
    notes += _edited(asked, place, given)
    if (kernel := str(nb.metadata.get("kernelspec", {}).get("name", "python3"))) != "python3":
        notes.append(f"kernel {kernel!r}: marked with the course's own")
    taken = {index for index in place.values() if index is not None}
    whole, done = [], set()
    for cell in release.cells:
        name = cell_settings(cell).get("grade_id")
        new = copy.deepcopy(cell)
        if name is not None and (index := place[name]) is not None:
            for before in range(index):  # the student's own cells stay before the cell that they stood before
                if before not in taken and before not in done and _is_own(given[before], names[before], asked):
                    whole.append(_own(given[before]))
                done.add(before)
            if cell_settings(cell)["solution"]:
                new.source = given[index].source
            elif name.startswith("setup") and given[index].source.strip() != cell.source.strip():
                whole.append(_own(given[index]))
            if cell.cell_type == "code" and given[index].cell_type == "code":
                new.outputs = _safe(given[index].get("outputs", []))
        whole.append(new)
    for index in sorted(set(range(len(given))) - taken - done):
        if _is_own(given[index], names[index], asked):
            whole.append(_own(given[index]))
    answer = copy.deepcopy(release)
    for index, cell in enumerate(whole):
        cell.id = f"cell-{index}"
    answer.cells = whole
    return answer, notes


def _chosen(name: str, names: list[str], given: list[nbformat.NotebookNode], cell: nbformat.NotebookNode,
            notes: list[str]) -> int | None:
    """Return which of the cells of one name counts: the last that differs from the stub."""
    found = [index for index, other in enumerate(names) if other == name]
    if not found:
        notes.append(f"cell {name!r} is missing: put back")
        return None
    if len(found) > 1:
        notes.append(f"cell {name!r} is there {len(found)} times: the last one with an answer counts")
        found = [index for index in found if given[index].source.strip() != cell.source.strip()] or found
    return found[-1]


def _recognised(given: list[nbformat.NotebookNode], names: list[str], asked: dict[str, nbformat.NotebookNode]) -> bool:
    """Give cells without metadata the names of the answers that they are, and say whether any was found."""
    functions = {cell.source.split("(")[0]: name for name, cell in asked.items() if cell.source.startswith("def ")}
    functions = {words.removeprefix("def "): name for words, name in functions.items() if name in asked and not
                 cell_settings(asked[name])["grade"]}
    written = [name for name, cell in asked.items() if cell.cell_type == "markdown" and cell_settings(cell)["grade"]]
    after_last_check = False
    for index, cell in enumerate(given):
        known = [functions[f] for f in functions_of(cell.source) if f in functions] if cell.cell_type == "code" else []
        if known:
            names[index] = known[0]
        check = next((n for n, c in asked.items() if c.source.strip() == cell.source.strip()), "")
        names[index] = names[index] or check
        if after_last_check and written and cell.cell_type == "markdown":
            names[index] = written.pop()
        after_last_check = cell.cell_type == "markdown" and " In words" in cell.source.split("\n")[0]
    return any(names)


def _edited(asked: dict[str, nbformat.NotebookNode], place: dict[str, int | None],
            given: list[nbformat.NotebookNode]) -> list[str]:
    """Return what is to be said of locked cells that were changed, and of an answer in words that stands elsewhere."""
    notes = []
    for name, cell in asked.items():
        index = place[name]
        if index is None or not (settings := cell_settings(cell)):
            continue
        same = given[index].source.strip() == cell.source.strip()
        if settings["locked"] and not same:
            notes.append(f"locked cell {name!r} was edited: the course's own counts")
        if settings["grade"] and settings["solution"] and same:
            texts = [c.source for c in given if c.cell_type == "markdown" and not cell_settings(c)]
            if len([text for text in texts if len(text.split()) > 25]) > len(asked):
                notes.append(f"{name!r} is empty, but there is text in other cells: read it")
    return notes


def _is_own(cell: nbformat.NotebookNode, name: str, asked: dict[str, nbformat.NotebookNode]) -> bool:
    """Say whether a cell is the student's own code, or a discarded copy of an answer."""
    return cell.cell_type == "code" and name not in asked


def _own(cell: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return a student's own cell without anybody's settings."""
    new = nbformat.v4.new_code_cell(cell.source)
    new.outputs = _safe(cell.get("outputs", []))
    return new


def _safe(outputs: list[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """Return stored outputs as text and pictures, cut short: nothing that a page would run."""
    kept = []
    for output in outputs[:20]:
        if output.get("output_type") == "stream":
            kept.append(nbformat.v4.new_output("stream", name="stdout", text="".join(output.get("text", ""))[:5000]))
        elif output.get("output_type") in ("execute_result", "display_data"):
            data = {
                k: v for k, v in output.get("data", {}).items() if k in ("text/plain", "image/png") and len(v) < 10**6
            }
            if isinstance(data.get("text/plain", ""), str):
                kept.append(
                    nbformat.v4.new_output(
                        "display_data", data={k: v[:5000] if k[0] == "t" else v for k, v in data.items()}
                    )
                )
    return kept
