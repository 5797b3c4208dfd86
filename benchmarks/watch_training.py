"""What a page that is looked at costs a training: `python benchmarks/watch_training.py [--minutes 4]`.

One default training runs with `--watch`. For PERIOD_SECONDS somebody asks the page for its live ticks and its curves,
as a browser does, then nobody does for as long, and so on to the end: a page that nobody asks leaves the training be.
Iterations that end while a period settles are left out; so is the time of evaluations, which leave no ticks and take
longer as the car drives further. Each watched period is held against the mean of the two unwatched ones beside it, so
that neither the training's progress nor a machine that grows busier counts. Told are wall seconds an iteration, and
processor seconds of training and page together (where the system has /proc): the latter are worth more on a machine
that does something else. Medians over the watched periods, and between which two values half of them lie. Not in it is
what the page's process takes to start, once, a second or two of another core.
"""

from __future__ import annotations

import argparse
import json
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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.envs.deepracer.vehicle import TICKS_PER_SECOND
from racecraft.formats.live_ticks import WATCHED_SECONDS

PERIOD_SECONDS, SETTLE_SECONDS = 14.0, WATCHED_SECONDS + 1.0
"""How long somebody looks, or nobody; and how long after each change both may still be the case."""
LOOK_SECONDS, CURVES_SECONDS, LEFT_TICKS = 0.25, 1.5, 11
"""How often the page looks whether it wants ticks, asks for the rest, and with how many ticks left it wants more."""


@dataclass(frozen=True)
class Period:
    """What a stretch of the training took while somebody looked, or nobody."""

    watched: bool
    wall: float
    """s an iteration."""
    processor: float
    """s an iteration, of all processes; NaN where the system does not say."""


class Training:
    """A default training with a page beside it."""

    def __init__(self, run: Path, minutes: float) -> None:
        command = [sys.executable, "-m", "racecraft", "train", "--run", str(run), "--stop", f"minutes={minutes}"]
        command += ["--no-pictures", "--json", "--watch"]
        self._metrics = run / "metrics.jsonl"
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
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

    def iterations(self) -> list[float]:
        """Return how long each iteration so far took, s, its evaluation out."""
        if not self._metrics.exists():
            return []
        rows = [
            json.loads(line) for line in self._metrics.read_text(encoding="utf-8").splitlines(True) if line[-1] == "\n"
        ]
        ends = [0.0, *(row["seconds"] for row in rows)]
        return [ends[k + 1] - ends[k] - (row.get("seconds_judge") or 0.0) for k, row in enumerate(rows)]

    def processor_seconds(self) -> float:
        """Return what training and page have taken of the processor, s."""
        family = [self._process.pid]
        try:
            family += map(int, Path(f"/proc/{family[0]}/task/{family[0]}/children").read_text().split())
            spent = [Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in family]
        except OSError:
            return float("nan")
        return sum(int(one[11]) + int(one[12]) for one in spent) / os.sysconf("SC_CLK_TCK")

    def period(self, watched: bool) -> Period | None:
        """Let the training go on for a period; None where it ended in it."""
        over = threading.Event()
        if watched:
            threading.Thread(target=ask, args=(self.page, over), daemon=True).start()
        time.sleep(SETTLE_SECONDS)
        first, began = self.next_end()
        time.sleep(PERIOD_SECONDS - SETTLE_SECONDS)
        last, ended = self.next_end()
        over.set()
        if not self.goes_on:
            return None
        return Period(watched, statistics.fmean(self.iterations()[first:last]), (ended - began) / (last - first))

    def next_end(self) -> tuple[int, float]:
        """Wait until an iteration ends; return how many have, and the processor seconds by then."""
        before = len(self.iterations())
        while self.goes_on and len(self.iterations()) == before:
            time.sleep(0.02)
        return len(self.iterations()), self.processor_seconds()


def ask(page: str, over: threading.Event) -> None:
    """Ask as a browser that shows live cars: for ticks when few are left to play, of the curves for what is new."""
    after, last, ticks_at, curves_at = 0, 0, 0.0, 0.0
    while not over.wait(LOOK_SECONDS):
        now = time.monotonic()
        try:
            if now >= ticks_at and (reel := told(f"{page}api/live?after={after}")["reel"]):
                after, ticks_at = reel["last"], now + (reel["ticks"] - LEFT_TICKS) / TICKS_PER_SECOND
            if now >= curves_at:
                curves_at = now + CURVES_SECONDS
                told(f"{page}api/run")
                rows = told(f"{page}api/curves?after={last}")["rows"]
                last = rows[-1]["iteration"] if rows else last
                told(f"{page}api/iterations")
        except (urllib.error.URLError, OSError, ValueError):
            continue  # the page is not there yet, or no longer


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


def main() -> None:
    words = argparse.ArgumentParser()
    words.add_argument("--minutes", type=float, default=4.0)
    asked = words.parse_args()
    periods: list[Period] = []
    with tempfile.TemporaryDirectory() as folder:
        training = Training(Path(folder) / "run", asked.minutes)
        while training.goes_on and len(training.iterations()) < 3:  # compiled, and warm
            time.sleep(0.5)
        while (period := training.period(watched=len(periods) % 2 == 1)) is not None:
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
        print(
            f"{what}: {statistics.median(values[::2]):.3f} unwatched, watched {middle:+.1f} % "
            f"(half of {len(found)} periods from {low:+.1f} to {high:+.1f})"
        )


if __name__ == "__main__":
    main()
