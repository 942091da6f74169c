"""Keep for the book what nbval hears, so that `make test` and `make book` execute a notebook once: a plugin of pytest.

    python -m pytest -p executed_once --nbval --nbval-current-env book

The kernels start in the environment of the book, and nbclient reads their messages, as in `notebooks.py execute`. A
notebook goes into the cache of `execute` when each of its cells ran once, in order, and passed; whole, or not at all.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path
from typing import Any

import notebooks
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionComplete
from nbval.plugin import IPyNbFile

from spectral_notes.plotting.scenes import MIME


class BookNotebook(IPyNbFile):
    """A notebook of the book: nbval executes and compares it, and what its kernel says is kept."""

    def setup(self) -> None:
        """Start the kernel; what the digest covers is read first, so that a later change makes the outputs old."""
        self.skip_compare += (MIME,)  # stored outputs hold no scenes
        self.started, self.surroundings = time.monotonic(), notebooks.surroundings_digest(self.config.rootpath)
        self.heard: list[dict[str, Any]] = []
        self.passed: list[tuple[int, list[dict[str, Any]]]] = []  # the cells by their numbers, with their messages
        with pytest.MonkeyPatch.context() as patch:
            for name, value in notebooks.BOOK_ENVIRONMENT.items():
                patch.setenv(name, value)
            super().setup()

    def get_kernel_message(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Return a message of the kernel to nbval, and note it."""
        self.heard.append(super().get_kernel_message(*args, **kwargs))
        return self.heard[-1]

    def teardown(self) -> None:
        """Stop the kernel, and keep the outputs where all is as it should be."""
        seconds = time.monotonic() - self.started
        super().teardown()
        nb = notebooks.normalise(self.nb)
        places = [place for place, cell in enumerate(nb.cells) if cell.cell_type == "code"]
        if [number for number, _ in self.passed] != list(range(len(places))):
            return
        reader = NotebookClient(nb, record_timing=False)
        for place, (_, messages) in zip(places, self.passed, strict=True):
            nb.cells[place].outputs, reader.clear_before_next_output = [], False
            request = messages[-1]["parent_header"]["msg_id"]  # the last message said that this cell was done
            for message in messages:
                if message["parent_header"].get("msg_id") == request:
                    with suppress(CellExecutionComplete):
                        reader.process_message(message, nb.cells[place], place)
        nb = notebooks.normalise(nb, images=True)
        if not any(fault for _, cell in notebooks.code_cells(nb) for fault in notebooks.output_faults(cell)):
            cache = self.config.rootpath / "_build/executed-outputs"
            notebooks.remember(cache, self.path, nb, self.surroundings, seconds)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> Generator[None, list[Any], list[Any]]:
    """Let the notebooks of the book be collected as such."""
    found = yield
    ours = file_path.parent == parent.config.rootpath / "book"
    nbval = (one for one in found if isinstance(one, IPyNbFile))
    return [BookNotebook.from_parent(parent, path=one.path) for one in nbval] if ours else found


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Note that a cell of the book passed, with what was heard of it."""
    report = yield
    if report.when == "call" and isinstance(item.parent, BookNotebook):
        heard, item.parent.heard = item.parent.heard, []
        if report.passed:
            item.parent.passed.append((item.cell_num, heard))
    return report
