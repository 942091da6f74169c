"""Build the book: execute what changed, stage a copy of the sources, render it, check the pages.

    python tools/build_book.py

Where the variables BOOK_REPOSITORY_URL, BOOK_REPOSITORY_BRANCH and BOOK_URL are set, as by the workflow that publishes
the book, its pages link to their sources and to services that run them; these are links, so no page asks for anything.
With BOOK_VERSIONED they also offer the other versions that `publish_version.py` has put beside theirs.

The notebooks of `book/` hold no images, so the pages are rendered from a staged copy, `_build/source`, in which each
notebook is replaced by its executed twin. What is generated for the pages to load on request (scripts, data) is
written into `_build/static` and staged as `book/_static`. The rendered book is `_build/html`.
"""

from __future__ import annotations

import argparse
import copy
import filecmp
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import check_book
import downloads
import exercises
import lab_files
import loop_files
import notebooks
import objectives
import part_edition
import scene_files
import viewer_files
import yaml

ROOT = Path(__file__).resolve().parents[1]
EXTENSIONS = ("offline_mathjax", "reference_pages", "page_finish", "figure_twins", "part_edition", "translated_pages")
STAGED = ("_toc.yml", "CHANGELOG.md", "book", *(f"tools/{name}.py" for name in EXTENSIONS))
LAUNCH_SERVICES = {"binderhub_url": "https://mybinder.org", "colab_url": "https://colab.research.google.com"}
TRANSLATIONS = {"locale_dirs": ["book/translations"], "gettext_compact": False}
SKIPPED_PARTS = ("__pycache__", ".ipynb_checkpoints")


def staged_config(root: Path) -> str:
    """Return the configuration of the book with execution off: the staged notebooks are executed already."""
    config = yaml.safe_load((root / "_config.yml").read_text(encoding="utf-8"))
    config["execute"] = {"execute_notebooks": "off", "stderr_output": "error"}
    config = with_version(with_repository(config, os.environ), root, os.environ)
    return yaml.safe_dump(config, sort_keys=False)


def with_repository(config: dict[str, Any], environment: Mapping[str, str]) -> dict[str, Any]:
    """Return the configuration with links to the repository and to launch services, where its address is known."""
    config = copy.deepcopy(config)
    if address := environment.get("BOOK_URL"):
        config["html"]["baseurl"] = address
    if url := environment.get("BOOK_REPOSITORY_URL", "").rstrip("/"):
        branch = environment.get("BOOK_REPOSITORY_BRANCH") or "main"
        config["repository"] = {"url": url, "branch": branch, "path_to_book": ""}
        config["html"] |= dict.fromkeys(("use_repository_button", "use_issues_button", "use_edit_page_button"), True)
        if url.startswith("https://github.com/"):
            config["launch_buttons"] |= LAUNCH_SERVICES
    return config


def with_version(config: dict[str, Any], root: Path, environment: Mapping[str, str]) -> dict[str, Any]:
    """Return the configuration with the project's version at the foot of every page, and a place for the others."""
    project = root / "pyproject.toml"
    if not project.exists():
        return config
    version = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"]
    place = "<span data-versions></span>" if environment.get("BOOK_VERSIONED") else ""
    config = copy.deepcopy(config)
    config["html"]["extra_footer"] = f'<p class="book-version">Version {version}{place}</p>'
    return config


def twins(executed: Path, target: Path) -> None:
    """Write copies of executed notebooks without their solutions."""
    paths = list(executed.glob("*.ipynb"))
    for path in paths:
        notebooks.write(target / path.name, notebooks.to_text(exercises.without_solutions(notebooks.read(path))))
    for stale in set(target.glob("*.ipynb")) - {target / path.name for path in paths}:
        stale.unlink()


