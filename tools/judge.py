"""Mark one notebook: hidden tests run here, the student's functions run in a process of their own (`worker.py`).

The source of an assignment says what is judged. Its cell of checks ends with a hidden part that sets `cases`, a list of
inputs, and may set `check`, which judges one returned value, and `slips`: points, words, and what undoes the slip. What
a function returns is compared here, with what the solution returns.
"""

from __future__ import annotations

import ast
import contextlib
import itertools
import json
import os
import pickle
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cloudpickle
import nbformat
import numpy as np
import scipy.sparse as sp
import worker

from spectral_notes.checking import Verdict, check_result, check_values

HIDDEN = re.compile(r"### BEGIN HIDDEN TESTS\n(.*?)### END HIDDEN TESTS\n?", re.DOTALL)
MARKERS = re.compile(r"^ *### (?:BEGIN|END) SOLUTION\n?", re.MULTILINE)
Answer = Callable[..., Any]


@dataclass(frozen=True)
class Limits:
    """Seconds that a call and a cell may take."""

    call: float = 10.0
    cell: float = 20.0


@dataclass
class Mark:
    """What a question earned, and what is said about it."""

    points: float
    earned: float = 0.0
    said: list[str] = field(default_factory=list)

    def markdown(self) -> str:
        """Return the words for the feedback."""
        told = "\n\n".join(dict.fromkeys(self.said))
        return f"{told}\n\n**{self.earned:g} of {self.points:g} points.**"


# --- the other process ----------------------------------------------------------------------------------------------


class Template:
    """The process that has run the set-up of an assignment; every reading of a notebook is a fork of it."""

    def __init__(self, setup: str) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="marking-"))
        self.ours, theirs = socket.socketpair()
        environment = {k: v for k, v in os.environ.items() if not k.startswith("SPECTRAL_NOTES")}
        self.process = subprocess.Popen(
            [sys.executable, worker.__file__, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            env=environment
            | {
                "MPLBACKEND": "agg",
                "MPLCONFIGDIR": str(self.folder),
                "OPENBLAS_NUM_THREADS": "1",
                "OMP_NUM_THREADS": "1",
                "MKL_NUM_THREADS": "1",
            },
        )
        theirs.close()
        worker.send(self.ours, setup.encode())
        if fault := worker.receive(self.ours).decode():
            raise RuntimeError(f"the set-up of the assignment does not run: {fault}")

    def fork(self) -> tuple[int, socket.socket]:
        """Return a new child and the connection to it."""
        ours, theirs = socket.socketpair()
        socket.send_fds(self.ours, [b"f"], [theirs.fileno()])
        theirs.close()
        (child,) = struct.unpack("!Q", worker.receive(self.ours))
        return child, ours

    def close(self) -> None:
        """End the process and forget its files."""
        self.ours.close()
        self.process.wait(30)
        shutil.rmtree(self.folder, ignore_errors=True)


class Reading:
    """A child that has run some cells of a notebook, and answers calls."""

    def __init__(self, template: Template, cells: list[str], reference: dict[str, Answer], limits: Limits) -> None:
        self.reference, self.limits = reference, limits
        self.scratch = Path(tempfile.mkdtemp(dir=template.folder))
        self.child, self.connection = template.fork()
        self.faults: list[str] = []
        self.ended = ""
        job = {"cells": cells, "seconds": limits.cell, "reference": list(reference), "scratch": str(self.scratch)}
        reply = self._exchange(pickle.dumps(job), limits.cell * (1 + len(cells)))
        self.faults = reply.get("faults", [])

    def call(self, name: str, inputs: tuple[Any, ...], without: list[str]) -> dict[str, Any]:
        """Return what came of a call, in the form of `worker.answer`."""
        seconds = self.limits.call
        job = {"call": name, "inputs": inputs, "without": without, "seconds": seconds}
        return self._exchange(cloudpickle.dumps(job), 2 * seconds + 5)

    def _exchange(self, message: bytes, seconds: float) -> dict[str, Any]:
        """Send a message and return the reply; earlier answers that the child asks for are given on the way."""
        if self.ended:
            return {"raised": ["NoAnswer", self.ended], "stub": False}
        until = time.monotonic() + seconds
        try:
            self.connection.settimeout(seconds)
            worker.send(self.connection, message)
            while True:
                self.connection.settimeout(max(0.01, until - time.monotonic()))
                reply = json.loads(worker.receive(self.connection))
                if not (isinstance(reply, dict) and "ask" in reply):
                    return reply if isinstance(reply, dict) else {}
                value = self.reference[reply["ask"]](*worker.decode(reply["inputs"]))
                worker.send(self.connection, pickle.dumps(value))
        except TimeoutError:
            self.ended = f"no answer within {seconds:g} seconds"
        except Exception as error:
            self.ended = f"the process ended: {type(error).__name__} (time, memory, or its own doing)"
        self.close()
        return {"raised": ["NoAnswer", self.ended], "stub": False}

    def close(self) -> None:
        """End the child and all that it started."""
        self.ended = self.ended or "closed"
        self.connection.close()
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.child, signal.SIGKILL)
        shutil.rmtree(self.scratch, ignore_errors=True)


