"""Running elsewhere: workflows, images, launch buttons and the wheel, each checked as far as it can be without a service."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import build_book
import matrix
import notebooks
import publish_version
import pytest
import wheel
import yaml

ROOT = Path(notebooks.__file__).resolve().parents[1]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
TARGETS = set(re.findall(r"^([a-z]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
HOSTED = {
    "BOOK_REPOSITORY_URL": "https://github.com/somebody/notes",
    "BOOK_REPOSITORY_BRANCH": "trunk",
    "BOOK_URL": "https://somebody.github.io/notes/",
}


# --- workflows -------------------------------------------------------------------------------------------------------


def schema_faults(schema: str, *paths: Path) -> str:
    """Return what a schema that comes with check-jsonschema says about files; nothing where they hold."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, *map(str, paths)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return "" if result.returncode == 0 else result.stdout + result.stderr


def test_the_workflows_are_those_that_the_project_needs() -> None:
    assert [path.stem for path in WORKFLOWS] == ["paper", "publish", "release", "test", "weekly"]


def test_every_workflow_fits_the_schema() -> None:
    assert schema_faults("vendor.github-workflows", *WORKFLOWS) == ""
    assert schema_faults("custom.github-workflows-require-timeout", *WORKFLOWS) == ""


def test_the_schema_finds_a_misspelt_key(tmp_path: Path) -> None:
    broken = tmp_path / "broken.yml"
    broken.write_text(WORKFLOWS[0].read_text(encoding="utf-8").replace("runs-on:", "run-on:"), encoding="utf-8")
    assert "run-on" in schema_faults("vendor.github-workflows", broken)


def test_the_citation_file_fits_its_schema() -> None:
    assert schema_faults("vendor.citation-file-format", ROOT / "CITATION.cff") == ""


@pytest.mark.parametrize("path", WORKFLOWS, ids=[path.stem for path in WORKFLOWS])
def test_a_workflow_names_targets_and_files_that_exist_and_asks_for_no_more_rights_than_it_needs(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    workflow = yaml.safe_load(text)
    assert workflow["permissions"] == {"contents": "read"}
    assert set(re.findall(r"make ([a-z]+)", text)) <= TARGETS
    for script in re.findall(r"(?:bash|python) ([\w./]+\.(?:py|sh)|\.ci/run)", text):
        assert (ROOT / script).exists()
    for job in workflow["jobs"].values():
        for step in job["steps"]:
            assert re.fullmatch(r"[\w.-]+/[\w.-]+@\w[\w./]*", step["uses"]) if "uses" in step else step["run"]
            assert "${{" not in step.get("run", ""), "values come through env, so that none is read as a command"


def test_rights_to_publish_are_given_to_the_one_job_that_publishes() -> None:
    for path, job in (("publish", "deploy"), ("release", "pypi")):
        workflow = yaml.safe_load((ROOT / f".github/workflows/{path}.yml").read_text(encoding="utf-8"))
        allowed = {name for name, job in workflow["jobs"].items() if "id-token" in job.get("permissions", {})}
        assert allowed == {job}


def test_the_three_systems_and_pythons_are_tested() -> None:
    jobs = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text(encoding="utf-8"))["jobs"]
    assert jobs["linux"]["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13", "3.14"]
    assert jobs["elsewhere"]["strategy"]["matrix"]["system"] == ["macos-latest", "windows-latest"]


# --- versions of the book ----------------------------------------------------------------------------------------------


