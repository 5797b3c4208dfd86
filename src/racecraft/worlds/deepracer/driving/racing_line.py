"""A line on a track with a speed at every point: what makers of lines return and the planner follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, headings, running_length


@dataclass(frozen=True, eq=False)
class RacingLine:
    """N points of base_link in driving order; on a loop the last is followed by the first."""

    closed: bool
    xy: np.ndarray
    """(N, 2) m."""
    speed: np.ndarray
    """(N,) m/s."""
    seconds: np.ndarray
    """Time at each point since the first, s: (N + 1,) on a loop, whose last is the lap time, else (N,)."""

    @property
    def lap_seconds(self) -> float:
        """Time of a flying lap; on an open track from standstill at the first point to the last, s."""
        return float(self.seconds[-1])

    @property
    def arc(self) -> np.ndarray:
        """Metres along the line, one for each of `seconds`."""
        return running_length(np.concatenate([self.xy, self.xy[:1]]) if self.closed else self.xy)

    @property
    def heading(self) -> np.ndarray:
        """(N,) rad, without jumps of 2π."""
        return headings(self.xy, self.closed)

    @property
    def curvature(self) -> np.ndarray:
        """(N,) 1/m, left positive."""
        return curvatures(self.xy, self.closed)

    @classmethod
    def on_road(cls, frame: RoadFrame, offset: np.ndarray, speed: np.ndarray, steps: np.ndarray) -> RacingLine:
        """Return the line at offsets from a road's stations.

        Args:
            frame: The road.
            offset: (N,) m, left positive.
            speed: (N,) m/s.
            steps: s from each point to the next, (N,) on a loop, else (N - 1,).
        """
        return cls(frame.closed, frame.points(offset), speed, np.concatenate([[0.0], np.cumsum(steps)]))


def curvatures(xy: np.ndarray, closed: bool) -> np.ndarray:
    """Return (N,) 1/m, left positive: the circle through each point and its neighbours."""
    before, after = (np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0)) if closed else (xy[:-2], xy[2:])
    here = xy if closed else xy[1:-1]
    a, b, c = here - before, after - here, after - before
    twice_area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    sides = np.hypot(*a.T) * np.hypot(*b.T) * np.hypot(*c.T)
    bend = 2.0 * twice_area / np.maximum(sides, 1e-12)
    return bend if closed else np.concatenate([bend[:1], bend, bend[-1:]])
