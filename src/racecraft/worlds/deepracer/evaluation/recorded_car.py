"""Which car drove, told from a racer's recordings alone. Begin with `recorded_car`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from racecraft.worlds.deepracer.evaluation.open_loop import drive_open_loop
from racecraft.worlds.deepracer.evaluation.recompute import walk
from racecraft.worlds.deepracer.evaluation.replay_report import RECORDED_CARS
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace

MOST_FILES = 3
FEWEST_WINDOWS = 20


class RecordedCar(NamedTuple):
    """The car that replays a folder's recordings best."""

    car: str
    """One of RECORDED_CARS."""
    strayed_m: dict[str, float]
    """By car: median distance from the recorded one after a second, m."""
    rows: int
    """Recorded rows that were asked."""


def recorded_car(folder: str | Path) -> RecordedCar | None:
    """Return the car that replays the recordings in a folder best.

    Args:
        folder: Where simulation traces (`*-iteration.csv`) lie, in it or below folders of it that are named after
            traces (`sim-trace`, `training-simtrace`); the MOST_FILES largest are asked.

    Returns:
        None where there are no traces, or too few windows of a second in them to tell.
    """
    traces = []
    for path in _recordings(Path(folder)):
        try:
            traces.append(read_sim_trace(path))
        except LogError:
            continue  # `racecraft replay` names what is wrong with it
    strayed: dict[str, float] = {}
    for car in RECORDED_CARS if traces else ():
        far = np.concatenate([drive_open_loop(trace, walk(trace), car).position_m["1s"] for trace in traces])
        far = far[np.isfinite(far)]
        if len(far) < FEWEST_WINDOWS:
            return None
        strayed[car] = round(float(np.median(far)), 4)
    if not strayed:
        return None
    return RecordedCar(min(strayed, key=strayed.__getitem__), strayed, sum(map(len, traces)))


def _recordings(folder: Path) -> list[Path]:
    """Return the largest traces of a racer's folder; a whole project is not searched."""
    found = list(folder.glob("*-iteration.csv"))
    for child in folder.glob("*trace*"):
        found += child.rglob("*-iteration.csv")
    return sorted(found, key=lambda path: (-path.stat().st_size, path))[:MOST_FILES]
