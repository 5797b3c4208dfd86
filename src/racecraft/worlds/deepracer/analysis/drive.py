"""What one car did, tick by tick: the one shape that films, pictures and tables of laps are made from.

Begin with `as_drive`, which takes what a race world wrote down or rows of an episode file.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.race import STATUSES
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS

if TYPE_CHECKING:
    import polars as pl

LAP_COMPLETE, OFF_TRACK, CRASHED, PAUSE = "lap_complete", "off_track", "crashed", "pause"
STILL_DRIVING = ("in_progress", "prepare", PAUSE)
"""Words of `status` that end nothing."""

WORDS = {
    LAP_COMPLETE: "lap complete",
    OFF_TRACK: "off track",
    CRASHED: "crashed",
    "immobilized": "stood still",
    "reversed": "drove backwards",
    "time_up": "out of time",
    "truncated": "out of time",
}
"""How people say the words of `status` that end something."""


GRIEF = {OFF_TRACK: "left the road", CRASHED: "crashed"}
"""Ways to come to grief, as people say them."""


class DriveError(UserInputError):
    """Rows of which no drive can be made."""


@dataclass(frozen=True, eq=False)
class Drive:
    """T ticks of one car, in order. Metres, radians, seconds; left is positive."""

    x_m: Array
    """(T,) the car's front point, east."""
    y_m: Array
    """(T,) north."""
    yaw_rad: Array
    """(T,) heading, counter-clockwise from east."""
    driven_mps: Array
    """(T,) speed the car had."""
    commanded_mps: Array
    """(T,) speed it was told."""
    steering_rad: Array
    """(T,) wheel angle it was told."""
    progress_percent: Array
    """(T,) of the lap, 0 to 100."""
    lap_seconds: Array
    """(T,) simulated time since the lap began."""
    lap: Array
    """(T,) lap of the drive, counted from 1; an attempt that failed counts."""
    status: Array
    """(T,) words: "in_progress", "lap_complete", "off_track", …"""
    trial: Array | None = None
    """(T,) trial of a judged race, counted from 1; None: it was none."""
    resets: Array | None = None
    """(T,) how often the car was set back so far in this trial."""
    penalty_seconds: Array | None = None
    """(T,) what that has cost so far."""
    boxes: Array | None = None
    """(K, 6) boxes as the last lap met them and bots where it ended: x, y, yaw, half length, half width, height."""

    @classmethod
    def from_reports(cls, reports: Array) -> Drive:
        """Return the drive that a race world wrote down.

        Args:
            reports: TICK_REPORT (T,) of one car, tick after tick.

        Raises:
            DriveError: There are no rows, or they are no reports of one car.
        """
        reports = np.asarray(reports)
        _require(reports.ndim == 1 and reports.dtype.names is not None, f"an array of shape {reports.shape}")
        _require(len(reports) > 0, "no rows")
        status = np.array(STATUSES)[reports["status"]]
        status = np.where(reports["truncated"] & (status != LAP_COMPLETE), "time_up", status)
        return cls(
            x_m=reports["front_x"].copy(),
            y_m=reports["front_y"].copy(),
            yaw_rad=reports["yaw"].copy(),
            driven_mps=reports["driven_speed"].copy(),
            commanded_mps=reports["speed"].copy(),
            steering_rad=reports["steering"].copy(),
            progress_percent=np.clip(reports["progress"], 0.0, 100.0),
            lap_seconds=reports["lap_seconds"].copy(),
            lap=_lap_numbers(status, reports["episode"]),
            status=status,
        )

    @classmethod
    def from_episodes(cls, rows: pl.DataFrame) -> Drive:
        """Return the drive of one car from rows of an episode file, in order (see `formats/episodes.py`).

        Raises:
            DriveError: There are no rows, a column is missing, or the rows are of several cars.
        """
        needed = (
            "episode", "tick", "x_m", "y_m", "yaw_rad", "velocity_mps", "speed_mps", "steering_rad",
            "progress_share", "status",
        )  # fmt: skip
        missing = [name for name in needed if name not in rows.columns]
        _require(not missing, f"rows without {', '.join(missing)}")
        _require(rows.height > 0, "no rows")
        cars = rows["world"].n_unique() if "world" in rows.columns else 1
        _require(cars == 1, f"rows of {cars} cars")
        status = rows["status"].to_numpy().astype(str)
        lap = _lap_numbers(status, rows["episode"].to_numpy())
        numbers = {name: rows[name].to_numpy().astype(np.float64) for name in needed[2:8]}
        return cls(
            x_m=numbers["x_m"],
            y_m=numbers["y_m"],
            yaw_rad=numbers["yaw_rad"],
            driven_mps=numbers["velocity_mps"],
            commanded_mps=numbers["speed_mps"],
            steering_rad=numbers["steering_rad"],
            progress_percent=np.clip(100.0 * rows["progress_share"].to_numpy(), 0.0, 100.0),
            lap_seconds=_seconds_into_lap(lap, rows["tick"].to_numpy(), rows["episode"].to_numpy()),
            lap=lap,
            status=status,
        )

    def __len__(self) -> int:
        return len(self.x_m)

    @property
    def xy(self) -> Array:
        """(T, 2) the front point."""
        return np.column_stack([self.x_m, self.y_m])

    @property
    def poses(self) -> Array:
        """(T, 3) x, y and yaw of base_link, as cameras take them."""
        return np.column_stack(
            [
                self.x_m - FRONT_POINT_M * np.cos(self.yaw_rad),
                self.y_m - FRONT_POINT_M * np.sin(self.yaw_rad),
                self.yaw_rad,
            ]
        )

    @property
    def endings(self) -> Array:
        """(E,) rows at which a lap or an attempt ended."""
        return np.flatnonzero(~np.isin(self.status, STILL_DRIVING))

    @property
    def best_lap_seconds(self) -> float | None:
        """The fastest full lap; None without one."""
        full = self.lap_seconds[self.status == LAP_COMPLETE]
        return float(full.min()) if len(full) else None

    def of_lap(self, number: int) -> Drive:
        """Return the rows of one lap, counted from 1.

        Raises:
            DriveError: There is no such lap.
        """
        rows = self.lap == number
        _require(bool(rows.any()), f"no lap {number} among {int(self.lap.max())}")
        columns = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "boxes"}
        cut: dict[str, Any] = {name: None if column is None else column[rows] for name, column in columns.items()}
        return Drive(**cut, boxes=self.boxes)

    def outcome(self, row: int) -> str:
        """Say how the drive stood at a row that ended something: "lap complete 22.47 s", "off track at 45 %"."""
        words = WORDS.get(str(self.status[row]), str(self.status[row]).replace("_", " "))
        if self.status[row] == LAP_COMPLETE:
            return f"{words} {self.lap_seconds[row]:.2f} s"
        return f"{words} at {self.progress_percent[row]:.0f} %"


