"""A published book offers its other versions, over http and from a folder."""

from __future__ import annotations

import json

import pytest

PLACE = """document.addEventListener("DOMContentLoaded", () =>
  document.querySelector(".book-version")?.insertAdjacentHTML("beforeend", "<span data-versions></span>"))"""


@pytest.mark.parametrize("over", ["http", "file"])
def test_a_page_offers_the_versions_that_lie_beside_its_own(visit, html, http, over):
    names = ["0.3.0", html.name, "latest"]
    with visit("book/index.html", over=over) as (page, watch):
        page.wait_for_load_state("networkidle")
        assert page.locator(".book-version").inner_text().startswith("Version ")
        page.add_init_script(PLACE)
        page.route("**/versions.js", lambda route: route.fulfill(body=f"spectralNotesVersions({json.dumps(names)})"))
        page.reload()
        choice = page.get_by_label("Version of the book")
        assert choice.locator("option").all_inner_texts() == names
        if over == "file":
            assert choice.input_value() == html.name
        page.route("**/0.3.0/index.html", lambda route: route.fulfill(body="<p>newer</p>", content_type="text/html"))
        page.wait_for_load_state("networkidle")
        choice.select_option("0.3.0")
        page.wait_for_url("**/0.3.0/index.html")
        assert page.locator("p").inner_text() == "newer"
        assert watch.errors == []
