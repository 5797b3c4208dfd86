"""What the console's pages take: `python benchmarks/console.py pages|first|live`. Each under three minutes.

pages   a workspace of --models, each with --runs of 100 episodes: milliseconds from request to answer on loopback,
        median and 99th percentile by page over --rounds, after each page was asked for once; the first answer
        beside it; and the seconds from the command to the first page
first   a first visit in a headless Chromium: bytes as sent, and requests to elsewhere
live    a model's page over a run that gets a row every 2 s for --seconds: growth of the page's heap after garbage
        collection and of the server's memory from the second third to the last, extrapolated to an hour
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
from playwright.sync_api import Page, sync_playwright

from first_car import console_in
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_lock import RunLock
from watch_browser import CHROMIUM, FLAGS, count_bytes

EPISODES, TICKS = 100, 20
PAGES = (
    "/models", "/models?sort=best", "/models?sort=name&q=m9", "/models?status=ready&tag=fast", "/models/m7",
    "/models/m7/laps", "/models/m7/checkpoints", "/models/m7/evaluations", "/models/m7/files", "/compare?m=m7&m=m8",
    "/drafts/new", "/jobs", "/tuning", "/races", "/tracks", "/settings",
)  # fmt: skip
ROW_SECONDS = 2.0


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("what", choices=("pages", "first", "live"))
    words.add_argument("--models", type=int, default=1000)
    words.add_argument("--runs", type=int, default=10)
    words.add_argument("--rounds", type=int, default=100)
    words.add_argument("--seconds", type=float, default=120.0)
    asked = words.parse_args()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        place = Path(folder)
        if asked.what == "pages":
            fill(place / "here", asked.models, asked.runs)
            pages(place, asked.rounds)
        elif asked.what == "first":
            first(place)
        else:
            live(place, asked.seconds)


def fill(workspace: Path, models: int, runs: int) -> None:
    """Make models with runs, whose episodes are one file under many names."""
    workspace.mkdir()
    write_episodes(workspace / "episodes.parquet", {
        "episode": np.repeat(np.arange(EPISODES), TICKS), "tick": np.tile(np.arange(1, TICKS + 1), EPISODES),
        "time_s": np.arange(EPISODES * TICKS) / 15.0,
    })  # fmt: skip
    for model in range(models):
        for run in range(1, runs + 1):
            path = workspace / f"models/m{model}/runs/{run}"
            (path / "episodes").mkdir(parents=True)
            os.link(workspace / "episodes.parquet", path / "episodes/1.parquet")
            write_job(path)
            (path / "metrics.jsonl").write_text("".join(map(row, range(1, 21))))
        tags = ["fast"] if model % 10 == 0 else []
        (workspace / f"models/m{model}/model.json").write_text(json.dumps({"kind": "deepracer", "tags": tags}))


def write_job(path: Path) -> None:
    """Write the least that a car's run says of itself."""
    job = {
        "format": "racecraft run", "version": 1, "kind": "deepracer", "title": "re:Invent 2018", "algorithm": "ppo",
        "asked": {"stops": ["minutes=10"], "track": "reinvent_base"}, "track": {"name": "reinvent_base"},
        "settings": {"race": {"type": "TIME_TRIAL"}},
    }  # fmt: skip
    (path / "job.json").write_text(json.dumps(job))


def row(iteration: int) -> str:
    """Return a row of a run's metrics."""
    lap = 6.0 + 5.0 / iteration
    return json.dumps({
        "iteration": iteration, "steps": 2048 * iteration, "seconds": 3.0 * iteration, "steps_per_second": 2000.0,
        "mean_reward": 1.0, "training_score": min(100.0, 3.0 * iteration), "evaluation_score": 50.0,
        "flying_lap_seconds": lap, "gap_percent": 100.0 * (lap / 5.67 - 1.0),
    }) + "\n"  # fmt: skip


def pages(folder: Path, rounds: int) -> None:
    """Print what each page takes once all models are listed."""
    with console_in(folder) as (address, _):
        models = sum(1 for _ in (folder / "here/models").iterdir())
        while json.loads(fetched(f"{address}/models.json"))["found"] < models:
            time.sleep(0.5)
        beginnings = {path: spent(address + path) for path in PAGES}
        for path in PAGES:
            taken = [spent(address + path) for _ in range(rounds)]
            worst = statistics.quantiles(taken, n=100)[98]
            print(
                f"{path:32} median {statistics.median(taken):6.1f} ms, p99 {worst:6.1f}, first {beginnings[path]:6.1f}"
            )
    began = time.perf_counter()
    with console_in(folder) as (address, _):
        fetched(address)
        print(f"command to first page, again: {time.perf_counter() - began:.2f} s")


def fetched(address: str) -> bytes:
    """Return what a page answers."""
    with urllib.request.urlopen(address) as answer:
        return bytes(answer.read())


def spent(address: str) -> float:
    """Return how long a page takes to answer, ms."""
    began = time.perf_counter()
    fetched(address)
    return 1000.0 * (time.perf_counter() - began)


def first(folder: Path) -> None:
    """Print what the first page sends to a browser that has nothing of it yet."""
    with console_in(folder) as (address, _), window() as page:
        elsewhere: list[str] = []
        page.on("request", lambda one: None if one.url.startswith((address, "data:")) else elsewhere.append(one.url))
        sent = count_bytes(page)
        page.goto(address)
        page.wait_for_timeout(2000)
        print(f"bytes of the first page as sent: {sent[0]:,}; requests to elsewhere: {len(elsewhere)}")


def live(folder: Path, seconds: float) -> None:
    """Print how a live page and its server grow."""
    run = folder / "here/models/m0/runs/1"
    run.mkdir(parents=True)
    write_job(run)
    seen: list[tuple[float, float]] = []
    with console_in(folder) as (address, pid), window() as page, RunLock(run):
        heap = page.context.new_cdp_session(page)
        began, iteration = time.monotonic(), 0
        while time.monotonic() - began < seconds:
            iteration += 1
            with (run / "metrics.jsonl").open("a") as file:
                file.write(row(iteration))
            if iteration == 2:
                page.goto(f"{address}/models/m0")
            page.wait_for_timeout(1000 * ROW_SECONDS)
            heap.send("HeapProfiler.collectGarbage")
            used = heap.send("Runtime.getHeapUsage")["usedSize"]
            seen.append((used / 1e6, psutil.Process(pid).memory_info().rss / 1e6))
    third = len(seen) // 3
    for what, values in zip(("page's heap", "server's memory"), zip(*seen, strict=True), strict=True):
        middle, last = statistics.median(values[third : 2 * third]), statistics.median(values[2 * third :])
        an_hour = (last - middle) / (third * seconds / len(seen)) * 3600.0
        print(f"{what}: {middle:.1f} MB, then {last:.1f} MB; {an_hour:+.1f} MB an hour, extrapolated")


@contextlib.contextmanager
def window() -> Iterator[Page]:
    """Yield a window of a fresh Chromium."""
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        yield browser.new_page(viewport={"width": 1280, "height": 900})
        browser.close()


if __name__ == "__main__":
    main()
