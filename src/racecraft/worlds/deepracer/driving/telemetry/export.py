"""Telemetry for others: plain figures for JSON, and a table of laps as CSV. Begin with `facts_of`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.formats.atomic import write_atomic
from racecraft.worlds.deepracer.driving.telemetry.laps import ORIGIN
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming

if TYPE_CHECKING:
    import polars as pl

VERSION = 1


def facts_of(compared: LapComparison) -> dict[str, Any]:
    """Return everything that a lap's telemetry tells, as plain values; times in s, unknown figures None."""
    timing, reference = compared.timing, compared.reference
    names, laps = lap_names(timing), timing.laps
    order = np.argsort(laps.lap_seconds, kind="stable")
    rows = laps.about.select("phase", "iteration", "episode", "begin_share", "from_rest", "resets").rows(named=True)
    best = float(laps.lap_seconds.min())
    return {
        "version": VERSION,
        "track": laps.track.name,
        "direction": laps.track.direction,
        "track_length_m": round(laps.track.length, 4),
        "episodes": laps.episodes,
        "lap": {"name": names[compared.row], "seconds": round(float(laps.lap_seconds[compared.row]), 4)},
        "reference": {"name": reference.name, "seconds": round(reference.lap_seconds, 4)},
        "lost_seconds": round(compared.lost_seconds, 4),
        "start_seconds": round(compared.start_seconds, 4),
        "advice": compared.advice(),
        "corners": [zone.as_dictionary() for zone in compared.zones],
        "best_sector_seconds": _rounded(timing.best_sector_seconds),
        "theoretical_best_seconds": round(timing.theoretical_best_seconds, 4),
        "median_lap_seconds": round(float(np.median(laps.lap_seconds)), 4),
        "laps": [
            {
                "name": names[row],
                **rows[row],
                "begin_share": round(rows[row]["begin_share"], 4),
                "seconds": round(float(laps.lap_seconds[row]), 4),
                "gap_seconds": round(float(laps.lap_seconds[row]) - best, 4),
                "sector_seconds": _rounded(timing.sector_seconds[row]),
            }
            for row in order.tolist()
        ],
    }


def lap_names(timing: LapTiming) -> list[str]:
    """Return what each lap is called: by iteration, evaluation or race, and episode; by worker and round of several."""
    about, titles = timing.laps.about, timing.laps.titles
    several = {name: about[name].n_unique() > 1 for name in ("round", "worker")}
    several["round"] = several["round"] and not titles
    names = []
    for row in about.select("round", "phase", "stream", "worker", "iteration", "episode").rows(named=True):
        parts = [f"round {row['round']}"] if several["round"] else []
        judged = titles.get(row["round"], f"{row['phase']}{_moment(row['stream'])}")
        parts += [judged] if row["phase"] != "training" else [f"iteration {row['iteration']}"]
        parts += [f"car {row['worker']}"] if several["worker"] else []
        names.append(", ".join([*parts, f"episode {row['episode']}"]))
    return names


def _moment(stream: str) -> str:
    """Return when an evaluation began, of the fourteen digits under which its files stand; "": they have none."""
    if len(stream) != 14 or not stream.isdigit():
        return ""
    return f" of {stream[:4]}-{stream[4:6]}-{stream[6:8]} {stream[8:10]}:{stream[10:12]}"


def lap_table(timing: LapTiming) -> pl.DataFrame:
    """Return a row a lap: where it comes from, `seconds`, `sector_1_s` …, and `turn_1_s` …, the zone of each corner."""
    import polars as pl

    sectors = {f"sector_{k + 1}_s": timing.sector_seconds[:, k] for k in range(timing.sector_seconds.shape[1])}
    turns = {f"turn_{one.number}_s": timing.zone_seconds[:, k] for k, one in enumerate(timing.corners)}
    columns = {name: pl.Series(values).round(4) for name, values in (sectors | turns).items()}
    kept = (*ORIGIN, "iteration", "episode", "begin_share", "from_rest", "resets", "seconds")
    return timing.laps.about.select(kept).with_columns(**columns).sort("seconds", maintain_order=True)


def write_lap_table(path: Path, timing: LapTiming) -> None:
    """Write `lap_table` as CSV.

    Raises:
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, lap_table(timing).write_csv())


def _rounded(values: Any) -> list[float]:
    return [round(float(value), 4) for value in values]
