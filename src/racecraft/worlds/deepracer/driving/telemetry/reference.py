"""A lap to compare with: planned, driven, or put together from best zones. Begin with `Reference`."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.action_tables import read_table
from racecraft.worlds.deepracer.driving.known_laps import TABLE, direction_of, read_laps
from racecraft.worlds.deepracer.driving.line_file import COLUMNS
from racecraft.worlds.deepracer.driving.planner import plan_best_lap
from racecraft.worlds.deepracer.driving.telemetry.laps import TRACES, Laps, driven_speed, trace_laps
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.planner import Plan
    from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming
    from racecraft.worlds.deepracer.env.actions import ActionSpace


@dataclass(frozen=True, eq=False)
class Reference:
    """One lap as traces along the lap, N pieces as in `Laps`. What is not known of it is nan."""

    name: str
    """What a sentence calls it: "the best known lap"."""
    lap_seconds: float
    seconds: Array
    metres: Array
    steering_rad: Array
    throttle_mps: Array
    offset_m: Array
    gathering: Array
    """(N,) bool: it stood at its beginning and is still gathering speed."""

    closed: bool = True
    """The track is a loop."""

    @property
    def speed_mps(self) -> Array:
        """(N,) driven speed, as `laps.driven_speed` has it."""
        return driven_speed(self.metres, self.seconds, self.closed)


def of_lap(laps: Laps, row: int, name: str) -> Reference:
    """Return one of the laps."""
    traces = {field: getattr(laps, field)[row] for field in TRACES}
    seconds = float(laps.lap_seconds[row])
    return Reference(name, seconds, gathering=laps.gathering[row], closed=laps.track.closed, **traces)


def of_best_zones(timing: LapTiming) -> Reference:
    """Return the best zones of several laps, put together: nobody drove it in one piece."""
    rows = timing.best_zone_rows[timing.zone_of]
    pieces = np.arange(timing.laps.pieces)
    traces = {field: getattr(timing.laps, field)[rows, pieces] for field in TRACES}
    gathering = timing.laps.gathering[rows, pieces]
    name, seconds = "your own best corners together", float(traces["seconds"].sum())
    return Reference(name, seconds, gathering=gathering, closed=timing.laps.track.closed, **traces)


def of_known_lap(track: Track, car: str, top_speed_mps: float, actions: ActionSpace | None) -> Reference | None:
    """Plan the best known lap again, tick by tick; some seconds of computing.

    Args:
        track: As it was driven.
        car: Vehicle profile, a key of `vehicle.PROFILES`.
        top_speed_mps: The fastest command of the car's actions.
        actions: The car's own, with which a lap is planned where the table of best known laps has none.

    Returns:
        None where the table has no lap and the car's own actions are unknown, or no plan comes round.
    """
    key = (track.name, direction_of(track.is_reversed), car, round(top_speed_mps, 2))
    known = next((lap for lap in read_laps(TABLE) if lap.key == key), None)
    if known is not None:
        name, actions = f"the best known lap ({car}, up to {top_speed_mps:g} m/s)", read_table(known.table)
    else:
        name = f"the planned lap with your own actions ({car})"
    plan = None if actions is None else plan_best_lap(track, PROFILES[car], actions)
    return None if plan is None else of_plan(plan, track, name)


def of_plan(plan: Plan, track: Track, name: str) -> Reference:
    """Return the best flying lap of a plan; of an open track the lap from rest."""
    lap = plan.best_lap
    rows = np.arange(lap.start, min(lap.stop + 1, len(plan.path)))
    x, y, yaw = plan.path[rows, :3].T
    commands = plan.commands[plan.choices[rows]]
    return _one_lap((x, y, yaw), np.arange(len(rows)) * TICK_SECONDS, commands[:, 0], commands[:, 1], track, name)


def of_line_file(path: Path, track: Track) -> Reference:
    """Read a line as `racecraft line --out FILE.csv` writes it.

    Raises:
        InputFileError: The file is no such line; the error names its line.
    """
    rows = []
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        for row in reader:
            try:
                rows.append([float(row[name]) for name in COLUMNS])
            except (KeyError, TypeError, ValueError) as error:
                expected = Message("a number for each of {columns}", columns=", ".join(COLUMNS))
                raise InputFileError(path, Message("the row {row}", row=row), expected, line=reader.line_num) from error
    if len(rows) < 3:
        raise InputFileError(path, Message("{count} points", count=len(rows)), "a line of three points or more")
    x, y, speed, seconds, heading = np.array(rows).T
    if track.closed:
        x, y, speed, heading = (np.append(one, one[0]) for one in (x, y, speed, heading))
        seconds = np.append(seconds, seconds[-1] + np.hypot(x[-1] - x[-2], y[-1] - y[-2]) / max(speed[-1], 0.1))
    return _one_lap((x, y, heading), seconds, np.full(len(x), np.nan), speed, track, f"the line of {path.name}")


def is_line_file(path: Path) -> bool:
    """Tell whether a file begins with the columns of a line."""
    if path.suffix != ".csv" or not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline().strip() == ",".join(COLUMNS)


def _one_lap(
    pose: tuple[Array, Array, Array], seconds: Array, steering: Array, speed: Array, track: Track, name: str
) -> Reference:
    """Return a lap of base_link's poses (x, y, yaw), with what is commanded and the time at each, (T,)."""
    x, y, yaw = pose
    columns = {
        "time_s": seconds, "x_m": x + FRONT_POINT_M * np.cos(yaw), "y_m": y + FRONT_POINT_M * np.sin(yaw),
        "steering_rad": steering, "speed_mps": speed,
    }  # fmt: skip
    traces, _ = trace_laps(columns, np.array([0]), np.array([len(x) - 1]), track)
    lap = {field: traces[field][0] for field in TRACES}
    still = np.zeros(len(lap["seconds"]), np.bool_)
    return Reference(name, float(lap["seconds"].sum()), gathering=still, closed=track.closed, **lap)