def stage(root: Path, executed: Path, generated: Path, target: Path) -> None:
    """Make `target` a copy of the sources with executed notebooks; touch only files whose content changed.

    Files of the folder `generated` join those of `book/_static`.
    """
    wanted: dict[Path, Path] = {}
    for name in STAGED:
        top = root / name
        for path in [top] if top.is_file() else top.rglob("*"):
            if path.is_file() and not set(SKIPPED_PARTS) & set(path.parts):
                twin = executed / path.name
                wanted[target / path.relative_to(root)] = twin if path.suffix == ".ipynb" and twin.exists() else path
    for path in generated.rglob("*"):
        if path.is_file():
            wanted[target / "book" / "_static" / path.relative_to(generated)] = path
    for twin, source in wanted.items():
        if not twin.exists() or not filecmp.cmp(source, twin, shallow=False):
            twin.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, twin)
    notebooks.write(target / "_config.yml", staged_config(root))
    for stale in (p for p in target.rglob("*") if p.is_file() and p not in wanted and p != target / "_config.yml"):
        stale.unlink()


def extend(source: Path, extension: str, settings: dict[str, Any]) -> None:
    """Add an extension and its settings to the configuration of a staged copy."""
    config = yaml.safe_load((source / "_config.yml").read_text(encoding="utf-8"))
    sphinx = config["sphinx"]
    sphinx["local_extensions"][extension] = "tools"
    sphinx["config"] |= settings | {"extensions": [*sphinx["config"]["extensions"], extension]}
    notebooks.write(source / "_config.yml", yaml.safe_dump(config, sort_keys=False))


def render(source: Path, build_parent: Path) -> int:
    """Render the staged sources into `build_parent/_build/html`; every warning is an error."""
    jupyter_book = [sys.executable, "-c", "from jupyter_book.cli.main import main; main()", "build", str(source)]
    strict = ["--path-output", str(build_parent), "-W", "-n", "--keep-going"]
    return subprocess.run([*jupyter_book, *strict], check=False).returncode


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--root", type=Path, default=ROOT, help="the folder that holds _config.yml")
    parser.add_argument("--jobs", default="2", help="notebooks executed at once")
    parser.add_argument("--edition", choices=("full", "student"), default="full", help="with solutions, or without")
    parser.add_argument("--parts", type=int, action="append", help="only this part of the book, counted from 1; again")
    parser.add_argument("--language", help="in this language, as far as book/translations goes")
    options = parser.parse_args(arguments)
    root = options.root.resolve()
    build = root / "_build"
    execute = ["execute", "--into", str(build / "executed"), "--root", str(root), "--jobs", options.jobs]
    absent = part_edition.absent(root, options.parts) if options.parts else set()
    if status := notebooks.main([*execute, *(str(p) for p in (root / "book").glob("*.ipynb") if p.stem not in absent)]):
        return status
    viewer_files.copy_scripts(build / "static", root)
    lab_files.write_labs(build / "static", root)
    loop_files.write_loops(build / "static", root)
    named = ["student" if options.edition == "student" else "", options.language, *(options.parts or [])]
    name = "-".join(str(one) for one in named if one)
    parent, executed = (build / name, build / "executed") if name else (root, build / "executed")
    source = (parent if name else build) / "source"
    if options.edition == "student":
        executed = parent / "executed"
        twins(build / "executed", executed)
    pages = parent / "_build" / "pages"
    scene_files.write_scenes(executed, pages, build / "static")
    objectives.say_times(pages)
    stage(root, pages, build / "static", source)
    if options.parts:
        told = part_edition.cut(root, source, options.parts, os.environ.get("BOOK_URL", ""))
        extend(source, "part_edition", told)
    if options.language:
        extend(source, "translated_pages", {"language": options.language} | TRANSLATIONS)
    if (source / objectives.PAGE).exists():
        objectives.fill(source)
    if status := render(source, parent):
        return status
    downloads.offer(parent / "_build" / "html")
    return check_book.main([str(parent / "_build" / "html"), "--toc", str(source / "_toc.yml")])


if __name__ == "__main__":
    sys.exit(main())
