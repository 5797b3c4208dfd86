"""What judging, auditing, killing and reading a league takes. Writes benchmarks/league.json and prints its table.

    python benchmarks/league.py RUN [RUN …] [--entries 200] [--audited 1000] [--kills 20] [--rows 10000]
    python benchmarks/league.py RUN --folder KEPT --only many audited --minutes 15

Runs are cars that were trained; their laps do not matter. With --folder what was judged is kept, so that a measurement
that was broken off, or stopped after --minutes, goes on where it was. Judging is measured by the wall clock on whatever
machine this is; the table says how many processors it has and how busy they were.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import http.client
import itertools
import json
import math
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec

import racecraft as rc
from racecraft.league.drive_process import DriveProcess
from racecraft.league.heats import remaining, solo_heat
from racecraft.league.judging import Drivers, judge
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.store import RACES, League

HERE = Path(__file__).resolve().parent
RULES: dict[str, Any] = {"type": "OBJECT_AVOIDANCE", "boxes": 3, "max_resets": 2}
"""Of the drives that are judged by the hundred: boxes stand elsewhere in each; few resets keep them short."""
READS = 200
"""Times that a board's page is loaded, unchanged and after one more result each."""


class SameProcess(Drivers):
    """Drives every heat in one process, where thousands are to be had quickly."""

    def __init__(self, kind: str, league: League) -> None:
        super().__init__(kind)
        self._only = DriveProcess(kind, [(league.path / RACES).resolve()])
        self._close, self._only.close = self._only.close, lambda: None  # type: ignore[method-assign]

    def acquire(self, more: bool) -> DriveProcess:
        """Return the process."""
        return self._only

    def close(self) -> None:
        """End it."""
        self._close()


def main() -> None:
    """Measure, write, print."""
    options, figures = _options(), _machine()
    with contextlib.ExitStack() as stack:
        folder = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="racecraft-league-")))
        for name in options.only:
            figures |= MEASUREMENTS[name](folder, options)
            print(json.dumps(figures), flush=True)
    figures["load_after"] = round(os.getloadavg()[0], 1)
    if set(options.only) < MEASUREMENTS.keys():
        return
    (HERE / "league.json").write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    print(table(figures))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    for name, count in (("entries", 200), ("audited", 1000), ("kills", 20), ("rows", 10_000)):
        parser.add_argument(f"--{name}", type=int, default=count)
    parser.add_argument("--only", nargs="+", choices=list(MEASUREMENTS), default=list(MEASUREMENTS))
    parser.add_argument("--folder", type=Path, help="keep the league here, and go on with it")
    parser.add_argument("--minutes", type=float, help="stop judging after so long; another call goes on")
    return parser.parse_args()


def _machine() -> dict[str, Any]:
    return {"processors": os.cpu_count(), "load_before": round(os.getloadavg()[0], 1)}


def _new(folder: Path, title: str, runs: list[Path], entries: int, **rules: Any) -> tuple[League, Race]:
    store = League.open_or_create(folder / "league")
    kept = [race for race in store.races() if race.title == title]
    race = kept[0] if kept else rc.create_race(title, league=store.path, track=["Oval_track"], **rules).race
    for number, run in list(zip(range(entries), itertools.cycle(runs)))[len(store.entries(race.id)) :]:
        rc.enter_race(race.id, run, racer=f"Racer {number}", league=store.path)
    return store, race


def _judge(league: League, race: Race, options: argparse.Namespace, drivers: Drivers | None = None) -> float:
    """Judge what waits, for so long as is asked; return the seconds that all of it has taken so far."""
    until = time.monotonic() + 60 * (options.minutes or math.inf)
    while remaining(race, league.entries(race.id), league.results(race.id)) and time.monotonic() < until:
        judge(league, race, 10, drivers)
    return sum(one.seconds for one in league.results(race.id).values())


