"""What a line asks of an action table, and what a table cannot give. Begin with `find_turns` or `table_warning`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from racecraft.worlds.deepracer.driving.guides import top_speeds
from racecraft.worlds.deepracer.driving.lines import SPACING_M, least_bend
from racecraft.worlds.deepracer.driving.profile import steady_curvature, with_speeds
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, road_frame
from racecraft.worlds.deepracer.driving.telemetry.corners import find_corners
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, action_label, clip_commands
from racecraft.worlds.deepracer.env.vehicle import MAX_LOGGED_SPEED_MPS, MAX_SPEED_MPS, MAX_STEERING_RAD, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

WINDOW_M = 0.4
"""Curvature counts as a mean over so much of the line: a car need not follow every kink of it."""
GENTLE = 0.01
"""Price of length of the line whose turns are counted (`lines.least_bend`)."""
TOO_SHARP = 1.25
"""A turn is beyond a table where it is so many times sharper than any action drives steadily: transients help."""
SLOW_LAP = 1.5
"""A table is called slow where the car could lap in less than its time divided by this."""


@dataclass(frozen=True)
class Turn:
    """A stretch of a line that bends one way."""

    number: int
    """As `telemetry.corners` counts it."""
    curvature: float
    """At its sharpest, 1/m, left positive."""
    speed: float
    """m/s there."""
    waypoint: int
    """The nearest waypoint of the track, as rewards count it."""

    def __str__(self) -> str:
        side = "left" if self.curvature > 0 else "right"
        return f"turn {self.number} ({side}, radius {1 / abs(self.curvature):.2f} m, near waypoint {self.waypoint})"


def find_turns(track: Track, car: CarProfile, top_speed: float = MAX_SPEED_MPS) -> list[Turn]:
    """Return a track's turns, in driving order.

    They are the corners of `telemetry.corners`. Each must be driven at least as sharply as the track's gentle line
    bends there.

    Args:
        track: In driving direction.
        car: How the car answers.
        top_speed: Fastest command, m/s.
    """
    frame, offset = _gentle_offset(track)
    return _turns(track, frame, with_speeds(frame, offset, car, top_speed))


@lru_cache(maxsize=32)
def _gentle_offset(track: Track) -> tuple[RoadFrame, np.ndarray]:
    frame = road_frame(track, SPACING_M)
    return frame, least_bend(frame, GENTLE)


def _turns(track: Track, frame: RoadFrame, line: RacingLine) -> list[Turn]:
    bend, count = _mean_curvature(line), len(frame.xy)
    turns: list[Turn] = []
    for corner in find_corners(track):
        last = corner.end if corner.end > corner.begin else corner.end + 1.0
        rows = np.arange(round(corner.begin * count), round(last * count) + 1) % count
        row = int(rows[np.argmax(np.sign(corner.turn_rad) * bend[rows])])
        waypoint = int(track.locate(frame.xy[row : row + 1]).nearer_waypoint[0])
        turns.append(Turn(corner.number, float(bend[row]), float(line.speed[row]), waypoint))
    return turns


def needed_commands(car: CarProfile, line: RacingLine) -> np.ndarray:
    """Return (N, 2) the wheel angle (rad) and speed command (m/s) with which a car follows a line steadily."""
    bend = np.abs(_mean_curvature(line))
    low, high = np.zeros_like(bend), np.full_like(bend, MAX_STEERING_RAD)
    for _ in range(30):
        middle = 0.5 * (low + high)
        is_enough = steady_curvature(car, line.speed, middle) >= bend
        low, high = np.where(is_enough, low, middle), np.where(is_enough, middle, high)
    return np.column_stack([np.sign(_mean_curvature(line)) * high, line.speed / car.speed_gain])


def turns_beyond(car: CarProfile, actions: ActionSpace, turns: list[Turn]) -> list[Turn]:
    """Return the turns that are clearly sharper than every action of a table drives steadily."""
    commands = _commands(actions)
    speed = np.minimum(car.speed_gain * commands[:, 1], car.max_speed)
    driven = steady_curvature(car, speed, commands[:, 0])
    return [turn for turn in turns if TOO_SHARP * (driven * np.sign(turn.curvature)).max() < abs(turn.curvature)]


def table_warning(track: Track, car_name: str, car: CarProfile, actions: ActionSpace) -> str | None:
    """Return a sentence about a table that cannot lap a track, or only slowly; None for any other.

    It takes a classical line and no plan: about 0.1 s, on the longest tracks 1 s.

    Args:
        track: The track, in driving direction.
        car_name: A key of `vehicle.PROFILES`.
        car: How that car answers.
        actions: What it can be told.
    """
    top_speed, quickest = float(top_speeds(actions).max()), MAX_LOGGED_SPEED_MPS.get(car_name, MAX_SPEED_MPS)
    frame, offset = _gentle_offset(track)
    line = with_speeds(frame, offset, car, top_speed)
    if beyond := turns_beyond(car, actions, _turns(track, frame, line)):
        return (
            f"{beyond[0]} of {track.name} is sharper than any of these actions turns {car_name}; expected an action at "
            "a larger angle or a lower speed. `racecraft actions` designs a table."
        )
    possible = with_speeds(frame, offset, car, quickest).lap_seconds
    if top_speed < quickest and line.lap_seconds > SLOW_LAP * possible:
        return (
            f"these actions allow about {line.lap_seconds:.0f} s a lap of {track.name} at best: their top speed is "
            f"{top_speed:g} m/s. Up to {quickest:g} m/s {car_name} can lap in about {possible:.0f} s."
        )
    return None


def unused_actions(actions: ActionSpace, counts: np.ndarray) -> list[str]:
    """Return the labels of a table's actions that a log never chose.

    Args:
        actions: The table.
        counts: (A,) how often each was chosen.
    """
    if isinstance(actions, ActionBox):
        return []
    pairs = zip(actions.steering, actions.speed, counts, strict=True)
    return [action_label(steering, speed) for steering, speed, count in pairs if count == 0]


def _mean_curvature(line: RacingLine) -> np.ndarray:
    """Return (N,) 1/m, the mean over WINDOW_M of line."""
    return _mean(line.curvature, line.arc[-1] / len(line.xy), line.closed)


def _mean(values: np.ndarray, spacing: float, closed: bool) -> np.ndarray:
    width = max(1, round(WINDOW_M / spacing))
    padded = np.pad(values, width, mode="wrap" if closed else "edge")
    return np.convolve(padded, np.ones(width) / width, "same")[width:-width]


def _commands(actions: ActionSpace) -> np.ndarray:
    """Return (A, 2) the commands of a table, or the corners of two ranges, as they are sent to a car."""
    if isinstance(actions, ActionBox):
        return clip_commands(np.array([(angle, speed) for angle in actions.steering for speed in actions.speed]))
    return clip_commands(np.column_stack([actions.steering, actions.speed]))
