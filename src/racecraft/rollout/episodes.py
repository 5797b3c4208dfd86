"""Let a policy play whole episodes, and keep what they came to. The one runner of episodes beside the collector.

A greedy policy may stand still in a world that knows no end; `max_ticks` cuts it then, or it would be judged for ever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, runtime_checkable

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World, allocate
from racecraft.rollout.statistics import EpisodeCounter

StepObserver = Callable[[World, StepBuffers, Array], None]
"""Sees the world, what it wrote and the actions just taken, (N, M, *action shape), after every tick. Never writes."""


@runtime_checkable
class RestsAgents(Protocol):
    """A world that can leave out agents that nobody waits for any more."""

    def rest(self, rows: Array) -> None:
        """These agents (bool (N, M)) need not act, see or be told of until the next `reset`."""
        ...


CUT = "cut_by_judge"
"""Status of an episode that was still going on at `max_ticks`."""


def play_episodes(
    policy: Policy,
    world: World,
    *,
    episodes_each: int = 1,
    seed: int = 0,
    observers: Iterable[StepObserver] = (),
    spare: int = 0,
    max_ticks: int | None = None,
    poll: Callable[[], None] | None = None,
) -> list[EpisodeRecord]:
    """Let every agent play until it has finished so many episodes; those that are done earlier play on unwatched.

    Args:
        policy: Who plays.
        world: Worlds to play in.
        episodes_each: Episodes that count, of every agent.
        seed: Of the world's reset.
        observers: See every tick.
        spare: Episodes of every agent before those, which do not count; for worlds whose reset need not put an agent
            back to a start.
        max_ticks: Ticks in all; what goes on then is cut, and counts with what it has earned so far. An agent that was
            never active is not waited for. None: as long as it takes, every agent.
        poll: Called before every tick; what it raises ends the play.

    Returns:
        The episodes that count, agent by agent, world by world.
    """
    spec, buffers = world.spec, allocate(world.spec)
    rows, wanted = spec.num_worlds * spec.num_agents, episodes_each + spare
    done: list[list[EpisodeRecord]] = [[] for _ in range(rows)]
    observers = tuple(observers)
    resting = world if isinstance(world, RestsAgents) and not observers else None  # who looks on is told of everyone
    counter, earned, steps = EpisodeCounter(world), np.zeros(rows), np.zeros(rows, int)
    world.reset(buffers, seed)
    counter.begin()
    policy.reset_state(np.ones(rows, bool))
    present = buffers.active.reshape(-1).copy() if max_ticks is not None else np.ones(rows, bool)
    unfinished = np.ones(rows, bool)
    tick = 0
    while (unfinished & present).any() and tick != max_ticks:
        if poll is not None:
            poll()
        seen = {name: part.reshape(rows, *part.shape[2:]) for name, part in buffers.observations.items()}
        mask = None if buffers.action_mask is None else buffers.action_mask.reshape(rows, -1)
        actions = policy.act(seen, mask).reshape(spec.num_worlds, spec.num_agents, *spec.actions.shape)
        steps += buffers.active.reshape(-1)
        world.step(actions, buffers)
        for observe in observers:
            observe(world, buffers, actions)
        earned += buffers.reward.reshape(-1)
        present |= buffers.active.reshape(-1)
        counter.count(buffers)
        ended_now = counter.pop()
        for record in ended_now:
            row = record.world * spec.num_agents + record.agent
            done[row].append(record)
            unfinished[row] = len(done[row]) < wanted
        if resting is not None and ended_now:
            resting.rest(~unfinished.reshape(spec.num_worlds, spec.num_agents))
        ended = buffers.ended.reshape(rows)
        if ended.any():
            earned[ended], steps[ended] = 0.0, 0
            policy.reset_state(ended)
        tick += 1
    for row in np.flatnonzero(present).tolist():
        if len(done[row]) < wanted and (steps[row] or not done[row]):
            n, m = divmod(row, spec.num_agents)
            done[row].append(EpisodeRecord(n, m, int(steps[row]), float(earned[row]), CUT))
    return [record for records in done for record in records[min(spare, max(len(records) - 1, 0)) : wanted]]
