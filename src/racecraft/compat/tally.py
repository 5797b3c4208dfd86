"""Training episodes of a script's environment as they end: what foreign metric lines are told from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium

Ended = Callable[[float, int], None]
"""Hears of an episode's sum of rewards and of its steps."""


class Watched(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment of one agent whose episodes are told of."""

    def __init__(self, env: gymnasium.Env[Any, Any], ended: Ended) -> None:
        super().__init__(env)
        self._ended, self._reward, self._steps = ended, 0.0, 0

    def reset(self, **words: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        self._reward, self._steps = 0.0, 0
        return self.env.reset(**words)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act once."""
        seen, reward, terminated, truncated, info = self.env.step(action)
        self._reward, self._steps = self._reward + float(reward), self._steps + 1
        if terminated or truncated:
            self._ended(self._reward, self._steps)
        return seen, float(reward), terminated, truncated, info


@dataclass(frozen=True)
class Told:
    """One episode of an environment, all its agents together."""

    reward: float
    """Sum of rewards of all agents, as RLlib counts."""
    steps: int
    by_policy: Mapping[str, list[float]] = field(default_factory=dict)
    """Each agent's sum, by the policy that it has."""


class Tally:
    """Episodes since somebody last asked."""

    def __init__(self) -> None:
        self._told: list[Told] = []

    def ended(self, reward: float, steps: int) -> None:
        """Take in an episode of one agent."""
        self.add(Told(reward, steps))

    def add(self, told: Told) -> None:
        """Take in an episode."""
        self._told.append(told)

    def take(self) -> list[Told]:
        """Return them, oldest first, and forget them."""
        told, self._told = self._told, []
        return told
