"""One episode from each of several starts, kept so that any tick of it can be driven again. Begin with `record_drives`.

A world's saved state is all it needs to go on, bit by bit; so a failure is kept with the states before it, and what
would have become of another action is no guess: it is driven (`rerun.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, StepBuffers, World, allocate
from racecraft.rollout.episodes import play_episodes
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.world import RaceWorld

FAILURES = (race.OFF_TRACK, race.CRASHED, race.IMMOBILISED, race.REVERSED)
"""How an episode ends that is explained; one that ran out of time failed nowhere in particular."""

State = Mapping[str, Array]
"""What `RaceWorld.save_state` gives."""


@dataclass(frozen=True, eq=False)
class RecordedDrives:
    """N cars' first episodes, tick by tick. A row's episode ends at its `last` tick; what follows is another's."""

    reports: Array
    """TICK_REPORT (T, N)."""
    actions: Array
    """(T, N, *action shape), as the world was told."""
    states: tuple[State, ...]
    """Of all worlds, before each tick, (T,)."""
    last: Array
    """int64 (N,): the tick, from 0, that ends each row's episode."""

    def __len__(self) -> int:
        return len(self.last)

    @property
    def failed(self) -> Array:
        """Rows that failed, in the order of their starts, int64 (F,)."""
        return np.flatnonzero(np.isin(self.endings["status"], FAILURES) & ~self.endings["truncated"])

    @property
    def endings(self) -> Array:
        """The report that ends each row's episode, TICK_REPORT (N,)."""
        return np.asarray(self.reports[self.last, np.arange(len(self.last))])

    def of(self, row: int) -> Array:
        """Return a row's episode, TICK_REPORT (T of this row,)."""
        return np.asarray(self.reports[: self.last[row] + 1, row])

    def state(self, tick: int, row: int) -> State:
        """Return what one row's world was before a tick, as of a world alone."""
        return {name: part[[row]] for name, part in self.states[tick].items()}


def record_drives(policy: Policy, world: RaceWorld, seed: int = 0) -> RecordedDrives:
    """Drive one episode from every start of a world, greedily and side by side, and keep all of it.

    Args:
        policy: Who drives.
        world: One car in each world.
        seed: Of what chance does, where it does.
    """
    keeper = _Keeper(world, seed)
    play_episodes(policy, world, seed=seed, observers=[keeper])
    reports = np.array(keeper.reports)
    ended = reports["terminated"] | reports["truncated"]
    return RecordedDrives(reports, np.array(keeper.actions), tuple(keeper.states), ended.argmax(axis=0))


class _Keeper:
    """Keeps every tick, and the state before it: the first is the reset's, which is the same every time."""

    def __init__(self, world: RaceWorld, seed: int) -> None:
        world.reset(allocate(world.spec), seed)
        self.states: list[State] = [world.save_state()]
        self.reports: list[Array] = []
        self.actions: list[Array] = []

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        assert isinstance(world, RaceWorld)
        self.reports.append(world.reports[:, 0].copy())
        self.actions.append(actions[:, 0].copy())
        self.states.append(world.save_state())
