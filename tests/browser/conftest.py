"""A browser over the built book: Debian's or any other Chromium, the book served over http and opened as files.

Tests here are skipped where there is no browser or no built book; `make browser` builds the book first, and sets
SPECTRAL_NOTES_BROWSER=required, with which a missing browser or book is a failure.
"""

from __future__ import annotations

import functools
import os
import re
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Request, Response, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
HTML = Path(os.environ.get("SPECTRAL_NOTES_HTML", ROOT / "_build" / "html"))
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-sync",
    "--disable-component-update", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
]
PATIENCE = 120_000  # milliseconds; drawing without a graphics card on a busy machine is slow


def missing(what: str) -> None:
    """Skip, or fail where a browser is required."""
    if os.environ.get("SPECTRAL_NOTES_BROWSER") == "required":
        pytest.fail(what)
    pytest.skip(what)


def pages_of(html: Path) -> list[str]:
    """Return the pages of the book, relative to its folder; the index beside it only leads to book/index.html."""
    found = sorted(path.relative_to(html).as_posix() for path in html.glob("book/**/*.html"))
    return [*found, "genindex.html", "search.html"]


@dataclass
class Watch:
    """What a page did that it should not have done."""

    own: str
    errors: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)
    sizes: dict[str, int] = field(default_factory=dict)  # address -> bytes

    def follow(self, page: Page) -> None:
        """Listen to a page from now on."""
        page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("requestfailed", self._fail)
        page.on("request", lambda request: self._ask(request.url))
        page.on("response", self._weigh)

    def _fail(self, request: Request) -> None:
        """Note a request that failed; one that the browser gave up, as it does when a page goes on, is no fault."""
        if request.failure != "net::ERR_ABORTED":
            self.errors.append(f"{request.url[:120]}: {request.failure}")

    def _ask(self, url: str) -> None:
        """Note a request that leaves the book."""
        if not url.startswith((self.own, "data:", "blob:", "about:")):
            self.foreign.append(url)

    def _weigh(self, response: Response) -> None:
        """Note how large a file is."""
        self.sizes[response.url] = int(response.headers.get("content-length", 0))

    def faults(self) -> list[str]:
        """Return what went wrong."""
        return [f"console: {text}" for text in self.errors] + [f"asks {url}" for url in self.foreign]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Return a running Chromium."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        missing(f"there is no browser: none of {', '.join(BROWSERS)} is installed")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        yield running
        running.close()


@pytest.fixture(scope="session")
def html() -> Path:
    """Return the folder of the built book."""
    if not (HTML / "index.html").exists():
        missing(f"there is no built book at {HTML.name}: run make book")
    return HTML


class Silent(SimpleHTTPRequestHandler):
    """A file server that does not write to the terminal."""

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="session")
def http(html: Path) -> Iterator[str]:
    """Return the address of a server that gives the book out, without the final slash."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Silent, directory=str(html)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="session")
def visit(browser: Browser, http: str, html: Path):
    """Return a function that opens a page of the book in a fresh context: `with visit("book/x.html") as (page, watch)`.

    `over` is "http" or "file"; `theme` is "light" or "dark"; further keywords go to the context (viewport, ...).
    """

    @contextmanager
    def opened(name: str, over: str = "http", theme: str = "light", **options) -> Iterator[tuple[Page, Watch]]:
        own = {"http": http, "file": html.as_uri()}[over]
        context = browser.new_context(color_scheme=theme, **options)
        try:
            context.set_default_timeout(PATIENCE)
            page, watch = context.new_page(), Watch(own)
            watch.follow(page)
            page.goto(f"{own}/{name}", wait_until="load")
            yield page, watch
        finally:
            context.close()

    return opened


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give every page of the book to a test that takes `name`."""
    if "name" in metafunc.fixturenames:
        names = pages_of(HTML) if HTML.exists() else ["book/index.html"]
        metafunc.parametrize("name", names, ids=[re.sub(r"\.html$", "", name) for name in names])
