"""The surfaces of the book turn: whole, all pictures of a figure together, in place, and the page still scrolls."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from unpacking import unpack_array

VERTEX = 20  # bytes that a vertex of a surface may take in its file, faces included
SCENE = 1_500_000  # bytes of all surfaces of a figure: what a reader asks for weighs no more than its page
LIVE = 4
PAGE = "book/08_eigenfunctions.html"
WINDOWS = {"upright": (390, 844), "sideways": (844, 390), "desktop": (1280, 800)}


def picture(page) -> np.ndarray:
    """The pixels of the first scene, (h, w, 3)."""
    page.wait_for_timeout(200)
    return np.asarray(Image.open(io.BytesIO(page.locator(".scene-view").first.screenshot())).convert("RGB")).astype(int)


def changed(one: np.ndarray, other: np.ndarray) -> float:
    """The share of pixels that differ clearly."""
    return float((np.abs(one - other).max(axis=2) > 40).mean())


def open_scene(page, number: int = 0) -> None:
    """Open the figure of this number and wait until its scene has the focus."""
    page.locator(".scene-turn").nth(number).evaluate("(button) => button.click()")
    page.wait_for_function(
        "(n) => document.querySelectorAll('.scene-turn')[n].parentElement.hidden && document.activeElement.classList.contains('scene-view')",
        arg=number,
    )


@pytest.mark.parametrize(("over", "theme", "window"), [("http", "light", "desktop"), ("file", "dark", "upright")])
def test_a_scene_turns_by_keys_and_its_tools(visit, over, theme, window):
    width, height = WINDOWS[window]
    with visit(PAGE, over, theme, viewport={"width": width, "height": height}) as (page, watch):
        open_scene(page)
        before = picture(page)
        assert len(np.unique(before.reshape(-1, 3), axis=0)) > 50, "the canvas is one colour"
        for key in ("ArrowRight", "ArrowRight", "ArrowUp", "+"):
            page.keyboard.press(key)
        assert changed(picture(page), before) > 0.02, "nothing turned"
        page.keyboard.press("Home")
        assert changed(picture(page), before) < 0.005, "it does not turn back"
        page.locator(".scene-bar select").select_option(index=3)
        assert changed(picture(page), before) > 0.02, "one picture looks like all of them"
        page.locator(".scene-bar select").select_option(index=0)
        for label in ("Closer", "Farther", "As at first"):
            now = picture(page)
            page.get_by_label(label, exact=True).click()
            assert changed(picture(page), now) > 0.01, label
            if label == "Farther":
                page.get_by_label(label, exact=True).click()
        page.get_by_label("Back to the still picture").click()
        assert page.locator(".scene-stage").count() == 0
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page became wider"
        assert watch.faults() == []


def test_all_pictures_turn_together_under_their_own_names(visit):
    with visit(PAGE) as (page, _):
        open_scene(page)
        titles = page.locator(".viewer-title").all_inner_texts()
        assert len(titles) > 3 and all(re.fullmatch(r"mode \d+", title) for title in titles)
        before = picture(page)
        page.keyboard.press("ArrowLeft")
        after = picture(page)
        columns = [box["x"] for box in (title.bounding_box() for title in page.locator(".viewer-title").all())]
        cells = page.evaluate("document.querySelector('.scene-view').clientWidth"), sorted(set(map(round, columns)))
        share = len(cells[1])
        for k in range(share):
            part = slice(k * before.shape[1] // share, (k + 1) * before.shape[1] // share)
            assert changed(before[:, part], after[:, part]) > 0.01, f"column {k} stood still"


def test_a_drag_turns_a_wheel_and_a_swipe_scroll_the_page(visit):
    with visit(PAGE, viewport={"width": 390, "height": 844}, has_touch=True) as (page, _):
        open_scene(page)
        box = page.locator(".scene-view").bounding_box()
        middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        before = picture(page)
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 60, middle[1] + 10, steps=3)
        page.mouse.up()
        assert changed(picture(page), before) > 0.02
        start = page.evaluate("scrollY")
        page.mouse.wheel(0, 200)
        page.wait_for_function("(start) => scrollY > start + 100", arg=start)
        assert page.locator(".viewer-canvas").evaluate("(c) => getComputedStyle(c).touchAction") == "pan-y"
        session = page.context.new_cdp_session(page)
        box = page.locator(".scene-view").bounding_box()
        start, x, y = page.evaluate("scrollY"), box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        for step in range(1, 11):
            session.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x, "y": y - 15 * step}]})
        session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        page.wait_for_function("(start) => scrollY > start + 80", arg=start)


def test_ctrl_and_the_wheel_zoom(visit):
    with visit(PAGE) as (page, _):
        open_scene(page)
        before, start = picture(page), page.evaluate("scrollY")
        page.locator(".viewer-canvas").dispatch_event("wheel", {"deltaY": -60, "ctrlKey": True, "cancelable": True})
        assert changed(picture(page), before) > 0.01
        assert page.evaluate("scrollY") == start


@pytest.mark.parametrize("window", WINDOWS)
def test_a_stage_stays_inside_the_window_with_its_close_button(visit, window):
    width, height = WINDOWS[window]
    with visit(PAGE, viewport={"width": width, "height": height}) as (page, _):
        for number in (0, 2):
            open_scene(page, number)
            page.wait_for_timeout(200)
            stage = page.locator(".scene-stage").last.bounding_box()
            close = page.get_by_label("Back to the still picture").last.bounding_box()
            assert stage["height"] <= height and stage["width"] <= width
            assert close["y"] >= 0 and close["y"] + close["height"] <= height
            assert close["x"] >= 0 and close["x"] + close["width"] <= width


def test_a_click_on_the_still_opens_it(visit):
    with visit(PAGE) as (page, _):
        still = page.locator(".scene-frame img:visible").first
        still.scroll_into_view_if_needed()
        still.click()
        page.wait_for_selector(".scene-bar select")
        page.keyboard.press("Escape")
        assert page.locator(".scene-stage").count() == 0


def test_a_fifth_scene_closes_the_oldest(visit):
    with visit(PAGE) as (page, watch):
        for number in range(LIVE + 1):
            open_scene(page, number)
        assert page.locator(".scene-stage").count() == LIVE
        hidden = page.locator(".scene-frame").evaluate_all("(frames) => frames.map((frame) => frame.hidden)")
        assert hidden[: LIVE + 1] == [False] + [True] * LIVE, "the oldest did not go back to its still"
        assert watch.faults() == []


def test_a_scene_that_is_lost_goes_back_to_its_still(visit):
    with visit(PAGE) as (page, watch):
        open_scene(page, 0)
        page.locator(".scene-stage canvas").evaluate("(canvas) => canvas.getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()")
        page.locator(".scene-frame").first.wait_for()
        assert page.locator(".scene-stage").count() == 0
        open_scene(page, 0)
        assert watch.faults() == []


def test_a_browser_without_webgl_keeps_the_still(visit):
    with visit(PAGE) as (page, _):
        page.evaluate("HTMLCanvasElement.prototype.getContext = () => null")
        page.locator(".scene-turn").first.click()
        page.wait_for_function("document.querySelector('.scene-message').textContent.includes('WebGL 2 is missing')")
        assert page.locator(".scene-frame").first.is_visible()


def test_what_our_own_code_takes_to_draw(visit, capsys):
    """Opening decodes and uploads; a turn only sets a few numbers: both without the drawing of the graphics card."""
    with visit(PAGE) as (page, _):
        page.evaluate("spectralNotes.viewer()")
        took = page.evaluate(
            """async (file) => {
              const start = performance.now();
              const scene = await spectralNotes.scene(file);
              const pictures = await spectralNotes.picturesOf(scene);
              return [performance.now() - start, pictures.length];
            }""",
            page.locator(".scenes").first.get_attribute("data-scene"),
        )
        open_scene(page)
        turns = page.evaluate(
            """async () => {
              const times = [];
              const view = document.querySelector(".scene-view");
              for (let k = 0; k < 12; k++) {
                view.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
                await new Promise(requestAnimationFrame);
                await new Promise(requestAnimationFrame);
                times.push(+view.dataset.milliseconds);
              }
              return times;
            }"""
        )
        with capsys.disabled():
            print(f"\nopening {took[1]} pictures: {took[0]:.0f} ms; a turn: {min(turns):.1f} to {max(turns):.1f} ms")
        assert min(turns) < 20


# --- the files and the stills ------------------------------------------------------------------------------------------

LISTED = re.compile(r'data-figure="([\w-]+)" data-scene="(scenes/[\w-]+)"')


def registered(html: Path, name: str) -> tuple[Any, int]:
    """Return what a data file registers, and its size in bytes."""
    text = (html / "_static" / f"{name}.js").read_text(encoding="utf-8")
    start = f'spectralNotes.register("{name}", '
    assert text.startswith(start), name
    return json.loads(text[len(start) :].rstrip().removesuffix(");")), len(text)


def read_scene(html: Path, name: str) -> tuple[list[dict[str, Any]], dict[str, int]]:
    """Return the pictures of a scene with their arrays, and the sizes of its files."""
    scene, size = registered(html, name)
    sizes, pictures = {name: size}, []
    for picture in scene["pictures"]:
        mesh, sizes[picture["mesh"]] = registered(html, picture["mesh"])
        numbers = unpack_array(mesh["arrays"]["vertices"])
        vertices = (np.array(mesh["facts"]["low"])[:, None] + mesh["facts"]["step"] * numbers).T
        arrays = {name: unpack_array(packed) for name, packed in picture["arrays"].items()}
        faces = unpack_array(mesh["arrays"]["faces"]) if "faces" in mesh["arrays"] else None
        more = {"name": picture["name"], "mesh": picture["mesh"], "box": picture["box"], "values": arrays.get("values")}
        pictures.append({**picture["facts"], **more, "vertices": vertices, "faces": faces})
    return pictures, sizes


def test_every_listed_scene_is_whole_and_small(html, capsys):
    """Each surface is packed and each scene in the budget, each index names a vertex, each value is finite."""
    pages = [path.read_text(encoding="utf-8") for path in (html / "book").rglob("*.html")]
    listed = {name for page in pages for _, name in LISTED.findall(page)}
    assert listed
    sizes, weights, count = {}, {}, 0
    for name in sorted(listed):
        scene, files = read_scene(html, name)
        sizes |= files
        weights[name] = sum(files.values())
        count += len(scene)
        for one in scene:
            n = len(one["vertices"])
            assert files[one["mesh"]] <= VERTEX * n + 1000, name
            assert np.isfinite(one["vertices"]).all(), name
            if one["faces"] is not None:
                assert one["faces"].max() < n, name
            if one["values"] is not None:
                assert len(one["values"]) == (len(one["faces"]) if one["onFaces"] else n), name
                assert np.isfinite(one["values"].astype(float)).all(), name
    largest = max(weights, key=weights.get)
    with capsys.disabled():
        total = sum(sizes.values()) / 1e6
        print(f"\n{count} pictures in {len(listed)} scenes, {total:.1f} MB; the largest, {largest}, {weights[largest] / 1e3:.0f} kB")
    assert weights[largest] <= SCENE


ALONE = """async ([file, k]) => {
  const host = document.createElement("div");
  host.style.cssText = "position: fixed; inset: 0; width: 420px; --wanted: 420px";
  document.body.append(host);
  const scene = await spectralNotes.scene(file);
  const pictures = await spectralNotes.picturesOf(scene);
  const stage = new spectralNotes.Stage(host, { ...scene, bar: null }, pictures);
  stage.show(k);
  stage.viewer.paint();
  const url = stage.viewer.canvas.toDataURL();
  stage.free();
  host.remove();
  return url;
}"""


def cut(image: Image.Image) -> tuple[np.ndarray, float]:
    """What is drawn of a picture, 48 pixels wide and high on white, and how wide it was for its height.

    A hair that is finer than a pixel is drawn by one renderer and not by the other: half a percent of the pixels at each
    end may lie outside.
    """
    pixels = np.asarray(image.convert("RGBA")).astype(float)
    flat = pixels[..., :3] * pixels[..., 3:] / 255 + 255 - pixels[..., 3:]
    inked = (flat < 247).any(axis=2)
    (top, left), (bottom, right) = np.quantile(np.argwhere(inked), [0.005, 0.995], axis=0).astype(int)
    part = flat[top : bottom + 1, left : right + 1].astype(np.uint8)
    small = np.asarray(Image.fromarray(part).resize((48, 48), Image.Resampling.BOX)).astype(float)
    return small, part.shape[1] / part.shape[0]


def test_an_outline_is_that_of_the_body_and_not_of_a_hair():
    def drawn(width: int, *hair: int) -> float:
        image = Image.new("RGB", (400, 300), "white")
        image.paste("black", (60, 80, 60 + width, 180))
        for x in hair:
            image.putpixel((x, 20), (0, 0, 0))
        return cut(image)[1]

    assert abs(drawn(200, 350) / drawn(200) - 1) < 0.01
    assert abs(drawn(220) / drawn(200) - 1) > 0.08


def test_an_opened_scene_looks_like_its_still(visit, html, name, capsys):
    """Every picture of every figure of the page: the same outline, and nearly the same colours."""
    text = (html / name).read_text(encoding="utf-8")
    worst = (0.0, "")
    figures = LISTED.findall(text)
    if not figures:
        return
    with visit(name) as (page, _):
        for figure, file in figures:
            found = re.search(rf'id="{figure}".*?<img[^>]*src="([^"]+)"', text, re.DOTALL)
            assert found, figure
            still = Image.open((html / name).parent / found[1])
            for k, picture in enumerate(read_scene(html, file)[0]):
                left, top, width, height = (share * size for share, size in zip(picture["box"], still.size * 2, strict=True))
                wanted, shape = cut(still.crop((int(left), int(top), int(left + width), int(top + height))))
                url = page.evaluate(ALONE, [file, k])
                seen, turned = cut(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))))
                worst = max(worst, (float(np.abs(seen - wanted).mean()) / 255, f"{figure} {k}"))
                assert abs(turned / shape - 1) < 0.08, f"{figure} {k}: {turned:.2f} wide for its height, the still {shape:.2f}"
    with capsys.disabled():
        print(f"\n{name}: at most {100 * worst[0]:.1f} % of a colour from the still, {worst[1]}")
    assert worst[0] < 0.12, worst
