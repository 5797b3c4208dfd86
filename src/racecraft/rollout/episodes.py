"""Let a policy play whole episodes, and keep what they came to."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World, allocate

Observer = Callable[[World, StepBuffers, Array], None]
"""Sees the world, what it wrote and the actions (N, M, …) after every tick."""


def play_episodes(
    policy: Policy, world: World, *, episodes_each: int = 1, seed: int = 0, observers: Iterable[Observer] = ()
) -> list[EpisodeRecord]:
    """Let every agent play until it has finished so many episodes; worlds that are done earlier play on unwatched.

    Returns:
        The first `episodes_each` episodes of every agent, world by world.
    """
    spec, buffers = world.spec, allocate(world.spec)
    rows = spec.num_worlds * spec.num_agents
    done: list[list[EpisodeRecord]] = [[] for _ in range(rows)]
    tally = _Tally(rows)
    world.reset(buffers, seed)
    policy.forget(np.ones(rows, bool))
    while any(len(episodes) < episodes_each for episodes in done):
        seen = {name: part.reshape(rows, *part.shape[2:]) for name, part in buffers.observations.items()}
        mask = None if buffers.action_mask is None else buffers.action_mask.reshape(rows, -1)
        actions = policy.act(seen, mask).reshape(spec.num_worlds, spec.num_agents, *spec.actions.shape)
        world.step(actions, buffers)
        for observe in observers:
            observe(world, buffers, actions)
        for record in tally.take(world, buffers):
            done[record.world * spec.num_agents + record.agent].append(record)
        policy.forget(buffers.ended.reshape(rows))
    return [record for episodes in done for record in episodes[:episodes_each]]


class _Tally:
    """Episodes in the world's own words where it tells of them, else counted from the buffers."""

    def __init__(self, rows: int) -> None:
        self._steps, self._reward = np.zeros(rows, int), np.zeros(rows)

    def take(self, world: World, buffers: StepBuffers) -> list[EpisodeRecord]:
        take_episodes = getattr(world, "take_episodes", None)
        if take_episodes is not None:
            return list(take_episodes())
        self._steps += 1
        self._reward += buffers.reward.reshape(-1)
        records = []
        for row in np.flatnonzero(buffers.ended):
            n, m = divmod(int(row), buffers.reward.shape[1])
            status = "terminated" if buffers.terminated[n, m] else "truncated"
            records.append(EpisodeRecord(n, m, int(self._steps[row]), float(self._reward[row]), status))
            self._steps[row], self._reward[row] = 0, 0.0
        return records
