"""Whole games among the seats of one policy, told as AWS's chart tells them: what a game pays in all, and its turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, StepBuffers, World
from racecraft.rollout.episodes import play_episodes


@dataclass(frozen=True)
class GameFigures:
    """What some games came to."""

    reward: Array
    """What each paid all its snakes together, float64 (games,)."""
    length: Array
    """Turns that each lasted, int64 (games,)."""

    def told(self) -> dict[str, float]:
        """Return means with their standard errors, in reward units and turns."""
        games = len(self.reward)
        return {
            "reward": float(self.reward.mean()),
            "reward_error": float(self.reward.std() / games**0.5),
            "length": float(self.length.mean()),
            "length_error": float(self.length.std() / games**0.5),
        }


def play_whole_games(policy: Policy, world: World, seed: int) -> GameFigures:
    """Let a policy play every seat of one game in every world, each to its end.

    Each world's first game counts, so that short games are not preferred.
    """
    tally = _Tally(world)
    play_episodes(policy, world, seed=seed, observers=[tally])
    return GameFigures(tally.reward, tally.length)


class _Tally:
    """Adds up the first game of each world; it is over when every seat's episode has ended."""

    def __init__(self, world: World) -> None:
        self._left = np.zeros((world.spec.num_worlds, world.spec.num_agents), bool)
        self.reward = np.zeros(world.spec.num_worlds)
        self.length = np.zeros(world.spec.num_worlds, np.int64)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        playing = ~self._left.all(axis=1)
        self.length += playing
        self.reward += np.where(playing, buffers.reward.sum(axis=1, dtype=np.float64), 0.0)
        self._left |= buffers.ended


class RandomMoves:
    """Any allowed move, each as likely; any at all where there is no mask. It is a `Policy`."""

    def __init__(self, seed: int, count: int = 4) -> None:
        self._rng, self._count = np.random.default_rng(seed), count

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return moves, int64 (R,)."""
        liking = self._rng.random((len(next(iter(observations.values()))), self._count))
        return np.asarray((liking if action_mask is None else liking * action_mask).argmax(axis=1))

    def forget(self, rows: Array) -> None:
        """Nothing is remembered."""