def _one_entry(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Judge one entry of three laps: in a process that is started for it, and in one that waits already."""
    cold, warm = [], []
    for number in range(5):
        league, race = _new(folder, f"Cold {number}", options.runs, 1)
        started = time.perf_counter()
        judge(league, race)
        cold.append(time.perf_counter() - started)
        league, race = _new(folder, f"Warm {number}", options.runs, 1)
        with Drivers(race.kind) as drivers:
            drivers.warm_up()
            while not drivers.is_warm:
                time.sleep(0.05)
            started = time.perf_counter()
            judge(league, race, drivers=drivers)
            warm.append(time.perf_counter() - started)
    return {
        "cold_seconds": _spread(cold),
        "warm_seconds": _spread(warm),
    }


def _many_entries(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Judge many entries, each in a fresh process; every one is driven again."""
    league, race = _new(folder, "Many", options.runs, options.entries, **RULES)
    seconds = _judge(league, race, options)
    audit = rc.audit_races(race.id, league=league.path).as_dictionary()
    return {"entries": len(league.results(race.id)), "entries_seconds": round(seconds, 1),
            "entries_equal": audit["equal"]}  # fmt: skip


def _audited(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Audit a season of two races with boxes at places of their own in each drive."""
    league = folder / "league"
    kept = League.open_or_create(league).seasons()
    season = kept[0] if kept else rc.create_season("Winter", league=league).season
    for title in ("First", "Second"):
        store, race = _new(folder, title, options.runs, options.audited // 2, **RULES, season=season.id)  # fmt: skip
        with SameProcess(race.kind, store) as drivers:
            _judge(store, race, options, drivers)
    started, before = time.perf_counter(), _processor_seconds()
    audit = rc.audit_races(season=season.id, league=league).as_dictionary()
    return {"audited": audit["heats"], "audited_equal": audit["equal"],
            "audited_seconds": round(time.perf_counter() - started, 1),
            "audited_processor_seconds": round(_processor_seconds() - before, 1)}  # fmt: skip


def _processor_seconds() -> float:
    """Return what this process and the children that have ended have used."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def _killed(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Kill a judge at moments of its work; what is left is judged on, and driven again."""
    league, race = _new(folder, "Killed", options.runs, options.kills, type="OBJECT_AVOIDANCE", boxes=2)
    words = [sys.executable, "-m", "racecraft", "league", "judge", race.id, "--league", str(league.path)]
    dice, kills, before = random.Random(1), 0, 0
    lost = 0
    while kills < options.kills:
        judge_process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(dice.uniform(0.5, 12.0))
        if judge_process.poll() is None:
            judge_process.send_signal(signal.SIGKILL)
            kills += 1
        judge_process.wait()
        now = len(league.results(race.id))
        lost += now < before
        before = now
        if now == options.kills:
            rc.reset_race(race.id, league=league.path)
            before = 0
    judge(league, race)
    audit = rc.audit_races(race.id, league=league.path).as_dictionary()
    return {"kills": kills, "kills_lost": lost, "after_kills": len(league.results(race.id)),
            "after_kills_equal": audit["equal"]}  # fmt: skip


def _long_board(folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """Load the page of a board of many results: as it is, and each time after one more entry and its result."""
    league = League.open_or_create(folder / "long/league")
    race = league.add_race(Race(id="", title="Long", kind="deepracer", tracks=("Oval_track",), rules={}))
    dice = random.Random(2)
    for number in range(1, options.rows + 1):
        _write_judged(league, race, number, dice)
    with _console(folder / "long") as connection:
        first = _loaded_ms(connection, f"/races/{race.id}")
        unchanged = [_loaded_ms(connection, f"/races/{race.id}") for _ in range(READS)]
        changed = []
        for number in range(options.rows + 1, options.rows + READS + 1):
            _write_judged(league, race, number, dice)
            changed.append(_loaded_ms(connection, f"/races/{race.id}"))
    return {"board_rows": options.rows, "board_first_ms": round(first), "board_unchanged_ms": _percentiles(unchanged),
            "board_changed_ms": _percentiles(changed)}  # fmt: skip


@contextlib.contextmanager
def _console(folder: Path) -> Iterator[http.client.HTTPConnection]:
    """Start a console over a workspace; yield a connection to it."""
    words = [sys.executable, "-m", "racecraft", "console", str(folder), "--port", "0", "--no-open"]
    environment = {**os.environ, "RACECRAFT_JOBS": str(folder / "jobs")}
    process = subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        address = urlsplit(re.findall(r"http\S+", process.stdout.readline())[0])
        yield http.client.HTTPConnection(str(address.hostname), address.port)
    finally:
        process.terminate()
        process.wait()


def _loaded_ms(connection: http.client.HTTPConnection, path: str) -> float:
    started = time.perf_counter()
    connection.request("GET", path, headers={"Accept": "text/html", "Accept-Encoding": "gzip"})
    answer = connection.getresponse()
    answer.read()
    assert answer.status == 200, f"{path}: {answer.status}"
    return 1000 * (time.perf_counter() - started)


def _percentiles(times: list[float]) -> list[int]:
    """Return the median, the 99th percentile and the slowest."""
    return [round(statistics.median(times)), round(statistics.quantiles(times, n=100)[98]), round(max(times))]


def _write_judged(league: League, race: Race, number: int, dice: random.Random) -> None:
    """Write an entry and its result as the store does, whole or not at all, but without waiting for the disk."""
    with tempfile.TemporaryDirectory(dir=league.folder(race.id), prefix=".new-", ignore_cleanup_errors=True) as draft:
        entry = Entry(number=number, racer=f"Racer {number}", model="car", entered=0.0)
        (Path(draft) / "entry.json").write_bytes(msgspec.json.encode(entry))
        os.rename(draft, league.folder(race.id) / "entries" / f"{number:05}")
    laps = tuple(round(dice.uniform(7.0, 12.0), 6) for _ in range(3))
    outcome = Outcome(laps=laps, total_seconds=sum(laps), progress_percent=100.0)
    drive = Drive(track="Oval_track", seed=1, outcomes=(outcome,))
    result = Result(heat=solo_heat(number), entries=(number,), drives=(drive,), judged=float(number))
    draft_file = league.folder(race.id) / "drives" / f"{number:05}.json"
    draft_file.write_bytes(msgspec.json.encode(dataclasses.asdict(result)))
    os.rename(draft_file, league.folder(race.id) / "results" / draft_file.name)


MEASUREMENTS = {
    "one": _one_entry, "many": _many_entries, "audited": _audited, "killed": _killed, "board": _long_board,
}  # fmt: skip


def _spread(seconds: list[float]) -> list[float]:
    return [round(statistics.median(seconds), 2), round(max(seconds), 2)]


def table(figures: dict[str, Any]) -> str:
    """Return the figures as a table."""
    cold, warm = figures["cold_seconds"], figures["warm_seconds"]
    rows = [
        ("one time trial of three laps, started cold", f"{cold[0]} s (slowest of 5: {cold[1]} s)", "10 s", "4 s"),
        ("the same, process warmed beforehand", f"{warm[0]} s (slowest of 5: {warm[1]} s)", "5 s", "3 s"),
        (f"{figures['entries']} entries, a fresh process each", f"{figures['entries_seconds']} s; "
         f"{figures['entries_equal']} equal to the bit", "all", "all"),
        (f"season of {figures['audited']} audited", f"{figures['audited_seconds']} s, of the processor "
         f"{figures['audited_processor_seconds']} s; {figures['audited_equal']} equal to the bit", "all", "all"),
        (f"kill -9 of the judge, {figures['kills']} moments", f"{figures['kills_lost']} results lost; "
         f"{figures['after_kills']} judged in the end, {figures['after_kills_equal']} equal", "0 lost", "0 lost"),
        *((f"page of a board of {figures['board_rows']} results, {when}: p99", f"{p99} ms (median {median} ms, slowest "
           f"{slowest} ms; first load {figures['board_first_ms']} ms)", "200 ms", "50 ms")
          for when, (median, p99, slowest) in (("unchanged", figures["board_unchanged_ms"]),
                                               ("after each new result", figures["board_changed_ms"]))),
    ]  # fmt: skip
    head = [("what", "measured", "at least", "aim"), ("---",) * 4]
    lines = [f"| {' | '.join(row)} |" for row in (*head, *rows)]
    about = (
        f"{figures['processors']} processors, load {figures['load_before']} before and {figures['load_after']} after."
    )
    return "\n".join([*lines, "", about])


if __name__ == "__main__":
    main()
