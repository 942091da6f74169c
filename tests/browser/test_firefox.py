"""The controls of a page in Firefox, driven over WebDriver BiDi, which needs nothing beside the browser itself."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterator

import pytest

websocket = pytest.importorskip("websocket")
COMMAND = shutil.which("firefox-esr") or shutil.which("firefox")
PORT = 9387


class Firefox:
    """One tab of a running Firefox."""

    def __init__(self, socket) -> None:
        self.socket, self.number = socket, 0
        self.call("session.new", capabilities={})
        self.tab = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def call(self, method: str, **params):
        """Send a command and return its result."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while (answer := json.loads(self.socket.recv())).get("id") != self.number:
            pass
        assert answer["type"] == "success", answer
        return answer["result"]

    def open(self, url: str, width: int) -> None:
        """Open a page in a window of this width."""
        self.call("browsingContext.setViewport", context=self.tab, viewport={"width": width, "height": 844})
        self.call("browsingContext.navigate", context=self.tab, url=url, wait="complete")

    def js(self, expression: str):
        """Return the value of an expression."""
        found = self.call("script.evaluate", expression=expression, target={"context": self.tab}, awaitPromise=True)
        assert found["type"] == "success", found
        return found["result"].get("value")

    def until(self, expression: str) -> None:
        """Wait for an expression to become true."""
        for _ in range(240):
            if self.js(f"Boolean({expression})"):
                return
            time.sleep(0.25)
        pytest.fail(f"never true in Firefox: {expression}")


@pytest.fixture(scope="module")
def firefox(tmp_path_factory) -> Iterator[Firefox]:
    """Return a running Firefox."""
    if COMMAND is None:
        pytest.skip("Firefox is not installed")
    home = tmp_path_factory.mktemp("firefox")
    call = [COMMAND, "--headless", "--no-remote", "--profile", str(home), "--remote-debugging-port", str(PORT)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(call, env=os.environ | {"HOME": str(home)}, **quiet)
    try:
        for _ in range(120):
            try:
                socket = websocket.create_connection(f"ws://127.0.0.1:{PORT}/session", timeout=120, suppress_origin=True)
                break
            except OSError:
                time.sleep(0.5)
        else:
            pytest.skip("Firefox does not open its port")
        yield Firefox(socket)
        socket.close()
    finally:
        process.terminate()
        process.wait(timeout=60)


@pytest.mark.parametrize("width", [390, 1280])
def test_the_contents_open_and_fold(firefox, http, width):
    firefox.open(f"{http}/book/index.html", width)
    links = "[...document.querySelectorAll('.bd-sidebar-primary a, #pst-primary-sidebar-modal a')]"
    open_to_view = "a.checkVisibility() && a.offsetWidth && a.getBoundingClientRect().right > 0"
    seen = f"{links}.some((a) => a.textContent.includes('Differentiation') && {open_to_view})"
    before = firefox.js(seen)
    assert before == (width > 1000)
    button = "[...document.querySelectorAll('.primary-toggle')].find((one) => one.offsetWidth)"
    firefox.js(f"{button}.click()")
    firefox.until(f"({seen}) !== {str(before).lower()}")


def test_a_loop_plays_and_gives_the_still_back(firefox, http):
    firefox.open(f"{http}/book/09_heat_waves_descriptors.html", 1280)
    image = "document.querySelector('.loop-frame img')"
    firefox.js("document.querySelector('.loop-play').scrollIntoView(); document.querySelector('.loop-play').click()")
    firefox.until(f"{image}.src.includes('/loops/') && {image}.complete && {image}.naturalWidth")
    firefox.js("document.querySelector('.loop-play').click()")
    firefox.until(f"!{image}.src.includes('/loops/') && {image}.complete")


def test_the_theme_turns(firefox, http):
    firefox.open(f"{http}/book/index.html", 1280)
    theme = "document.documentElement.dataset.theme"
    seen = {firefox.js(theme)}
    for _ in range(3):
        firefox.js("[...document.querySelectorAll('.theme-switch-button')].find((one) => one.offsetWidth).click()")
        seen.add(firefox.js(theme))
    assert seen == {"light", "dark"}


def test_a_lab_starts_or_says_why_not(firefox, http):
    firefox.open(f"{http}/book/labs.html", 1280)
    for name in ("ends", "bump-dent"):
        firefox.js(f"document.querySelector('spectral-lab[name={name}] .lab-start').click()")
    firefox.until("document.querySelector('spectral-lab[name=ends] .lab-numbers dd')")
    lab = "document.querySelector('spectral-lab[name=bump-dent]')"
    firefox.until(f"{lab}.querySelector('.lab-numbers dd') || {lab}.textContent.includes('WebGL 2 is missing')")
