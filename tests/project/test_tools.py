"""The tools that keep the notebooks and the rendered book honest, each shown failing on what it must catch."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import build_book
import check_book
import nbformat
import notebooks
import page_finish
import pytest
import scene_files
from PIL import Image

TOOLS = Path(notebooks.__file__).parent
FIGURE = {
    "mystnb": {
        "figure": {"caption": "A line.", "name": "fig-00-line"},
        "image": {"alt": "A straight line that rises from left to right."},
    }
}
DRAW = "import matplotlib.pyplot as plt\nfig, ax = plt.subplots()\nline = ax.plot([0, 1])"


def code(source: str, n: int = 0, **metadata: object) -> nbformat.NotebookNode:
    """Make a code cell."""
    return nbformat.v4.new_code_cell(source, id=f"code-{n}", metadata=metadata)


def make_notebook(path: Path, *cells: nbformat.NotebookNode) -> Path:
    """Write a notebook that was never run."""
    title = nbformat.v4.new_markdown_cell("# Title", id="title")
    notebooks.write(path, notebooks.to_text(nbformat.v4.new_notebook(cells=[title, *cells])))
    return path


def tool(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run one of the tools as a reader would."""
    command = [sys.executable, str(TOOLS / name), *map(str, arguments)]
    return subprocess.run(command, check=False, capture_output=True, text=True)


def stored(*cells: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return a notebook in normal form, as if it had been run."""
    return notebooks.normalise(nbformat.v4.new_notebook(cells=list(cells)))


def faults_of(tmp_path: Path, *cells: nbformat.NotebookNode) -> str:
    """Return the faults of a notebook stored with the given cells, as one text."""
    path = tmp_path / "made.ipynb"
    notebooks.write(path, notebooks.to_text(stored(*cells)))
    return "\n".join(notebooks.faults(path))


def with_outputs(cell: nbformat.NotebookNode, *outputs: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Return the cell with outputs."""
    cell.outputs = list(outputs)
    return cell


# --- run and check --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a notebook that `run` has executed and stored."""
    path = make_notebook(
        tmp_path_factory.mktemp("book") / "00_tiny.ipynb",
        code(DRAW, 1, **FIGURE, collapsed=True),
        code("for i in range(3):\n    print(i, flush=True)\nprint(round(2**0.5, 3))", 2),
    )
    result = tool("notebooks.py", "run", path)
    assert result.returncode == 0, result.stderr
    return path


def test_run_stores_counts_and_text_and_no_images(executed: Path) -> None:
    nb = notebooks.read(executed)
    drawn, printed = (cell for _, cell in notebooks.code_cells(nb))
    assert (drawn.execution_count, printed.execution_count) == (1, 2)
    assert drawn.outputs[0]["data"] == {"text/plain": "<Figure size 640x480 with 1 Axes>"}
    assert [output["text"] for output in printed.outputs] == ["0\n1\n2\n1.414\n"]
    assert drawn.metadata == FIGURE, "only the metadata of the book are kept"
    assert nb.metadata.language_info == notebooks.LANGUAGE, "the version of Python is not stored"
    assert [cell.id for cell in nb.cells] == ["title", "code-1", "code-2"]
    assert notebooks.faults(executed) == []


def test_run_again_changes_nothing(executed: Path) -> None:
    before = executed.read_bytes()
    assert tool("notebooks.py", "run", executed).returncode == 0
    assert executed.read_bytes() == before


def test_one_wrong_digit_fails_the_comparison_with_a_fresh_run(executed: Path, tmp_path: Path) -> None:
    def compare(path: Path) -> subprocess.CompletedProcess[str]:
        options = ["--nbval", "--nbval-current-env", "-p", "no:cacheprovider", "-c", "/dev/null", "--rootdir", str(tmp_path)]
        command = [sys.executable, "-m", "pytest", "-q", *options, str(path)]
        return subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path)

    broken = tmp_path / "broken.ipynb"
    broken.write_text(executed.read_text(encoding="utf-8").replace("1.414", "1.415"), encoding="utf-8")
    assert compare(executed).returncode == 0
    result = compare(broken)
    assert result.returncode == 1
    assert "1.415" in result.stdout


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("1 / 0", "cell 2 raises ZeroDivisionError: division by zero"),
        ("import warnings\nwarnings.warn('noise')", "cell 2 writes to stderr"),
        ("object()", "cell 2 ends in the repr of an object"),
        ("print(object())", "cell 2 prints a memory address"),
        ("import os\nos._exit(1)", "cell 2 did not finish"),
    ],
)
def test_a_faulty_cell_fails_the_run_and_is_not_stored(source: str, message: str, tmp_path: Path) -> None:
    path = make_notebook(tmp_path / "bad.ipynb", code("x = 1", 1), code(source, 2))
    before = path.read_bytes()
    result = tool("notebooks.py", "run", path)
    assert result.returncode == 1
    assert f"bad.ipynb: {message}" in result.stderr
    assert path.read_bytes() == before


