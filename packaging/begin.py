"""Start racecraft without a terminal: make its environment in this folder, show that in the browser, open the console.

It needs nothing but the interpreter and the uv that lie beside it, and writes nowhere else:

    racecraft/                      one folder; to remove racecraft, delete it
        Start racecraft.…           what is double-clicked: it runs this file
        workspace/                  the models
        parts/begin.py              this file
        parts/python, parts/uv      an interpreter and uv, carried along
        parts/wheels/               packages, where they are carried along; otherwise uv fetches them
        parts/environment/          made at the first start
        parts/data/                 caches, jobs and own tracks

A second start finds `parts/ready.json`, fetches nothing and asks nobody. Begin with `main`.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request
import webbrowser
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

PARTS = Path(__file__).resolve().parent
WINDOWS = sys.platform == "win32"
LINES_KEPT = 12
LOOPBACK = ("127.0.0.1", "localhost")


class StepError(Exception):
    """A step failed; the message says what to do."""


@dataclass
class Step:
    """One thing that is done."""

    key: str
    text: str
    expected_s: float
    """How long it takes on a small laptop, for people who wait."""
    state: str = "waits"
    """waits, runs, done or failed."""
    began: float = 0.0
    seconds: float = 0.0
    note: str = ""


@dataclass
class Progress:
    """What the page shows."""

    steps: list[Step]
    address: str = ""
    """Of the console, once it answers."""
    message: str = ""
    log: list[str] = field(default_factory=list)
    retry: threading.Event = field(default_factory=threading.Event)

    def as_dictionary(self) -> dict[str, Any]:
        """Return plain values."""
        now = time.monotonic()
        steps = [
            {**asdict(step), "seconds": round(now - step.began if step.state == "runs" else step.seconds, 1)}
            for step in self.steps
        ]
        return {"steps": steps, "address": self.address, "message": self.message, "log": self.log[-LINES_KEPT:]}

    @contextlib.contextmanager
    def doing(self, key: str) -> Iterator[Step]:
        """Yield a step that runs; it is done at the end, or failed."""
        step = next(step for step in self.steps if step.key == key)
        step.state, step.began = "runs", time.monotonic()
        try:
            yield step
        except BaseException:
            step.state, step.seconds = "failed", time.monotonic() - step.began
            raise
        step.state, step.seconds, step.note = "done", time.monotonic() - step.began, ""


@dataclass(frozen=True)
class Place:
    """The folder and what lies in it."""

    parts: Path

    @property
    def workspace(self) -> Path:
        """The models."""
        return self.parts.parent / "workspace"

    @property
    def ready(self) -> Path:
        """The file that says that the environment is whole."""
        return self.parts / "ready.json"

    @property
    def python(self) -> Path:
        """The environment's interpreter."""
        return self.parts / "environment" / ("Scripts/python.exe" if WINDOWS else "bin/python")

    @property
    def uv(self) -> str:
        """The uv that lies beside, or one that is installed."""
        own = self.parts / ("uv.exe" if WINDOWS else "uv")
        return str(own) if own.is_file() else shutil.which("uv") or str(own)

    def variables(self) -> dict[str, str]:
        """Return the environment of every child: what it keeps stays in this folder."""
        data = self.parts / "data"
        own = {
            "UV_CACHE_DIR": str(data / "uv"),
            "UV_PYTHON_DOWNLOADS": "never",
            "XDG_DATA_HOME": str(data),
            "XDG_CACHE_HOME": str(data / "cache"),
            "XDG_CONFIG_HOME": str(data / "config"),
            "MPLCONFIGDIR": str(data / "matplotlib"),
            "PYTHONUTF8": "1",
        }
        if WINDOWS:
            own["LOCALAPPDATA"] = str(data)
        if sys.platform == "darwin":
            own["HOME"] = str(data)
        dropped = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "CONDA_PREFIX")
        return {name: value for name, value in os.environ.items() if name not in dropped} | own


