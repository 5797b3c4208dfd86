"""When each picture of a film is taken: between ticks a car's pose is interpolated. See `moments`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import JUMP_M
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

MIN_FPS, MAX_FPS = 15, 60
HELD_SECONDS = 2.0
"""How long the last picture stays."""
CHASE_LAG_SECONDS = 0.3
"""How far the chase camera's heading lags behind its car's (facts: deepracer.md 2.5, damping 1.0; the lag is ours)."""


@dataclass(frozen=True, eq=False)
class Moments:
    """P pictures of one drive."""

    ticks: Array
    """(P,) the row of the drive whose figures are shown."""
    poses: Array
    """(P, 3) x, y, yaw of base_link."""
    chase_yaw: Array
    """(P,) heading of the camera behind the car."""
    past: Array
    """(P,) how far behind its tick a picture is taken, share of a tick from 0 to 1."""

    def __len__(self) -> int:
        return len(self.ticks)


def moments(drive: Drive, fps: float) -> Moments:
    """Return the moments of a film in real time, with the last one held for HELD_SECONDS.

    A car that was set down elsewhere does not slide there.

    Args:
        drive: T ticks, TICKS_PER_SECOND of them a second.
        fps: Pictures a second.
    """
    times = np.arange(math.floor((len(drive) - 1) / TICKS_PER_SECOND * fps + 1e-9) + 1) / fps * TICKS_PER_SECOND
    ticks = np.minimum(times.astype(int), len(drive) - 1)
    after = np.minimum(ticks + 1, len(drive) - 1)
    poses = drive.poses
    step = poses[after] - poses[ticks]
    step[:, 2] = np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))
    slides = np.hypot(step[:, 0], step[:, 1]) < JUMP_M
    between = poses[ticks] + np.where(slides, times - ticks, 0.0)[:, None] * step
    held = np.minimum(np.arange(len(times) + round(HELD_SECONDS * fps)), len(times) - 1)
    return Moments(ticks[held], between[held], _lagging(between, fps)[held], (times - ticks)[held])


def _lagging(poses: Array, fps: float) -> Array:
    """Return headings that follow the car's with a lag; where it was set down elsewhere they begin anew."""
    follow = 1.0 - math.exp(-1.0 / (fps * CHASE_LAG_SECONDS))
    yaw = np.empty(len(poses))
    for k, (x, y, heading) in enumerate(poses):
        if k == 0 or math.hypot(x - poses[k - 1, 0], y - poses[k - 1, 1]) > JUMP_M:
            yaw[k] = heading
        else:
            turn = heading - yaw[k - 1]
            yaw[k] = yaw[k - 1] + follow * math.atan2(math.sin(turn), math.cos(turn))
    return yaw
