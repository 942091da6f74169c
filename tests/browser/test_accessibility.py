"""Every page can be used by everybody: axe-core finds nothing serious, and every picture says what is seen."""

from __future__ import annotations

import re

import pytest
from axe_playwright_python.sync_playwright import Axe

SEVERE = ("serious", "critical")


def severe(page) -> list[str]:
    """Return what axe-core finds on a page as it stands: the rule, and the first places that break it."""
    page.add_style_tag(content="* { transition: none !important; animation: none !important; }")  # no colour half-way
    found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
    return [
        f"{one['id']}: {one['help']}, {len(one['nodes'])} times, first {[n['html'][:160] for n in one['nodes'][:3]]}"
        for one in found
        if one["impact"] in SEVERE
    ]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_serious(visit, name, theme):
    with visit(name, theme=theme) as (page, _):
        page.wait_for_load_state("networkidle")
        assert page.evaluate("document.documentElement.dataset.theme") == theme
        assert severe(page) == []
