"""Repeat a drive from a state before its end with one action changed. Begin with `rerun_with_change`.

Each change is a world of its own beside hundreds of others: it begins in the state before the change, takes the other
action for some ticks, and then the policy drives on. A policy that remembers is shown the episode from its first tick,
told what it did, so that it remembers at the change what it remembered then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.recorded_drives import RecordedDrives, State

AT_ONCE = 384
"""Worlds that are driven side by side."""
PAST_M = 1.5
"""A car is past the place where it failed when it is so far beyond it and still drives."""
PATIENCE_TICKS = 60
"""How long after the moment of the failure it may take to be past it."""


@dataclass(frozen=True, eq=False)
class Change:
    """Another action at one moment of one drive."""

    row: int
    """Whose drive."""
    tick: int
    """From 0: the first tick that is told otherwise."""
    action: Array
    """What it is told, (*action shape)."""
    hold: int
    """For so many ticks."""


def rerun_with_change(
    policy: Policy,
    worlds: Callable[[int], RaceWorld],
    drives: RecordedDrives,
    changes: Sequence[Change],
    remembers: bool = False,
    past_m: float = PAST_M,
) -> Array:
    """Return for each change whether the car then passes the place where it failed, bool (C,).

    Args:
        policy: Who drives on after the change.
        worlds: Returns a world of so many cars like those that drove.
        drives: What was driven.
        changes: Each of a row that failed.
        remembers: Whether the policy carries a memory from tick to tick.
        past_m: How far beyond the place counts as past it.
    """
    saved = np.zeros(len(changes), bool)
    order = sorted(range(len(changes)), key=lambda k: _length(changes[k], drives, remembers))
    size = min(AT_ONCE, len(changes))
    world = worlds(size) if size else None
    for first in range(0, len(order), max(size, 1)):
        assert world is not None
        some = order[first : first + size]
        padded = [changes[k] for k in some] + [changes[some[-1]]] * (size - len(some))
        saved[some] = _drive_on(policy, world, drives, padded, remembers, past_m)[: len(some)]
    return saved


def _length(change: Change, drives: RecordedDrives, remembers: bool) -> int:
    """Return how long a change is driven at most: those of one length go side by side."""
    return int(drives.last[change.row]) - (0 if remembers else change.tick)


def _drive_on(
    policy: Policy, world: RaceWorld, drives: RecordedDrives, changes: Sequence[Change], remembers: bool, past_m: float
) -> Array:
    """Drive every change to its end, bool (C,)."""
    rows = np.array([change.row for change in changes])
    ticks = np.array([change.tick for change in changes])
    holds = np.array([change.hold for change in changes])
    others = np.array([change.action for change in changes])
    begin = np.zeros_like(ticks) if remembers else ticks
    endings, last = drives.endings[rows], drives.last[rows]
    goal = np.minimum(endings["progress"] + 100.0 * past_m / world.track.length, 100.0)
    buffers = allocate(world.spec)
    world.load_state(states_of(drives, begin, rows), buffers)
    policy.reset_state(np.ones(len(rows), bool))
    saved, decided = np.zeros(len(rows), bool), np.zeros(len(rows), bool)
    now = begin.copy()
    while not decided.all():
        seen = {name: part.reshape(len(rows), *part.shape[2:]) for name, part in buffers.observations.items()}
        actions = np.array(policy.act(seen, None))
        is_recorded = now < ticks
        actions[is_recorded] = drives.actions[now[is_recorded], rows[is_recorded]]
        changed = ~is_recorded & (now < ticks + holds)
        actions[changed] = others[changed]
        world.step(actions[:, None], buffers)
        reports = world.reports[:, 0]
        ended = reports["terminated"] | reports["truncated"]
        past = np.where(ended, reports["status"] == race.LAP_COMPLETE, reports["progress"] >= goal)
        saved |= past & ~decided
        decided |= past | ended | (now >= last + PATIENCE_TICKS)
        policy.reset_state(ended)
        now += 1
    return saved


def states_of(drives: RecordedDrives, ticks: Array, rows: Array) -> State:
    """Return one state of worlds that are each a row of the drives before a tick of its own.

    Args:
        drives: Whose.
        ticks: (W,) from 0.
        rows: (W,).
    """
    return {
        name: np.stack([drives.states[tick][name][row] for tick, row in zip(ticks, rows, strict=True)])
        for name in drives.states[0]
    }
