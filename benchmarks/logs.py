"""A million rows of logs beside deepracer-utils: the same folder, the same questions, in turns in one process.

    python benchmarks/logs.py FOLDER [--rows 1000000] [--repeats 3]

FOLDER is a real training, such as a DeepRacer for Cloud prefix; its traces are repeated with new episode numbers until
there are enough rows. The last line of the output is one JSON object.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import statistics
import tempfile
import time
import warnings
from collections.abc import Callable
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


def their_heat_map(frame, track) -> None:
    PlottingUtils.plot_track(frame, TheirTrack(track.name, np.asarray(track.rows)))
    plt.close("all")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder, log = Path(place) / "model", Path(place) / "sim.log"
        rows = repeated(asked.folder, folder, asked.rows)
        as_log(folder, log)
        figures = measured(folder, log, asked.repeats)
    print(f"{rows:,} rows; medians of {asked.repeats} turns, theirs and ours by turns")
    print(f"{'':52}{'theirs':>10}{'ours':>10}{'times':>8}   {'CPU':>9}{'ours':>10}{'times':>8}")
    for name, (theirs, ours, their_cpu, our_cpu) in figures.items():
        clock = f"{theirs:9.2f}s{ours:9.3f}s{theirs / ours:7.1f}x"
        print(f"{name:52}{clock}   {their_cpu:8.2f}s{our_cpu:9.3f}s{their_cpu / our_cpu:7.1f}x")
    print(json.dumps({"rows": rows, "seconds": figures}))


def measured(folder: Path, log: Path, repeats: int) -> dict[str, list[float]]:
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
    return {
        name: [statistics.median(turn[kind] for turn in side) for kind in (0, 1) for side in sides]
        for name, sides in taken.items()
    }


if __name__ == "__main__":
    main()
