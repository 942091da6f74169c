"""Every control of the theme and of ours is pressed: by pointer, touch and keys, on a phone and a desktop, light and dark."""

from __future__ import annotations

import pytest

PAGE = "book/01_function_spaces.html"
WINDOWS = {"upright": (390, 844), "sideways": (844, 390), "desktop": (1280, 800)}
CASES = [
    ("upright", "light", "http"), ("upright", "dark", "file"), ("sideways", "light", "file"),
    ("sideways", "dark", "http"), ("desktop", "light", "file"), ("desktop", "dark", "http"),
]


@pytest.fixture(params=CASES, ids="-".join)
def page_of(request, visit):
    """Open the page in every kind of window, in both themes, from a server and from a folder."""
    window, theme, over = request.param
    width, height = WINDOWS[window]
    with visit(PAGE, over, theme, viewport={"width": width, "height": height}, has_touch=window != "desktop") as (page, watch):
        page.wait_for_function("document.querySelector('#pst-primary-sidebar') !== null")
        yield page, watch, window


def press(page, locator, window: str) -> None:
    """Press with the finger on a phone, with the pointer on a desktop."""
    locator.tap() if window != "desktop" else locator.click()


def test_the_contents_open_on_a_phone_and_fold_on_a_desktop(page_of):
    page, watch, window = page_of
    button = page.locator(".primary-toggle")
    assert button.count() == 1, "the theme's script binds the first of several"
    link = page.locator(".bd-sidebar-primary a, #pst-primary-sidebar-modal a").filter(has_text="Differentiation").first
    shown = window == "desktop"
    assert link.is_visible() == shown
    for by in ("pointer", "keys"):
        if by == "pointer":
            press(page, button, window)
        else:
            button.focus()
            page.keyboard.press("Enter")
        page.wait_for_timeout(500)
        assert link.is_visible() != shown, f"{by}: nothing happened"
        if shown:
            button.press("Enter")
        else:
            page.keyboard.press("Escape")
        page.wait_for_timeout(500)
        assert link.is_visible() == shown, f"{by}: it does not go back"
    assert watch.faults() == []


def test_the_contents_of_the_page_open_where_they_are_folded(page_of):
    page, watch, window = page_of
    button = page.locator(".secondary-toggle")
    assert button.count() == 1
    link = page.locator(".page-toc a, #pst-secondary-sidebar-modal a").filter(has_text="Exercises").first
    if button.is_visible():
        press(page, button, window)
        page.wait_for_timeout(300)
        assert link.is_visible()
        page.keyboard.press("Escape")
    else:
        assert link.is_visible()
    assert watch.faults() == []


def test_the_theme_changes_and_is_kept(page_of):
    page, watch, window = page_of
    seen = set()
    for _ in range(3):
        press(page, page.locator(".theme-switch-button").first, window)
        seen.add(page.evaluate("[document.documentElement.dataset.mode, document.documentElement.dataset.theme].join()"))
    assert len(seen) == 3
    assert page.evaluate("localStorage.getItem('mode')") in ("light", "dark", "auto")
    assert watch.faults() == []


def test_downloads_open_and_print_and_the_whole_screen_do_not_fail(page_of):
    page, watch, window = page_of
    press(page, page.locator(".dropdown-download-buttons > button"), window)
    page.locator(".dropdown-download-buttons .dropdown-item").first.wait_for()
    page.evaluate("window.print = () => (window.printed = true)")
    press(page, page.locator(".btn-download-pdf-button"), window)
    assert page.evaluate("window.printed")
    press(page, page.locator(".btn-fullscreen-button"), window)
    page.wait_for_timeout(200)
    assert watch.faults() == []


def test_the_search_opens_and_finds_and_marks_its_hits(page_of):
    page, watch, _ = page_of
    page.keyboard.press("Control+k")
    field = page.locator("#pst-search-dialog input[type=search]")
    field.wait_for()
    field.fill("metamer")
    page.keyboard.press("Enter")
    page.wait_for_url("**/search.html?q=metamer*")
    hit = page.locator("ul.search li a").first
    hit.wait_for()
    hit.click()
    page.wait_for_url("**/book/**")
    page.locator("article .highlighted").first.wait_for(state="attached", timeout=20_000)
    assert watch.faults() == []


def test_previous_next_and_top(page_of):
    page, watch, window = page_of
    for name, wanted in (("a.right-next", "02_"), ("a.left-prev", "01_")):
        press(page, page.locator(name).first, window)
        page.wait_for_url(f"**/{wanted}*")
    page.evaluate("scrollTo(0, 5000)")
    assert watch.faults() == []


