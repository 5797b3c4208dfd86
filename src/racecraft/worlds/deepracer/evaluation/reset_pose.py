"""Where a car goes on after a mishap: at rest, in a lane, at the progress of the tick before. Begin with `set_down`.

As the original does (facts: deepracer.md 5.5, simapp `rollout_agent_ctrl.py`): the nearer of two lanes, nose along the
road. Where a box lies within a metre along the road, the car goes on behind that box in the other lane; with mercy,
every third time in a row at one box, ahead of it. A car that ran into a bot stays where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.kernels import localise, starts
from racecraft.worlds.deepracer.env.world import RaceWorld

CLOSEST_OBJECT_M = 1.0
"""A car is not set down so near to a box, along the centre line (simapp CLOSEST_OBJ_GAP)."""


@dataclass
class BoxResets:
    """How far from a box a car goes on, and how often in a row it was set down at the same one.

    Args:
        behind_m: Distance behind the box.
        ahead_m: Distance ahead of it, with mercy.
        mercy_after: At the how-manieth reset in a row at one box the car goes on ahead of it; None: never.
    """

    behind_m: float
    ahead_m: float = 1.0
    mercy_after: int | None = None
    _box: int = -1
    _resets: int = 0

    def offset_m(self, box: int) -> float:
        """Count a reset at a box; return where the car goes on, m ahead of the box, negative behind."""
        self._resets = self._resets + 1 if box == self._box else 1
        self._box = box
        if self._resets != self.mercy_after:
            return -self.behind_m
        self._resets = 0
        return self.ahead_m


def set_down(world: RaceWorld, car: Array, n: int, crashed: bool, resets: BoxResets) -> None:
    """Put a car of world n, CAR_STATE (1,), back on the road at rest; what else it knows of its lap stays.

    Args:
        world: Where it drives.
        car: As it was before the tick of the mishap; written.
        n: Its world, whose boxes are kept away from.
        crashed: It hit an object: its own place is where it is, not where it was a tick ago.
        resets: How far from a box it goes on; counts.
    """
    one = car[0]
    progress = float(one["progress"] if crashed else one["last_progress"])
    if not (crashed and world.has_bots):
        whole = 1.0 if world.track.closed else 1.0 - float(one["start_share"])
        share = float((one["start_share"] + whole * progress / 100.0) % 1.0)
        car["x"], car["y"], car["yaw"] = _pose(world, n, share, (float(one["x"]), float(one["y"])), resets)
    for name in ("speed", "steering", "old_steering", "old_speed"):
        car[name] = 0.0
    car["preparing"] = False
    car["progress"] = progress
    localise.locate(world.track.arrays(), car[0])
    car["still_ticks"] = car["backward_ticks"] = 0


def _pose(
    world: RaceWorld, n: int, share: float, was: tuple[float, float], resets: BoxResets
) -> tuple[float, float, float]:
    """Return the pose at which a car goes on: in the lane nearer to where it was, or in the one beside a box."""
    arrays, length = world.track.arrays(), world.track.length
    box = _box_near(world, n, share)
    if box >= 0:
        place = world.track.locate(world.boxes[n][box : box + 1, :2])
        share = (float(place.arc[0]) + resets.offset_m(box)) / length
        share = share % 1.0 if world.track.closed else min(max(0.0, share), 1.0)
    left, right = (starts.start_pose(arrays, share, side) for side in (race.START_LANE, -race.START_LANE))
    if box >= 0:
        return right if place.is_left[0] else left
    return left if math.dist(left[:2], was) <= math.dist(right[:2], was) else right


def _box_near(world: RaceWorld, n: int, share: float) -> int:
    """Return which box lies within CLOSEST_OBJECT_M along the centre line, the nearest; -1 without one."""
    if world.has_bots or not world.kinds.size:
        return -1
    length = world.track.length
    gaps = np.abs(world.track.locate(world.boxes[n][:, :2]).arc - share * length)
    if world.track.closed:
        gaps = np.minimum(gaps, length - gaps)
    nearest = int(gaps.argmin())
    return nearest if gaps[nearest] < CLOSEST_OBJECT_M else -1