def built(folder: Path, text: str) -> Path:
    """Make a book of one page."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "index.html").write_text(text, encoding="utf-8")
    return folder


def test_books_lie_beside_each_other_with_the_newest_release_in_front(tmp_path: Path) -> None:
    site = tmp_path / "site"
    site.mkdir()
    assert publish_version.put(site, built(tmp_path / "a", "main"), "latest") == ["latest"]
    for name in ("0.9.0", "0.10.0", "0.2.0"):
        names = publish_version.put(site, built(tmp_path / "b", name), name)
    assert names == ["0.10.0", "0.9.0", "0.2.0", "latest"]
    assert (site / "versions.js").read_text() == 'spectralNotesVersions(["0.10.0", "0.9.0", "0.2.0", "latest"]);\n'
    assert "url=0.10.0/index.html" in (site / "index.html").read_text()
    (site / "0.9.0/old.html").touch()
    publish_version.put(site, built(tmp_path / "b", "mended"), "0.9.0")
    assert [path.name for path in (site / "0.9.0").iterdir()] == ["index.html"]
    with pytest.raises(ValueError, match=r"name must be a version, like 0.2.0, or latest; got '../x'"):
        publish_version.put(site, tmp_path / "b", "../x")
    with pytest.raises(FileNotFoundError, match=r"book must be a built book; .* run make book"):
        publish_version.put(site, tmp_path, "latest")


def test_pages_carry_their_version_and_offer_others_only_where_they_are_published() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    alone, published = (
        build_book.with_version({"html": {}}, ROOT, environment)["html"]["extra_footer"]
        for environment in ({}, {"BOOK_VERSIONED": "1"})
    )
    assert f"Version {project['version']}" in alone and "data-versions" not in alone
    assert "data-versions" in published


def test_the_published_branch_keeps_every_version(tmp_path: Path) -> None:
    workflow = yaml.safe_load((ROOT / ".github/workflows/publish.yml").read_text(encoding="utf-8"))
    step = next(s["run"] for s in workflow["jobs"]["build"]["steps"] if s.get("name") == "Put it beside the other versions")
    origin = tmp_path / "origin"
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "init.defaultBranch=main"]
    subprocess.run([*git, "init", "-q", "--bare", str(origin)], check=True)
    for name in ("latest", "v0.2.0"):
        work = tmp_path / name / "work"
        subprocess.run([*git, "clone", "-q", str(origin), str(work)], check=True, capture_output=True)
        if name == "latest":
            (work / "README.md").touch()
            subprocess.run([*git, "add", "README.md"], check=True, cwd=work)
            subprocess.run([*git, "commit", "-qm", "start"], check=True, cwd=work)
            subprocess.run([*git, "push", "-q", "origin", "HEAD:main"], check=True, cwd=work)
        (work / "tools").mkdir()
        shutil.copy(ROOT / "tools/publish_version.py", work / "tools")
        built(work / "_build/html", name)
        (work / ".venv/bin").mkdir(parents=True)
        (work / ".venv/bin/python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        (work / ".venv/bin/python").chmod(0o755)
        environment = os.environ | {"GITHUB_WORKSPACE": str(work), "NAME": name}
        subprocess.run(["bash", "-eo", "pipefail", "-c", step], check=True, cwd=work, env=environment, capture_output=True)
    site = work / "_build/site"
    assert {path.name for path in site.iterdir()} == {"0.2.0", "latest", "index.html", "versions.js", ".nojekyll"}
    assert (site / "latest/index.html").read_text() == "latest"


# --- what others read: citation, deposits, paper, recipe, forms ----------------------------------------------------------


def test_citation_deposits_and_package_agree() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    zenodo = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((ROOT / "tools/conda/recipe.yaml").read_text(encoding="utf-8"))
    versions = {project["version"], citation["version"], meta["version"], zenodo["version"], recipe["context"]["version"]}
    assert len(versions) == 1
    assert citation["title"] == meta["name"] == zenodo["title"]
    assert citation["abstract"].strip() == meta["description"] == zenodo["description"]
    assert citation["date-released"] == meta["dateModified"] == zenodo["publication_date"]
    assert citation["keywords"] == meta["keywords"] == zenodo["keywords"]
    assert [a["name"] for a in citation["authors"]] == [a["name"] for a in meta["author"] + zenodo["creators"]][:1]
    assert project["license"] == zenodo["license"] == citation["license"][0] == recipe["about"]["license"]


def test_the_recipe_asks_for_what_the_package_needs() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = project["dependencies"] + project["optional-dependencies"]["pictures"]  # a recipe has no extras
    names = {re.split(r"[\s<>=;!\[]", line)[0].lower() for line in lines}
    run = yaml.safe_load((ROOT / "tools/conda/recipe.yaml").read_text(encoding="utf-8"))["requirements"]["run"]
    there = {re.split(r"[\s<>=]", line)[0].lower() for line in run if isinstance(line, str)}
    elsewhere = {"matplotlib-base": "matplotlib", "robust_laplacian": "robust-laplacian"}
    assert {elsewhere.get(name, name) for name in there} - {"python"} == names - {"cholespy"}  # only where there is a wheel


def test_the_builder_of_conda_understands_the_recipe() -> None:
    builder = pytest.importorskip("rattler_build", reason="pip install py-rattler-build; the weekly workflow does")
    recipe = builder.Stage0Recipe.from_file(ROOT / "tools/conda/recipe.yaml").to_dict()
    assert recipe["package"]["name"] == "spectral-notes"


def test_the_paper_cites_what_the_book_cites() -> None:
    entry = re.compile(r"^@\w+\{([\w-]+),\n.*?\n\}$", re.DOTALL | re.MULTILINE)
    book = {m[1]: m[0] for m in entry.finditer((ROOT / "book/references.bib").read_text(encoding="utf-8"))}
    paper = {m[1]: m[0] for m in entry.finditer((ROOT / "paper/paper.bib").read_text(encoding="utf-8"))}
    text = (ROOT / "paper/paper.md").read_text(encoding="utf-8")
    assert paper == {key: book[key] for key in set(re.findall(r"@([a-z]+\d{4})", text))}
    headings = re.findall(r"^# (.*)$", text, re.MULTILINE)
    wanted = ["Statement of need", "Learning objectives", "Content", "Instructional design", "Experience of use"]
    assert headings == ["Summary", *wanted, "References"]


def test_every_form_asks_for_something_and_fits_what_the_service_reads() -> None:
    forms = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("[0-9]*.yml"))
    assert len(forms) == 3
    for path in forms:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert set(form) == {"name", "description", "labels", "body"}
        assert any(item.get("validations", {}).get("required") for item in form["body"])
        assert all(item["type"] in ("input", "textarea") and item["attributes"]["label"] for item in form["body"])
        assert len({item["id"] for item in form["body"]}) == len(form["body"])


# --- images ----------------------------------------------------------------------------------------------------------


def test_every_image_installs_the_same_things() -> None:
    """Binder, the development container, continuous integration: one list of system packages, one file of pins."""
    packages = set((ROOT / "binder/apt.txt").read_text(encoding="utf-8").split())
    container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    assert set(re.search(r"--no-install-recommends (.*)", container["onCreateCommand"])[1].split()) == packages
    assert container["postCreateCommand"] == "python -m pip install -r requirements.txt"
    assert (ROOT / "binder/requirements.txt").read_text(encoding="utf-8").split() == ["-r", "../requirements.txt"]
    for path in WORKFLOWS:
        for names in re.findall(r"--no-install-recommends (.*)", path.read_text(encoding="utf-8")):
            assert set(names.split()) == packages


def test_images_have_a_python_that_the_project_supports() -> None:
    lowest, beyond = re.findall(
        r"3\.(\d+)", tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    )
    for text in ((ROOT / "binder/runtime.txt").read_text(), (ROOT / ".devcontainer/devcontainer.json").read_text()):
        assert int(lowest) <= int(re.search(r"python[-:]3\.(\d+)", text)[1]) < int(beyond)


# --- launch buttons and edit links ------------------------------------------------------------------------------------


def config() -> dict:
    return yaml.safe_load((ROOT / "_config.yml").read_text(encoding="utf-8"))


def test_without_an_address_the_book_has_no_link_to_a_repository() -> None:
    assert build_book.with_repository(config(), {}) == config()
    assert "repository" not in config()


def test_with_an_address_it_links_to_sources_and_services() -> None:
    hosted = build_book.with_repository(config(), HOSTED)
    assert hosted["repository"] == {"url": "https://github.com/somebody/notes", "branch": "trunk", "path_to_book": ""}
    assert hosted["launch_buttons"]["binderhub_url"] == "https://mybinder.org"
    assert hosted["launch_buttons"]["thebe"] is False
    assert hosted["html"]["baseurl"] == "https://somebody.github.io/notes/"
    elsewhere = build_book.with_repository(config(), {"BOOK_REPOSITORY_URL": "https://git.example.org/notes/"})
    assert elsewhere["launch_buttons"] == config()["launch_buttons"], "the services know one host only"
    assert elsewhere["repository"]["branch"] == "main"


@pytest.mark.parametrize("hosted", [False, True])
def test_rendered_pages_have_the_links_only_when_the_address_is_known(hosted: bool, tmp_path: Path) -> None:
    """One page, rendered by Jupyter Book with the project's configuration but for its own extensions."""
    made = build_book.with_repository(config(), HOSTED if hosted else {})
    made["execute"] = {"execute_notebooks": "off"}
    made["sphinx"]["local_extensions"] = {}
    made["sphinx"]["config"] = {"html_theme": "sphinx_book_theme"}
    made.pop("bibtex_bibfiles")
    made.pop("exclude_patterns")
    made["html"] = {key: value for key, value in made["html"].items() if key not in ("favicon", "logo")}
    files = {"_config.yml": yaml.safe_dump(made), "_toc.yml": "format: jb-book\nroot: page\n", "page.ipynb": PAGE}
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert build_book.render(tmp_path, tmp_path) == 0
    page = (tmp_path / "_build/html/page.html").read_text(encoding="utf-8")
    links = [
        "https://mybinder.org/v2/gh/somebody/notes/trunk?urlpath=lab/tree/page.ipynb",
        "https://colab.research.google.com/github/somebody/notes/blob/trunk/page.ipynb",
        "https://github.com/somebody/notes/edit/trunk/page.ipynb",
    ]
    assert [link in page for link in links] == [hosted] * 3