def test_check_finds_a_notebook_that_was_never_run(tmp_path: Path) -> None:
    path = make_notebook(tmp_path / "fresh.ipynb", code("print(1)"))
    assert "was not executed from top to bottom" in "\n".join(notebooks.faults(path))
    assert "prints, but no output is stored" in "\n".join(notebooks.faults(path))


def test_check_finds_images_and_foreign_metadata(executed: Path, tmp_path: Path) -> None:
    nb = json.loads(executed.read_text(encoding="utf-8"))
    copy = tmp_path / "copy.ipynb"
    nb["cells"][1]["metadata"]["collapsed"] = True
    copy.write_text(json.dumps(nb), encoding="utf-8")
    assert "copy.ipynb: is not in normal form (metadata, streams or spelling)" in notebooks.faults(copy)
    nb["cells"][1]["outputs"][0]["data"]["image/png"] = "iVBORw0KGgo="
    copy.write_text(json.dumps(nb), encoding="utf-8")
    assert "copy.ipynb: holds images" in notebooks.faults(copy)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("%matplotlib inline", "holds a shell or magic command"),
        ("!pip list", "holds a shell or magic command"),
        ("import sys\nsys.path.append('..')", "holds a change of sys.path"),
        ("from urllib import request", "holds a download"),
        ("x = 1;", "holds a trailing semicolon"),
        ("", "is empty"),
        ("\n".join(f"x{i} = {i}" for i in range(13)), "has 13 lines; at most 12"),
        ("x = 1\ny = " + "+".join(["1"] * 37), "has a line of 77 characters; at most 76"),
    ],
)
def test_check_finds_what_a_cell_must_not_hold(source: str, message: str, tmp_path: Path) -> None:
    assert message in faults_of(tmp_path, code(source))


def test_check_lets_a_long_plotting_cell_hide(tmp_path: Path) -> None:
    source = "\n".join(f"x{i} = {i}" for i in range(13))
    assert faults_of(tmp_path, code(source, tags=["hide-input"])) == ""
    assert faults_of(tmp_path, code("y = 11" + "+1" * 35)) == ""  # 76 characters
    assert faults_of(tmp_path, code("y = 1" + "+1" * 99, tags=["hide-input"])) == ""


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ({"figure": {"name": "fig-x"}, "image": {"alt": "seen"}}, "has no caption"),
        ({"figure": {"caption": "A line."}, "image": {"alt": "seen"}}, "has no label"),
        ({"figure": {"caption": "A line.", "name": "line"}, "image": {"alt": "seen"}}, "has no label"),
        ({"figure": {"caption": "A line.", "name": "fig-x"}}, "has no alternative text of its own"),
        ({"figure": {"caption": "A", "name": "fig-x"}, "image": {"alt": "A"}}, "has no alternative text of its own"),
    ],
)
def test_check_finds_an_incomplete_figure(missing: dict[str, object], message: str, tmp_path: Path) -> None:
    picture = nbformat.v4.new_output("display_data", data={"text/plain": "<Figure size 640x480 with 1 Axes>"})
    assert message in faults_of(tmp_path, with_outputs(code(DRAW, mystnb=missing), picture))
    assert faults_of(tmp_path, with_outputs(code(DRAW, **FIGURE), picture)) == ""
    assert "shows 2 figures" in faults_of(tmp_path, with_outputs(code(DRAW, **FIGURE), picture, picture))
    assert "shows 0 figures" in faults_of(tmp_path, code(DRAW, **FIGURE))


