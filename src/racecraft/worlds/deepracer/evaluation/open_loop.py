"""Our car given the commands of a recorded race: how far does it stray? Begin with `drive_open_loop`.

From every fifth row in which the car was driven, a window opens: our car is put where the recorded one stood and obeys
the recorded commands for a second, without ever looking. Its speed, the angle of its wheels and the commands still on
their way are those of a car that obeyed every command since the episode's first row. No window reaches past the end of
an episode, a pause, or a row that is missing.

Two things the records taught (docs/fidelity.md has the figures):

* The wheels keep their angle when a car is put back to its start: the reset moves the body, not the hinges. The last
  row's command acts for two ticks (between its stamp and the next episode's lie 0.133 s), then *prepare* steers them
  straight for one. In a file's first episode they stand straight.
* The clock of the trace is read beside the pose, not with it. In the classic build every tick is one frame of 1/15 s,
  whatever `tstamp` says (the two do not correlate). In the ROS 2 build the physics runs on, and a row's command acts
  for as long as the stamp of its row lies behind that of the row before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import (
    MAX_SPEED_MPS,
    MAX_STEERING_RAD,
    MIN_SPEED_MPS,
    PROFILES,
    TICK_SECONDS,
    CarProfile,
)
from racecraft.worlds.deepracer.evaluation.kernels.replay import drive_windows
from racecraft.worlds.deepracer.evaluation.recompute import TracePath
from racecraft.worlds.deepracer.files.sim_trace import SimTrace

HORIZONS = {"0.5s": 8, "1s": 15}
"""Where a window is measured, ticks after its first row; the first whole ticks at or after the name's time."""
EVERY = 5
"""A window opens at every fifth row in which the car was driven."""
CLOCKED_CARS = ("v6", "v6-unlimited")
"""Cars whose recorded ticks last as long as their clock says."""
LONGEST_TICK_SECONDS = 3.0
TICKS_TO_RESET = 2
"""An episode's last command acts for so many ticks, until the car stands at its next start."""


@dataclass(frozen=True)
class Windows:
    """W windows of open-loop driving over one trace."""

    first: Array
    """(W,) row at which the window opens."""
    ticks: Array
    """(W,) how many ticks it lasts, 8 to 15."""
    paths: Array
    """(W, 16, 3) driven front point x, y (m) and yaw (rad) at each tick; NaN after the window's end."""
    position_m: dict[str, Array]
    """By horizon, (W,): distance between the driven front point and the recorded one; NaN where the window is short."""
    yaw_rad: dict[str, Array]
    """By horizon, (W,): angle between the driven heading and the recorded one, never negative."""

    def __len__(self) -> int:
        return len(self.first)


def drive_open_loop(trace: SimTrace, retold: TracePath, car: str | CarProfile, clocked: bool | None = None) -> Windows:
    """Drive a car with the commands of a trace.

    Args:
        trace: What was recorded.
        retold: The same trace by `walk` or `recompute`.
        car: A name of PROFILES, or a profile of one's own.
        clocked: Whether ticks last as long as the trace's clock says; by default as CLOCKED_CARS has it.
    """
    profile = PROFILES[car] if isinstance(car, str) else car
    if clocked is None:
        clocked = car in CLOCKED_CARS
    first, ticks = open_windows(trace, retold)
    paths = np.full((len(first), max(HORIZONS.values()) + 1, 3), np.nan)
    drive_windows(
        profile,
        retold.poses,
        commands_of(trace),
        seconds_of(trace, retold, clocked),
        retold.restarts,
        retold.held,
        first,
        ticks,
        paths,
    )
    position, yaw = {}, {}
    for name, horizon in HORIZONS.items():
        there = np.minimum(first + horizon, len(trace) - 1)
        gap = paths[:, horizon, :2] - np.column_stack([trace.columns["X"], trace.columns["Y"]])[there]
        turn = paths[:, horizon, 2] - retold.poses[there, 2]
        position[name] = np.hypot(gap[:, 0], gap[:, 1])
        yaw[name] = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    return Windows(first, ticks, paths, position, yaw)


def real_speeds(trace: SimTrace, windows: Windows) -> Array:
    """Return how fast the recorded car drove in each window, m/s, (W,): the way of its front point over its ticks."""
    front = np.column_stack([trace.columns["X"], trace.columns["Y"]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(front, axis=0).T))])
    return (way[windows.first + windows.ticks] - way[windows.first]) / (windows.ticks * TICK_SECONDS)


def open_windows(trace: SimTrace, retold: TracePath) -> tuple[Array, Array]:
    """Return the first row of every window and how many ticks it lasts, (W,) each."""
    follows = np.zeros(len(trace), bool)  # the row after this one is the tick after it
    follows[:-1] = (np.diff(trace.columns["steps"]) == 1) & ~retold.begins[1:] & ~retold.held[:-1] & ~retold.held[1:]
    last = np.where(follows, -1, np.arange(len(trace)))
    last = np.minimum.accumulate(np.where(last < 0, len(trace), last)[::-1])[::-1]
    ahead = np.minimum(last - np.arange(len(trace)), max(HORIZONS.values()))
    driven = ~retold.held
    if "episode_status" in trace.columns:
        driven &= trace.columns["episode_status"] == "in_progress"
    count = np.cumsum(driven) - 1
    episode = np.cumsum(retold.begins) - 1
    before = np.concatenate([[0], np.cumsum(driven)])[np.flatnonzero(retold.begins)]
    opens = driven & ((count - before[episode]) % EVERY == 0) & (ahead >= min(HORIZONS.values()))
    first = np.flatnonzero(opens)
    return first, ahead[first]


def commands_of(trace: SimTrace) -> Array:
    """Return what was sent to the car, steering (rad) and speed (m/s), clipped as the original clips, (T, 2)."""
    steering = np.clip(np.radians(trace.columns["steer"]), -MAX_STEERING_RAD, MAX_STEERING_RAD)
    return np.column_stack([steering, np.clip(trace.columns["throttle"], MIN_SPEED_MPS, MAX_SPEED_MPS)])


def seconds_of(trace: SimTrace, retold: TracePath, clocked: bool) -> Array:
    """Return how long each row's command acted, s, (T,); over a row that is missing the command acts on."""
    steps = np.ones(len(trace))
    steps[:-1] = np.where(retold.restarts[1:], TICKS_TO_RESET, np.diff(trace.columns["steps"]))
    seconds = TICK_SECONDS * np.clip(steps, 1, LONGEST_TICK_SECONDS / TICK_SECONDS)
    if clocked:
        since = np.diff(trace.columns["tstamp"], prepend=0.0)
        settled = ~retold.restarts
        settled[0] = False
        settled[1:] &= ~retold.restarts[:-1]  # not the row after the start either: its stamp follows a reset
        sound = settled & (since > 0.0) & (since < LONGEST_TICK_SECONDS) & (steps == 1)
        seconds = np.where(sound, since, seconds)
    return seconds
