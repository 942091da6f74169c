"""Every page of the built book loads without a complaint and asks no other host."""

from __future__ import annotations

import pytest

LAB_DATA = 3_000_000


def test_a_page_opens_from_a_folder_without_errors_and_asks_nobody(visit, name):
    with visit(name, "file") as (page, watch):
        page.wait_for_load_state("networkidle")
        assert page.title()
        assert watch.faults() == []


@pytest.mark.parametrize("over", ["http", "file"])
def test_the_viewer_loads_on_request_only(visit, over):
    with visit("book/index.html", over) as (page, watch):
        assert page.evaluate("spectralNotes.Viewer === undefined")
        assert page.evaluate("spectralNotes.viewer().then(() => spectralNotes.Viewer.name)") == "Viewer"
        assert watch.faults() == []


def test_a_data_file_that_is_not_there_is_named(visit):
    with visit("book/index.html") as (page, _):
        said = page.evaluate("spectralNotes.data('scenes/none').catch((error) => error.message)")
        assert said == "scenes/none.js did not load"


def test_the_watch_sees_a_foreign_request_and_an_error(visit):
    with visit("book/index.html") as (page, watch):
        page.route("https://example.org/**", lambda route: route.abort())
        page.evaluate("fetch('https://example.org/a').catch(() => 0)")
        page.evaluate("console.error('broken')")
        assert "asks https://example.org/a" in watch.faults()
        assert "console: broken" in watch.faults()


def test_what_a_lab_loads_on_request_is_small(html, capsys):
    labs = {path.name: path.stat().st_size for path in (html / "_static" / "labs" / "data").glob("*.js")}
    with capsys.disabled():
        print("\n" + ", ".join(f"{name} {size / 1e6:.2f} MB" for name, size in labs.items()))
    assert labs
    assert max(labs.values()) <= LAB_DATA