def test_check_counts_cells_whose_output_is_not_compared(tmp_path: Path) -> None:
    ignored = {"tags": ["nbval-ignore-output"], "reason": "a ratio of times"}
    assert faults_of(tmp_path, code("x = 1", **ignored)) == ""
    assert "2 cells carry nbval-ignore-output" in faults_of(tmp_path, code("x = 1", 1, **ignored), code("y = 1", 2, **ignored))
    assert "without a reason" in faults_of(tmp_path, code("x = 1", tags=["nbval-ignore-output"]))
    assert "carries the tag raises-exception" in faults_of(tmp_path, code("x = 1", tags=["raises-exception"]))


def test_check_finds_two_cells_with_one_id(tmp_path: Path) -> None:
    path = tmp_path / "made.ipynb"
    notebooks.write(path, notebooks.to_text(stored(code("x = 1", 1), code("y = 1", 2))).replace("code-2", "code-1"))
    assert "made.ipynb: has two cells with the id code-1" in notebooks.faults(path)


def test_a_missing_notebook_is_named() -> None:
    result = tool("notebooks.py", "check", "none.ipynb")
    assert result.returncode == 1
    assert "none.ipynb: there is no such notebook or folder" in result.stderr


# --- the cache of executed notebooks --------------------------------------------------------------------------------


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a project of one notebook, one module and pins."""
    (tmp_path / "spectral_notes").mkdir()
    (tmp_path / "spectral_notes" / "signals.py").write_text("ANSWER = 42\n", encoding="utf-8")
    (tmp_path / "requirements.txt").write_text("numpy==2.0.0\n", encoding="utf-8")
    make_notebook(tmp_path / "book" / "00_tiny.ipynb", code("print(6 * 7)", 1))
    return tmp_path


def execute(project: Path) -> str:
    """Execute a project's notebooks for the book and return what the tool says."""
    result = tool("notebooks.py", "execute", project / "book", "--into", project / "_build/executed", "--root", project)
    assert result.returncode == 0, result.stderr
    return result.stderr


def test_only_what_changed_is_executed_again(project: Path) -> None:
    assert "0 of 1 notebooks are unchanged, 1 to execute" in execute(project)
    assert "1 of 1 notebooks are unchanged, 0 to execute" in execute(project)
    (project / "spectral_notes" / "signals.py").write_text("ANSWER = 43\n", encoding="utf-8")
    assert "1 to execute" in execute(project), "a changed library executes the notebooks again"
    (project / "requirements.txt").write_text("numpy==2.0.1\n", encoding="utf-8")
    assert "1 to execute" in execute(project), "changed pins execute the notebooks again"
    make_notebook(project / "book" / "00_tiny.ipynb", code("print(6 * 8)", 1))
    assert "1 to execute" in execute(project), "changed code executes the notebook again"


def test_changed_prose_keeps_the_outputs(project: Path) -> None:
    execute(project)
    path = project / "book" / "00_tiny.ipynb"
    path.write_text(path.read_text(encoding="utf-8").replace("# Title", "# Another title"), encoding="utf-8")
    assert "0 to execute" in execute(project)
    nb = notebooks.read(project / "_build/executed/00_tiny.ipynb")
    assert nb.cells[0].source == "# Another title"
    assert nb.cells[1].outputs[0]["text"] == "42\n"


