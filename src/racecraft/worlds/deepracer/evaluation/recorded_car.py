"""Which car drove, told from a racer's recordings alone. Begin with `recorded_car`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from racecraft.worlds.deepracer.evaluation.car_verdict import RECORDED_CARS, CarVerdict, judge_car
from racecraft.worlds.deepracer.evaluation.open_loop import drive_open_loop
from racecraft.worlds.deepracer.evaluation.recompute import trace_path
from racecraft.worlds.deepracer.logs.about import facts_of
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.logs.sources import ABOUT, Source

MAX_FILES = 3


class RecordedCar(NamedTuple):
    """What a folder's recordings say of their car."""

    verdict: CarVerdict
    rows: int
    """Recorded rows that it was judged by."""


def recorded_car(folder: str | Path) -> RecordedCar | None:
    """Return which car the recordings in a folder show.

    Args:
        folder: Where simulation traces (`*-iteration.csv`) or logs lie, in it or below folders of it that are named
            after traces (`sim-trace`, `training-simtrace`) or logs; the MAX_FILES largest are judged, traces if any.

    Returns:
        None where there are no recordings.
    """
    folder = Path(folder)
    logs = _largest([*folder.glob("*.log"), *(log for child in folder.glob("*log*") for log in child.rglob("*.log"))])
    traces = []
    for path in _recordings(folder) or logs:
        try:
            traces.append(read_sim_trace(path))
        except LogError:
            continue  # `racecraft replay` names what is wrong with it
    if not traces:
        return None
    walks = [trace_path(trace) for trace in traces]
    errors = {
        car: np.concatenate(
            [drive_open_loop(trace, way, car).position_m["1s"] for trace, way in zip(traces, walks, strict=True)]
        )
        for car in RECORDED_CARS
    }
    build = "ROS 2" if any("wall_clock" in trace.columns for trace in traces) else _build(logs)
    return RecordedCar(judge_car(errors, build), sum(map(len, traces)))


def _recordings(folder: Path) -> list[Path]:
    """Return the largest traces of a racer's folder; a whole project is not searched."""
    found = list(folder.glob("*-iteration.csv"))
    for child in folder.glob("*trace*"):
        found += child.rglob("*-iteration.csv")
    return _largest(found)


def _largest(files: list[Path]) -> list[Path]:
    return sorted(files, key=lambda path: (-path.stat().st_size, path))[:MAX_FILES]


def _build(logs: list[Path]) -> str | None:
    """Return the build that a log names, the largest first."""
    named = (facts_of(Source(str(log), ABOUT, "")).get("build") for log in logs)
    return next((build for build in named if build), None)
