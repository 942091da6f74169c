"""PyVista, loaded without words: its import brings a progress bar that complains where there are no widgets."""

from __future__ import annotations

import importlib
import warnings
from typing import Any


def load_pyvista() -> Any:
    """Return the module pyvista."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="IProgress not found")
        return importlib.import_module("pyvista")
