"""A real Chromium for tests of pages. Without one they are skipped, or fail where FULLWELL_REQUIRE_ALL=1 asks for all."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from servers import missing

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

__all__ = ["Watch", "chromium", "opened"]

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    # WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]


@dataclass
class Watch:
    """What a page did that it should not: messages on its console, uncaught errors, requests to other hosts."""

    errors: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """Run a browser until the block ends."""
    program = os.environ.get("FULLWELL_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        missing("no Chromium is installed; `bash .ci/install-chromium` installs one")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed; install fullwell[dev]")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=ARGUMENTS)
        try:
            yield browser
        finally:
            browser.close()


@contextlib.contextmanager
def opened(browser: Browser, url: str, *, size: tuple[int, int] = (1360, 860), **context: Any) -> Iterator[tuple[Page, Watch]]:
    """Open an address in a browser that remembers nothing; give the page and what it did wrong so far."""
    width, height = size
    session = browser.new_context(viewport={"width": width, "height": height}, locale="en-GB", **context)
    page = session.new_page()
    page.set_default_timeout(30_000)
    watch = Watch()
    origin = url.split("/assets", maxsplit=1)[0]
    allowed = (origin, origin.replace("http", "ws", 1), "data:", "blob:")
    page.on("console", lambda message: watch.errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: watch.errors.append(str(error)))
    page.on("request", lambda request: None if request.url.startswith(allowed) else watch.foreign.append(request.url))
    try:
        page.goto(url)
        yield page, watch
    finally:
        session.close()
