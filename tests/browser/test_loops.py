"""Pictures that move: still first, played on request, stopped by the same button, none for who wants less motion."""

from __future__ import annotations

import io

import loop_files
import numpy as np
import pytest
from PIL import Image

PAGE = "book/09_heat_waves_descriptors.html"


def pixels(page) -> np.ndarray:
    """What the first such figure shows."""
    return np.asarray(Image.open(io.BytesIO(page.locator(".loop-frame").first.screenshot())).convert("RGB")).astype(int)


@pytest.mark.parametrize(("over", "theme", "width"), [("http", "light", 1280), ("file", "dark", 390)])
def test_a_loop_plays_on_request_and_stops(visit, over, theme, width):
    with visit(PAGE, over, theme, viewport={"width": width, "height": 800}) as (page, watch):
        button, image = page.locator(".loop-play").first, page.locator(".loop-frame img:visible").first
        button.scroll_into_view_if_needed()
        page.wait_for_function("(i) => i.complete && i.naturalWidth", arg=image.element_handle())
        first = pixels(page)
        page.wait_for_timeout(400)
        assert np.array_equal(pixels(page), first), "it moves before it is asked"
        assert not [url for url in watch.sizes if "/loops/" in url and url.endswith(".webp")]
        assert button.get_attribute("aria-label").startswith("Play: Fig. 9.")
        button.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("(i) => i.src.includes('/loops/') && i.complete && i.naturalWidth", arg=image.element_handle())
        assert ("-dark" in image.get_attribute("src")) == (theme == "dark")
        assert button.get_attribute("aria-label").startswith("Stop: Fig. 9.")
        seen = []
        for _ in range(8):
            page.wait_for_timeout(250)
            seen.append(pixels(page))
        assert max(np.abs(one - seen[0]).max(axis=2).mean() for one in seen) > 2, "it does not move"
        button.click()
        page.wait_for_function("(i) => !i.src.includes('/loops/') && i.complete", arg=image.element_handle())
        page.wait_for_timeout(200)
        page.mouse.move(0, 0)
        button.evaluate("(b) => b.blur()")
        assert (np.abs(pixels(page) - first).max(axis=2) > 40).mean() < 0.01, "the still did not come back"
        assert watch.faults() == []


def test_who_prefers_less_motion_keeps_the_stills(visit):
    with visit(PAGE, reduced_motion="reduce") as (page, _):
        assert page.locator("figure.loop").count() == 2 and page.locator(".loop-play").count() == 0


def test_a_loop_that_does_not_load_leaves_the_still(visit):
    with visit(PAGE) as (page, _):
        page.route("**/loops/*.webp", lambda route: route.abort())
        button = page.locator(".loop-play").first
        button.click()
        page.wait_for_function("(b) => b.textContent.includes('Play')", arg=button.element_handle())
        assert "/loops/" not in page.locator(".loop-frame img:visible").first.get_attribute("src")


def test_every_loop_is_in_the_book_and_small(html, capsys):
    sizes = {path.name: path.stat().st_size for path in (html / "_static" / "loops").glob("*.webp")}
    assert {name.removesuffix(".webp").removesuffix("-dark") for name in sizes} == set(loop_files.LOOPS)
    with capsys.disabled():
        print("\n" + ", ".join(f"{name} {size / 1e3:.0f} kB" for name, size in sorted(sizes.items())))
    assert max(sizes.values()) <= loop_files.MAX_BYTES
