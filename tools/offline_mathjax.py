"""Sphinx extension: MathJax comes with the book instead of from another host.

The files are those of the package sphinx-mathjax-offline (MathJax 3). Only the one component with every TeX
package inside and its fonts are copied: 2 MB instead of 24.
"""

from __future__ import annotations

import shutil
from importlib.metadata import files
from pathlib import Path

from sphinx.application import Sphinx

COMPONENT = "tex-chtml-full.js"
FONTS = "output/chtml/fonts"


def mathjax_folder() -> Path:
    """Return the folder that holds the MathJax files of the installed package."""
    for file in files("sphinx-mathjax-offline") or []:
        if file.name == COMPONENT:
            return Path(str(file.locate())).resolve().parent
    raise FileNotFoundError(f"sphinx-mathjax-offline is installed without {COMPONENT}")


def copy_mathjax(app: Sphinx, error: Exception | None) -> None:
    """Copy the component and its fonts into the book."""
    if error is None and app.builder.format == "html":
        source, target = mathjax_folder(), Path(app.outdir) / "_static" / "mathjax"
        shutil.copytree(source / FONTS, target / FONTS, dirs_exist_ok=True)
        shutil.copy2(source / COMPONENT, target / COMPONENT)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    for setting in ("comments_config", "use_jupyterbook_latex"):  # set by Jupyter Book for extensions left away here
        app.add_config_value(setting, None, "html", [dict, bool])
    app.config.mathjax_path = f"mathjax/{COMPONENT}"
    app.connect("build-finished", copy_mathjax)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
