"""The laps of a car's run: where one loses time, and its traces beside a reference. Begin with `laps_page`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.pages.chart import Chart, Mark, Series
from racecraft.worlds.deepracer.analysis.ghosts import on_road
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.driving.telemetry.export import facts_of, lap_names
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison, compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_best_zones, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming, time_laps
from racecraft.worlds.deepracer.logs import read

SHOWN = 20
"""Laps in the table, the fastest first."""
ZONES = "zones"
"""What a lap is compared with where nothing is named: the best corners of all laps together."""
SPEEDS = 5
"""Colours of the lap on the map, from slow to fast."""
EVERY = 3
"""Pieces of the lap that are one line on the map."""


def laps_page(run: Path, asked: Mapping[str, str]) -> dict[str, Any]:
    """Return what the page of a run's laps shows.

    Args:
        run: The run folder.
        asked: `lap`, counted from 1, the fastest first; `against`: ZONES, or the number of another lap.

    Raises:
        SettingError: There is no such lap.
        UserInputError: The run's track or log cannot be read.
    """
    timing = _timing(str(run), _mark(run))
    if timing is None:
        return {"laps": [], "comparison": None}
    order = np.argsort(timing.laps.lap_seconds, kind="stable")
    lap, against = _number(asked.get("lap", "1"), len(order)), asked.get("against", ZONES)
    compared = compare_lap(timing, int(order[lap - 1]), _reference(timing, order, against))
    names = lap_names(timing)
    best = timing.best_sector_seconds
    return {
        "laps": [
            {
                "number": number,
                "name": names[row],
                "seconds": float(timing.laps.lap_seconds[row]),
                "sectors": [
                    {"seconds": float(time), "best": bool(time <= best[k] + 1e-9)}
                    for k, time in enumerate(timing.sector_seconds[row])
                ],
                "from_rest": bool(timing.laps.about["from_rest"][int(row)]),
                "here": number == lap,
            }
            for number, row in enumerate(order[:SHOWN], 1)
        ],
        "count": len(order),
        "theoretical_best": timing.theoretical_best_seconds,
        "against": against,
        "lap": lap,
        "comparison": facts_of(compared),
        "map": _map(compared),
        "charts": [(chart.title, chart.shown()) for chart in _charts(compared)],
    }


def _mark(run: Path) -> float:
    """Return when the run's episodes last changed: laps are read again then."""
    try:
        return (run / "episodes").stat().st_mtime
    except OSError:
        return 0.0


@lru_cache(maxsize=8)
def _timing(run: str, mark: float) -> LapTiming | None:
    """Return a run's full laps with their times; None where there is none."""
    track = track_of(RunFolder(Path(run)).read_job())
    if track is None or not any((Path(run) / "episodes").glob("*.parquet")):
        return None
    laps = find_laps(read([Path(run)]).require_ticks(), track)
    return time_laps(laps) if len(laps) else None


def _number(text: str, count: int) -> int:
    if not text.isdigit() or not 1 <= int(text) <= count:
        raise SettingError("lap is {text!r}; expected 1 to {count}, the fastest first.", text=text[:20], count=count)
    return int(text)


def _reference(timing: LapTiming, order: Array, against: str) -> Reference:
    if against == ZONES:
        return of_best_zones(timing)
    row = int(order[_number(against, len(order)) - 1])
    return of_lap(timing.laps, row, f"lap {against}")


def _charts(compared: LapComparison) -> list[Chart]:
    """Return time lost, speed and steering over the lap."""
    lap, other, length = compared.lap, compared.reference, compared.timing.laps.track.length
    metres = compared.timing.laps.shares * length
    marks = [
        Mark(corner.begin * length, str(corner.number), corner.end * length)
        for corner in compared.timing.corners
        if corner.begin < corner.end
    ]
    x = "distance, m"

    def pair(title: str, y: str, ours: Array, theirs: Array) -> Chart:
        series = [Series("this lap", metres, ours, colour=1), Series(other.name, metres, theirs, "dashed", colour=2)]
        return Chart(title, x, y, series, marks=marks)

    lost = [Series("time lost", metres, compared.delta_seconds, colour=1)]
    return [
        Chart("Time lost", x, "s", lost, marks=marks),
        pair("Speed", "m/s", lap.speed_mps, other.speed_mps),
        pair("Steering", "degrees, left positive", np.degrees(lap.steering_rad), np.degrees(other.steering_rad)),
    ]


def _map(compared: LapComparison) -> dict[str, Any]:
    """Return the track, the lap as lines by speed, and the reference, in metres: x east, y south, as SVG has it."""
    laps = compared.timing.laps
    track, lap = laps.track, compared.lap
    points = on_road(lap.offset_m, track)
    speed = np.nan_to_num(lap.speed_mps)
    low, high = (float(one) for one in np.percentile(speed, (5, 95)))
    step = np.clip(((speed - low) / max(high - low, 1e-9) * SPEEDS).astype(int), 0, SPEEDS - 1)
    lines = [
        {"colour": int(step[k]) + 1, "points": _text(points[k : k + EVERY + 1])} for k in range(0, len(points), EVERY)
    ]
    x0, y0, x1, y1 = track.bounds
    return {
        "view": f"{x0 - 0.4:.2f} {-y1 - 0.4:.2f} {x1 - x0 + 0.8:.2f} {y1 - y0 + 0.8:.2f}",
        "road": [_text(track.outer), _text(track.inner)],
        "lap": lines,
        "reference": _text(on_road(compared.reference.offset_m, track)),
        "low": low,
        "high": high,
        "corners": [
            {"number": corner.number, "x": float(at[0]), "y": -float(at[1])}
            for corner in compared.timing.corners
            for at in [points[int(corner.begin * len(points)) % len(points)]]
        ],
        "title": track.title or track.name,
    }


def _text(points: Array) -> str:
    return " ".join(f"{x:.2f},{-y:.2f}" for x, y in points)
