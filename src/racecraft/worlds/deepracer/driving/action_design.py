"""Design the action table that loses least time on one track or several. Begin with `design_table`.

A few candidates of at most the asked size are planned on every track, and the one with the least mean loss is kept:
grids of angles and speeds, and the centres of what the tracks' lines ask for. A loss is measured against the best
candidate on that track.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.worlds.deepracer.driving.demand import needed_commands
from racecraft.worlds.deepracer.driving.guides import guides
from racecraft.worlds.deepracer.driving.planner import plan_best_lap
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, ActionTable
from racecraft.worlds.deepracer.env.vehicle import MAX_STEERING_RAD, MIN_SPEED_MPS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

BEAM = 100
STRAIGHT_SHARE, SLOW_QUANTILE = 0.9, 0.02
"""The slowest speed is this share of the speed that a line falls below at this share of its length."""
CLUSTER_ROUNDS = 40


@dataclass(frozen=True, eq=False)
class Design:
    """A table or two ranges, and what they allow."""

    actions: ActionSpace
    laps: tuple[float | None, ...]
    """The best lap planned on each track, s; None where none was found."""
    demand: np.ndarray
    """(P, 2) wheel angle (rad) and speed command (m/s) that the tracks' lines ask for."""
    tried: int
    """How many candidates were planned."""


def design_table(tracks: list[Track], car: CarProfile, top_speed: float, count: int) -> Design | None:
    """Return the best discrete table of at most `count` actions; None where no candidate laps every track.

    Args:
        tracks: In driving direction.
        car: How the car answers.
        top_speed: Fastest command, m/s.
        count: Largest number of actions, 4 or more.
    """
    demand, lines = _demand(tracks, car, _every_command(top_speed))
    return _best(_candidates(demand, top_speed, count), tracks, car, lines, demand)


def design_ranges(tracks: list[Track], car: CarProfile, top_speed: float) -> Design | None:
    """Return the continuous ranges that the tracks ask for; arguments as for `design_table`."""
    demand, lines = _demand(tracks, car, _every_command(top_speed))
    angle = min(MAX_STEERING_RAD, math.radians(math.ceil(math.degrees(np.abs(demand[:, 0]).max()) * 1.2)))
    slow = _slowest(demand, top_speed)
    return _best([ActionBox((-angle, angle), (slow, top_speed))], tracks, car, lines, demand)


def evaluate_table(tracks: list[Track], car: CarProfile, actions: ActionSpace) -> Design:
    """Return what a given table allows on the tracks."""
    demand, lines = _demand(tracks, car, actions)
    return Design(actions, _laps(tracks, car, actions, lines), demand, 1)


def _every_command(top_speed: float) -> ActionBox:
    return ActionBox((-MAX_STEERING_RAD, MAX_STEERING_RAD), (MIN_SPEED_MPS, top_speed))


def _demand(tracks: list[Track], car: CarProfile, actions: ActionSpace) -> tuple[np.ndarray, list[list[RacingLine]]]:
    """Return what the best guide of each track asks for, and the guides."""
    lines = [guides(track, car, actions) for track in tracks]
    return np.concatenate([needed_commands(car, every[0]) for every in lines]), lines


def _slowest(demand: np.ndarray, top_speed: float) -> float:
    slow = STRAIGHT_SHARE * float(np.quantile(demand[:, 1], SLOW_QUANTILE))
    return round(min(max(slow, MIN_SPEED_MPS), 0.6 * top_speed), 1)


def _candidates(demand: np.ndarray, top_speed: float, count: int) -> list[ActionSpace]:
    """Return grids of odd numbers of angles by two and three speeds, and a table around what is asked for."""
    slow = _slowest(demand, top_speed)
    middle = round(0.5 * (slow + top_speed), 1)
    found: list[ActionSpace] = []
    for speeds in ((slow, top_speed), (slow, middle, top_speed)):
        angles = min(13, count // len(speeds))
        angles -= 1 - angles % 2
        if angles >= 3:
            found.append(_table([(a, v) for a in np.linspace(-1, 1, angles) * MAX_STEERING_RAD for v in speeds]))
    if count >= 5:
        found.append(_table(_clusters(demand, slow, top_speed, count)))
    return found or [_table([(a, v) for a in (-MAX_STEERING_RAD, MAX_STEERING_RAD) for v in (slow, top_speed)])]


def _clusters(demand: np.ndarray, slow: float, top_speed: float, count: int) -> list[tuple[float, float]]:
    """Return straight ahead, both full locks slow, and pairs of mirrored centres of what is asked for (k-means)."""
    fixed = [(0.0, top_speed), (-MAX_STEERING_RAD, slow), (MAX_STEERING_RAD, slow)]
    scale = np.array([MAX_STEERING_RAD, top_speed])
    points = np.abs(demand) / scale
    centres = np.linspace(points.min(axis=0), points.max(axis=0), (count - len(fixed)) // 2 + 2)[1:-1]
    for _ in range(CLUSTER_ROUNDS):
        nearest = ((points[:, None] - centres[None]) ** 2).sum(axis=2).argmin(axis=1)
        means = [points[nearest == k].mean(axis=0) if (nearest == k).any() else one for k, one in enumerate(centres)]
        centres = np.array(means)
    return fixed + [(side * angle, speed) for angle, speed in centres * scale for side in (-1.0, 1.0)]


def _table(pairs: list[tuple[float, float]]) -> ActionTable:
    """Return a table from right to left, slow before fast, in whole degrees and tenths of m/s."""
    rounded = {(math.radians(round(math.degrees(angle))), round(float(speed), 1)) for angle, speed in pairs}
    return ActionTable.of(sorted(rounded))


def _laps(
    tracks: list[Track], car: CarProfile, actions: ActionSpace, lines: list[list[RacingLine]]
) -> tuple[float | None, ...]:
    plans = [
        plan_best_lap(track, car, actions, every, refinements=1, beam=BEAM)
        for track, every in zip(tracks, lines, strict=True)
    ]
    return tuple(None if plan is None else plan.lap_seconds for plan in plans)


def _best(
    candidates: Sequence[ActionSpace], tracks: list[Track], car: CarProfile, lines: list[list[RacingLine]],
    demand: np.ndarray,
) -> Design | None:  # fmt: skip
    """Plan every candidate on every track; of those that lap all, return the one with the least mean loss."""
    laps = [_laps(tracks, car, actions, lines) for actions in candidates]
    times = np.array([[math.inf if lap is None else lap for lap in row] for row in laps])
    if not np.isfinite(times).all(axis=1).any():
        return None
    best = times.min(axis=0)
    loss = (times / best).mean(axis=1)
    winner = int(np.argmin(loss))
    return Design(candidates[winner], laps[winner], demand, len(candidates))