def test_what_nbval_hears_is_what_execute_keeps_and_nothing_else_is_kept(project: Path) -> None:
    shown = """
import os
from IPython.display import display
print("one")
scenes = {"application/vnd.spectral-notes.scenes+json": {"bar": None}} if os.environ.get("SPECTRAL_NOTES_SCENES") else {}
display({"text/plain": "seen", "image/png": "iVBORw0KGgo="} | scenes, raw=True)
print("two")"""
    whole = make_notebook(project / "book/00_tiny.ipynb", code(shown, 1), code("[len(scenes) and 6 * 7][1:]", 2))
    assert tool("notebooks.py", "run", whole).returncode == 0
    said = [nbformat.v4.new_output("stream", text="41\n")]
    others = {
        "book/wrong": [with_outputs(code("print(42)", 1), *said)],
        "book/address": [code("print(object())", 1, tags=["nbval-ignore-output"], reason="it is another each time")],
        "book/part": [code("x = 1", 1), code("y = 1", 2)],
        "elsewhere": [code("x = 1", 1)],
    }
    for name, cells in others.items():
        notebooks.write(project / f"{name}.ipynb", notebooks.to_text(stored(*cells)))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", "/dev/null", "--rootdir", str(project)]
    command += ["-o", f"pythonpath={TOOLS}", "-p", "executed_once", "--nbval", "--nbval-current-env"]
    command += [str(project / "book"), str(project / "elsewhere.ipynb"), "--deselect", "book/part.ipynb::Cell 1"]
    result = subprocess.run(command, check=False, capture_output=True, text=True, cwd=TOOLS.parent)
    assert "1 failed, 5 passed, 1 deselected" in result.stdout, result.stdout
    kept = project / "_build/executed-outputs"
    assert [path.name for path in kept.iterdir()] == ["00_tiny.json"]
    heard = json.loads((kept / "00_tiny.json").read_text(encoding="utf-8"))
    for name in others:
        (project / f"{name}.ipynb").unlink()
    assert "1 of 1 notebooks are unchanged, 0 to execute" in execute(project)
    executed = (project / "_build/executed/00_tiny.ipynb").read_text(encoding="utf-8")
    shutil.rmtree(project / "_build")
    assert "1 to execute" in execute(project)
    memory = json.loads((kept / "00_tiny.json").read_text(encoding="utf-8"))
    assert heard | {"seconds": 0} == memory | {"seconds": 0}
    assert executed == (project / "_build/executed/00_tiny.ipynb").read_text(encoding="utf-8")
    assert [list(output.get("data", {})) for output in memory["outputs"][0]] == [[], ["text/plain", "image/png", scene_files.MIME], []]


def test_notebooks_depend_on_the_library_the_measured_numbers_and_the_pins(tmp_path: Path) -> None:
    names = ("spectral_notes/a.py", "benchmarks/learning.json", "requirements.txt")
    seen = {notebooks.surroundings_digest(tmp_path)}
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("1")
        seen.add(notebooks.surroundings_digest(tmp_path))
    (tmp_path / "benchmarks/learning.py").write_text("1")  # a page reads no script
    assert len(seen) == 4 and notebooks.surroundings_digest(tmp_path) in seen


def test_what_is_made_once_is_made_again_when_a_source_changes_and_after_a_failure(tmp_path: Path) -> None:
    record, source, made = tmp_path / "x.digest", tmp_path / "draws.py", []
    for text, calls in (("one", 1), ("one", 1), ("two", 2)):
        source.write_text(text)
        notebooks.once(record, [source], tmp_path, partial(made.append, text))
        assert len(made) == calls
    source.write_text("three")
    with pytest.raises(ZeroDivisionError):
        notebooks.once(record, [source], tmp_path, lambda: 1 / 0)
    notebooks.once(record, [source], tmp_path, lambda: made.append("three"))
    assert made == ["one", "two", "three"]


def test_a_raising_cell_fails_the_execution_and_is_named(project: Path) -> None:
    make_notebook(project / "book" / "00_tiny.ipynb", code("x = 1", 1), code("x['a']", 2))
    result = tool("notebooks.py", "execute", project / "book", "--into", project / "_build/executed", "--root", project)
    assert result.returncode == 1
    assert "00_tiny.ipynb: cell 2 raises TypeError: 'int' object is not subscriptable" in result.stderr
    assert not (project / "_build/executed/00_tiny.ipynb").exists()


def test_a_raising_cell_fails_the_build_of_the_book(project: Path) -> None:
    make_notebook(project / "book" / "00_tiny.ipynb", code("1 / 0", 1))
    result = tool("build_book.py", "--root", project)
    assert result.returncode == 1
    assert "00_tiny.ipynb: cell 1 raises ZeroDivisionError" in result.stderr


