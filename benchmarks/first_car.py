"""From one click to a car that races: `python benchmarks/first_car.py [--rounds 3]`. About two minutes a round.

A console with a workspace and jobs of its own is started; the click is sent when its warm worker waits. With
`--browser` a headless Chromium clicks and then shows the model's page, as a person's would; without, the same request
is sent alone. Seconds from the click are told to: the line before the first tick; the first iteration's row; the first
evaluation with a full lap; full laps from every start, in two evaluations one after the other; the end. Then the
iterations, and of the best evaluated lap its seconds and how many per cent it is above the best known one.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

import psutil

from racecraft.worlds.deepracer.console.parts import fastest_lap

MODEL = "models/first-car"
LOOK_SECONDS = 0.05
REST_SECONDS = 3.0
"""A worker that took no processor time for so long is warm."""


def main() -> None:
    """Measure and print a line a round."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--browser", action="store_true", help="a Chromium clicks and shows the live page")
    asked = parser.parse_args()
    for _ in range(asked.rounds):
        print(json.dumps({"load": os.getloadavg()[0], **measure(asked.browser)}), flush=True)


def measure(with_browser: bool) -> dict[str, float]:
    """Return seconds from the click to what happens, by name."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, console_in(Path(folder)) as (address, pid):
        await_warm_worker(Path(folder) / "jobs", pid)
        with clicking_browser(address) if with_browser else contextlib.nullcontext(send_click(address)) as click:
            began = time.perf_counter()
            click()
            return seconds_to_events(Path(folder), began)


@contextlib.contextmanager
def console_in(folder: Path) -> Iterator[tuple[str, int]]:
    """Yield the address and the process of a console; its supervisor ends with it."""
    environment = {**os.environ, "RACECRAFT_JOBS": f"{folder}/jobs"}
    environment.pop("RACECRAFT_JOB_STORE", None)
    words = ["console", f"{folder}/here", "--port", "0", "--no-open"]
    command = [sys.executable, "-m", "racecraft", *words]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as console:
        assert console.stdout is not None
        try:
            yield re.search(r"http://[\d.:]+", console.stdout.readline())[0], console.pid  # type: ignore[index]
        finally:
            with contextlib.suppress(OSError, ValueError):
                os.kill(json.loads((folder / "jobs/run.lock").read_text())["pid"], signal.SIGTERM)
            console.terminate()


def await_warm_worker(jobs: Path, console: int) -> None:
    """Wait until the worker that is kept warm rests."""
    rested, before = time.perf_counter(), -1.0
    while time.perf_counter() - rested < REST_SECONDS or before < 1.0:
        time.sleep(LOOK_SECONDS)
        with contextlib.suppress(OSError, ValueError, psutil.Error):
            supervisor = psutil.Process(json.loads((jobs / "run.lock").read_text())["pid"])
            used = sum(sum(one.cpu_times()[:2]) for one in supervisor.children())
            if used != before:
                rested, before = time.perf_counter(), used


def send_click(address: str) -> Callable[[], None]:
    """Return what sends the form of the first page."""
    opened = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
    page = opened.open(address).read().decode()
    token = re.search(r'name="form_token" value="([^"]+)"', page)[1]  # type: ignore[index]
    form = urllib.parse.urlencode({"form_token": token, "kind": "deepracer"}).encode()
    return lambda: opened.open(f"{address}/models/first", form).close()


@contextlib.contextmanager
def clicking_browser(address: str) -> Iterator[Callable[[], None]]:
    """Yield what clicks in a browser that shows the first page, and then the model's."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(address)
        yield lambda: page.click("#train-first", no_wait_after=True)
        browser.close()


def seconds_to_events(folder: Path, began: float) -> dict[str, float]:
    """Return when each event is seen, seconds after `began`."""
    seen: dict[str, float] = {}
    while "ended" not in seen:
        time.sleep(LOOK_SECONDS)
        rows = _rows(folder / "here" / MODEL / "runs/1/metrics.jsonl")
        logs = "".join(log.read_text(errors="replace") for log in (folder / "jobs").rglob("log.txt"))
        events = {
            "first_tick": "; stops at " in logs,
            "first_iteration": bool(rows),
            "first_judged_lap": any(row.get("best_lap_seconds") for row in rows),
            "stable_laps": _laps_twice(rows),
            "ended": "stopped: " in logs,
        }
        for name in (name for name, is_seen in events.items() if is_seen and name not in seen):
            seen[name] = round(time.perf_counter() - began, 2)
    lap, gap = fastest_lap(rows)
    return {**seen, "iterations": len(rows), "lap_seconds": lap or math.nan, "gap_percent": gap or math.nan}


def _laps_twice(rows: list[dict[str, Any]]) -> bool:
    full = [row["evaluation_score"] >= 100.0 for row in rows if row.get("evaluation_score") is not None]
    return any(one and after for one, after in itertools.pairwise(full))


def _rows(metrics: Path) -> list[dict[str, Any]]:
    with contextlib.suppress(OSError, ValueError):
        return [json.loads(line) for line in metrics.read_text().splitlines()]
    return []


if __name__ == "__main__":
    main()
