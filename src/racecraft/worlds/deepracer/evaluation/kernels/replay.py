"""A recorded race walked through row by row: its figures told again, its commands given to our car.

T rows stand in the order in which they were written; `places` (T, 3) are base_link x, y (m) and yaw (rad). What the
arguments mean, and why, is told in `evaluation/recompute.py` and `evaluation/open_loop.py`.
"""

from __future__ import annotations

import math

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.kernels.localise import progress_percent, wheels_on_road
from racecraft.worlds.deepracer.env.kernels.vehicle import drive
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M


@kernel
def recompute_progress(lap_shares, begins, start_shares, progress):
    """Fill `progress` (T,), per cent, from each row's share of the lap and its episode's start.

    `begins` (T,) marks an episode's first row: there the progress of the row before counts as 0.
    """
    last = 0.0
    for row in range(lap_shares.shape[0]):
        if begins[row]:
            last = 0.0
        last = progress_percent(lap_shares[row], start_shares[row], last)
        progress[row] = last


@kernel
def count_wheels(track, places, wheels):
    """Fill `wheels` (T,) with how many of the four wheel centres lie on the road."""
    for row in range(places.shape[0]):
        yaw = places[row, 2]
        wheels[row] = wheels_on_road(track, places[row, 0], places[row, 1], math.cos(yaw), math.sin(yaw))


@kernel
def drive_windows(profile, places, commands, seconds, restarts, held, windows, ticks, paths):
    """Drive a car from every window's first pose with the commands that were given from there on.

    Args:
        profile: CarProfile.
        places: (T, 3) where the recorded car stood.
        commands: (T, 2) steering (rad) and speed (m/s), as sent to the car.
        seconds: (T,) how long each row's command acted.
        restarts: (T,) bool, the car stands at a start, its wheels turned as the last episode left them.
        held: (T,) bool, the car is held in place and told to steer straight.
        windows: (W,) first rows of the windows, rising.
        ticks: (W,) how many ticks each window lasts.
        paths: (W, 1 + most ticks, 3) is filled with the driven front point (x, y) and yaw, tick after tick.
    """
    speed, steering, old_steering, old_speed = 0.0, 0.0, 0.0, 0.0
    window = 0
    for row in range(places.shape[0]):
        if restarts[row]:
            speed, old_steering, old_speed = 0.0, 0.0, 0.0
        while window < windows.shape[0] and windows[window] == row:
            _drive_window(
                profile, places[row], commands[row:], seconds[row:], ticks[window],
                speed, steering, old_steering, old_speed, paths[window],
            )  # fmt: skip
            window += 1
        to_steering, to_speed = commands[row, 0], commands[row, 1]
        if held[row]:
            to_steering, to_speed = 0.0, 0.0
        _, _, _, speed, steering = drive(
            profile, 0.0, 0.0, 0.0, speed, steering, old_steering, old_speed, to_steering, to_speed, seconds[row]
        )
        old_steering, old_speed = to_steering, to_speed
        if held[row]:
            speed = 0.0


@kernel
def _drive_window(profile, place, commands, seconds, ticks, speed, steering, old_steering, old_speed, path):  # noqa: PLR0913
    x, y, yaw = place[0], place[1], place[2]
    for tick in range(ticks + 1):
        path[tick, 0] = x + FRONT_POINT_M * math.cos(yaw)
        path[tick, 1] = y + FRONT_POINT_M * math.sin(yaw)
        path[tick, 2] = yaw
        if tick < ticks:
            x, y, yaw, speed, steering = drive(
                profile, x, y, yaw, speed, steering, old_steering, old_speed,
                commands[tick, 0], commands[tick, 1], seconds[tick],
            )  # fmt: skip
            old_steering, old_speed = commands[tick, 0], commands[tick, 1]
