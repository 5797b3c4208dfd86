"""A reward function to begin with, and made-up moments of a lap to try one on."""

from __future__ import annotations

import math
from typing import Any

Params = dict[str, Any]


def default_reward_source(has_objects: bool = False, has_rivals: bool = False) -> str:
    """Return our own reward function, as text for a new file.

    On an empty road it pays the more the nearer to the centre line; with objects on it, for a free lane; among cars
    that race each other, for speed in a free lane.
    """
    if has_rivals:
        return _AMONG_CARS_SOURCE
    return _AMONG_OBJECTS_SOURCE if has_objects else _DEFAULT_SOURCE


def racing_reward_source() -> str:
    """Return the reward function of the car that races, as text for a new file."""
    return _RACING_SOURCE


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


_RACING_SOURCE = '''\
"""Pay the car for every metre that it gains along the centre line, and a little for steering calmly.

`params` tells where the car is and what it does at this moment; the number returned is its pay for this moment.
A fast line gains more metres a moment, so the car finds one by itself. Change the pay below and train again.
"""


class Before:
    """What the car did a moment ago; every car has its own."""

    steps, progress, steering = float("inf"), 0.0, 0.0


def reward_function(params):
    """Return the reward for one tick."""
    steps, progress, steering = params["steps"], params["progress"], params["steering_angle"]
    if steps <= Before.steps:  # a new episode
        Before.progress, Before.steering = progress, steering
    metres = (progress - Before.progress) / 100.0 * params["track_length"]
    turned = abs(steering - Before.steering) / 30.0
    Before.steps, Before.progress, Before.steering = steps, progress, steering
    return 2.0 * metres - 0.1 * turned
'''

_DEFAULT_SOURCE = '''\
"""Pay the car for staying near the centre line.

`params` tells where the car is and what it does at this moment; the number returned is its pay for this moment.
Change the shares and the pay below, train again, and see what the car makes of it.
"""


def reward_function(params):
    """Return the reward for one tick."""
    # How far the car is from the centre line, in metres, and how wide the track is here.
    distance = params["distance_from_center"]
    width = params["track_width"]

    # Three bands round the centre line: the nearer, the more.
    if distance <= 0.10 * width:
        return 1.0
    if distance <= 0.25 * width:
        return 0.5
    if distance <= 0.50 * width:
        return 0.1

    # Beyond the border: next to nothing, but not zero, so that less bad is still told from worse.
    return 1e-3
'''

_AMONG_OBJECTS_SOURCE = '''\
"""Pay the car for staying on the road and, near an object, for being in the other lane.

`params` tells where the car is, what it does, and what stands or drives ahead; the number returned is its pay for this
moment. Change the distances and the pay below, train again, and see what the car makes of it.
"""

NEAR = 1.2  # metres ahead within which an object matters
BESIDE = 0.35  # metres past its middle until which it still does


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_crashed"] or params["is_offtrack"]:
        return 1e-3

    # The car's place across the road: -1 at the right border, 0 on the centre line, 1 at the left border.
    half = 0.5 * params["track_width"]
    place = params["distance_from_center"] / half
    if not params["is_left_of_center"]:
        place = -place

    # Where it should be: on the centre line, or in the middle of the lane that the nearest object leaves free.
    wanted = 0.0
    nearest = NEAR
    for distance, is_left in zip(params["objects_distance"], params["objects_left_of_center"]):
        ahead = (distance - params["projection_distance"]) % params["track_length"]
        if params["track_length"] - ahead < BESIDE:
            ahead = 0.0
        if ahead < nearest:
            nearest = ahead
            wanted = -0.55 if is_left else 0.55

    # The nearer to that place, the more; beyond the border nearly nothing.
    if abs(place) > 1.0:
        return 1e-3
    return max(1e-3, 1.0 - abs(place - wanted)) ** 2
'''

_AMONG_CARS_SOURCE = '''\
"""Pay the car for speed and, behind or beside another car, for being in the other lane: so that it overtakes.

A car that is paid for its place on the road alone is content behind a slow one. Paid for its speed, it loses by waiting
there, and by running into the other it loses all that would still come.
"""

FAST = 1.0  # m/s that are paid in full; more is paid more
NEAR = 1.5  # metres ahead within which another car matters
BESIDE = 0.4  # metres past its middle until which it still does


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_crashed"] or params["is_offtrack"]:
        return 1e-3

    # The car's place across the road: -1 at the right border, 0 on the centre line, 1 at the left border.
    half = 0.5 * params["track_width"]
    place = params["distance_from_center"] / half
    if not params["is_left_of_center"]:
        place = -place

    # Where it should be: on the centre line, or in the middle of the lane that the nearest car leaves free.
    wanted = 0.0
    nearest = NEAR
    for number, distance in enumerate(params["objects_distance"]):
        ahead = (distance - params["projection_distance"]) % params["track_length"]
        if params["track_length"] - ahead < BESIDE:
            ahead = 0.0
        if ahead < nearest:
            nearest = ahead
            wanted = -0.5 if params["objects_left_of_center"][number] else 0.5

    # The nearer to that place and the faster, the more; beyond the border nearly nothing.
    if abs(place) > 1.0:
        return 1e-3
    return max(1e-3, 1.0 - 0.5 * abs(place - wanted)) ** 2 * params["speed"] / FAST
'''
