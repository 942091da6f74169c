"""Every page loads little and can be used by everybody: axe-core finds nothing serious, and every picture says what is seen."""

from __future__ import annotations

import re

from axe_playwright_python.sync_playwright import Axe

FIRST_LOAD = 1_500_000  # bytes of a page, without the search index and MathJax
SEVERE = ("serious", "critical")
REPEATED = """() => {
  const seen = {};
  const marks = [...document.querySelectorAll("pre span:not(:has(*))")].filter((mark) => {
    const kind = [mark.className, getComputedStyle(mark).color, mark.closest("[class*=output], [class*=input]")?.className];
    return (seen[kind] = (seen[kind] ?? 0) + 1) > 3;
  });
  for (const mark of marks) mark.replaceWith(mark.textContent);
}"""

CONTRAST = "color-contrast"
SAMPLES = """() => {
  const seen = {}, under = new Map([[null, ""]]);
  const ground = (element) => {
    if (!under.has(element)) {
      const { backgroundColor, backgroundImage, opacity, filter } = getComputedStyle(element);
      under.set(element, [backgroundColor, backgroundImage, opacity, filter, ground(element.parentElement)].join());
    }
    return under.get(element);
  };
  for (const element of document.body.querySelectorAll("*")) {
    const { color, fontSize, fontWeight, textShadow } = getComputedStyle(element);
    const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    const kind = [element.tagName, element.className, color, fontSize, fontWeight, textShadow, ground(element)];
    const sample = own ? (seen[kind] = (seen[kind] ?? 0) + 1) <= 3 : element.matches("input, select, textarea, button");
    element.toggleAttribute("data-sample", sample);
  }
}"""


def weight(sizes: dict[str, int]) -> int:
    """Return the bytes of a first load that count."""
    return sum(size for url, size in sizes.items() if "/mathjax/" not in url and "searchindex.js" not in url)


def severe(page, *rules: str) -> list[str]:
    """Return what axe-core finds on a page: the rule, and the first places that break it.

    Of the marks of code (two thirds of a page) three of each kind and colour stay; where contrast alone is asked for, it
    is measured on three texts of each kind, colour, size and ground.
    """
    page.add_style_tag(content="* { transition: none !important; animation: none !important; }")  # no colour half-way
    page.evaluate(REPEATED)
    options, where = {"resultTypes": ["violations"]} | ({"runOnly": list(rules)} if rules else {}), None
    if rules == (CONTRAST,):
        page.evaluate(SAMPLES)
        where = {"include": [["[data-sample]"]]}
    found = Axe().run(page, where, options).response["violations"]
    return [
        f"{one['id']}: {one['help']}, {len(one['nodes'])} times, first {[n['html'][:160] for n in one['nodes'][:3]]}"
        for one in found
        if one["impact"] in SEVERE
    ]


def test_a_page_loads_little_and_everybody_can_use_it(visit, name, capsys):
    """By axe, whose rules but one do not see the theme; and pictures say what is seen."""
    with visit(name) as (page, watch):
        page.wait_for_load_state("networkidle")
        assert watch.faults() == []
        with capsys.disabled():
            print(f"\n{name}: first load {weight(watch.sizes) / 1e6:.2f} MB")
        assert weight(watch.sizes) <= FIRST_LOAD, sorted(watch.sizes.items(), key=lambda one: -one[1])[:8]
        assert page.evaluate("document.documentElement.dataset.theme") == "light"
        assert severe(page) == []
        assert [picture for picture in page.evaluate(PICTURES) if poor(**picture)] == []
        page.evaluate("document.documentElement.dataset.theme = 'dark'")
        assert severe(page, CONTRAST) == []


def test_axe_finds_nothing_on_a_phone_and_sees_a_pale_word_and_a_formula_out_of_reach(visit):
    with visit("book/03_differentiation.html", theme="dark", viewport={"width": 390, "height": 844}) as (page, _):
        page.wait_for_load_state("networkidle")
        assert severe(page) == []
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        page.evaluate("document.querySelector('article p').style.color = '#555'")
        assert [one.split(":")[0] for one in severe(page, CONTRAST)] == ["color-contrast"]
        page.locator("mjx-container[tabindex='0']").first.evaluate("(formula) => formula.removeAttribute('tabindex')")
        assert [one.split(":")[0] for one in severe(page, "scrollable-region-focusable")] == ["scrollable-region-focusable"]


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