def test_staging_replaces_notebooks_by_their_executed_twins(tmp_path: Path) -> None:
    root, executed_twins, target = tmp_path / "root", tmp_path / "executed", tmp_path / "source"
    generated = tmp_path / "static"
    for path, text in {
        root / "_config.yml": "title: T\nexecute:\n  execute_notebooks: cache\n",
        root / "_toc.yml": "root: book/index\n",
        root / "book/index.md": "# T\n",
        root / "book/00.ipynb": "stored",
        root / "tools/offline_mathjax.py": "",
        executed_twins / "00.ipynb": "executed",
        generated / "scenes/a.js": "data",
        target / "book/gone.md": "left over",
    }.items():
        notebooks.write(path, text)
    build_book.stage(root, executed_twins, generated, target)
    assert (target / "book/00.ipynb").read_text() == "executed"
    assert (target / "book/index.md").read_text() == "# T\n"
    assert "'off'" in (target / "_config.yml").read_text()
    assert (target / "book/_static/scenes/a.js").read_text() == "data"
    assert not (target / "book/gone.md").exists()


def test_scenes_leave_the_page_for_files_of_their_own(tmp_path: Path) -> None:
    scene = {"meshes": {"meshes/0a1b": {"facts": {"step": 1.0}}}, "pictures": [{"mesh": "meshes/0a1b", "name": "<b>"}], "bar": None}
    data = {"image/png": "iVBORw0KGgo=", scene_files.MIME: scene}
    drawn = with_outputs(code(DRAW, 1, **FIGURE), nbformat.v4.new_output("display_data", data=data))
    write_executed(tmp_path / "executed" / "00.ipynb", drawn)
    notebooks.write(tmp_path / "static/scenes/fig-gone-0.js", "left over")
    notebooks.write(tmp_path / "pages/gone.ipynb", "left over")
    scene_files.write_scenes(tmp_path / "executed", tmp_path / "pages", tmp_path / "static")
    page = notebooks.read(tmp_path / "pages/00.ipynb")
    assert list(page.cells[0].outputs[0].data) == ["image/png"], "the page holds no data"
    assert 'data-figure="fig-00-line"' in page.cells[1].source
    assert "<b>" not in page.cells[1].source
    files = {path.relative_to(tmp_path / "static").as_posix(): path.read_text() for path in (tmp_path / "static").rglob("*.js")}
    picture = '{"bar":null,"pictures":[{"mesh":"meshes/0a1b","name":"<b>"}]}'
    assert files == {
        "meshes/0a1b.js": 'spectralNotes.register("meshes/0a1b", {"facts":{"step":1.0}});\n',
        "scenes/fig-00-line.js": f'spectralNotes.register("scenes/fig-00-line", {picture});\n',
    }
    assert not (tmp_path / "pages/gone.ipynb").exists()


def write_executed(path: Path, *cells: nbformat.NotebookNode) -> None:
    """Write a notebook with its outputs and images."""
    nb = notebooks.normalise(nbformat.v4.new_notebook(cells=list(cells)), images=True)
    notebooks.write(path, notebooks.to_text(nb))


def test_figures_bring_their_scenes_into_the_book_and_not_into_stored_outputs(project: Path) -> None:
    source = "import os\nprint(os.environ.get('SPECTRAL_NOTES_SCENES'))"
    path = make_notebook(project / "book" / "00_tiny.ipynb", code(source, 1))
    execute(project)
    assert notebooks.read(project / "_build/executed/00_tiny.ipynb").cells[1].outputs[0]["text"] == "1\n"
    assert tool("notebooks.py", "run", path).returncode == 0
    assert notebooks.read(path).cells[1].outputs[0]["text"] == "None\n"


# --- what a page loads --------------------------------------------------------------------------------------------


def builder(tmp_path: Path) -> SimpleNamespace:
    """Return what a Sphinx extension sees of a book with one picture."""
    Image.new("RGB", (40, 20), "white").save(tmp_path / "goat.png")
    (tmp_path / "out/_images").mkdir(parents=True)
    (tmp_path / "out/_static/scripts").mkdir(parents=True)
    shutil.copy(tmp_path / "goat.png", tmp_path / "out/_images/goat1.png")
    made = SimpleNamespace(format="html", images={"goat.png": "goat1.png"}, name="html")
    return SimpleNamespace(srcdir=tmp_path, outdir=tmp_path / "out", builder=made)


