"""A real browser for tests: headless Chromium, told what to do over its DevTools pipe. See `Browser`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--remote-debugging-pipe",
)  # fmt: skip

LAUNCHER = """
import fcntl, os, sys
to_read, to_write = (fcntl.fcntl(int(one), fcntl.F_DUPFD, 10) for one in sys.argv[1:3])
os.dup2(to_read, 3), os.dup2(to_write, 4)
os.execv(sys.argv[3], sys.argv[3:])
"""

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None or os.name != "posix",
    reason="no Chromium here: `apt-get install chromium` (or your system's package) brings one",
)


class Browser:
    """One page. Commands are JSON texts that end in a zero byte, on descriptors 3 (to) and 4 (from the browser)."""

    def __init__(self, folder: Path, width: int = 1200, height: int = 900) -> None:
        to_read, self._to = os.pipe()
        back, to_write = os.pipe()
        start = [sys.executable, "-c", LAUNCHER, str(to_read), str(to_write)]
        command = [*start, CHROMIUM, *FLAGS, f"--window-size={width},{height}", f"--user-data-dir={folder}"]
        self._process = subprocess.Popen(
            command, pass_fds=(to_read, to_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(to_read)
        os.close(to_write)
        self._from = open(back, "rb", buffering=0)  # noqa: SIM115
        self._rest, self._number, self._session = b"", 0, ""
        page = next(one for one in self.say("Target.getTargets")["targetInfos"] if one["type"] == "page")
        attached = self.say("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self._session = attached["sessionId"]
        self.complaints = []
        self.say("Runtime.enable")
        self.say("Page.enable")

    def close(self) -> None:
        """End the browser."""
        self._process.kill()
        self._process.wait()
        os.close(self._to)
        self._from.close()

    def say(self, method: str, **parameters: object) -> dict:
        """Send a command; return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("method") in ("Runtime.exceptionThrown",):
                self.complaints.append(answer["params"])
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def open(self, address: str) -> None:
        """Go to a page; wait until it is loaded."""
        self.say("Page.navigate", url=address)
        self.until(f"document.readyState === 'complete' && location.href === {json.dumps(address)}")

    def value(self, script: str) -> object:
        """Return what a script says."""
        said = self.say("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in said, said
        return said["result"].get("value")

    def until(self, script: str, seconds: float = 10.0) -> None:
        """Wait until a script says yes."""
        end = time.monotonic() + seconds
        while not self.value(script):
            assert time.monotonic() < end, f"{script}: still not so after {seconds} s"
            time.sleep(0.02)

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        text = {"text": key} if len(key) == 1 else {}
        self.say("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.say("Input.dispatchKeyEvent", type="keyUp", key=key)

    def click(self, name: str) -> None:
        """Click the middle of an element, named by its id."""
        x, y = self.value(
            f"(r => [r.x + r.width / 2, r.y + r.height / 2])(document.getElementById('{name}').getBoundingClientRect())"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.say("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def _next(self) -> dict:
        while b"\0" not in self._rest:
            chunk = self._from.read(1 << 16)
            assert chunk, "the browser is gone"
            self._rest += chunk
        text, self._rest = self._rest.split(b"\0", 1)
        return json.loads(text)