PAGE = json.dumps(
    {
        "cells": [{"cell_type": "markdown", "id": "a", "metadata": {}, "source": "# A page"}],
        "metadata": {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
)


# --- the matrix of versions ------------------------------------------------------------------------------------------


def test_the_oldest_release_is_the_lowest_that_the_project_allows(tmp_path: Path) -> None:
    made = tmp_path / "pyproject.toml"
    made.write_text('[project]\ndependencies = ["numpy>=1.26,<3", "scipy>=1.15", "scipy-stubs>=1"]\n', encoding="utf-8")
    assert matrix.requirements("oldest", made) == ["numpy==1.26", "scipy==1.15"]
    assert matrix.requirements("newest", made) == ["numpy>=1.26,<3", "scipy>=1.15"]


def test_what_the_matrix_runs_exists() -> None:
    assert all((ROOT / f"tests/{name}.py").exists() for name in matrix.TESTS)
    assert all((ROOT / f"book/{name}.ipynb").exists() for name in matrix.NOTEBOOKS)
    runs = yaml.safe_load((ROOT / ".github/workflows/weekly.yml").read_text(encoding="utf-8"))["jobs"]["versions"]
    assert runs["strategy"]["matrix"]["run"] == [f"{r}-{t}" for r in matrix.RELEASES for t in matrix.THREADS]


# --- the wheel -------------------------------------------------------------------------------------------------------


def test_a_wheel_with_more_than_the_library_is_found(tmp_path: Path) -> None:
    made = tmp_path / "made.whl"
    with zipfile.ZipFile(made, "w") as archive:
        for name in ("spectral_notes/meshes.py", "spectral_notes-0.1.0.dist-info/METADATA", "tests/test_meshes.py"):
            archive.writestr(name, "")
    assert wheel.strangers(made) == ["tests/test_meshes.py"]


def test_the_wheel_is_tried_with_what_the_readme_shows() -> None:
    assert "compute_eigenbasis(L, M, 10)" in wheel.readme_example()