class Remote:
    """A student's function, as it looks from here: a call goes to the other process."""

    def __init__(self, reading: Reading, name: str, without: list[str]) -> None:
        self.reading, self.name, self.without = reading, name, without
        self.known: dict[bytes, dict[str, Any]] = {}
        self.spent: dict[str, Any] = {}
        self.is_stub = False

    def __call__(self, *inputs: Any) -> Any:
        """Return what the function returned, raise what it raised."""
        key = cloudpickle.dumps(inputs)
        if key not in self.known:
            self.known[key] = self.spent or self.reading.call(self.name, inputs, self.without)
        reply = self.known[key]
        if "raised" in reply and reply["raised"][0] in ("TimeoutError", "MemoryError"):
            self.spent = reply  # no second wait for the same answer
        self.is_stub = bool(reply.get("stub"))
        if reply.get("missing"):
            raise type("NameError", (Exception,), {})(f"there is no function {self.name}")
        if "raised" in reply:
            kind, words = map(str, reply["raised"])
            raise type(kind, (NotImplementedError if self.is_stub else Exception,), {})("" if self.is_stub else words)
        return worker.decode(reply.get("value"))


# --- an assignment --------------------------------------------------------------------------------------------------


def cell_settings(cell: nbformat.NotebookNode) -> dict[str, Any]:
    """Return what nbgrader knows about a cell."""
    return cell.metadata.get("nbgrader", {})


