"""An environment of the old gym as one of Gymnasium's: `reset` gives one thing there, and `step` four."""

from __future__ import annotations

import inspect
from typing import Any

import gymnasium

from racecraft.worlds.gymnasium.env.user_env import contract_error, missing_error, reward_given


class FromOldGym(gymnasium.Env[Any, Any]):
    """One environment, old or new.

    Args:
        env: With `reset` and `step`, in either form.

    Raises:
        EnvironmentFailedError: It does not say what it shows, or what may be done.
    """

    def __init__(self, env: Any) -> None:
        self.env = env
        for name in ("observation_space", "action_space"):
            if not hasattr(env, name):
                raise missing_error(env, name)
        self.observation_space, self.action_space = env.observation_space, env.action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        first = start_episode(self.env, seed)
        is_new = isinstance(first, tuple) and len(first) == 2 and isinstance(first[1], dict)
        return first if is_new else (first, {})

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Act once; an episode that a time limit cut was truncated."""
        result = self.env.step(action)
        if not isinstance(result, tuple) or len(result) not in (4, 5):
            things = f"{len(result)} things" if isinstance(result, tuple) else "one thing"
            raise contract_error(self.env, "step", "its answer", result, "(observation, reward, done, info)", things)
        if len(result) == 5:
            return result
        seen, reward, done, info = result
        cut = bool(done and (info or {}).get("TimeLimit.truncated", False))
        return seen, reward_given(self.env, reward), bool(done) and not cut, cut, info

    def close(self) -> None:
        """Let go of it."""
        if hasattr(self.env, "close"):
            self.env.close()


def start_episode(env: Any, seed: int | None) -> Any:
    """Begin an episode of an environment and fix its chance in the manner that it has: `seed`, or `reset(seed=…)`."""
    if seed is None:
        return env.reset()
    if callable(getattr(env, "seed", None)):
        env.seed(seed)
        return env.reset()
    return env.reset(seed=seed) if takes_seed(env) else env.reset()


def takes_seed(env: Any) -> bool:
    """Tell whether an environment's `reset` is told a seed."""
    try:
        return "seed" in inspect.signature(env.reset).parameters
    except (TypeError, ValueError):
        return False
