"""The logs of local trainings under the names of CloudWatch: `cw_utils.py` of the workshops, without a cloud.

A *log group* is a kind of log: simulations (trainings and evaluations), or submissions to a leaderboard. A *stream* is
one simulation; its id `sim-…` is made from where its files lie, so it is the same tomorrow.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.errors import nearest
from racecraft.contract.message import Message
from racecraft.formats.atomic import atomic_file
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.read import read
from racecraft.worlds.deepracer.logs.workshop_api import MARK, rows_of

if TYPE_CHECKING:
    import polars as pl

SIMULATIONS, LEADERBOARDS = "/aws/robomaker/SimulationJobs", "/aws/deepracer/leaderboard/SimulationJobs"
PHASES = {SIMULATIONS: ("training", "evaluation"), LEADERBOARDS: ("leaderboard",)}
ROOT = "RACECRAFT_RUNS"
"""Environment variable that names the folder of runs; without it `runs` in the working folder."""
LEAGUE, DRIVES = "RACECRAFT_LEAGUE", "drives"
"""Environment variable that names the league's folder, without it `league` in the working folder; and what a race calls
the folder of its drives."""
DATES = ("%d %B %Y", "%d %b %Y", "%B %d %Y", "%b %d %Y", "%Y/%m/%d", "%d %B %Y %H:%M", "%d %b %Y %H:%M")
LETTERS = "0123456789abcdfghjklmnpqrstvwxyz"


@dataclass(frozen=True)
class Stream:
    """One simulation."""

    simulation: str
    """Its id, such as sim-4jmjmdh43ykx."""
    path: Path
    """The run folder, or a log of somebody's."""
    phase: str
    first_ms: int
    """Time of its first tick, ms since 1970 (UTC); of a log that does not tell, by when its files were written."""
    last_ms: int
    """Likewise of its last."""


def streams(log_group: str = SIMULATIONS) -> list[Stream]:
    """Return the simulations of a log group, the one that ended last at the end.

    Raises:
        LogError: There is no such group, or no folder of runs.
    """
    if log_group not in PHASES:
        raise LogError(
            "log_group",
            repr(log_group),
            Message("one of {phases}", phases=", ".join(PHASES)),
            nearest(log_group, tuple(PHASES)),
        )
    root = Path(os.environ.get(ROOT, "runs"))
    judged = _judged_drives() if log_group == LEADERBOARDS else []
    if not root.is_dir() and not judged:
        raise LogError(
            str(root),
            "no folder",
            Message("the folder of runs; {root} names another", root=ROOT),
            "Train something first.",
        )
    runs = [*(sorted(root.iterdir()) if root.is_dir() else ()), *judged]
    found = [stream for phase in PHASES[log_group] for run in runs for stream in _of(run, phase)]
    return sorted(found, key=lambda stream: (stream.last_ms, stream.simulation))


def _judged_drives() -> list[Path]:
    """Return the folders of every drive that the league beside the runs has judged."""
    return sorted(Path(os.environ.get(LEAGUE, "league")).glob(f"races/*/{DRIVES}/*-*"))


def get_log_events(
    log_group: str,
    stream_name: str | None = None,
    stream_prefix: str | None = None,
    start_time: int | None = None,
    end_time: int | None = None,
) -> Iterator[dict[str, str]]:
    """Yield the rows of a simulation as events: {"message": "SIM_TRACE_LOG:…"}; times are ms since 1970."""
    for stream in _chosen(log_group, stream_name, stream_prefix):
        if stream.last_ms >= (start_time or 0) and (end_time is None or stream.first_ms <= end_time):
            for row in rows_of(_ticks(stream.path, stream.phase)):
                yield {"message": f"{MARK}{row}"}


def download_log(
    fname: str | Path,
    stream_name: str | None = None,
    stream_prefix: str | None = None,
    log_group: str | None = None,
    start_time: int | None = None,
    end_time: int | None = None,
) -> None:
    """Write the log of a simulation into a file of its own.

    Raises:
        LogError: There is no such simulation.
    """
    events = get_log_events(log_group or SIMULATIONS, stream_name, stream_prefix, start_time, end_time)
    rows = [event["message"] for event in events]
    with atomic_file(fname) as part:
        Path(part).write_text("".join(f"{row}\n" for row in rows), encoding="utf-8")


