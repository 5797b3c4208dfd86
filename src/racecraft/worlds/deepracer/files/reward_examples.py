"""A reward function to begin with, and made-up moments of a lap to try one on."""

from __future__ import annotations

import math
from typing import Any

from racecraft.worlds.deepracer.files.reward_samples import read_sample

Params = dict[str, Any]


def default_reward_source(has_objects: bool = False, has_rivals: bool = False) -> str:
    """Return our own reward function, as text for a new file.

    On an empty road it pays the more the nearer to the centre line; with objects on it, for a free lane; among cars
    that race each other, for speed in a free lane.
    """
    if has_rivals:
        return read_sample("pass_cars")
    return read_sample("free_lane" if has_objects else "centre_line")


def racing_reward_source() -> str:
    """Return the reward function of the car that races, as text for a new file."""
    return read_sample("metres_gained")


def example_situations() -> dict[str, Params]:
    """Return the parameters of a car on a round track, 8 m across, in some moments of a lap, one after another.

    Steps, progress and time only grow, as in a race: a reward that keeps the last ones divides by what they grew by.
    """
    return {
        "at the start": _situation(),
        "on the way": _situation(progress=35.0, steps=80.0, speed=2.0, steering_angle=-15.0),
        "near the border": _situation(offset=0.45, progress=50.0, steps=120.0, all_wheels_on_track=False),
        "off the track": _situation(
            offset=0.7, progress=60.0, steps=150.0, all_wheels_on_track=False, is_offtrack=True
        ),
        "an object ahead": _situation(
            progress=70.0,
            steps=180.0,
            closest_objects=[0, 0],
            objects_location=[[0.0, 4.0]],
            objects_left_of_center=[True],
            objects_distance=[6.3],
            objects_distance_from_center=[0.2],
            objects_heading=[0.0],
            objects_speed=[0.0],
            object_in_camera=True,
        ),
        "lap complete": _situation(progress=100.0, steps=250.0),
    }


def _situation(offset: float = 0.1, **changes: Any) -> Params:
    """Return the parameters of a car `offset` metres right of the centre line of a round track."""
    corners = 40
    circle = [
        (4 * math.sin(2 * math.pi * k / corners), -4 * math.cos(2 * math.pi * k / corners)) for k in range(corners)
    ]
    params: Params = {
        "all_wheels_on_track": True,
        "x": 0.0,
        "y": -4.0 - offset,
        "heading": 0.0,
        "distance_from_center": offset,
        "projection_distance": 0.0,
        "progress": 0.4,
        "steps": 2.0,
        "speed": 1.0,
        "steering_angle": 0.0,
        "track_width": 1.0,
        "track_length": 25.1,
        "waypoints": [*circle, circle[0]],
        "closest_waypoints": [0, 1],
        "is_left_of_center": False,
        "is_reversed": False,
        "is_crashed": False,
        "is_offtrack": False,
        "closest_objects": [0, 0],
        "objects_location": [],
        "objects_left_of_center": [],
        "objects_distance": [],
        "objects_distance_from_center": [],
        "objects_heading": [],
        "objects_speed": [],
        "object_in_camera": False,
        "sim_time": changes.get("steps", 2.0) / 15,
    }
    return {**params, **changes}
