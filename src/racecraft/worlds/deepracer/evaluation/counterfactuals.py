"""What would have prevented a failure: other actions driven from moments before it. Begin with `try_alternatives`."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, action_label
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.recorded_drives import RecordedDrives
from racecraft.worlds.deepracer.evaluation.rerun import Change, rerun_with_change

MOMENTS = (2, 4, 6, 8, 10, 12, 15, 18, 22, 26, 30)
"""Ticks before the failure at which another action is tried: closer together the later, within its last two seconds."""
HOLDS = (1, 3, 9)
"""For how many ticks it is held: for one; where that does not save most, for 0.2 s; where that does not, for 0.6 s."""
ENOUGH = 0.8
"""Share of the failures that one and the same change must save, or longer holds are tried."""
NEARLY = 0.2
"""A change that saves so much less of the failures than the best one counts as much."""
STEERINGS, SPEEDS = 5, 3
"""Of two ranges so many angles and speeds are tried, evenly spread."""
SPEED_WEIGHT = 0.5
"""An option that is 1 m/s off is as far from what was done as one that steers by half a radian otherwise."""


@dataclass(frozen=True, eq=False)
class Options:
    """What a car can be told instead."""

    actions: Array
    """(A, *action shape)."""
    commands: Array
    """(A, 2) steering in rad, left positive, and speed in m/s."""
    labels: tuple[str, ...]
    """In a racer's words."""

    @classmethod
    def of(cls, space: ActionSpace) -> Options:
        """Return all of a table; of two ranges a grid of STEERINGS x SPEEDS."""
        if isinstance(space, ActionBox):
            steering, speed = np.linspace(*space.steering, STEERINGS), np.linspace(*space.speed, SPEEDS)
            actions: Array = np.array(list(itertools.product(steering, speed)), np.float32)
        else:
            actions = np.arange(space.spec.count)
        commands = space.commands(actions).chosen
        return cls(actions, commands, tuple(command_words(*row) for row in commands))


def command_words(steering_rad: float, speed_mps: float) -> str:
    """Return a command in a racer's words, to the degree and the tenth.

    >>> command_words(0.5236, 1.0), command_words(-0.0002, 2.34)
    ('left 30° at 1 m/s', 'straight at 2.3 m/s')
    """
    degrees = float(np.radians(np.round(np.degrees(steering_rad))))
    return action_label(degrees, round(float(speed_mps), 1))


@dataclass(frozen=True, eq=False)
class Trials:
    """What came of each change: F failures, D moments, A options, H holds."""

    rows: Array
    """int64 (F,) of the drives."""
    moments: Array
    """int64 (D,) ticks before the failure."""
    holds: Array
    """int64 (H,) ticks."""
    options: Options
    saved: Array
    """bool (F, D, A, H): the car then passed the place; False where that is what it had done anyway."""

    @property
    def counts(self) -> Array:
        """How many of the F failures each change saves, int64 (D, A, H)."""
        return np.asarray(self.saved.sum(axis=0))

    @property
    def best_share(self) -> Array:
        """Share of the failures that some option saves at each moment, (D, H): a failure each its own."""
        return np.asarray(self.saved.any(axis=2).mean(axis=0))

    def ranked(self, commanded: Array) -> list[tuple[int, int, int]]:
        """Return changes (moment, option, hold) as indices, the best first.

        Those that save nearly as many as the best one does come first, the latest of them in front: before a mistake
        much can make up for it, and the latest change is nearest to the mistake. Of one moment the shortest hold, then
        the option nearest to what was done.

        Args:
            commanded: (D, 2) what was commonly commanded at each moment.
        """
        counts = self.counts
        nearly = max(1.0, counts.max() - NEARLY * len(self.rows))
        far = np.abs(self.options.commands - commanded[:, None]) @ (1.0, SPEED_WEIGHT)

        def merit(at: tuple[int, int, int]) -> tuple[float, ...]:
            moment, option, hold = at
            first = 0 if counts[at] >= nearly else -counts[at]
            near = self.moments[moment], self.holds[hold], -counts[at], round(float(far[moment, option]), 6)
            return (counts[at] < nearly, first, *near)

        moments, options, holds = counts.shape
        return sorted(itertools.product(range(moments), range(options), range(holds)), key=merit)


def try_alternatives(
    policy: Policy,
    worlds: Callable[[int], RaceWorld],
    drives: RecordedDrives,
    rows: Array,
    space: ActionSpace,
    remembers: bool = False,
) -> Trials:
    """Try every other action at every moment before the failures of some rows.

    Args:
        policy: Who drives on.
        worlds: Returns a world of so many cars like those that drove.
        drives: What was driven.
        rows: Which of them, (F,); each failed.
        space: What a car can be told.
        remembers: Whether the policy carries a memory from tick to tick.
    """
    options, moments = Options.of(space), np.array(MOMENTS)
    saved = np.zeros((len(rows), len(moments), len(options.actions), 0), bool)
    for hold in HOLDS:
        came = _try_all(policy, worlds, drives, rows, options, moments, hold, remembers)
        saved = np.concatenate([saved, came[..., None]], axis=3)
        if came.mean(axis=0).max() >= ENOUGH:
            break
    return Trials(rows, moments, np.array(HOLDS[: saved.shape[3]]), options, saved)


def _try_all(
    policy: Policy,
    worlds: Callable[[int], RaceWorld],
    drives: RecordedDrives,
    rows: Array,
    options: Options,
    moments: Array,
    hold: int,
    remembers: bool,
) -> Array:
    """Return what each option saves at each moment, held so long, bool (F, D, A)."""
    saved = np.zeros((len(rows), len(moments), len(options.actions)), bool)
    places, changes = [], []
    for f, d, a in np.ndindex(*saved.shape):
        row, tick = int(rows[f]), int(drives.last[rows[f]] - moments[d])
        if tick >= 1 and (drives.actions[tick, row] != options.actions[a]).any():  # the first tick holds the car
            places.append((f, d, a))
            changes.append(Change(row, tick, options.actions[a], hold))
    for place, passed in zip(places, rerun_with_change(policy, worlds, drives, changes, remembers), strict=True):
        saved[place] = passed
    return saved
