"""`UnityAECEnv`: the agents of a scene act one after the other, as PettingZoo's `AECEnv`."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.gym import error
from racecraft.compat.names.mlagents_envs.base_env import BaseEnv
from racecraft.compat.names.mlagents_envs.envs.unity_pettingzoo_base_env import UnityPettingzooBaseEnv
from racecraft.contract.errors import MissingExtraError

try:
    from pettingzoo import AECEnv
except ImportError as cause:
    raise MissingExtraError("PettingZoo is not installed; UnityAECEnv needs it. pip install pettingzoo") from cause


class UnityAECEnv(UnityPettingzooBaseEnv, AECEnv):  # type: ignore[type-arg,misc,unused-ignore]
    """One after the other; the scene goes on when everybody has acted. See `UnityPettingzooBaseEnv`.

    Args:
        env: A low-level environment.
        seed: Of the spaces.
    """

    def __init__(self, env: BaseEnv, seed: int | None = None) -> None:
        super().__init__(env, seed)
        self.agent_selection: str = ""
        self._begin_round({})

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """Begin a game. Players take a seed when they start, so one given here changes nothing."""
        self._begin_game()
        self._begin_round({})

    def step(self, action: Any) -> None:
        """Note the selected agent's action, None for one that has left; with the last one's the scene goes on."""
        if not self.agents:
            raise error.Error("nobody is left; call reset() first.")
        agent = self.agent_selection
        self._cumulative_rewards[agent] = 0.0
        if self.terminations[agent] or self.truncations[agent]:
            if action is not None:
                raise ValueError(f"{agent} has left; its action must be None")
            self._forget(agent)
        else:
            self._chosen[agent] = action
        self._turns.pop(0)
        self.rewards = dict.fromkeys(self.agents, 0.0)
        if self._turns:
            self.agent_selection = self._turns[0]
        elif self._chosen:
            earned = self._cumulative_rewards
            self._act(self._chosen)
            self._begin_round(earned)

    def observe(self, agent: str) -> Any:
        """Return what an agent sees."""
        return self._seen[agent]

    def _begin_round(self, earned: dict[str, float]) -> None:
        self._chosen: dict[str, Any] = {}
        self._turns = list(self.agents)
        self._cumulative_rewards = {agent: earned.get(agent, 0.0) + self.rewards[agent] for agent in self.agents}
        if self._turns:
            self.agent_selection = self._turns[0]

    def _forget(self, agent: str) -> None:
        self.agents.remove(agent)
        for values in (self.rewards, self.terminations, self.truncations, self.infos, self._cumulative_rewards):
            values.pop(agent, None)


__all__ = ["UnityAECEnv"]
