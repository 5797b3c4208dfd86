"""Slips of sign, found by changing one parameter at a time on driven laps. Begin with `probe`.

A probe pays the same rows twice, once as they were driven and once with one thing changed everywhere; each time a fresh
copy answers, so a reward that keeps state is asked the same story twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.findings import FAULT, NOTE, Finding
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.poses import place_on_road, reports_of
from racecraft.worlds.deepracer.driving.reward.stock import Drive
from racecraft.worlds.deepracer.tracks.track import Track

MOST = 0.9
"""A slip is told when so large a share of the rows that change at all change the wrong way."""
FEW = 0.05
"""And when at least so large a share of the rows changes."""
ROWS = 120
LATE_TICKS, LATE_PROGRESS = 300.0, 40.0

OFF_ROAD = Finding(
    FAULT, "sign", "a car beside the road is paid more than one on it",
    "Look for a sign that is turned, or a `not` that is missing.",
)  # fmt: skip
WHEELS = Finding(
    FAULT, "sign", "a car with a wheel off the track is paid more than one with all wheels on it",
    "`all_wheels_on_track` is true while the car is on the road.",
)  # fmt: skip
CENTRE = Finding(
    FAULT, "sign", "the farther from the centre line, the more is paid, right up to the border",
    "`distance_from_center` is 0 on the centre line and grows to both sides.",
)  # fmt: skip
SPEED = Finding(
    FAULT, "sign", "the faster the command, the less is paid, at every speed from 0.8 to 4 m/s",
    "Look for a sign that is turned, or a comparison the wrong way round.",
)  # fmt: skip
HEADING = Finding(
    FAULT, "heading", "a car that looks across the road or back is paid more than one that looks along it",
    "`heading` is in degrees from -180 to 180; compare it with `math.degrees(math.atan2(dy, dx))`.",
)  # fmt: skip
WRAP = Finding(
    FAULT, "heading", "near 180 degrees the pay of a car that looks along the road drops from {:.3g} to {:.3g}",
    "A difference of two directions needs wrapping: `(a - b + 180) % 360 - 180`.",
)  # fmt: skip
TIME = Finding(
    FAULT, "time", "the same moment is paid more the later it comes, so the car is paid for taking its time",
    "`steps` and `sim_time` only grow: divide by them, or take something away for them.",
)  # fmt: skip
PAST = Finding(
    NOTE, "past", "the same moment is paid more the farther the car has come: it is paid for its past, and single "
    "actions are hard to tell apart", "Pay for what was gained since the last call, as the sample metres_gained does.",
)  # fmt: skip


class Probes:
    """The laps that are changed, and what they pay as they were driven.

    Args:
        fresh: Returns a fresh copy of the reward function.
        laps: Laps of one track.
    """

    def __init__(self, fresh: Callable[[], Payer], laps: list[Drive]) -> None:
        self._fresh, self._track = fresh, laps[0].track
        self._rows = np.concatenate([lap.reports[:ROWS] for lap in laps])
        self._as_driven = self._pay(self._rows)

    def findings(self) -> list[Finding]:
        """Return every slip."""
        return [found for probe in (
            self._off_road, self._wheels, self._centre, self._speed, self._heading, self._wrap, self._time, self._past,
        ) if (found := probe()) is not None]  # fmt: skip

    def _pay(self, rows: Array) -> Array:
        return self._fresh().compute_rewards(self._track, rows).rewards

    def _changed(self, **values: Array | float | bool) -> Array:
        rows = self._rows.copy()
        for name, value in values.items():
            rows[name] = value
        return self._pay(rows)

    def _rises(self, more: Array, less: Array) -> bool:
        """Tell whether the first pays more than the second, in nearly all rows in which they differ."""
        gain = more - less
        gain = gain[np.isfinite(gain)]
        size = max(float(np.abs(self._as_driven[np.isfinite(self._as_driven)]).max(initial=0.0)), 1e-9)
        differs = np.abs(gain) > 1e-6 * size
        return bool(differs.mean() >= FEW and (gain[differs] > 0).mean() >= MOST)

    def _off_road(self) -> Finding | None:
        width = self._rows["track_width"]
        beside = self._changed(is_off=True, all_wheels_on=False, centre_distance=0.8 * width)
        on = self._changed(is_off=False, all_wheels_on=True, centre_distance=0.1 * width)
        if not self._rises(beside, on):
            return None
        return OFF_ROAD

    def _wheels(self) -> Finding | None:
        if not self._rises(self._changed(all_wheels_on=False), self._changed(all_wheels_on=True)):
            return None
        return WHEELS

    def _centre(self) -> Finding | None:
        width = self._rows["track_width"]
        shares = (0.05, 0.2, 0.35, 0.45)
        paid = [self._changed(centre_distance=share * width) for share in shares]
        if not all(not self._rises(near, far) for near, far in zip(paid, paid[1:], strict=False)):
            return None
        if not self._rises(paid[-1], paid[0]):
            return None
        return CENTRE

    def _speed(self) -> Finding | None:
        speeds = (0.8, 1.5, 2.2, 3.0, 4.0)
        paid = [self._changed(speed=speed) for speed in speeds]
        if not self._rises(paid[0], paid[-1]) or any(
            self._rises(fast, slow) for slow, fast in zip(paid, paid[1:], strict=False)
        ):
            return None
        return SPEED

    def _heading(self) -> Finding | None:
        paid = {turn: self._headed(np.radians(turn), 60) for turn in (0.0, 90.0, -90.0, 180.0)}
        along = float(np.nanmean(paid[0.0]))
        wrong = max(float(np.nanmean(paid[turn])) for turn in (90.0, -90.0, 180.0))
        if not np.isfinite(along) or wrong <= along + 0.05 * abs(along) + 1e-9:
            return None
        return HEADING

    def _wrap(self) -> Finding | None:
        """Place cars where heading and road lie on both sides of 180 degrees, and where they do not."""
        crossing: list[tuple[float, float]] = []
        plain: list[tuple[float, float]] = []
        for arc in np.linspace(0.0, self._track.length, 240, endpoint=False):
            road = np.degrees(self._track.pose_at(arc).yaw)
            for turn in (-6.0, 6.0):
                if abs(road) > 150.0:
                    (crossing if abs(road + turn) > 180.0 else plain).append((arc, np.radians(turn)))
        if min(len(crossing), len(plain)) < 4:
            return None
        means = [float(np.nanmean(self._at(places))) for places in (crossing, plain)]
        straight = float(np.nanmean(self._headed(0.0, 60)))
        if not np.isfinite(means).all() or means[0] >= means[1] - 0.25 * abs(means[1]) or straight <= 0.0:
            return None
        return replace(WRAP, text=WRAP.text.format(*means[::-1]))

    def _time(self) -> Finding | None:
        late = self._changed(steps=self._rows["steps"] + LATE_TICKS, time=self._rows["time"] + LATE_TICKS / 15.0)
        if not self._rises(late, self._as_driven):
            return None
        return TIME

    def _past(self) -> Finding | None:
        far = self._changed(progress=np.minimum(self._rows["progress"] + LATE_PROGRESS, 99.9))
        if not self._rises(far, self._as_driven):
            return None
        return PAST

    def _headed(self, turn: float, count: int) -> Array:
        return self._at([(arc, turn) for arc in np.linspace(0.0, self._track.length, count, endpoint=False)])

    def _at(self, places: list[tuple[float, float]]) -> Array:
        arcs, turns = np.array(places).T
        return self._fresh().compute_rewards(self._track, _standing(self._track, arcs, turns)).rewards


def probe(fresh: Callable[[], Payer], stock: tuple[Drive, ...]) -> list[Finding]:
    """Return the slips of sign of a reward function, tried on a slow, a middling and a fast lap of the first track.

    Args:
        fresh: Returns a fresh copy of it.
        stock: The drives.
    """
    laps = [drive for drive in stock if drive.is_lap and drive.track is stock[0].track]
    return Probes(fresh, [laps[0], laps[len(laps) // 2], laps[-4]]).findings()


def _standing(track: Track, arcs: Array, turns: Array) -> Array:
    """Return rows of cars on the centre line, each at a place of its own, along the road but for a turn (rad)."""
    return reports_of(track, place_on_road(track, arcs, np.zeros(len(arcs)), turns, 0.0, 1.5))
