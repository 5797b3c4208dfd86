"""One tick of a race, told in order. Begin here.

A tick is what happens between two camera frames, 1/15 s. There are N worlds side by side, which never meet, and M cars
in each. A world does one act after the other, each for all its cars in turn (`kernels/race.py` has the bodies)::

    report      write down pose, place on the track, objects and cars near and touched, and the command that was chosen
                here: the reward's parameters; and name how the car stands: lap complete, crashed, off track,
                immobilised, reversed, out of time, in this order
    move        steering and throttle act for one tick; then, where the car lies along the track, how far from the
                centre, which wheels are on the road; bots drive on
    look last   a car whose episode ended sees its last frame
    restart     and goes to its next start, clear of cars and objects, in the same tick; with the world's first car its
                objects go to their next places
    look        every car sees the frame by which its next action is chosen, and a critic what only it may see

Nobody moves before all are written down, and nobody looks before all have moved: what a world's cars see and feel of
one another is of one moment. What is in their way are objects (`objects.py`) and the other cars of their world, which
each finds around it as boxes of a car's size (`Nearby`, `kernels/nearby.py`): a car that touches an object has crashed,
and of two cars that touch, the one behind. Who was hit drives on.

A car may be *held*: it waits where it stands, its clock runs, and others drive through it, as after a penalty. A
*parked* one is carried off the road.

So a row is (pose, action, reward): the reward speaks of the pose the action was chosen at, as in the original
(simapp `deepracer_racetrack_env.py`). The first tick of an episode is *prepare*: the car is held at the start, its
command is ignored, the reward is 0 and the reward function is not called; the next row is the first a racer sees, with
`steps` 2.0.

This page holds the two records a tick reads and writes, and the names of its outcomes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

IMMOBILISED_TICKS = 15
"""A car that moved at most IMMOBILISED_M a tick for so many ticks in a row is immobilised (simapp `reset/rules`)."""
IMMOBILISED_M = 0.0003
REVERSED_TICKS = 15
"""A car whose progress fell for so many ticks in a row drives backwards (simapp NUMBER_OF_REVERSE_COUNTS)."""

STATUSES = (
    "in_progress",
    "lap_complete",
    "off_track",
    "immobilized",
    "reversed",
    "time_up",
    "prepare",
    "park",
    "crashed",
    "pause",
)
"""How a row stands; the code is the index. Spelling is the original's, which racers' tools look for."""
IN_PROGRESS, LAP_COMPLETE, OFF_TRACK, IMMOBILISED, REVERSED, TIME_UP, PREPARE, PARK, CRASHED, PAUSE = range(
    len(STATUSES)
)
TRUNCATED = "truncated"
"""What the record of an episode says that was cut before any of these ended it."""

START_GAP_M = 0.75
"""Cars of one world start so far behind one another along the centre line (simapp START_POS_OFFSET)."""
START_LANE = 0.5
"""And this far beside it, share of the half road: even cars in the outer lane, odd ones in the inner (facts 5.4)."""
START_CLEAR_M = 0.4
"""A start is free where no other car's base_link lies nearer: a car's corners reach 0.19 m from its middle."""
START_OBJECT_M = 1.0
"""Where an object lies so near along the centre line, a car starts in the lane beside it (facts 5.4)."""
START_MARGIN_M = 0.1
"""And never with less than this between its sides and an object's."""

CRITIC_LOOKS_AHEAD_M = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""Distances along the centre line at which the critic is told the road's direction."""
CRITIC_NUMBERS = 5 + 2 * len(CRITIC_LOOKS_AHEAD_M)
"""Length of the privileged observation; see `look` in kernels/observations.py."""

CRITIC_OBJECTS = 2
"""So many objects next ahead the critic is told of, in a race that has any."""
CRITIC_OBJECT_REACH_M = 3.0
"""Along the centre line; what lies farther ahead is not told."""
CRITIC_OBJECT_BEHIND_M = 0.4
"""An object counts as ahead until the car's nose is so far past its middle."""
CRITIC_OBJECT_NUMBERS = 2 * CRITIC_OBJECTS
"""How much longer the privileged observation then is; see `tell_objects` in kernels/observations.py."""

CAR_STATE = np.dtype(
    [
        ("x", "f8"), ("y", "f8"), ("yaw", "f8"),  # base_link, m and rad
        ("speed", "f8"), ("steering", "f8"),  # what the car does, m/s and rad
        ("old_steering", "f8"), ("old_speed", "f8"),  # last tick's command, rad and m/s
        ("start_share", "f8"),  # where the episode began, share of the lap
        ("start_left", "f8"),  # how far left of the centre line it begins its episodes, share of the half road
        ("ticks", "i8"),  # of this episode, the prepare tick included
        ("drives", "i8"),  # standing starts before its last one
        ("drive_ticks", "i8"),  # since its last standing start
        ("lap_ticks", "i8"),  # of this lap
        ("total_ticks", "i8"),  # since the race was reset
        ("episode", "i8"), ("laps", "i8"),  # episodes begun before this one; laps done in it
        ("still_ticks", "i8"), ("backward_ticks", "i8"),  # in a row
        ("preparing", "b1"),
        ("ended_yaw", "f8"),  # rad, where its nose pointed in the last frame of the episode before
        ("held", "i8"),  # ticks that it still waits where it stands, as after a penalty; nobody can hit it then
        ("away", "b1"),  # parked: carried off the road until its next start
        # Where the car lies; written by `locate`.
        ("front_x", "f8"), ("front_y", "f8"),  # the point racers call x, y
        ("arc", "f8"),  # of its projection on the centre line, m from the start line
        ("centre_distance", "f8"),  # m, never negative
        ("border_inner", "f8"), ("border_outer", "f8"),  # m from the front point to the border points
        ("track_width", "f8"),  # m between the border points
        ("waypoint_before", "i8"), ("waypoint_after", "i8"),
        ("progress", "f8"), ("last_progress", "f8"),  # per cent
        ("wheels_on", "i8"),  # how many wheel centres lie on the road
    ]
)  # fmt: skip
"""One car. The record is all a car needs to go on: saving it saves the car."""

