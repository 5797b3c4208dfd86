"""What a page that is looked at costs a training: `python benchmarks/watch_training.py [--minutes 4]`.

One default training runs with `--watch`, on a workload that stays the same: it takes no step to learn by (a learning
rate of next to nothing), so that its cars leave the road as often at the end as at first, and it judges nothing.
For PERIOD_SECONDS somebody asks the page for live ticks, pictures and curves, as a browser does, then nobody does for
as long, and so on to the end. A period counts whole iterations only. Each watched period is held against the mean of
the two unwatched ones beside it, so that a machine that grows busier does not count. Told are wall seconds and
processor seconds of the training's process an iteration (the latter where the system has /proc; they are worth more on
a machine that does something else): the median over the watched periods, between which two values it lies with 95 %,
and between which two half of the periods lie. What the page's own process takes is told as a share of one core; not in
it is what it takes to start, once, a second or two.

With `--clients 10` ten ask at once, from the process of this script, whose share of a core is told, too: what it takes
is taken from the training as well, though no server's cost. With `--browser` a headless Chromium without a
graphics card shows the page, so that its drawing counts.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

STEADY = ("ppo.learning_rate=1e-8", "evaluation.every=1000000")
PERIOD_SECONDS, SETTLE_SECONDS = 10.0, 3.0
"""How long somebody looks, or nobody; and how long after each change is not counted: a page is loaded, a wish of the
page before is still answered."""
LOOK_SECONDS, PICTURE_SECONDS, AHEAD_TICKS = 0.5, 0.5, 30
"""How often the page asks for ticks, while it wants some, and for pictures beside a training, and with how many ticks
left it wants more; as `pages/cars.js` does."""


@dataclass(frozen=True)
class Period:
    """What a stretch of the training took while somebody looked, or nobody."""

    watched: bool
    wall: float
    """s an iteration."""
    processor: float
    """s an iteration, of the training's process; NaN where the system does not say."""
    page: float
    """Processor seconds a second, of the page's process; likewise."""
    clients: float
    """The same of this process, in which scripted clients ask."""


class Training:
    """A default training with a page beside it."""

    def __init__(self, run: Path, minutes: float) -> None:
        command = [sys.executable, "-m", "racecraft", "train", "--run", str(run), "--stop", f"minutes={minutes}"]
        command += ["--no-pictures", "--json", "--watch", *(word for one in STEADY for word in ("--set", one))]
        self._metrics = run / "metrics.jsonl"
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self._page: list[int] = []
        assert self._process.stderr is not None
        said = next(
            (found for line in self._process.stderr if (found := re.search(r"watch: (http://\S+/)", line))), None
        )
        if said is None:
            raise SystemExit("The training named no page.")
        self.page = said[1]
        threading.Thread(target=self._process.stderr.read, daemon=True).start()

    @property
    def goes_on(self) -> bool:
        """Whether it still trains."""
        return self._process.poll() is None

    def ends(self) -> list[float]:
        """Return when each iteration so far ended, s."""
        if not self._metrics.exists():
            return []
        rows = self._metrics.read_text(encoding="utf-8").splitlines(True)
        return [json.loads(row)["seconds"] for row in rows if row[-1] == "\n"]

    def processor_seconds(self) -> tuple[float, float]:
        """Return what the training's process has taken of the processor, and what the page's, s."""
        training = self._process.pid
        try:
            if not self._page:
                self._page = [
                    int(word) for word in Path(f"/proc/{training}/task/{training}/children").read_text().split()
                ]
            return spent(training), sum(map(spent, self._page))
        except OSError:
            return float("nan"), float("nan")

    def period(self, look: AbstractContextManager[None] | None) -> Period | None:
        """Let the training go on for a period, while somebody looks or nobody; None where it ended in it."""
        with look or nullcontext():
            return self._period(look is not None)

    def _period(self, watched: bool) -> Period | None:
        time.sleep(SETTLE_SECONDS)
        first, began = self.next_end()
        asked = time.process_time()
        time.sleep(PERIOD_SECONDS - SETTLE_SECONDS)
        last, ended = self.next_end()
        asked = time.process_time() - asked
        if not self.goes_on:
            return None
        ends, count = self.ends(), last - first
        wall = ends[last - 1] - ends[first - 1]
        return Period(watched, wall / count, (ended[0] - began[0]) / count, (ended[1] - began[1]) / wall, asked / wall)

    def next_end(self) -> tuple[int, tuple[float, float]]:
        """Wait until an iteration ends; return how many have, and the processor seconds by then."""
        before = len(self.ends())
        while self.goes_on and len(self.ends()) == before:
            time.sleep(0.01)
        return len(self.ends()), self.processor_seconds()


