"""`UnityParallelEnv`: all agents of a scene act at once, as PettingZoo's `ParallelEnv`."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.mlagents_envs.base_env import BaseEnv
from racecraft.compat.names.mlagents_envs.envs.unity_pettingzoo_base_env import UnityPettingzooBaseEnv
from racecraft.contract.errors import MissingExtraError

try:
    from pettingzoo import ParallelEnv
except ImportError as cause:
    raise MissingExtraError("PettingZoo is not installed; UnityParallelEnv needs it. pip install pettingzoo") from cause


class UnityParallelEnv(UnityPettingzooBaseEnv, ParallelEnv):  # type: ignore[type-arg,misc,unused-ignore]
    """Everybody at once; see `UnityPettingzooBaseEnv`.

    Args:
        env: A low-level environment.
        seed: Of the spaces.
    """

    def __init__(self, env: BaseEnv, seed: int | None = None) -> None:
        super().__init__(env, seed)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begin a game. Players take a seed when they start, so one given here changes nothing.

        Returns:
            Observations and infos, by agent.
        """
        self._begin_game()
        return dict(self._seen), dict(self.infos)

    def step(self, actions: dict[str, Any]) -> Any:
        """Act; agents without an action get zeros.

        Returns:
            Observations, rewards, terminations, truncations and infos, of everybody who asks or has just left.
        """
        self._act({agent: action for agent, action in actions.items() if agent in self._rows})
        result = (dict(self._seen), self.rewards, self.terminations, self.truncations, self.infos)
        self.agents = [agent for agent in self.agents if agent in self._rows]
        return result


__all__ = ["UnityParallelEnv"]
