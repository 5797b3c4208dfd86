"""Whole episodes, but not for ever: a greedy policy may stand still in a scene that knows no end.

Begin with `play_bounded`. It differs from `evaluation.episodes.play_episodes` in its limit alone.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World, allocate

CUT = "cut_by_judge"
"""Status of an episode that was still going on at the limit."""


def play_bounded(
    policy: Policy,
    world: World,
    *,
    episodes_each: int,
    spare: int,
    max_ticks: int,
    seed: int,
    observe: Callable[[World, StepBuffers, Array], None],
) -> list[EpisodeRecord]:
    """Let every agent finish so many episodes, or play for `max_ticks`.

    Args:
        policy: Who plays.
        world: Worlds of one agent each, which tell of their episodes (`take_episodes`).
        episodes_each: Episodes that count, of every agent.
        spare: Episodes of every agent before those, which do not count.
        max_ticks: Ticks in all; what goes on then is cut, and counts with what it has earned so far.
        seed: Of the world's reset.
        observe: Sees the world, what it wrote and the actions after every tick.

    Returns:
        At least one episode of every agent that was ever active: those that count, world by world.
    """
    buffers, rows = allocate(world.spec), world.spec.num_worlds
    done: list[list[EpisodeRecord]] = [[] for _ in range(rows)]
    earned, steps = np.zeros(rows), np.zeros(rows, int)
    world.reset(buffers, seed)
    world.take_episodes()  # type: ignore[attr-defined]
    present = buffers.active[:, 0].copy()
    policy.forget(np.ones(rows, bool))
    for _ in range(max_ticks):
        if all(len(done[row]) >= episodes_each + spare for row in np.flatnonzero(present)):
            break
        seen = {name: part[:, 0] for name, part in buffers.observations.items()}
        mask = None if buffers.action_mask is None else buffers.action_mask[:, 0]
        actions = policy.act(seen, mask)[:, None]
        steps[buffers.active[:, 0]] += 1
        world.step(actions, buffers)
        observe(world, buffers, actions)
        earned += buffers.reward[:, 0]
        present |= buffers.active[:, 0]
        ended = buffers.ended[:, 0]
        for record in world.take_episodes():  # type: ignore[attr-defined]
            done[record.world].append(record)
        earned[ended], steps[ended] = 0.0, 0
        policy.forget(ended)
    for row in np.flatnonzero(present):
        if len(done[row]) < episodes_each + spare and (steps[row] or not done[row]):
            done[row].append(EpisodeRecord(int(row), 0, int(steps[row]), float(earned[row]), CUT))
    return [record for told in done for record in told[min(spare, max(len(told) - 1, 0)) : episodes_each + spare]]
