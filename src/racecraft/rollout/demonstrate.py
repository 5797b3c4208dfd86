"""Let a policy show what it does, for others to learn from. Begin with `demonstrate`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from racecraft.algorithms.learner import Decision
from racecraft.algorithms.policy_spec import spec_of_policy
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec, World
from racecraft.formats.demonstrations import Demonstrations
from racecraft.rollout.collector import Collector


class Demonstrator:
    """A policy as the collector asks one: greedy, or drawn by its own probabilities.

    Raises:
        SettingError: Draws are wanted of a policy that offers none.
    """

    device = torch.device("cpu")
    columns: Mapping[str, ArraySpec] = {}

    def __init__(self, policy: Policy, sampled: bool) -> None:
        self._policy, self._sample = policy, getattr(policy, "sample", None) if sampled else None
        if sampled and self._sample is None:
            raise SettingError(
                "this policy draws no actions, it only takes the likeliest; record it without --sampled."
            )

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Ask the policy."""
        if self._sample is not None:
            return Decision(self._sample(observations, action_mask, generator), {})
        return Decision(self._policy.act(observations, action_mask), {})

    def reset_state(self, rows: Array) -> None:
        """Pass on whose episode ended."""
        self._policy.reset_state(rows)


def demonstrate(
    policy: Policy,
    world: World,
    episodes: int,
    *,
    seed: int = 0,
    sampled: bool = False,
    source: Mapping[str, Any] | None = None,
) -> Demonstrations:
    """Let a policy play whole episodes and return what it saw and did.

    Args:
        policy: Who shows; any `Policy`, trained or written by hand. One that remembers is not asked about rows that
            stand parked, so it must not count rows.
        world: Where.
        episodes: How many; each of the world's rows plays its share, and what is too much is left out.
        seed: Of the world and of draws.
        sampled: Draw actions by the policy's probabilities instead of the likeliest (`sample`).
        source: Where they come from, for people.

    Raises:
        SettingError: Draws are wanted of a policy that offers none.
    """
    rows = world.spec.num_worlds * world.spec.num_agents
    collector = Collector(world, Demonstrator(policy, sampled), 1, seed)
    batch = collector.collect_episodes(-(-episodes // rows))
    ticks, number = in_episodes(batch, episodes)
    flat = {name: array.reshape(-1, *array.shape[2:])[ticks] for name, array in batch.observations.items()}
    mask = batch.action_mask
    return Demonstrations(
        observations=flat,
        actions=batch.actions.reshape(-1, *batch.actions.shape[2:])[ticks],
        reward=batch.reward.reshape(-1)[ticks],
        episode=number,
        spec=spec_of_policy(world.spec, "", {}).as_dictionary(),
        action_mask=None if mask is None else mask.reshape(-1, mask.shape[-1])[ticks],
        source=dict(source or {}),
    )


def in_episodes(batch: RolloutBatch, episodes: int) -> tuple[Array, Array]:
    """Return the active ticks of the first episodes, t * R + r, episode by episode; and whose each is, int32.

    The first are the first of every row, then the second of every row: not those that ended first, which are the
    shortest.
    """
    ended = batch.terminated | batch.truncated
    rows = ended.shape[1]
    number = (np.cumsum(ended, axis=0) - ended) * rows + np.arange(rows)
    active = np.flatnonzero(batch.active.reshape(-1))
    of_tick = number.reshape(-1)[active]
    order = np.argsort(of_tick, kind="stable")
    ticks, names = active[order], of_tick[order]
    _, place = np.unique(names, return_inverse=True)
    kept = place < episodes
    return ticks[kept], place[kept].astype(np.int32)