def incidents(statuses: Iterable[str]) -> str:
    """Return how cars came to grief, of the words of `status` that there are.

    >>> incidents([CRASHED, OFF_TRACK, OFF_TRACK]), incidents([CRASHED])
    ('left the road or crashed', 'crashed')
    """
    return " or ".join(way for status, way in GRIEF.items() if status in set(statuses))


def as_drive(rows: Drive | Array | pl.DataFrame) -> Drive:
    """Return the drive that rows of either kind tell of; a drive is given back as it is.

    Raises:
        DriveError: No drive can be made of them.
    """
    if isinstance(rows, Drive):
        return rows
    return Drive.from_reports(rows) if isinstance(rows, np.ndarray) else Drive.from_episodes(rows)


def _lap_numbers(status: Array, episode: Array) -> Array:
    """Return which lap every row belongs to: a new one begins after every ending and with every episode."""
    begins = np.zeros(len(status), bool)
    begins[1:] = ~np.isin(status[:-1], STILL_DRIVING) | (episode[1:] != episode[:-1])
    return 1 + np.cumsum(begins)


def _seconds_into_lap(lap: Array, tick: Array, episode: Array) -> Array:
    """Return the time since each row's lap began; a lap that is no standing start began with its first row."""
    first = np.searchsorted(lap, lap)  # row of each lap's beginning
    flying = (first > 0) & (episode[first] == episode[first - 1]) & (tick[first] == tick[first - 1] + 1)
    return TICK_SECONDS * np.where(flying, tick - tick[first] + 1, tick)


def _require(holds: bool, found: str) -> None:
    if not holds:
        raise DriveError(
            "A drive cannot be made of {found}; expected the ticks of one car, in order, as `formats/episodes.py` or "
            "TICK_REPORT has them. Pick one world's rows.",
            found=found,
        )