TICK_REPORT = np.dtype(
    [
        ("episode", "i8"), ("steps", "f8"), ("status", "i8"),
        ("x", "f8"), ("y", "f8"), ("yaw", "f8"),  # base_link at the moment the action was chosen, m and rad
        ("front_x", "f8"), ("front_y", "f8"),
        ("action", "i8"),  # number of the action chosen; -1 where actions are continuous
        ("speed", "f8"), ("steering", "f8"),  # commanded, as `RaceWorld.as_reported` has it: m/s and rad
        ("driven_speed", "f8"), ("driven_steering", "f8"),  # what the car did at that moment
        ("progress", "f8"), ("arc", "f8"), ("centre_distance", "f8"), ("track_width", "f8"),
        ("waypoint_before", "i8"), ("waypoint_after", "i8"), ("waypoint_nearest", "i8"),
        ("is_left", "b1"), ("all_wheels_on", "b1"), ("is_off", "b1"),
        ("object_before", "i8"), ("object_after", "i8"),  # along the centre line; 0 without objects
        ("object_hit", "i8"),  # which object the car touches; -1 none
        ("is_crashed", "b1"),  # it touches one, and not because a bot ran into it
        ("object_in_camera", "b1"),  # the next object is in the frame, or a part of it
        ("terminated", "b1"), ("truncated", "b1"),
        ("time", "f8"), ("lap_seconds", "f8"),  # s of simulated time; lap_seconds counts from the lap's start
        ("start_share", "f8"), ("laps", "i8"),
    ]
)  # fmt: skip
"""What is written down of one car in one tick."""


class Rules(NamedTuple):
    """What the marshals were told; a plain tuple, so that kernels take it whole."""

    max_ticks: int
    """An episode is truncated after so many ticks since the car's last standing start."""
    practice_ticks: int
    """Likewise in all but one of PRACTICE drives, for the sake of standing starts; as `max_ticks`: all are alike."""
    laps: int
    """An episode ends after so many complete laps."""
    start_advance: float
    """Share of the lap by which the next start of a car moves on."""
    cut_ends: bool = False
    """Whether an episode that reaches `max_ticks` counts as ended rather than truncated."""
    jitter: float = 0.0
    """How much longer or shorter than TICK_SECONDS a tick may last, share of it; every length between is as likely."""
    wheel_kick: float = 0.0
    """Spread of the push that the angle of the wheels takes in every tick, rad; they come back as they steer."""
    keeps_wheels: bool = False
    """Whether a car that is put back to its start keeps the angle of its wheels."""
    jumps: bool = False
    """Whether a car off the road is placed on whatever stretch of it is nearest."""
    start_ahead: float = 0.0
    """m ahead of another car of its world at which a car starts again, behind it where its own car is the faster one;
    0: where its own next start lies."""
    drives_on: bool = False
    """Whether a car that completes a lap drives on: the lap is cut, not ended, and the next episode begins there."""


PRACTICE = 5
"""Where standing starts are practised, one of so many drives of a car is a whole one."""

PROFILE = np.dtype([(name, "f8") for name in CarProfile._fields])
"""One car's `CarProfile` as a record, so that every car of a world may have its own."""


def new_cars(track: Track, cars_per_world: int, start_shares: Array) -> Array:
    """Return the records of cars that are about to take their first start, CAR_STATE (N, M).

    A car alone starts on the centre line. Several stand in two lanes, START_GAP_M behind one another; the first of them
    at the world's start, or on an open track, where nothing lies behind the line, the last.

    Args:
        track: The circuit, in driving direction.
        cars_per_world: M.
        start_shares: Where each world's cars start, share of the lap, (N,).
    """
    cars = np.zeros((len(start_shares), cars_per_world), CAR_STATE)
    places = np.arange(cars_per_world)
    behind = places - (0 if track.closed else cars_per_world - 1)
    cars["start_share"] = np.mod(start_shares[:, None] - behind * (START_GAP_M / track.length), 1.0)
    if cars_per_world > 1:
        cars["start_left"] = np.where((places % 2 == 1) == track.is_ccw, START_LANE, -START_LANE)
    return cars


def car_profiles(profiles: Sequence[CarProfile]) -> Array:
    """Return profiles as records, PROFILE (M,)."""
    return np.array([tuple(profile) for profile in profiles], PROFILE)


def max_ticks(seconds: float) -> int:
    """Return how many ticks fit into so many simulated seconds, at least 2."""
    return max(2, round(seconds / TICK_SECONDS))
