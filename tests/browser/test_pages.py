"""Every page of the built book loads without a complaint and without asking another host, served and from a folder."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize("over", ["http", "file"])
def test_a_page_loads_without_errors_and_asks_nobody(visit, name, over):
    with visit(name, over) as (page, watch):
        page.wait_for_load_state("networkidle")
        assert page.title()
        assert watch.faults() == []


@pytest.mark.parametrize("over", ["http", "file"])
def test_plotly_loads_on_request_only(visit, over):
    with visit("book/index.html", over) as (page, watch):
        assert page.evaluate("window.Plotly === undefined")
        assert page.evaluate("spectralNotes.plotly().then((plotly) => plotly.version)")
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