def main(words: list[str], parts: Path = PARTS) -> int:
    """Show the page, make what is missing, open the console, and wait until it ends."""
    end_with_the_window()
    place = Place(parts)
    if address := running(place):
        open_browser(address, words)
        return 0
    progress = Progress(
        [
            Step("environment", "Make a place for racecraft in this folder", 5),
            Step("packages", "Fetch and install its packages" if fetches(place) else "Install its packages", 180),
            Step("simulator", "Compile the simulator", 60),
            Step("console", "Open the console", 8),
        ]
    )
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler(place, progress))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = f"http://127.0.0.1:{server.server_address[1]}/"
    print(f"racecraft starts; {page} shows how far it is. Close this window to end it.", flush=True)
    open_browser(page, words)
    try:
        return start(place, progress, page, retries="--no-retry" not in words)
    except KeyboardInterrupt:
        return 0
    finally:
        server.shutdown()
        server.server_close()


def end_with_the_window() -> None:
    """Take the end of the window as Ctrl-C, so that the console ends as well; only a main thread can."""
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), signal.default_int_handler)


def start(place: Place, progress: Progress, page: str, retries: bool) -> int:
    """Prepare and open the console; where a step fails, try again when the page asks for it."""
    while True:
        try:
            prepare(place, progress)
            return open_console(place, progress, page)
        except (StepError, OSError) as error:
            progress.message = str(error)
            print(error, flush=True)
            if not retries:
                return 1
            progress.retry.wait()
            progress.retry.clear()
            progress.message = ""


def prepare(place: Place, progress: Progress) -> None:
    """Make the environment; whatever is there already is kept.

    Raises:
        StepError: Packages cannot be fetched or installed.
    """
    if place.ready.is_file() and place.python.exists():
        for step in progress.steps[:3]:
            step.state = "done"
        return
    with progress.doing("environment"):
        run(
            place,
            progress,
            [place.uv, "venv", "--allow-existing", "--python", sys.executable, str(place.python.parents[1])],
        )
    with progress.doing("packages") as step:
        run(
            place,
            progress,
            [place.uv, "pip", "install", "--python", str(place.python), *packages(place)],
            lambda line: note_package(step, line),
        )
    with progress.doing("simulator"):
        warm_up = "from racecraft.worlds.deepracer.training.warm_up import warm_up; warm_up()"
        run(place, progress, [str(place.python), "-c", warm_up])
    shutil.rmtree(place.parts / "data" / "uv", ignore_errors=True)  # installed packages need no second copy
    place.ready.write_text(json.dumps({"python": sys.version.split()[0]}) + "\n", encoding="utf-8")


def packages(place: Place) -> list[str]:
    """Return what uv installs: the carried racecraft, and its packages by the versions it was tested with."""
    own = sorted(place.parts.glob("racecraft-*.whl"))
    if not own:
        raise StepError(
            f"{place.parts} lacks racecraft-….whl; expected the whole folder of the download. Unpack it again."
        )
    words = [str(own[-1])]
    if (constraints := place.parts / "constraints.txt").is_file():
        words += ["--constraints", str(constraints)]
    if not fetches(place):
        return [*words, "--no-index", "--find-links", str(place.parts / "wheels")]
    if sys.platform != "darwin":
        words += ["--torch-backend", "auto" if has_gpu() else "cpu"]
    return words


def fetches(place: Place) -> bool:
    """Tell whether packages come from the network."""
    return not (place.parts / "wheels").is_dir()


def has_gpu() -> bool:
    """Tell whether a graphics card of NVIDIA answers."""
    try:
        return subprocess.run(["nvidia-smi", "-L"], capture_output=True, timeout=10).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def note_package(step: Step, line: str) -> None:
    """Say on the page which package is under way."""
    if match := re.match(r"\s*(Downloading|Downloaded|Building|Prepared|Installed|Resolved) (.{1,60})", line):
        step.note = f"{match[1]} {match[2]}".strip()


