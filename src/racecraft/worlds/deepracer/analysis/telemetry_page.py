"""A lap's telemetry as a page: map with ghosts, traces, corners, laps. Begin with `telemetry_data`.

The parts stand in `pages/templates/telemetry_parts.html`; the console shows the same ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.analysis.plot import PlotError
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.pages.chart import Chart, Level, Mark, Series
from racecraft.pages.render import render_file
from racecraft.worlds.deepracer.analysis.ghosts import drive_of
from racecraft.worlds.deepracer.analysis.logs.sequences import action_sequences
from racecraft.worlds.deepracer.analysis.telemetry_map import lap_map, moving_cars
from racecraft.worlds.deepracer.driving.telemetry.export import lap_names
from racecraft.worlds.deepracer.driving.telemetry.laps import Laps
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison

TEMPLATE = "racecraft.worlds.deepracer.pages/telemetry.html"
SHOWN_LAPS = 12
SHOWN_SEQUENCES = 8
MAX_POINTS = 400
DISTANCE = "distance, m"
"""Name of the x axis of all traces; charts with the same one share their cursor."""
CORNER_HEADS = ("corner", "lap, s", "reference, s", "lost, s", "slowest, m/s", "reference, m/s", "apex, cm",
                "reference, cm")  # fmt: skip
CORNER_WORDS = (
    "A corner's time runs from 1 m before it to the next one. Apex: how far inside the centre line the car comes."
)
STEADY_HEADS = ("corner", "best, s", "spread, s", "with the lap")
STEADY_WORDS = (
    "Spread: half of all laps lie within so much of each other. With the lap: correlation of the time here with the "
    "time of the lap; near 1, slow laps are slow here."
)


def write_telemetry_page(path: Path, compared: LapComparison, title: str) -> None:
    """Write a page that is one file and works offline.

    Args:
        path: The file, .html.
        compared: The lap and its reference.
        title: The headline.

    Raises:
        OutputFileError: The place cannot be written.
    """
    data = telemetry_data(compared)
    write_atomic(path, render_file(TEMPLATE, title=title, about=data["about"], told=data))


def telemetry_data(compared: LapComparison) -> dict[str, Any]:
    """Return what the parts of `telemetry_parts.html` show, as plain values."""
    timing = compared.timing
    laps, names = timing.laps, lap_names(timing)
    of_laps = f"{len(laps):,} full lap{'s' if len(laps) != 1 else ''} of {laps.episodes:,} episodes"
    return {
        "about": f"{laps.track.title or laps.track.name}, {of_laps}",
        "lap_name": f"{compared.lap.lap_seconds:.2f} s: {names[compared.row]}",
        "reference_name": f"{compared.reference.name}, {compared.reference.lap_seconds:.2f} s",
        "gap": f"{compared.lost_seconds:+.2f} s",
        "advice": compared.advice(),
        "map": lap_map(compared),
        "ghosts": _ghosts(compared),
        "traces": [chart.shown() for chart in _traces(compared)],
        "corners": corner_table(compared),
        "steady": steady_table(compared),
        "laps": lap_table(compared, names),
        "steadiness": _steadiness(compared).shown(),
        "sequences": _sequences(compared),
    }


def _ghosts(compared: LapComparison) -> dict[str, Any]:
    """Return the reference and the lap as moving cars, and how far the lap is along the track at each tick, m."""
    track = compared.timing.laps.track
    moving = moving_cars([compared.reference, compared.lap], track)
    progress = drive_of(compared.lap, track, moving["ticks"]).progress_percent / 100.0
    return moving | {"metres": [round(one, 2) for one in (progress * track.length).tolist()]}


def _traces(compared: LapComparison) -> list[Chart]:
    lap, other = compared.lap, compared.reference
    laps = compared.timing.laps
    rows = np.unique(np.linspace(0, laps.pieces - 1, min(MAX_POINTS, laps.pieces)).round().astype(int))
    metres = (laps.shares * laps.track.length)[rows]
    marks = tuple(_marks(compared))

    def both(mine: Array, theirs: Array, look: Any = "line") -> list[Series]:
        series = [Series("this lap", metres, mine[rows], look, colour=1)]
        if np.isfinite(theirs).any():
            series.append(Series("reference", metres, theirs[rows], "dashed", colour=6))
        return series

    lost = [Series("time lost", metres, compared.delta_seconds[rows], colour=2)]
    return [
        Chart("Time lost", DISTANCE, "s", lost, marks=marks, levels=[Level(0.0, "reference")]),
        Chart("Speed, driven", DISTANCE, "m/s", both(lap.speed_mps, other.speed_mps), marks=marks, low=0.0),
        Chart("Throttle: commanded speed", DISTANCE, "m/s", both(lap.throttle_mps, other.throttle_mps, "steps"),
              marks=marks, low=0.0),
        Chart("Steering: commanded angle, left positive", DISTANCE, "°",
              both(np.degrees(lap.steering_rad), np.degrees(other.steering_rad), "steps"), marks=marks, digits=0),
    ]  # fmt: skip


def _marks(compared: LapComparison) -> list[Mark]:
    """Return the corners as regions; one across the start line as two."""
    length, marks = compared.timing.laps.track.length, []
    for corner in compared.timing.corners:
        ends = [(corner.begin, corner.end)] if corner.begin < corner.end else [(corner.begin, 1.0), (0.0, corner.end)]
        marks += [Mark(begin * length, str(corner.number), end * length) for begin, end in ends]
    return marks


def corner_table(compared: LapComparison) -> dict[str, Any]:
    """Return the lap beside the reference, a row a corner, and what the standing start costs."""
    rows: list[tuple[str, ...]] = [
        (
            zone.name, _figure(zone.seconds), _figure(zone.reference_seconds), _figure(zone.lost_seconds, "+.2f"),
            _figure(zone.slowest_mps, ".1f"), _figure(zone.reference_slowest_mps, ".1f"),
            _figure(100.0 * zone.apex_metres, ".0f"), _figure(100.0 * zone.reference_apex_metres, ".0f"),
        )
        for zone in compared.zones
    ]  # fmt: skip
    if compared.start_seconds:
        blank = ("",) * (len(CORNER_HEADS) - 4)
        rows.append(("standing start", "", "", _figure(compared.start_seconds, "+.2f"), *blank))
    return {"heads": CORNER_HEADS, "rows": rows, "words": CORNER_WORDS}


def steady_table(compared: LapComparison) -> dict[str, Any]:
    """Return how steadily all laps drive each corner."""
    rows = [
        (zone.name, _figure(zone.best_seconds), _figure(zone.spread_seconds), _figure(zone.correlation, "+.2f"))
        for zone in compared.zones
    ]
    return {"heads": STEADY_HEADS, "rows": rows, "words": STEADY_WORDS}


def lap_table(compared: LapComparison, names: Sequence[str], shown: Sequence[int] | None = None) -> dict[str, Any]:
    """Return laps with their sectors, each with whether it is the best of all; they lead nowhere yet.

    Args:
        compared: All laps.
        names: Of each.
        shown: Rows of laps, in order; None: the SHOWN_LAPS fastest.
    """
    timing = compared.timing
    seconds, best = timing.laps.lap_seconds, timing.best_sector_seconds
    rows_shown = np.argsort(seconds, kind="stable")[:SHOWN_LAPS].tolist() if shown is None else shown
    rows = [
        {
            "name": names[row],
            "here": row == compared.row,
            "href": "",
            "sectors": [(f"{one:.2f}", one <= least + 1e-9) for one, least in zip(sectors, best.tolist(), strict=True)],
            "time": f"{seconds[row]:.2f}",
            "gap": f"{seconds[row] - seconds.min():+.2f}",
        }
        for row, sectors in ((row, timing.sector_seconds[row].tolist()) for row in rows_shown)
    ]
    theoretical = timing.theoretical_best_seconds
    return {
        "heads": ["lap", *(f"sector {k + 1}" for k in range(len(best))), "time", "gap"],
        "rows": rows,
        "best": [f"{one:.2f}" for one in best],
        "theoretical": f"{theoretical:.2f}",
        "theoretical_gap": f"{theoretical - seconds.min():+.2f}",
        "words": f"Seconds. The {SHOWN_LAPS} fastest of {len(seconds):,} laps."
        if shown is None and len(seconds) > SHOWN_LAPS
        else "Seconds.",
    }


def _steadiness(compared: LapComparison) -> Chart:
    """Return every lap in the order of the log."""
    timing = compared.timing
    seconds = timing.laps.lap_seconds
    place = list(range(1, len(seconds) + 1))
    levels = [Level(timing.theoretical_best_seconds, "best sectors together")]
    return Chart("How steady are the laps?", "lap, in the order of the log", "lap time, s",
                 [Series("laps", place, seconds.tolist(), "dots", colour=1)], levels=levels)  # fmt: skip


def frequent_sequences(laps: Laps) -> list[dict[str, Any]]:
    """Return the most frequent four actions in a row of these laps: names, count, share, mean_reward of a tick."""
    wanted = laps.about["unique_episode"].unique().implode()
    try:
        found = action_sequences(
            laps.ticks.filter(laps.ticks["unique_episode"].is_in(wanted)), most=SHOWN_SEQUENCES
        ).data
    except PlotError:
        return []
    return found.select("names", "count", "share", "mean_reward").rows(named=True)


def _sequences(compared: LapComparison) -> dict[str, Any]:
    sequences = frequent_sequences(compared.timing.laps)
    rows = [(one["names"], f"{one['count']:,}", f"{100 * one['share']:.1f} %") for one in sequences]
    return {"heads": ("four actions in a row", "times", "share"), "rows": rows}


def _figure(value: float, form: str = ".2f") -> str:
    return f"{value:{form}}" if np.isfinite(value) else "–"
