"""The surfaces of the book turn: in place, from a folder too, with few contexts, in files that are small and whole."""

from __future__ import annotations

import base64
import io
import json
import re

import numpy as np
import pytest
from PIL import Image

SCENE = 250_000  # bytes
LIVE = 4
PAGE = "book/08_eigenfunctions.html"


def picture(page) -> np.ndarray:
    """The pixels of the first scene, (h, w, 3)."""
    page.wait_for_timeout(500)
    return np.asarray(Image.open(io.BytesIO(page.locator(".scene-view").first.screenshot())).convert("RGB")).astype(int)


def open_scene(page, number: int = 0) -> None:
    """Open the figure of this number and wait until its scene has the focus."""
    page.locator(".scene-turn").nth(number).evaluate("(button) => button.click()")
    page.wait_for_function("document.activeElement.classList.contains('scene-view')")
    page.evaluate("document.activeElement.blur()")


@pytest.mark.parametrize(("over", "theme", "width"), [("http", "light", 1280), ("file", "dark", 390)])
def test_a_scene_turns(visit, over, theme, width):
    with visit(PAGE, over, theme, viewport={"width": width, "height": 844}) as (page, watch):
        open_scene(page)
        before = picture(page)
        assert len(np.unique(before.reshape(-1, 3), axis=0)) > 50, "the canvas is one colour"
        for key in ("ArrowRight", "ArrowRight", "ArrowUp", "+"):
            page.locator(".scene-view").press(key)
        turned = picture(page)
        assert (np.abs(turned - before).max(axis=2) > 40).mean() > 0.02, "nothing turned"
        page.locator(".scene-view").press("Home")
        assert (np.abs(picture(page) - before).max(axis=2) > 40).mean() < 0.005, "it does not turn back"
        page.locator(".scene-bar select").select_option(index=5)
        assert (np.abs(picture(page) - before).max(axis=2) > 40).mean() > 0.02, "another picture looks the same"
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page became wider"
        assert watch.faults() == []


def test_a_click_on_a_picture_opens_that_one(visit):
    with visit(PAGE) as (page, _):
        still = page.locator(".scene-frame img").first
        still.scroll_into_view_if_needed()
        box = still.bounding_box()
        still.click(position={"x": 0.64 * box["width"], "y": 0.6 * box["height"]})
        page.wait_for_selector(".scene-bar select")
        assert page.locator(".scene-bar select").evaluate("(choice) => choice.selectedOptions[0].text") == "mode 10"


def test_a_fifth_scene_closes_the_oldest(visit):
    with visit(PAGE) as (page, watch):
        warnings = []
        page.on("console", lambda message: warnings.append(message.text) if "context" in message.text.lower() else None)
        for number in range(LIVE + 1):
            open_scene(page, number)
        assert page.locator(".scene-stage").count() == LIVE
        hidden = page.locator(".scene-frame").evaluate_all("(frames) => frames.map((frame) => frame.hidden)")
        assert hidden[: LIVE + 1] == [False] + [True] * LIVE, "the oldest did not go back to its still"
        assert warnings == []
        assert watch.faults() == []


def test_a_browser_without_webgl_keeps_the_still(visit):
    with visit(PAGE) as (page, _):
        page.evaluate("HTMLCanvasElement.prototype.getContext = () => null")
        page.locator(".scene-turn").first.click()
        page.wait_for_function("document.querySelector('.scene-message').textContent.includes('WebGL is missing')")
        assert page.locator(".scene-frame").first.is_visible()


def unpacked(array: dict[str, str]) -> np.ndarray:
    """An array as Plotly.js unpacks it."""
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=f"<{array['dtype']}")


def test_every_listed_scene_is_a_small_whole_file(html, capsys):
    """Each file is in the budget, each index names a vertex, each value is finite."""
    pages = [path.read_text(encoding="utf-8") for path in (html / "book").rglob("*.html")]
    listed = {name for page in pages for name in re.findall(r"&quot;file&quot;: &quot;(scenes/[\w-]+)&quot;", page)}
    assert listed
    sizes = {}
    for name in sorted(listed):
        text = (html / "_static" / f"{name}.js").read_text(encoding="utf-8")
        sizes[name] = len(text)
        start = f'spectralNotes.register("{name}", '
        assert text.startswith(start), name
        scene = json.loads(text[len(start) :].rstrip().removesuffix(");"))
        for trace in scene["data"]:
            if trace["type"] == "mesh3d":
                n, faces = len(unpacked(trace["x"])), [unpacked(trace[corner]) for corner in "ijk"]
                assert max(corner.max() for corner in faces) < n, name
                values = unpacked(trace.get("intensity", trace["x"]))
                assert len(values) in (n, len(faces[0])), name
                assert np.isfinite(values).all(), name
    largest = max(sizes, key=sizes.get)
    with capsys.disabled():
        total = sum(sizes.values()) / 1e6
        print(f"\n{len(sizes)} scenes, {total:.1f} MB; the largest, {largest}, {sizes[largest] / 1e3:.0f} kB")
    assert sizes[largest] <= SCENE
