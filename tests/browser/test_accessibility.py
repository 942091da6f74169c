"""Every page can be used by everybody: axe-core finds nothing serious, and every picture says what is seen."""

from __future__ import annotations

import re

from axe_playwright_python.sync_playwright import Axe

SEVERE = ("serious", "critical")


# Thousands of marks of one kind: whether keys reach formulas is asked directly, the colours of code on one page.
MANY = ("mjx-container", ".highlight pre")


def severe(page, *rules: str, without: tuple[str, ...] = MANY) -> list[str]:
    """Return what axe-core finds on a page as it stands: the rule, and the first places that break it."""
    page.add_style_tag(content="* { transition: none !important; animation: none !important; }")  # no colour half-way
    options = {"resultTypes": ["violations"]} | ({"runOnly": list(rules)} if rules else {})
    found = Axe().run(page, {"exclude": [[one] for one in without]}, options=options).response["violations"]
    return [
        f"{one['id']}: {one['help']}, {len(one['nodes'])} times, first {[n['html'][:160] for n in one['nodes'][:3]]}"
        for one in found
        if one["impact"] in SEVERE
    ]


def test_everybody_can_use_a_page(visit, name):
    """By axe, in the dark by its colours; formulas that scroll are reached by keys; pictures say what is seen."""
    with visit(name) as (page, _):
        page.wait_for_load_state("networkidle")
        assert page.evaluate("document.documentElement.dataset.theme") == "light"
        assert severe(page) == []
        pictures = page.evaluate(PICTURES)
        assert [picture for picture in pictures if poor(**picture)] == []
        formulas = page.locator("mjx-container[display=true]")
        assert formulas.evaluate_all("(all) => all.filter((one) => one.clientWidth && one.scrollWidth > one.clientWidth + 1 && one.tabIndex < 0).length") == 0
        page.evaluate("document.documentElement.dataset.theme = 'dark'")
        assert severe(page, "color-contrast") == []


def test_axe_sees_a_pale_word_and_a_formula_out_of_reach(visit):
    with visit("book/03_differentiation.html", theme="dark") as (page, _):
        page.wait_for_load_state("networkidle")
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        assert severe(page, "color-contrast", without=("mjx-container",)) == [], "the colours of code"
        page.evaluate("document.querySelector('article p').style.color = '#555'")
        assert severe(page, "color-contrast")[0].startswith("color-contrast")
        page.set_viewport_size({"width": 390, "height": 844})
        page.locator("mjx-container[tabindex='0']").first.wait_for()


PICTURES = """[...document.querySelectorAll("article img")].map((picture) => ({
  alt: picture.alt, caption: picture.closest("figure")?.querySelector("figcaption")?.textContent ?? ""
}))"""


def words(text: str) -> str:
    """Return the words of a text alone."""
    return " ".join(re.findall(r"\w+", text.lower()))


def poor(alt: str, caption: str) -> bool:
    """Say whether an alternative text says nothing of the picture: too short, a file's name, or the caption again."""
    is_name = re.search(r"\.(png|webp|svg|jpe?g|gif)\b|_images|^[0-9a-f]{16,}$", alt)
    return len(words(alt).split()) < 4 or bool(is_name) or words(alt) in words(caption)


def test_a_poor_alternative_text_is_found():
    good = "A goat in red and blue, black lines between the colours."
    assert not poor(good, "Mode 5 of the goat.")
    assert poor("goat.png seen from the left side", "")
    assert poor("A goat", "")
    assert poor("Mode 5 of the goat", "Fig. 3 Mode 5 of the goat. #")


def test_the_way_through_a_figure_by_keys(visit):
    """A keyboard reaches the button, the scene, its tools, and comes back to the button."""
    with visit("book/08_eigenfunctions.html") as (page, _):
        button = page.locator(".scene-turn").first
        button.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("document.activeElement.classList.contains('scene-view')")
        order = []
        for _ in range(5):
            page.keyboard.press("Shift+Tab")
            order.insert(0, page.evaluate("document.activeElement.getAttribute('aria-label')"))
        assert order[0].startswith("Pictures of Fig.")
        assert order[1:] == ["Closer", "Farther", "As at first", "Back to the still picture"]
        assert severe(page) == []
        page.locator(".scene-view").first.press("Escape")
        assert button.evaluate("(button) => button === document.activeElement")