def run(place: Place, progress: Progress, words: list[str], hear: Callable[[str], None] = lambda line: None) -> None:
    """Run a program, its lines kept for the page.

    Raises:
        StepError: It failed.
    """
    try:
        child = subprocess.Popen(
            words, env=place.variables(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            encoding="utf-8", errors="replace", stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except OSError as error:
        raise StepError(f"{words[0]} cannot be started ({error.strerror}). Unpack the download again.") from error
    with child:
        assert child.stdout is not None
        for line in child.stdout:
            if text := line.rstrip():
                progress.log.append(text)
                hear(text)
    if child.returncode != 0:
        last = " ".join(progress.log[-3:])[-300:]
        raise StepError(f"{Path(words[0]).name} ended with code {child.returncode}: {last}")


def open_console(place: Place, progress: Progress, page: str) -> int:
    """Start the console, tell its address, and wait until it ends; return its exit code.

    Raises:
        StepError: It ended before it answered.
    """
    words = [str(place.python), "-m", "racecraft", "console", str(place.workspace), "--no-open", "--json"]
    with progress.doing("console"):
        console = subprocess.Popen(
            words,
            env=place.variables() | {"RACECRAFT_STARTER": page},
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        assert console.stdout is not None
        line = console.stdout.readline()
        if not line.startswith("{"):
            console.stdout.close()
            raise StepError(f"The console ended with code {console.wait()} before it answered.")
        progress.address = json.loads(line)["address"]
    note = place.parts / "running.json"
    note.write_text(json.dumps({"address": progress.address}) + "\n", encoding="utf-8")
    print(f"The console is at {progress.address}", flush=True)
    try:
        with console:
            return console.wait()
    except KeyboardInterrupt:
        console.terminate()
        return console.wait()
    finally:
        note.unlink(missing_ok=True)


def running(place: Place) -> str:
    """Return the address of a console that an earlier start opened and that answers; "": none does."""
    try:
        address = str(json.loads((place.parts / "running.json").read_text(encoding="utf-8"))["address"])
        with urllib.request.urlopen(address, timeout=3) as answer:
            return address if answer.status == 200 else ""
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def newer_version(place: Place) -> str:
    """Ask the package index, by uv, whether there is a newer racecraft; return a sentence."""
    words = [
        place.uv,
        "pip",
        "install",
        "--python",
        str(place.python),
        "--dry-run",
        "--upgrade",
        "--no-deps",
        "racecraft",
    ]
    try:
        done = subprocess.run(words, env=place.variables(), capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"Nobody could be asked ({error})."
    if match := re.search(r"\+ racecraft==(\S+)", done.stdout + done.stderr):
        return f"Version {match[1]} is newer. Download it, and move your workspace folder into it."
    return (
        "This is the newest version."
        if done.returncode == 0
        else "Nobody could be asked: " + done.stderr.strip()[-200:]
    )


def open_browser(address: str, words: list[str]) -> None:
    """Open a page, aside: some browsers keep their caller waiting."""
    if "--no-open" not in words:
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def handler(place: Place, progress: Progress) -> type[BaseHTTPRequestHandler]:
    """Return what answers the page; only this machine's own pages are answered."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if not self._is_own():
                return self._send(403, "text/plain", b"")
            if self.path.startswith("/state"):
                return self._send(200, "application/json", json.dumps(progress.as_dictionary()).encode())
            if self.path.split("?")[0] == "/":
                return self._send(200, "text/html; charset=utf-8", (place.parts / "begin.html").read_bytes())
            return self._send(404, "text/plain", b"")

        def do_POST(self) -> None:
            origin = self.headers.get("Origin")
            if not self._is_own() or (origin is not None and origin.partition("://")[2] != self.headers.get("Host")):
                return self._send(403, "text/plain", b"")
            if self.path == "/again":
                progress.retry.set()
                return self._send(200, "application/json", b"{}")
            if self.path == "/newer":
                return self._send(200, "application/json", json.dumps({"text": newer_version(place)}).encode())
            return self._send(404, "text/plain", b"")

        def _is_own(self) -> bool:
            return self.headers.get("Host", "").rpartition(":")[0] in LOOPBACK

        def _send(self, status: int, kind: str, data: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(data)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, format: str, *arguments: Any) -> None:
            """Keep quiet: the window is for people."""

    return Handler


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
