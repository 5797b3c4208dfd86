"""Lines for the planner to follow: the solver's where CasADi is installed, else classical ones. Begin with `guides`."""

from __future__ import annotations

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.worlds.deepracer.driving.lines import SPACING_M, least_bend
from racecraft.worlds.deepracer.driving.profile import with_speeds
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.road_frame import road_frame
from racecraft.worlds.deepracer.driving.solver import solve_line
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace
from racecraft.worlds.deepracer.env.vehicle import MAX_SPEED_MPS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

LENGTH_PRICES = (0.01, 0.1, 0.3)
"""Prices of length tried where there is no solver; which gives the best lap depends on car and track."""
SLACK_MPS = 0.2
"""A table counts as equally fast at all angles where its top speeds differ by no more."""


def guides(track: Track, car: CarProfile, actions: ActionSpace) -> list[RacingLine]:
    """Return lines to plan along, the most promising first.

    A guide knows one top speed. For a table that is slower at large angles there is one for each of its two ends.
    """
    speeds = top_speeds(actions)
    ends = [speeds.max()] if np.ptp(speeds) <= SLACK_MPS else [speeds.max(), speeds.min()]
    slowest = actions.speed[0] if isinstance(actions, ActionBox) else min(actions.speed)
    return [line for top_speed in ends for line in _guides(track, car, float(top_speed), slowest)]


def top_speeds(actions: ActionSpace) -> np.ndarray:
    """Return the largest speed command at each angle of an action space, m/s."""
    if isinstance(actions, ActionBox):
        return np.minimum(np.array([actions.speed[1]]), MAX_SPEED_MPS)
    angles, speeds = np.round(actions.steering, 4), np.minimum(actions.speed, MAX_SPEED_MPS)
    return np.array([speeds[angles == angle].max() for angle in np.unique(angles)])


def _guides(track: Track, car: CarProfile, top_speed: float, slowest: float) -> list[RacingLine]:
    try:
        return [solve_line(track, car, top_speed, slowest)]
    except (MissingExtraError, ArithmeticError):
        frame = road_frame(track, SPACING_M)
        lines = [with_speeds(frame, least_bend(frame, price), car, top_speed) for price in LENGTH_PRICES]
        return sorted(lines, key=lambda line: line.lap_seconds)
