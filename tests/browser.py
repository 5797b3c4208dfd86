"""A real browser for tests: the system's Chromium, headless, driven by Playwright. Begin with `Browser`.

axe (tests/vendor) looks for what shuts people out: `Browser.shut_out`.
"""

from __future__ import annotations

import asyncio
import atexit
import re
import shutil
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip
SETTLED = """() => Promise.all(document.getAnimations()
  .filter(one => one.effect.getComputedTiming().endTime < 5000).map(one => one.finished.catch(() => null)))"""
"""Waits until colours stand that change when a page turns dark."""
BROKEN = """() => [...document.images]
  .filter(one => one.checkVisibility() && one.complete && !one.naturalWidth).map(one => one.outerHTML)"""
AXE = Path(__file__).parent / "vendor" / "axe.min.js"
AXE_RUN = """() => axe.run({ resultTypes: ["violations"] })
  .then(told => told.violations.map(one => [one.id, one.nodes[0].html]))"""
"""What passes is not described: that takes as long as to look."""

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here: `apt-get install chromium` (or your system's package) brings one"
)


@cache
def _driver() -> Any:
    """Return Playwright, started once: it bears no second one beside it."""
    from playwright.sync_api import sync_playwright

    driver = sync_playwright().start()
    atexit.register(driver.stop)
    atexit.register(asyncio._set_running_loop, driver._loop)  # before it stops
    return driver


@cache
def _launched() -> Any:
    """Return Chromium, which takes a second to start: each browser of a test is a context in it that shares nothing."""
    return _driver().chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))


@cache
def _idle(touch: bool) -> list[Any]:
    """Return the contexts nobody uses; each keeps one empty page, since to open a first window takes half a second."""
    return []


def _borrowed(touch: bool) -> Any:
    """Return a context as empty as a new one, but for its first page."""
    asyncio._set_running_loop(_driver()._loop)
    if not _launched().is_connected():
        _launched.cache_clear()
        _idle.cache_clear()
    if idle := _idle(touch):
        return idle.pop()
    made = _launched().new_context(has_touch=touch, is_mobile=touch)
    made.new_page()
    return made


def _returned(context: Any, touch: bool) -> None:
    """Close the pages of a test and empty their context: cookies, what they stored, what was cached."""
    first, *more = context.pages
    for page in more:
        page.close()
    session = context.new_cdp_session(first)
    session.send("Storage.clearDataForOrigin", {"origin": "*", "storageTypes": "all"})
    session.send("Network.clearBrowserCache")
    session.detach()
    context.clear_cookies()
    _idle(touch).append(context)


_OPEN: set[Browser] = set()


def shown() -> list[tuple[str, str]]:
    """Return of each open browser where its page is, and the text in sight, for the report of a test that failed."""
    found = []
    for one in _OPEN:
        with suppress(Exception):  # a page that is gone must not hide why the test failed
            found.append((f"the page at {one.page.url}", one.page.inner_text("body", timeout=2000)[:4000]))
    return found


class Browser:
    """One page of a browser of its own; `complaints` are the page's uncaught errors and what it printed as one.

    Args:
        width: Of the window, CSS pixels.
        height: Likewise.
        dark: Whether the system is said to be dark.
        touch: Whether it is a phone.
    """

    def __init__(self, width: int = 1200, height: int = 900, dark: bool = False, touch: bool = False) -> None:
        _OPEN.add(self)
        self._touch, self._context = touch, _borrowed(touch)
        self.page = self._context.new_page()
        self.show(width, height, dark)
        self.complaints: list[str] = []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)

    def bypass_policy(self) -> None:
        """Let scripts of a test do what the pages' Content-Security-Policy forbids; for pages opened from now on."""
        self.page.context.new_cdp_session(self.page).send("Page.setBypassCSP", {"enabled": True})

    def close(self) -> None:
        """End the browser; where it was the last one open, let other event loops run in this thread."""
        _returned(self._context, self._touch)
        _OPEN.discard(self)
        if not _OPEN:
            asyncio._set_running_loop(None)

    def open(self, address: str) -> None:
        """Go to a page; wait until it is loaded."""
        self.page.goto(address)

    def show(self, width: int, height: int = 900, dark: bool = False) -> None:
        """Change the window, and whether the system is dark."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.emulate_media(color_scheme="dark" if dark else "light")

    def value(self, script: str) -> object:
        """Return what a script says."""
        return self.page.evaluate(script)

    def until(self, script: str, seconds: float = 60.0) -> None:
        """Wait until a script says yes."""
        end = time.monotonic() + seconds
        while not self.value(script):
            assert time.monotonic() < end, f"{script}: still not so after {seconds} s"
            self.page.wait_for_timeout(20)

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        self.page.keyboard.press("Space" if key == " " else key)

    def click(self, which: str) -> None:
        """Click the middle of an element, named by its id or by a CSS selector."""
        self.page.click(f"#{which}" if re.fullmatch(r"[\w-]+", which) else which)

    def shut_out(self) -> list[tuple[str, str]]:
        """Return what axe finds on the page, once its transitions are over, and pictures in sight that show nothing.

        Each is the rule, and the first element or the picture.
        """
        self.page.evaluate(AXE.read_text(encoding="utf-8"))
        self.page.evaluate(SETTLED)
        found = self.page.evaluate(AXE_RUN)
        return [(rule, element) for rule, element in found] + self.broken_pictures()

    def broken_pictures(self) -> list[tuple[str, str]]:
        """Return the pictures in sight that failed or were given no address; none may be shown before its frame is."""
        return [("broken picture", picture) for picture in self.page.evaluate(BROKEN)]

    def sideways(self) -> int:
        """Return by how many CSS pixels the page is wider than its window."""
        return int(self.page.evaluate("document.documentElement.scrollWidth - innerWidth"))