def test_focus_is_seen_on_every_button_of_the_header(page_of):
    page, _, _ = page_of
    for button in page.locator(".bd-header-article button:visible").all():
        button.focus()
        page.keyboard.press("Shift")  # focus by keys, as the browser sees it
        drawn = button.evaluate("(b) => getComputedStyle(b).outlineStyle + getComputedStyle(b).outlineWidth")
        assert drawn == "solid3px", button.evaluate("(b) => b.outerHTML.slice(0, 120)")


# --- folded, predicted, ticked ------------------------------------------------------------------------------------------


def test_a_link_into_a_folded_place_opens_it(visit):
    with visit(PAGE) as (page, _):
        inside = page.evaluate(
            """() => {
              const folded = document.querySelector("article details:not([open]) div, article .toggle-hidden p");
              folded.id = "a-folded-place";
              return !folded.checkVisibility();  // Chromium lays out what a closed <details> holds, and skips drawing it
            }"""
        )
        assert inside
        page.evaluate("location.hash = '#a-folded-place'")
        page.wait_for_function("document.getElementById('a-folded-place').checkVisibility()")


def test_a_prediction_is_kept_and_opens_the_answer(visit):
    with visit(PAGE) as (page, watch):
        line = page.get_by_label("Your prediction").first
        line.fill("it doubles")
        line.press("Enter")
        answer = page.locator("form.prediction + .admonition.dropdown").first
        assert "toggle-hidden" not in (answer.get_attribute("class") or "")
        page.reload()
        assert page.get_by_label("Your prediction").first.input_value() == "it doubles"
        assert watch.faults() == []


def test_ticked_exercises_are_counted_in_the_side_bar_and_saved_to_a_file(visit):
    with visit(PAGE, viewport={"width": 1280, "height": 800}) as (page, watch):
        page.get_by_label("Done").first.check()
        assert page.locator(".progress-mark").inner_text().strip().startswith("1/")
        with page.expect_download() as kept:
            page.get_by_role("button", name="Save what I wrote").click()
        assert "exercises" in kept.value.path().read_text()
        page.get_by_label("Done").first.uncheck()
        assert page.locator(".progress-mark").inner_text().strip() == ""
        assert watch.faults() == []


def test_few_stops_of_the_tab_key(visit):
    with visit("book/07_laplacian.html") as (page, _):
        page.wait_for_load_state("networkidle")
        stops = page.evaluate(
            "[...document.querySelectorAll('a[href], button, input, select, [tabindex]')].filter((e) => e.tabIndex >= 0 && e.checkVisibility()).length"
        )
        formulas = page.locator("mjx-container[tabindex='0']")  # only one that scrolls is a stop: keys must move it
        assert formulas.evaluate_all("(all) => all.every((one) => one.scrollWidth > one.clientWidth)")
        assert stops < 320, stops


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_figure_shows_one_twin_and_its_caption(visit, theme):
    with visit(PAGE, theme=theme) as (page, watch):
        figure = page.locator("figure:has(img.only-dark)").first
        figure.scroll_into_view_if_needed()
        assert figure.locator("img:visible").count() == 1
        assert figure.locator(f"img.only-{theme}").is_visible()
        assert figure.locator("figcaption").is_visible()
        page.wait_for_function("document.querySelector('figure img:not([style])').complete")
        assert watch.faults() == []


# --- without scripts, without storage -----------------------------------------------------------------------------------


def test_without_scripts_the_page_is_light_and_the_code_is_read(browser, http):
    context = browser.new_context(java_script_enabled=False, color_scheme="dark")
    page = context.new_page()
    page.goto(f"{http}/{PAGE}")
    assert page.locator("html").get_attribute("data-theme") == "light"
    assert page.locator("article img:visible").count() > 5
    context.close()


def test_without_storage_everything_still_works(visit):
    with visit("book/index.html") as (page, watch):
        page.add_init_script("Object.defineProperty(window, 'localStorage', { configurable: true, get() { throw new DOMException('denied', 'SecurityError'); } })")
        page.goto(page.url.replace("index", "01_function_spaces"))
        page.locator(".theme-switch-button").first.click()
        page.get_by_label("Your prediction").first.fill("it doubles")
        page.get_by_label("Your prediction").first.press("Enter")
        page.goto(page.url.split("book/")[0] + "search.html?q=metamer")
        page.locator("ul.search li a").first.wait_for()
        assert watch.faults() == []
