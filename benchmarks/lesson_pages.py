"""First paint of every page of the course: `python benchmarks/lesson_pages.py [--rounds 3]`. About a minute.

A fresh `racecraft lessons` and a fresh headless Chromium, 390 px wide, without a graphics card. The first page of each
round is the slowest: neither side holds anything yet; which lesson comes first changes from round to round. Printed are
milliseconds from the click to the first paint of content (Chromium's own clock), median and slowest by page.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from statistics import median
from typing import Any

from playwright.sync_api import sync_playwright

from racecraft.lessons.course import course
from watch_browser import CHROMIUM, FLAGS

PAINT = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null"


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--rounds", type=int, default=3)
    lessons, first = [lesson.id for lesson in course().lessons], []
    painted: dict[str, list[float]] = defaultdict(list)
    for number in range(words.parse_args().rounds):
        turned = lessons[number:] + lessons[:number]
        for at, (lesson, milliseconds) in enumerate(zip(turned, one_round(turned), strict=True)):
            (painted[lesson] if at else first).append(milliseconds)
    for lesson, found in painted.items():
        print(f"{lesson}: {median(found):.0f} ms, slowest {max(found):.0f} ms")
    print(f"first page of a fresh server: {median(first):.0f} ms, slowest {max(first):.0f} ms")


def one_round(lessons: list[str]) -> list[float]:
    """Return the first paint of each lesson's page, ms, with a server and a browser of their own."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        server = subprocess.Popen(
            [sys.executable, "-m", "racecraft", "lessons", "--port", "0", "--no-open", "--json"],
            cwd=folder, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert server.stdout is not None
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        try:
            address, page = (
                json.loads(server.stdout.readline())["address"],
                browser.new_page(viewport={"width": 390, "height": 844}),
            )
            return [first_paint(page, f"{address}/{lesson}") for lesson in lessons]
        finally:
            browser.close()
            server.terminate()
            server.wait()


def first_paint(page: Any, address: str) -> float:
    page.goto(address)
    while (painted := page.evaluate(PAINT)) is None:
        page.wait_for_timeout(20)
    return float(painted)


if __name__ == "__main__":
    main()
