"""How calmly a car steers: by how much its command changes, and how often it changes sides. See `smoothness_of`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

STRAIGHT = np.radians(4.0)
"""Angles up to here (rad) are straight ahead: a car of continuous actions hardly ever steers by exactly nothing."""


class Smoothness(NamedTuple):
    """The steering commands of a drive in two figures."""

    change_rad_per_second: float
    """Mean size of the change of the commanded angle, rad/s."""
    turns_share: float
    """Share of ticks in which the car begins to steer to the other side than it last did, 0 to 1; angles up to
    STRAIGHT are no side."""

    def __str__(self) -> str:
        """Return the figures as a racer reads them.

        >>> str(Smoothness(0.9425, 0.021))
        'steering changes 54°/s; 2.1 % of ticks turn its sign'
        """
        degrees = np.degrees(self.change_rad_per_second)
        return f"steering changes {degrees:.0f}°/s; {100 * self.turns_share:.1f} % of ticks turn its sign"

    def as_dictionary(self) -> dict[str, float]:
        """Return the figures as plain values, fit for JSON."""
        return {
            "steering_change_degrees_per_second": round(float(np.degrees(self.change_rad_per_second)), 2),
            "steering_sign_turns_share": round(self.turns_share, 4),
        }


def smoothness_of(reports: Array) -> Smoothness | None:
    """Return how calmly a car steered.

    Args:
        reports: TICK_REPORT (T,) of one car, tick after tick. Ticks in which it is held count nothing, and nothing is
            compared across episodes.

    Returns:
        None where no two ticks follow each other.
    """
    driven = ~np.isin(reports["status"], (race.PREPARE, race.PARK, race.PAUSE))
    follows = driven[1:] & driven[:-1] & (np.diff(reports["episode"]) == 0) & (np.diff(reports["steps"]) == 1)
    return smoothness_of_commands(reports["steering"], follows)


def smoothness_of_commands(steering_rad: Array, follows: Array) -> Smoothness | None:
    """Return how calm a row of steering commands is.

    Args:
        steering_rad: (T,) commanded angles.
        follows: (T - 1,) whether each command but the first comes a tick after the one before it.

    Returns:
        None where no two ticks follow each other.
    """
    if not follows.any():
        return None
    changes = np.where(follows, np.diff(steering_rad), 0.0)
    stretch = np.concatenate([[0], np.cumsum(~follows)])
    aside = np.flatnonzero(np.abs(steering_rad) > STRAIGHT)
    sides, stretches = np.sign(steering_rad[aside]), stretch[aside]
    turns = (sides[1:] != sides[:-1]) & (stretches[1:] == stretches[:-1])
    count = int(follows.sum())
    return Smoothness(float(np.abs(changes).sum()) * TICKS_PER_SECOND / count, float(turns.sum()) / count)
