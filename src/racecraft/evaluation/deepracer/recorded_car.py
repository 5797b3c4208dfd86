"""Which car drove, told from a racer's recordings alone. Begin with `recorded_car`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from racecraft.evaluation.deepracer.open_loop import drive_open_loop
from racecraft.evaluation.deepracer.recompute import walk
from racecraft.evaluation.deepracer.replay_report import RECORDED_CARS
from racecraft.formats.aws.sim_trace import SimTraceError, read_sim_trace

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
        folder: Where simulation traces (`*-iteration.csv`) lie, at any depth; the MOST_FILES largest are asked.

    Returns:
        None where there are no traces, or too few windows of a second in them to tell.
    """
    paths = sorted(Path(folder).rglob("*-iteration.csv"), key=lambda path: (-path.stat().st_size, path))
    traces = []
    for path in paths[:MOST_FILES]:
        try:
            traces.append(read_sim_trace(path))
        except SimTraceError:
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
