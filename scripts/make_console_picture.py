"""Draw a picture of the console: `python scripts/make_console_picture.py WORKSPACE docs/pictures/console.png [PATH]`.

The workspace is a real one, with at least one trained model; the page is its garage in Chromium, 1280 pixels wide.
"""

from __future__ import annotations

import subprocess
import sys
import time
import urllib.request
from pathlib import Path

from playwright.sync_api import sync_playwright

CHROMIUM = "/usr/bin/chromium"
OPTIONS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-background-networking", "--disable-sync")
PORT = 8977
WAITED_SECONDS = 60


def main() -> int:
    """Serve the workspace, look at it, and end the server."""
    if len(sys.argv) not in (3, 4):
        print(__doc__)
        return 2
    workspace, picture = map(Path, sys.argv[1:3])
    path = sys.argv[3] if len(sys.argv) == 4 else "/"
    command = [sys.executable, "-m", "racecraft", "console", str(workspace), "--port", str(PORT), "--no-open"]
    with subprocess.Popen(command) as server:
        try:
            _wait_for(f"http://127.0.0.1:{PORT}/")
            _draw(f"http://127.0.0.1:{PORT}{path}", picture)
        finally:
            server.terminate()
    return 0


def _wait_for(address: str) -> None:
    end = time.monotonic() + WAITED_SECONDS
    while True:
        try:
            with urllib.request.urlopen(address):
                return
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)


def _draw(address: str, picture: Path) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(OPTIONS))
        page = browser.new_page(viewport={"width": 1280, "height": 760})
        page.goto(address)
        page.wait_for_timeout(1500)
        page.screenshot(path=picture)
        browser.close()


if __name__ == "__main__":
    sys.exit(main())
