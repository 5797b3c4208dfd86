"""The dictionary handed to a user's `reward_function(params)`: one of the doors to the AWS dialect (degrees, percent).

Every key of the original is there, with the original's meaning, oddities included: `x`, `y` are the front of the car,
`speed` and `steering_angle` are what was *commanded*, `steps` is a float that the user first sees as 2.0 (facts,
section 3.1; simapp `agent_ctrl/constants.py`, `agent_ctrl/utils.py`). Each call gets a fresh dictionary with fresh
lists; the waypoint tuples inside are shared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from racecraft.contract.world import Array

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.track import Track

REWARD_PARAMETERS: dict[str, str] = {
    "all_wheels_on_track": "bool: all four wheel centres lie strictly inside the road's borders",
    "x": "float, m: front of the car, east",
    "y": "float, m: front of the car, north",
    "heading": "float, degrees in [-180, 180]: where the nose points, counter-clockwise from east",
    "distance_from_center": "float, m, >= 0: from (x, y) to the nearest point of the centre line",
    "projection_distance": "float, m: that nearest point's distance from the start line along the centre line",
    "progress": "float, per cent of the lap since the episode's start, up to 100; may be slightly negative",
    "steps": "float: rows of this episode so far; the first call sees 2.0",
    "speed": "float, m/s: commanded by the action just chosen",
    "steering_angle": "float, degrees, positive left: commanded by the action just chosen",
    "track_width": "float, m: between the border points nearest to the car",
    "track_length": "float, m: of the centre line",
    "waypoints": "list of (x, y), m: the centre line, in driving direction, closing point included",
    "closest_waypoints": "[int, int]: index of the waypoint behind and of the one ahead",
    "is_left_of_center": "bool: the car is left of the centre line, looking in driving direction",
    "is_reversed": "bool: the race runs round the track the other way",
    "closest_objects": "[int, int]: index of the object behind and of the one ahead; [0, 0] without objects",
    "objects_location": "list of [x, y], m",
    "objects_left_of_center": "list of bool",
    "objects_distance": "list of float, m along the centre line",
    "objects_distance_from_center": "list of float, m",
    "objects_heading": "list of float, rad (the original's documents say degrees; its code does not)",
    "objects_speed": "list of float, m/s: what bots were told, 0 of boxes, what another car really drives",
    "object_in_camera": "bool",
    "is_crashed": "bool: the car touches an object, or ran into another car",
    "is_offtrack": "bool: no wheel centre lies on the road",
    "sim_time": "float, s: simulated time since the training began",
}
"""Every key, with type, unit and meaning."""


class ObjectReports(NamedTuple):
    """What each of R cars found around it at the moment that is told of: objects, and behind them other cars."""

    boxes: Array
    """(R, J, 6), as `Objects.boxes`."""
    states: Array
    """OBJECT_STATE (R, J)."""
    objects: int
    """How many of the J are boxes or bots; the others are cars."""
    drive: bool
    """Whether they are bots that drive."""
    speed: float
    """m/s that bots were told to drive, standing in penalty or not; 0 of what never drives."""
    counts: Array | None = None
    """(R,) how many of the J were there; None: all."""

    def of(self, cars: Array) -> ObjectReports:
        """Return what some cars found, in their order: (R',) numbers of rows."""
        counts = None if self.counts is None else self.counts[cars]
        return self._replace(boxes=self.boxes[cars], states=self.states[cars], counts=counts)

    def params(self, car: int) -> dict[str, Any]:
        """Return what a car found, as it is in the dictionary; fresh lists."""
        count = self.states.shape[1] if self.counts is None else int(self.counts[car])
        boxes, states = self.boxes[car, :count], self.states[car, :count]
        others = states[self.objects :]
        headings = boxes[:, 2] if self.drive else np.append(np.zeros(self.objects), boxes[self.objects :, 2])
        return {
            "objects_location": boxes[:, :2].tolist(),
            "objects_left_of_center": states["is_left"].tolist(),
            "objects_distance": states["arc"].tolist(),
            "objects_distance_from_center": states["centre_distance"].tolist(),
            "objects_heading": headings.tolist(),
            "objects_speed": [self.speed] * self.objects + others["speed"].tolist(),
        }


class CentreLine(NamedTuple):
    """What of a track the dictionary holds."""

    centre: Array
    """(W, 2), m: the waypoints in driving direction, closing point included."""
    length: float
    """m."""


class RewardParams:
    """Makes the dictionaries of one track."""

    def __init__(self, track: Track | CentreLine, is_reversed: bool = False) -> None:
        self._waypoints = [(float(x), float(y)) for x, y in track.centre]
        self._track_length = float(track.length)
        self._is_reversed = is_reversed

    def of(
        self, reports: Array, objects: ObjectReports | None = None, cars: Array | None = None
    ) -> Iterator[dict[str, Any]]:
        """Yield one dictionary for each TICK_REPORT row, in order.

        Args:
            reports: TICK_REPORT (R,).
            objects: What stands or drives around every car; None: nothing.
            cars: (R,) the row of `objects` that is of each row's car; needed where there are objects.
        """
        if objects is None or cars is None:
            yield from self._of_cars(reports)
            return
        columns = zip(*(reports[name].tolist() for name in _OBJECT_COLUMNS), strict=True)
        for params, car, (before, after, seen, crashed) in zip(
            self._of_cars(reports), cars.tolist(), columns, strict=True
        ):
            params.update(objects.params(car))
            params["closest_objects"] = [before, after]
            params["object_in_camera"], params["is_crashed"] = seen, crashed
            yield params

    def _of_cars(self, reports: Array) -> Iterator[dict[str, Any]]:
        columns = (reports[name].tolist() for name in _COLUMNS)
        for (
            on,
            x,
            y,
            yaw,
            off_centre,
            arc,
            progress,
            steps,
            speed,
            steering,
            width,
            before,
            after,
            left,
            off,
            time,
        ) in zip(*columns, strict=True):
            yield {
                "all_wheels_on_track": on,
                "x": x,
                "y": y,
                "heading": yaw * _DEGREES,
                "distance_from_center": off_centre,
                "projection_distance": arc,
                "progress": progress,
                "steps": steps,
                "speed": speed,
                "steering_angle": _tidy(steering * _DEGREES),
                "track_width": width,
                "track_length": self._track_length,
                "waypoints": self._waypoints.copy(),
                "closest_waypoints": [before, after],
                "is_left_of_center": left,
                "is_reversed": self._is_reversed,
                "closest_objects": [0, 0],
                "objects_location": [],
                "objects_left_of_center": [],
                "objects_distance": [],
                "objects_distance_from_center": [],
                "objects_heading": [],
                "objects_speed": [],
                "object_in_camera": False,
                "is_crashed": False,
                "is_offtrack": off,
                "sim_time": time,
            }


_DEGREES = 180.0 / math.pi
_COLUMNS = (
    "all_wheels_on", "front_x", "front_y", "yaw", "centre_distance", "arc", "progress", "steps", "speed", "steering",
    "track_width", "waypoint_before", "waypoint_after", "is_left", "is_off", "time",
)  # fmt: skip
_OBJECT_COLUMNS = ("object_before", "object_after", "object_in_camera", "is_crashed")


def _tidy(degrees: float) -> float:
    """Return an angle as the action table spelt it: 30 degrees went through radians and must come back as 30.0."""
    return round(degrees, 10)
