"""What the live page costs the browser: `python benchmarks/watch_browser.py [--seconds 30]`. About two minutes.

A default training of 32 cars runs with `--watch`; a headless Chromium without a graphics card shows its page, in a
window of 1280 x 900. Processor seconds of all of the browser's processes are told as a share of one core, over
`--seconds` of live cars and over half as many of a hidden page, how many pictures of the cars were drawn meanwhile, and
the bytes that the page took, as they were sent.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import psutil
from playwright.sync_api import Page, sync_playwright

from watch_training import Training

FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync")  # fmt: skip
CHROMIUM = "/usr/bin/chromium"
SETTLE_SECONDS = 5.0
COUNT_PICTURES = """() => {
    const { map } = document.querySelector("rc-cars"), draw = map.draw;
    window.drawn = 0;
    map.draw = (...all) => { window.drawn++; draw.apply(map, all); };
}"""
"""A browser that gets too little of the processor shows fewer pictures, and its share says nothing."""


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--seconds", type=float, default=30.0)
    asked = words.parse_args()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, sync_playwright() as driver:
        training = Training(Path(folder) / "run", 1.5 + 2.5 * asked.seconds / 60)
        while len(training.ends()) < 3:
            time.sleep(0.5)
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        sent = count_bytes(page)
        page.goto(training.page)
        page.wait_for_timeout(1000 * SETTLE_SECONDS)
        print(f"bytes of the page, its styles and modules, as sent: {sent[0]:,}")
        page.evaluate(COUNT_PICTURES)
        live, drawn = share(page, asked.seconds), page.evaluate("window.drawn") / asked.seconds
        print(f"live: {live:.1f} % of a core, {drawn:.1f} pictures a second, {10 * live / drawn:.1f} ms for each")
        page.evaluate("Object.defineProperty(document, 'hidden', { value: true, configurable: true })")
        page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")
        page.wait_for_timeout(1000 * SETTLE_SECONDS)
        print(f"hidden: {share(page, asked.seconds / 2):.1f} % of a core")
        browser.close()


def count_bytes(page: Page) -> list[int]:
    """Return a count of the bytes that documents, styles, modules and fonts take, which goes on by itself."""
    count, wanted = [0], {}
    network = page.context.new_cdp_session(page)
    network.send("Network.enable")

    def begun(event: dict) -> None:
        if (
            event["type"] in ("Document", "Stylesheet", "Script", "Font", "Image")
            and "?" not in event["response"]["url"]
        ):
            wanted[event["requestId"]] = event["response"]["url"]

    def ended(event: dict) -> None:
        if event["requestId"] in wanted:
            count[0] += int(event["encodedDataLength"])

    network.on("Network.responseReceived", begun)
    network.on("Network.loadingFinished", ended)
    return count


def share(page: Page, seconds: float) -> float:
    """Return the browser's processor time while a page is shown, per cent of a core."""
    before, began = spent(), time.monotonic()
    page.wait_for_timeout(1000 * seconds)
    return 100.0 * (spent() - before) / (time.monotonic() - began)


def spent() -> float:
    """Return the processor seconds of all processes of the browser."""
    told = 0.0
    for process in psutil.Process().children(recursive=True):
        if "chrom" in process.name():
            times = process.cpu_times()
            told += times.user + times.system
    return told


if __name__ == "__main__":
    main()
