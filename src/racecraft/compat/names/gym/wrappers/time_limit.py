"""`gym.wrappers.time_limit`."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.gym import Wrapper


class TimeLimit(Wrapper):
    """Cuts an episode after so many steps; None: after none."""

    def __init__(self, env: Any, max_episode_steps: int | None = None) -> None:
        super().__init__(env)
        self.action_space, self.observation_space = env.action_space, env.observation_space
        self._most, self._steps = max_episode_steps, 0

    def reset(self, **words: Any) -> Any:
        """Begin an episode."""
        self._steps = 0
        return self.env.reset(**words)

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once; a cut stands in the info, as it used to."""
        seen, reward, done, info = self.env.step(action)
        self._steps += 1
        if self._most is not None and self._steps >= self._most:
            info, done = {**info, "TimeLimit.truncated": not done}, True
        return seen, reward, done, info


__all__ = ["TimeLimit"]
