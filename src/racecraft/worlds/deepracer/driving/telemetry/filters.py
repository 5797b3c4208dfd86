"""Which laps of a log count. Begin with `LapFilter`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.telemetry.laps import Laps
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps

LINE, REST, FLYING = "line", "rest", "flying"
BEGINNINGS = (LINE, REST, FLYING)
LINE_SHARE = 0.02
"""A lap begins at the start line if it begins within so much of the lap from it."""


@dataclass(frozen=True)
class LapFilter:
    """What a lap must be to count; every condition that is given must hold."""

    phase: str | None = None
    """"training", "evaluation" or "leaderboard"."""
    iterations: tuple[int, int] | None = None
    """First and last iteration, both included, counted as the log counts them."""
    quarter: int | None = None
    """Quarter of the log's episodes, 1 to 4."""
    begins: str | None = None
    """LINE: at the start line; REST: from standstill; FLYING: at speed."""
    within_percent: float | None = None
    """At most so much slower than the fastest of the laps that are left, 0 or more."""
    fastest: int | None = None
    """So many of the laps that are left, the fastest."""
    clean: bool = False
    """The car never left the road in it and was never set back."""
    turn: tuple[int, float] | None = None
    """Number of a corner, and how many seconds its zone takes at most."""
    section: tuple[int, int, float] | None = None
    """First and last waypoint of a section, and how many seconds it takes at most; it may reach over the start line."""
    max_slide_rad: float | None = None
    """The angle between where the car points and where it goes is at most so large."""
    top_speed_mps: float | None = None
    """The car drives so fast somewhere, at least."""
    mean_reward: float | None = None
    """A tick pays so much on average, at least."""

    def __post_init__(self) -> None:
        """Refuse what no lap can be.

        Raises:
            SettingError: A value outside its range.
        """
        if self.begins is not None and self.begins not in BEGINNINGS:
            raise SettingError(
                "--begins is {begins!r}; expected one of {beginnings}.",
                begins=self.begins,
                beginnings=", ".join(BEGINNINGS),
            )
        if self.quarter is not None and not 1 <= self.quarter <= 4:
            raise SettingError("--quarter is {quarter}; expected 1 to 4.", quarter=self.quarter)

    def rows(self, laps: Laps) -> Array:
        """Return the rows of the laps that count, in the log's order."""
        about = laps.about
        counts = np.ones(len(laps), np.bool_)
        if self.phase is not None:
            counts &= (about["phase"] == self.phase).to_numpy()
        if self.iterations is not None:
            counts &= about["iteration"].is_between(*self.iterations).to_numpy()
        if self.quarter is not None:
            counts &= (4 * about["unique_episode"].to_numpy() // max(1, laps.episodes)) + 1 == self.quarter
        if self.begins == LINE:
            share = about["begin_share"].to_numpy()
            counts &= np.minimum(share, 1.0 - share) <= LINE_SHARE
        elif self.begins is not None:
            counts &= about["from_rest"].to_numpy() == (self.begins == REST)
        if self.clean:
            counts &= about["resets"].to_numpy() == 0
        return self._quick(np.flatnonzero(counts & self._driven(laps)), laps.lap_seconds)

    def _driven(self, laps: Laps) -> Array:
        """Tell which laps (L,) were driven as asked.

        Raises:
            SettingError: The track has no such corner.
        """
        counts = np.ones(len(laps), np.bool_)
        if self.top_speed_mps is not None and len(laps):
            counts &= np.nanmax(laps.speed_mps, axis=1) >= self.top_speed_mps
        if self.mean_reward is not None:
            counts &= laps.about["mean_reward"].fill_null(-np.inf).to_numpy() >= self.mean_reward
        if self.max_slide_rad is not None:
            counts &= laps.about["max_slide_rad"].to_numpy() <= self.max_slide_rad
        if self.section is not None:
            first, last, seconds = self.section
            counts &= _section_seconds(laps, first, last) <= seconds
        if self.turn is not None:
            number, most = self.turn
            timing = time_laps(laps)
            if not 1 <= number <= len(timing.corners):
                raise SettingError(
                    "--turn {number}: {track} has {count} corners; expected one of them.",
                    number=number,
                    track=laps.track.name,
                    count=len(timing.corners),
                )
            counts &= timing.zone_seconds[:, number - 1] <= most
        return counts

    def _quick(self, rows: Array, seconds: Array) -> Array:
        """Return those of the rows that are quick enough."""
        if self.within_percent is not None and len(rows):
            rows = rows[seconds[rows] <= seconds[rows].min() * (1.0 + self.within_percent / 100.0) + 1e-9]
        if self.fastest is not None:
            rows = np.sort(rows[np.argsort(seconds[rows], kind="stable")[: self.fastest]])
        return rows


def _section_seconds(laps: Laps, first: int, last: int) -> Array:
    """Return how long each lap takes from one waypoint to another, (L,) s.

    Raises:
        SettingError: The track has no such waypoint.
    """
    waypoints = laps.track.as_filed().centre
    if not (0 <= first < len(waypoints) and 0 <= last < len(waypoints)):
        raise SettingError(
            "--section {first}..{last}: {track} has waypoints 0 to {count}; expected two of them.",
            first=first,
            last=last,
            track=laps.track.name,
            count=len(waypoints) - 1,
        )
    begin, end = laps.track.locate(waypoints[[first, last]]).arc / laps.track.length
    inside = (
        (laps.shares >= begin) & (laps.shares < end) if begin <= end else (laps.shares >= begin) | (laps.shares < end)
    )
    return np.asarray(laps.seconds[:, inside].sum(axis=1))


def read_section(text: str) -> tuple[int, int, float]:
    """Return first and last waypoint and the longest time, s, of "30..50=1.6".

    Raises:
        SettingError: Another form.

    >>> read_section("30..50=1.6")
    (30, 50, 1.6)
    """
    waypoints, _, seconds = text.partition("=")
    first, _, last = waypoints.partition("..")
    try:
        return int(first), int(last), float(seconds)
    except ValueError:
        raise SettingError(
            "--section is {text!r}; expected two waypoints and seconds, such as 30..50=1.6.", text=text
        ) from None


def read_iterations(text: str) -> tuple[int, int]:
    """Return the first and the last iteration of "10..20", "10.." or "10".

    Raises:
        SettingError: Another form, or the last lies before the first.

    >>> read_iterations("10..20"), read_iterations("7")
    ((10, 20), (7, 7))
    """
    first, dots, last = text.partition("..")
    try:
        ends = int(first or 0), (int(last) if last else 2**31 - 1) if dots else int(first)
    except ValueError:
        ends = (1, 0)
    if ends[1] < ends[0] or not text:
        raise SettingError("--iterations is {text!r}; expected a number, or two such as 10..20.", text=text)
    return ends


def read_turn(text: str) -> tuple[int, float]:
    """Return a corner's number and its longest time, s, of "3=1.6".

    Raises:
        SettingError: Another form.

    >>> read_turn("3=1.6")
    (3, 1.6)
    """
    number, _, seconds = text.partition("=")
    try:
        return int(number), float(seconds)
    except ValueError:
        raise SettingError("--turn is {text!r}; expected a corner and seconds, such as 3=1.6.", text=text) from None