def spent(process: int) -> float:
    """Return what a process has taken of the processor, s."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def asking(page: str, clients: int) -> Iterator[None]:
    """So many ask for live cars."""
    over = threading.Event()
    for _ in range(clients):
        threading.Thread(target=ask, args=(page, over), daemon=True).start()
    yield
    over.set()


@contextmanager
def drawing(page: str, browser: Any) -> Iterator[None]:
    """A browser shows them."""
    browser.goto(page)
    yield
    browser.goto("about:blank")


def ask(page: str, over: threading.Event) -> None:
    """Ask as a browser that shows live cars: for ticks when few are left to play, for the picture of one car all along.

    What comes is played to its end before what comes next, so the page asks again when AHEAD_TICKS are left of both.
    """
    threading.Thread(target=follow, args=(page, over), daemon=True).start()
    after, played_at, ticks_at = 0, 0.0, 0.0
    car: dict[str, Any] = {}
    while not over.wait(PICTURE_SECONDS):
        now = time.monotonic()
        try:
            if now >= max(ticks_at, played_at - AHEAD_TICKS / TICKS_PER_SECOND):
                ticks_at = now + LOOK_SECONDS
                if reel := told(f"{page}api/live?after={after}")["reel"]:
                    after, car = reel["last"], reel["cars"][0]
                    played_at = max(now, played_at) + reel["ticks"] / TICKS_PER_SECOND
            if car:
                tick = max(0, len(car["x"]) - 1 - int(max(0.0, played_at - now) * TICKS_PER_SECOND))
                urllib.request.urlopen(
                    f"{page}camera.jpg?x={car['x'][tick]}&y={car['y'][tick]}&yaw={car['yaw'][tick]}", timeout=10
                ).close()
        except (urllib.error.URLError, OSError, ValueError):
            continue  # the page is not there yet, or no longer


def follow(page: str, over: threading.Event) -> None:
    """Take what the page is sent of each iteration, and ask for its row of the curves."""
    last = 0
    with suppress(urllib.error.URLError, OSError), urllib.request.urlopen(f"{page}api/events", timeout=30) as events:
        for line in events:
            if over.is_set():
                return
            if line.startswith(b"data:"):
                rows = told(f"{page}api/curves?after={last}")["rows"]
                last = rows[-1]["iteration"] if rows else last


def told(address: str) -> dict[str, Any]:
    """Return what the page's server answers."""
    with urllib.request.urlopen(address, timeout=10) as answer:
        found: dict[str, Any] = json.load(answer)
    return found


def costs(values: list[float]) -> list[float]:
    """Return how much more each watched period takes than the two beside it, per cent; they come in turns.

    >>> costs([1.0, 1.1, 1.2, 1.2, 1.2])
    [0.0, 0.0]
    """
    return [
        round(100.0 * (values[k] / (0.5 * (values[k - 1] + values[k + 1])) - 1.0), 6)
        for k in range(1, len(values) - 1, 2)
    ]


def surely(values: list[float]) -> tuple[float, float]:
    """Return between which two values the median lies with 95 %: two of the values, whatever they are spread like.

    >>> surely([float(k) for k in range(20)])
    (5.0, 14.0)
    """
    ordered, count = sorted(values), len(values)
    below = [sum(math.comb(count, k) for k in range(place + 1)) / 2**count for place in range(count)]
    outside = max((place for place in range(count // 2) if below[place] <= 0.025), default=0)
    return ordered[outside], ordered[count - 1 - outside]


@contextmanager
def shown_in(wanted: bool) -> Iterator[Any]:
    """Yield a window of Chromium where one is wanted."""
    if not wanted:
        yield None
        return
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"])
        yield browser.new_page(viewport={"width": 1280, "height": 900})
        browser.close()


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--minutes", type=float, default=4.0)
    words.add_argument("--clients", type=int, default=1)
    words.add_argument("--browser", action="store_true")
    asked = words.parse_args()
    periods: list[Period] = []
    with tempfile.TemporaryDirectory() as folder, shown_in(asked.browser) as browser:
        training = Training(Path(folder) / "run", asked.minutes)
        while training.goes_on and len(training.ends()) < 5:  # compiled, and warm
            time.sleep(0.5)
        while True:
            look = drawing(training.page, browser) if browser else asking(training.page, asked.clients)
            period = training.period(look if len(periods) % 2 == 1 else None)
            if period is None:
                break
            periods.append(period)
        while training.goes_on:
            time.sleep(0.5)
    for what, values in (
        ("wall seconds an iteration", [one.wall for one in periods]),
        ("processor seconds an iteration", [one.processor for one in periods]),
    ):
        found = costs(values)
        if len(found) < 2:
            raise SystemExit("Too few periods; give it more --minutes.")
        low, middle, high = statistics.quantiles(found, n=4)
        least, most = surely(found)
        print(
            f"{what}: {statistics.median(values[::2]):.4f} unwatched, watched {middle:+.2f} % (surely {least:+.1f} to "
            f"{most:+.1f}; half of {len(found)} periods {low:+.1f} to {high:+.1f})"
        )
    page = 100.0 * statistics.median(one.page for one in periods[1::2])
    clients = 100.0 * statistics.median(one.clients for one in periods[1::2])
    print(f"the page's process, watched: {page:.1f} % of a core; this one, whose clients ask: {clients:.1f} %")


if __name__ == "__main__":
    main()