def download_all_logs(
    pathprefix: str, log_group: str, not_older_than: str | None = None, older_than: str | None = None
) -> list[tuple[str, str, int, int]]:
    """Write the logs of a group, each as `<pathprefix>sim-….log`.

    Args:
        pathprefix: What the names begin with, folder included.
        log_group: SIMULATIONS or LEADERBOARDS.
        not_older_than: A time as `iso_to_timestamp` takes it; simulations that ended before it are left out.
        older_than: Likewise; simulations that began at it or later are left out.

    Returns:
        (path, simulation id, first and last time in ms since 1970) of each, ordered by the last.
    """
    low = 0 if not_older_than is None else iso_to_timestamp(not_older_than)
    high = None if older_than is None else iso_to_timestamp(older_than)
    written = []
    Path(pathprefix + "x").parent.mkdir(parents=True, exist_ok=True)
    for stream in streams(log_group):
        if stream.last_ms >= low and (high is None or stream.first_ms < high):
            path = f"{pathprefix}{stream.simulation}.log"
            download_log(path, stream.simulation, log_group=log_group)
            written.append((path, stream.simulation, stream.first_ms, stream.last_ms))
    return written


def iso_to_timestamp(iso: str) -> int:
    """Return an ISO time, or an English date such as "19 May 2019", in ms since 1970; without a zone in the local one.

    >>> iso_to_timestamp("2019-07-01T00:00:00+00:00")
    1561939200000

    Raises:
        LogError: It is neither.
    """
    text = " ".join(iso.replace(",", " ").split())
    parsers: list[Callable[[str], datetime]] = [datetime.fromisoformat, *(partial(_parsed, form) for form in DATES)]
    for parse in parsers:
        try:
            return int(1000 * parse(text).timestamp())
        except ValueError:
            continue
    raise LogError("time", repr(iso), 'an ISO time such as "2019-05-19", or a date such as "19 May 2019"')


def _parsed(form: str, text: str) -> datetime:
    return datetime.strptime(text, form)


def _of(run: Path, phase: str) -> Iterator[Stream]:
    """Yield the simulation of one phase in a run folder, if there is one."""
    try:
        part = _ticks(run, phase)
    except LogError:
        return
    if not part.height:
        return
    clock = part["wall_clock_s"].drop_nulls().to_numpy()
    first, last = (float(clock.min()), float(clock.max())) if len(clock) else _written(run, part)
    yield Stream(simulation_id(run, phase), run, phase, int(1000 * first), int(1000 * last))


def _written(run: Path, ticks: pl.DataFrame) -> tuple[float, float]:
    """Return when the first file of ticks, less its simulated time, and the last were written, s since 1970."""
    names = read(run).files
    paths = [Path(names[file]) for file in ticks["file"].unique(maintain_order=True)]
    times = [path.stat().st_mtime for path in paths if path.is_file()] or [run.stat().st_mtime]
    of_first = ticks.filter(ticks["file"] == ticks["file"][0])["time_s"].drop_nulls()
    span = float(np.ptp(of_first.to_numpy())) if len(of_first) else 0.0
    return min(times) - span, max(times)


def _ticks(run: Path, phase: str) -> pl.DataFrame:
    import polars as pl

    return read(run).ticks.filter(pl.col("phase") == phase).collect()


def simulation_id(run: Path, phase: str) -> str:
    """Return the id of a simulation: `sim-` and twelve letters and figures, from the run's name and the phase.

    Drives of a league are numbered in each race, so the race's name counts as well.
    """
    name = f"{run.parents[1].name}/{run.name}" if run.parent.name == DRIVES else run.name
    number = int.from_bytes(hashlib.sha256(f"{name}/{phase}".encode()).digest()[:8], "big")
    return "sim-" + "".join(LETTERS[(number >> (5 * k)) & 31] for k in range(12))


def _chosen(log_group: str, name: str | None, prefix: str | None) -> list[Stream]:
    if name is None and prefix is None:
        raise LogError("stream", "neither name nor prefix", "one of them", "Give stream_name or stream_prefix.")
    known = streams(log_group)
    found = [one for one in known if one.simulation == name or (prefix and one.simulation.startswith(prefix))]
    if not found:
        ids = [one.simulation for one in known]
        raise LogError(
            "stream",
            repr(name or prefix),
            Message("one of {ids}", ids=", ".join(ids) or "none"),
            nearest(str(name), ids),
        )
    return found