def test_pictures_come_light_when_they_are_scrolled_to(tmp_path: Path) -> None:
    app = builder(tmp_path)
    other = '<img alt="A lab." src="../_static/lab.png"/>'
    context = {"body": f'<img alt="A goat: 2 &gt; 1." src="../_images/goat1.png" />{other}'}
    page_finish.finish_page(app, "book/a", "page.html", context, None)
    twins = "".join(
        f'<img width="40" height="20" class="only-{theme} wide-figure" loading="lazy" decoding="async" '
        f'alt="A goat: 2 &gt; 1." src="../_images/{name}.webp" />' for theme, name in (("light", "goat1"), ("dark", "goat1-dark"))
    )
    assert context["body"] == twins + other
    page_finish.write_light_files(app, None)
    for name in ("goat1", "goat1-dark"):
        with Image.open(tmp_path / f"out/_images/{name}.webp") as picture:
            assert picture.size == (40, 20)
    assert (tmp_path / "out/_static/scripts/fontawesome.js").stat().st_size < 100


def test_a_failed_build_writes_no_light_files(tmp_path: Path) -> None:
    page_finish.write_light_files(builder(tmp_path), RuntimeError("broken"))
    assert not list((tmp_path / "out/_images").glob("*.webp"))


# --- the rendered book ----------------------------------------------------------------------------------------------


def rendered(tmp_path: Path, body: str = "", head: str = "") -> str:
    """Return the faults of a rendered book of one page with the given body and head."""
    page = f"<html><head><title>T</title>{head}</head><body>{body}</body></html>"
    (tmp_path / "index.html").write_text(page, encoding="utf-8")
    (tmp_path / "_toc.yml").write_text("format: jb-book\nroot: index\n", encoding="utf-8")
    return "\n".join(check_book.faults(tmp_path, tmp_path / "_toc.yml"))


def test_a_page_that_asks_nobody_passes(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"")
    body = '<a href="https://example.org">a source</a><img src="a.png" alt="A line."><img src="data:," alt="A dot.">'
    assert rendered(tmp_path, body) == ""


@pytest.mark.parametrize(
    ("body", "head"),
    [
        ('<img src="https://example.org/a.png" alt="a">', ""),
        ('<img srcset="//example.org/a.png 2x" alt="a">', ""),
        ('<iframe src="http://example.org"></iframe>', ""),
        ('<p style="background: url(https://example.org/a.png)">', ""),
        ("<script>fetch('https://example.org/data.json')</script>", ""),
        ("<script>s.src = 'https://example.org/a.js'</script>", ""),
        ("", '<script src="https://example.org/a.js"></script>'),
        ("", '<link rel="stylesheet" href="https://example.org/a.css">'),
        ("", '<link rel="preconnect" href="https://fonts.example.org">'),
        ("", "<style>@import 'https://example.org/a.css';</style>"),
        ("", "<style>@font-face { src: url('https://example.org/a.woff2') }</style>"),
    ],
)
def test_a_page_that_asks_another_host_is_found(body: str, head: str, tmp_path: Path) -> None:
    assert "index.html: asks another host for" in rendered(tmp_path, body, head)


def test_an_asset_that_asks_another_host_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.css").write_text("@import url(https://example.org/a.css);", encoding="utf-8")
    (tmp_path / "b.js").write_text('import("https://example.org/b.js")', encoding="utf-8")
    found = rendered(tmp_path)
    assert "a.css: asks another host" in found
    assert "b.js: asks another host" in found


def test_other_faults_of_a_page_are_found(tmp_path: Path) -> None:
    assert "loads a.png, which is not there" in rendered(tmp_path, '<img src="a.png" alt="a">')
    assert "without alternative text" in rendered(tmp_path, '<img src="data:,">')
    assert "shows 1 warnings" in rendered(tmp_path, '<div class="output stderr">noise</div>')


def test_a_named_page_that_is_missing_is_found(tmp_path: Path) -> None:
    toc = tmp_path / "contents.yml"
    toc.write_text("root: index\nparts:\n- chapters:\n  - file: book/01.ipynb\n    sections:\n    - file: book/more.md\n")
    assert check_book.named_pages(toc) == ["index", "book/01", "book/more"]
    assert check_book.main([str(tmp_path), "--toc", str(toc)]) == 1