def functions_of(source: str) -> list[str]:
    """Return the functions that a cell defines."""
    with contextlib.suppress(SyntaxError):
        return [node.name for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    return []


def dense(value: Any) -> Any:
    """Return a matrix, dense or sparse, as an array."""
    return value.toarray() if sp.issparse(value) else np.asarray(value)


def agree(one: Any, other: Any) -> bool:
    """Say whether two values are the same numbers, up to a thousandth of the largest."""
    try:
        if isinstance(other, tuple):
            return len(one) == len(other) and all(itertools.starmap(agree, zip(one, other, strict=True)))
        one, other = (dense(x).astype(complex) for x in (one, other))
        return one.shape == other.shape and abs(one - other).max(initial=0) <= 1e-3 * abs(other).max(initial=0)
    except Exception:
        return False


class Assignment:
    """The questions of an assignment, with the solutions and hidden tests that a seed makes."""

    def __init__(self, nb: nbformat.NotebookNode, without: dict[str, list[str]], seed: int = 0) -> None:
        cells = {cell_settings(cell)["grade_id"]: cell for cell in nb.cells if cell_settings(cell)}
        self.setup = next((cell.source for name, cell in cells.items() if name.startswith("setup")), "")
        self.answers = {
            n: c for n, c in cells.items() if cell_settings(c)["solution"] and not cell_settings(c)["grade"]
        }
        self.checks = {n: cells[f"check-{n}"] for n in self.answers}
        self.without, self.seed = without, seed
        self.names: dict[str, Any] = {"__name__": "reference"}
        exec(self.setup, self.names)
        for cell in self.answers.values():
            exec(MARKERS.sub("", cell.source), self.names)
        self.function = {name: functions_of(cell.source)[-1] for name, cell in self.answers.items()}

    def points(self, name: str) -> float:
        """Return the points of a question."""
        return float(cell_settings(self.checks[name])["points"])

    def refused(self, name: str) -> list[str]:
        """Return the modules that the answer to a question does without."""
        return self.without.get(name, self.without.get("*", []))

    def judged(self, name: str, answer: Answer) -> Mark:
        """Return what a function earns as the answer of a question."""
        reference = self.names[self.function[name]]
        names = self.names | {self.function[name]: answer}
        visible, hidden = HIDDEN.split(self.checks[name].source)[0], HIDDEN.search(self.checks[name].source)
        exec(visible, names)
        shown: list[Verdict] = names["verdicts"]

        def instead(slipped: Answer) -> Answer:
            return lambda value, *inputs: reference(*inputs) if agree(value, slipped(*inputs)) else value

        def check(value: object, *inputs: Any) -> Verdict:
            return check_values(value, reference(*inputs), law=names.get("law", ""))

        number = sorted(self.answers).index(name)
        names |= {"reference": reference, "dense": dense, "instead": instead, "check": check, "slips": [],
                  "rng": np.random.default_rng([self.seed, number])}
        exec(hidden[1] if hidden else "cases = []", names)

        def tests(function: Answer) -> list[Verdict]:
            return [check_result(function, inputs, names["check"], *inputs) for inputs in names["cases"]]

        verdicts = tests(answer)
        mark = Mark(self.points(name), said=[v._repr_markdown_() for v in [*shown, *verdicts]])
        share = sum(map(bool, verdicts)) / len(verdicts)
        mark.earned = mark.points * share if share == 1 else round(2 * mark.points * share) / 2 if share >= 0.5 else 0.0
        if share < 1:
            for points, words, mend in names["slips"]:
                if points > mark.earned and all(tests(_mended(answer, mend))):
                    mark.earned = points
                    mark.said.append(f"One slip, which costs {mark.points - points:g} points: {words}.")
        return mark


def _mended(answer: Answer, mend: Answer) -> Answer:
    """Return a function whose values are mended."""
    return lambda *inputs: mend(answer(*inputs), *inputs)


# --- a notebook -----------------------------------------------------------------------------------------------------


class Marker:
    """Marks notebooks of one assignment; it starts the other process once."""

    def __init__(self, assignment: Assignment, limits: Limits | None = None) -> None:
        self.assignment, self.limits = assignment, limits or Limits()
        self.template = Template(assignment.setup)

    def __enter__(self) -> Marker:
        return self

    def __exit__(self, *_: object) -> None:
        self.template.close()

    def marks(self, nb: nbformat.NotebookNode) -> dict[str, Mark]:
        """Return what each question earned; the notebook has every cell once (see `submissions.mended`)."""
        code = [cell for cell in nb.cells if cell.cell_type == "code"]
        kept = [(cell_settings(c).get("grade_id", ""), c.source) for c in code if not cell_settings(c).get("grade")]
        own = [(name, source) for name, source in kept if source.strip() and not name.startswith("setup")]
        marks: dict[str, Mark] = {}
        whole = Reading(self.template, [source for _, source in own], {}, self.limits)
        for name in self.assignment.answers:
            best = self._mark(name, whole, own)
            for cells, other in self._fallbacks(name, own):
                if best.earned == best.points:
                    break
                names = {self.assignment.function[n]: n for n in self.assignment.answers if n != name}
                reference = {function: self.assignment.names[function] for function in names}
                with contextlib.closing(
                    Reading(self.template, [s for _, s in cells], reference, self.limits)
                ) as reading:
                    mark = self._mark(name, reading, cells)
                if mark.earned > best.earned:
                    best = mark
                    best.said.append(f"This is what the answer earns {other}.")
            marks[name] = best
        whole.close()
        return marks

    def _fallbacks(self, name: str, own: list[tuple[str, str]]) -> Iterator[tuple[list[tuple[str, str]], str]]:
        """Yield other readings of the notebook in which an answer may be right, and what they are called."""
        if name in (names := [n for n, _ in own]):
            last = len(names) - names[::-1].index(name)
            yield own[:last], "with the cells below it left out, and right answers to the other questions"
            yield [own[last - 1]], "alone, with right answers to the other questions"

    def _mark(self, name: str, reading: Reading, cells: list[tuple[str, str]]) -> Mark:
        """Return what an answer earns in one reading."""
        answer = Remote(reading, self.assignment.function[name], self.assignment.refused(name))
        mark = self.assignment.judged(name, answer)
        for (cell, _), fault in zip(cells, reading.faults, strict=False):
            if cell == name and fault:
                mark.said.insert(0, f"**The cell of the answer does not run.** {fault}")
        return mark
