"""Sphinx extension: a translated paragraph is read as MyST, on pages that are notebooks, too.

Sphinx would give it to the parser of the page, and that of a notebook wants a whole notebook.
"""

from __future__ import annotations

import contextlib
from typing import Any

from docutils.io import StringInput
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.io import SphinxI18nReader
from sphinx.transforms import i18n


def read_as_myst(app: Any, source: str, path: str, line: int, config: Any, settings: Any) -> Any:
    """Return a translated paragraph."""
    parser, reader = MystParser(), SphinxI18nReader()
    parser.set_application(app)
    reader.setup(app)
    document = reader.read(StringInput(source, f"{path}:{line}:<translated>"), parser, settings)
    with contextlib.suppress(IndexError):
        return document[0]
    return document


def setup(app: Any) -> dict[str, bool]:
    """Register the extension."""
    i18n.publish_msgstr = read_as_myst
    return {"parallel_read_safe": True, "parallel_write_safe": True}
