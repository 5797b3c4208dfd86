"""A million rows of logs beside deepracer-utils: the same folder, the same questions, in turns in one process.

    python benchmarks/logs.py FOLDER [--rows 1000000] [--repeats 3] [--only fresh]

Behind them stand the same in a fresh process each, imports and loading of compiled code included, and what the command
takes. FOLDER is a real training, such as a DeepRacer for Cloud prefix; its traces are repeated with new episode numbers
until there are enough rows. The last line of the output is one JSON object.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
import polars as pl  # noqa: E402
from deepracer.logs import AnalysisUtils, DeepRacerLog, PlottingUtils, SimulationLogsIO  # noqa: E402
from deepracer.tracks import Track as TheirTrack  # noqa: E402

from racecraft.worlds.deepracer.analysis import logs as analysis  # noqa: E402
from racecraft.worlds.deepracer.files.simulation_log import trace_lines  # noqa: E402
from racecraft.worlds.deepracer.logs import read  # noqa: E402
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace  # noqa: E402

THEIR_PROGRAM = """
from deepracer.logs import AnalysisUtils, DeepRacerLog
log = DeepRacerLog({folder!r})
log.load(ignore_metadata=True)
AnalysisUtils.simulation_agg(log.df, secondgroup="unique_episode")
"""
OUR_PROGRAM = """
from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.logs import read
analysis.simulation_agg(read({folder!r}).ticks)
"""
HEAT_MAP_ROWS = 100_000
"""Rows of the heat map: theirs walks row by row, and a million would take minutes."""


def repeated(source: Path, folder: Path, rows: int) -> int:
    """Write the traces of a training over and over until there are so many rows; return how many there are."""
    traces = [Path(one.name) for one in read(source).sources if one.kind == "trace" and one.phase in ("training", None)]
    if not traces:
        raise SystemExit(f"{source}: no trace of a training; expected a folder with training-simtrace")
    home = folder / "training-simtrace"
    home.mkdir(parents=True)
    written = iteration = episode = 0
    while written < rows:
        for trace in traces:
            head, *lines = trace.read_text().splitlines()
            first = int(lines[0].split(",", 1)[0])
            moved = [(int(number) - first + episode, rest) for number, rest in (line.split(",", 1) for line in lines)]
            text = "\n".join([head, *(f"{number},{rest}" for number, rest in moved)]) + "\n"
            (home / f"{iteration}-iteration.csv").write_text(text)
            episode, iteration, written = moved[-1][0] + 1, iteration + 1, written + len(lines)
            if written >= rows:
                break
    return written


def as_log(folder: Path, path: Path) -> None:
    """Write the traces of a folder as the text of one simulation log."""
    with open(path, "w") as file:
        for trace in sorted(folder.glob("training-simtrace/*.csv"), key=lambda one: int(one.name.split("-")[0])):
            file.write("\n".join(trace_lines(read_sim_trace(trace).columns)) + "\n")


def seconds(act: Callable[[], object]) -> tuple[float, float]:
    """Return how long an act takes, by the clock and in CPU seconds of all threads; what it prints is kept quiet."""
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        begun, used = time.perf_counter(), time.process_time()
        act()
        return time.perf_counter() - begun, time.process_time() - used


def fresh(*command: str) -> tuple[float, float]:
    """Return what a process takes from its start to its end: seconds of the clock, and of the CPU."""
    began = time.perf_counter()
    process = subprocess.Popen([sys.executable, *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{command}: ended with {os.waitstatus_to_exitcode(status)}; run it by hand to see why.")
    return time.perf_counter() - began, used.ru_utime + used.ru_stime


def measured_fresh(folder: Path, repeats: int) -> dict[str, list[float | None]]:
    """Return the same of fresh processes; theirs has no command, so ours stand alone (None)."""
    name, page = str(folder), str(folder.parent / "page.html")
    rows: dict[str, tuple[tuple[str, ...] | None, tuple[str, ...]]] = {
        "fresh process: read a folder, table of episodes": (
            ("-c", THEIR_PROGRAM.format(folder=name)), ("-c", OUR_PROGRAM.format(folder=name)),
        ),
        "fresh process: racecraft logs FOLDER": (None, ("-m", "racecraft", "logs", name)),
        "fresh process: racecraft logs FOLDER --page": (None, ("-m", "racecraft", "logs", name, "--page", page)),
    }  # fmt: skip
    taken: dict[str, list[list[tuple[float, float]]]] = {row: [[], []] for row in rows}
    for _ in range(repeats):
        for row, commands in rows.items():
            for command, kept in zip(commands, taken[row], strict=True):
                kept += [] if command is None else [fresh(*command)]
    return {row: medians(sides) for row, sides in taken.items()}


def medians(sides: Sequence[list[tuple[float, float]]]) -> list[float | None]:
    """Return theirs and ours by the clock, then theirs and ours by the CPU; None where nothing was measured."""
    return [statistics.median(turn[kind] for turn in side) if side else None for kind in (0, 1) for side in sides]


def their_heat_map(frame, track) -> None:
    PlottingUtils.plot_track(frame, TheirTrack(track.name, np.asarray(track.rows)))
    plt.close("all")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", choices=("warm", "fresh"), help="measure one of the two parts")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder, log = Path(place) / "model", Path(place) / "sim.log"
        rows = repeated(asked.folder, folder, asked.rows)
        figures: dict[str, list[float | None]] = {}
        if asked.only != "fresh":
            as_log(folder, log)
            figures |= measured(folder, log, asked.repeats)
        if asked.only != "warm":
            figures |= measured_fresh(folder, asked.repeats)
    print(f"{rows:,} rows; medians of {asked.repeats} turns, theirs and ours by turns")
    print(f"{'':52}{'theirs':>10}{'ours':>10}{'times':>8}   {'CPU':>9}{'ours':>10}{'times':>8}")
    for name, (theirs, ours, their_cpu, our_cpu) in figures.items():
        print(f"{name:52}{_pair(theirs, ours)}   {_pair(their_cpu, our_cpu)}")
    print(json.dumps({"rows": rows, "seconds": figures}))


def _pair(theirs: float | None, ours: float) -> str:
    if theirs is None:
        return f"{'–':>10}{ours:9.3f}s{'–':>8}"
    return f"{theirs:9.2f}s{ours:9.3f}s{theirs / ours:7.1f}x"


def measured(folder: Path, log: Path, repeats: int) -> dict[str, list[float | None]]:
    """Return theirs and ours by the clock, then theirs and ours in CPU time, s, for each question; medians."""
    loaded = DeepRacerLog(str(folder))
    with contextlib.redirect_stdout(io.StringIO()):
        loaded.load(ignore_metadata=True)
    ticks = read(folder).ticks.collect()
    track = analysis.find_track(ticks)
    few = loaded.df.head(HEAT_MAP_ROWS)

    def their_load() -> DeepRacerLog:
        one = DeepRacerLog(str(folder))
        one.load(ignore_metadata=True)
        return one

    def their_session() -> None:
        """Read once, then ask what every notebook begins with."""
        one = their_load()
        AnalysisUtils.simulation_agg(one.df, secondgroup="unique_episode")
        one.stability.analyze()

    def our_session() -> None:
        all_ticks = read(folder).ticks.collect()
        analysis.simulation_agg(all_ticks)
        analysis.stability(all_ticks)

    paid = pl.col("reward").sum()

    turns: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
        "read every column of a folder of traces": (
            their_load, lambda: read(folder).ticks.collect(),
        ),
        "read a folder, table of episodes": (
            lambda: AnalysisUtils.simulation_agg(their_load().df, secondgroup="unique_episode"),
            lambda: analysis.simulation_agg(read(folder).ticks),
        ),
        "read a folder, reward of each episode": (
            lambda: their_load().df.groupby("unique_episode")["reward"].sum(),
            lambda: read(folder).ticks.group_by("unique_episode").agg(paid).collect(),
        ),
        "read a folder, stability table": (
            lambda: their_load().stability.analyze(), lambda: analysis.stability(read(folder).ticks).data,
        ),
        "read a folder, and both tables of it": (their_session, our_session),
        "read a simulation log": (
            lambda: SimulationLogsIO.load_pandas(str(log)), lambda: read(log).ticks.collect(),
        ),
        "table of episodes": (
            lambda: AnalysisUtils.simulation_agg(loaded.df, secondgroup="unique_episode"),
            lambda: analysis.simulation_agg(ticks),
        ),
        "stability table": (lambda: loaded.stability.analyze(), lambda: analysis.stability(ticks).data),
        f"reward heat map of {HEAT_MAP_ROWS:,} rows, drawn": (
            lambda: their_heat_map(few, track),
            lambda: analysis.reward_heat_map(ticks.head(HEAT_MAP_ROWS), track).figure.canvas.draw(),
        ),
    }  # fmt: skip
    for _, ours in turns.values():
        ours()  # once unmeasured: compiled code is loaded, and the disk has been read
    taken: dict[str, tuple[list[tuple[float, float]], ...]] = {name: ([], []) for name in turns}
    for _ in range(repeats):
        for name, pair in turns.items():
            for act, kept in zip(pair, taken[name], strict=True):
                kept.append(seconds(act))
    return {name: medians(sides) for name, sides in taken.items()}


if __name__ == "__main__":
    main()
