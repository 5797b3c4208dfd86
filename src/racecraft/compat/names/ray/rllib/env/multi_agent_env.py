"""`ray.rllib.env.multi_agent_env`: an environment whose reset and step give dictionaries by agent."""

from __future__ import annotations

from typing import Any


class MultiAgentEnv:
    """An environment of several agents.

    `reset() -> {agent: observation}`, `step({agent: action}) -> observations, rewards, dones, infos`, each by agent;
    the key `"__all__"` of dones tells whether the episode is over. Only agents that are shown act next.
    """

    observation_space: Any = None
    action_space: Any = None

    def reset(self) -> dict[Any, Any]:
        """Begin an episode."""
        raise NotImplementedError

    def step(self, action_dict: dict[Any, Any]) -> tuple[dict[Any, Any], ...]:
        """Act once, every agent that was shown."""
        raise NotImplementedError

    def render(self, mode: str | None = None) -> None:
        """Show it."""

    def close(self) -> None:
        """Let go of it."""


__all__ = ["MultiAgentEnv"]
