"""Whether a car gets round the bends of a drawn track. Begin with `bend_remarks`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.worlds.deepracer.driving.profile import sharpest_curvature
from racecraft.worlds.deepracer.driving.road_frame import road_frame
from racecraft.worlds.deepracer.env.vehicle import MAX_SPEED_MPS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

SPACING_M = 0.05
SLOW_MPS = 1.0


@dataclass(frozen=True)
class Bend:
    """A bend that is tighter than the car turns."""

    x: float
    y: float
    """m, where it is tightest."""
    radius: float
    """Of the centre line, m."""
    needed: float
    """The least radius that the car drives at full lock, m."""
    is_passable: bool
    """Whether the outside of the road is wide enough for it."""

    @property
    def text(self) -> str:
        """A sentence for people."""
        end = "it has to take the outside" if self.is_passable else "it cannot get round"
        return f"({self.x:.1f}, {self.y:.1f}): radius {self.radius:.2f} m, the car needs {self.needed:.2f} m; {end}."


def bend_remarks(track: Track, car: CarProfile) -> list[Bend]:
    """Return the bends that are tighter than a car turns at walking pace, in driving order."""
    frame = road_frame(track, SPACING_M)
    speed = np.full(1, SLOW_MPS)
    needed = 1.0 / float(sharpest_curvature(car, MAX_SPEED_MPS, speed)[0])
    radius = 1.0 / np.maximum(np.abs(frame.curvature), 1e-9)
    outside = np.where(frame.curvature > 0.0, frame.right, frame.left)
    tight = radius < needed
    found = []
    for rows in np.split(np.arange(len(tight)), np.flatnonzero(np.diff(tight.astype(int))) + 1):
        if tight[rows[0]]:
            row = rows[np.argmin(radius[rows])]
            x, y = frame.xy[row].tolist()
            found.append(Bend(x, y, float(radius[row]), needed, bool(radius[row] + outside[row] >= needed)))
    return found
