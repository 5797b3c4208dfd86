"""Training episodes of a script's environment as they go on: what foreign metric lines and callbacks are told from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import gymnasium

Ended = Callable[[float, int], None]
"""Hears of an episode's sum of rewards and of its steps."""
SOLE, SOLE_POLICY = "agent0", "default_policy"
"""What RLlib calls the one agent of an environment that names none, and its policy."""


class EpisodeListener(Protocol):
    """Hears of every episode of the worlds that are learned in, tick by tick."""

    def on_env(self, env: Any) -> int:
        """Hear of an environment, as its maker gave it; return its number."""
        ...

    def on_start(self, world: int, policies: Mapping[Any, str], seen: Mapping[Any, Any]) -> None:
        """Hear that an episode begins: each agent's policy, and what it sees, by agent."""
        ...

    def on_step(
        self, world: int, done: Mapping[Any, Any], seen: Mapping[Any, Any], earned: Mapping[Any, float],
        infos: Mapping[Any, Any],
    ) -> None:  # fmt: skip
        """Hear of a tick: what was done, seen, earned and said, by agent."""
        ...

    def on_end(self, world: int) -> None:
        """Hear that an episode is over."""
        ...


class Watched(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment of one agent whose episodes are told of.

    Args:
        env: Of Gymnasium's manners.
        ended: Hears of each episode.
        listener: Hears of each tick; None: nobody does.
        own: The environment as the script made it.
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], ended: Ended, listener: EpisodeListener | None = None, own: Any = None
    ) -> None:
        super().__init__(env)
        self._ended, self._reward, self._steps = ended, 0.0, 0
        self._listener, self._number = listener, listener.on_env(own) if listener else 0

    def reset(self, **words: Any) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; one that was not over was cut from outside, by a limit of ticks."""
        if self._steps:
            self._end()
        observation = self.env.reset(**words)
        if self._listener is not None:
            self._listener.on_start(self._number, {SOLE: SOLE_POLICY}, {SOLE: observation[0]})
        return observation

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act once."""
        seen, reward, terminated, truncated, info = self.env.step(action)
        self._reward, self._steps = self._reward + float(reward), self._steps + 1
        if self._listener is not None:
            self._listener.on_step(self._number, {SOLE: action}, {SOLE: seen}, {SOLE: float(reward)}, {SOLE: info})
        if terminated or truncated:
            self._end()
        return seen, float(reward), terminated, truncated, info

    def _end(self) -> None:
        self._ended(self._reward, self._steps)
        if self._listener is not None:
            self._listener.on_end(self._number)
        self._reward, self._steps = 0.0, 0


@dataclass(frozen=True)
class WatchedEpisode:
    """One episode of an environment, all its agents together."""

    reward: float
    """Sum of rewards of all agents, as RLlib counts."""
    steps: int
    by_policy: Mapping[str, list[float]] = field(default_factory=dict)
    """Each agent's sum, by the policy that it has."""


class FinishedEpisodes:
    """Episodes since somebody last asked."""

    def __init__(self) -> None:
        self._told: list[WatchedEpisode] = []

    def ended(self, reward: float, steps: int) -> None:
        """Take in an episode of one agent."""
        self.add(WatchedEpisode(reward, steps))

    def add(self, episode: WatchedEpisode) -> None:
        """Take in an episode."""
        self._told.append(episode)

    def pop(self) -> list[WatchedEpisode]:
        """Return them, oldest first, and forget them."""
        episodes, self._told = self._told, []
        return episodes
