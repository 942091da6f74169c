"""PyVista, loaded without words: its import brings a progress bar that complains where there are no widgets."""

from __future__ import annotations

import importlib
import warnings
from typing import Any


def load_pyvista() -> Any:
    """Return the module pyvista, or say how to get it: pictures are an extra of the library."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="IProgress not found")
        try:
            return importlib.import_module("pyvista")
        except ModuleNotFoundError as error:
            what = f"pictures of surfaces are drawn by pyvista, and {error.name} is missing"
            raise ModuleNotFoundError(f'{what}; pip install "spectral-notes[pictures]" brings it') from error
