"""A minimal old-style `gym`, the one before 0.26: `reset` returns an observation, `step` four things.

Enough to wrap an environment and to make a registered one. Spaces are Gymnasium's.
"""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import gymnasium

from racecraft.compat.names.gym import error, spaces, utils

__version__ = "0.21.0"

Observation = TypeVar("Observation")
Action = TypeVar("Action")


class Env(Generic[Observation, Action]):
    """An environment: `reset() -> observation`, `step(action) -> observation, reward, done, info`."""

    metadata: dict[str, Any] = {"render.modes": []}
    reward_range = (-float("inf"), float("inf"))
    spec: Any = None
    action_space: Any
    observation_space: Any

    def step(self, action: Action) -> tuple[Observation, float, bool, dict[str, Any]]:
        """Act once."""
        raise NotImplementedError

    def reset(self) -> Observation:
        """Begin an episode."""
        raise NotImplementedError

    def render(self, mode: str = "human") -> Any:
        """Show the environment."""
        raise NotImplementedError

    def close(self) -> None:
        """Let go of everything."""

    def seed(self, seed: int | None = None) -> Any:
        """Fix chance, where there is any."""
        return None

    @property
    def unwrapped(self) -> Env[Any, Any]:
        """The environment under all wrappers."""
        return self

    def __enter__(self) -> Env[Observation, Action]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Wrapper(Env[Any, Any]):
    """An environment around another; what it does not change is the inner one's."""

    def __init__(self, env: Env[Any, Any]) -> None:
        self.env = env

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"private attribute '{name}' is not looked for in the wrapped environment")
        return getattr(self.env, name)

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once."""
        return self.env.step(action)

    def reset(self, **words: Any) -> Any:
        """Begin an episode."""
        return self.env.reset(**words)

    def render(self, mode: str = "human") -> Any:
        """Show the inner environment."""
        return self.env.render(mode)

    def close(self) -> None:
        """Close the inner environment."""
        self.env.close()

    def seed(self, seed: int | None = None) -> Any:
        """Fix the inner environment's chance."""
        return self.env.seed(seed)

    @property
    def unwrapped(self) -> Env[Any, Any]:
        """The environment under all wrappers."""
        return self.env.unwrapped


class ObservationWrapper(Wrapper):
    """Changes what is seen: override `observation`."""

    def reset(self, **words: Any) -> Any:
        """Begin an episode."""
        return self.observation(self.env.reset(**words))

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once."""
        seen, reward, done, info = self.env.step(action)
        return self.observation(seen), reward, done, info

    def observation(self, observation: Any) -> Any:
        """Change an observation."""
        raise NotImplementedError


class RewardWrapper(Wrapper):
    """Changes what is earned: override `reward`."""

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once."""
        seen, reward, done, info = self.env.step(action)
        return seen, self.reward(reward), done, info

    def reward(self, reward: float) -> float:
        """Change a reward."""
        raise NotImplementedError


class ActionWrapper(Wrapper):
    """Changes what is done: override `action`."""

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once."""
        return self.env.step(self.action(action))

    def action(self, action: Any) -> Any:
        """Change an action."""
        raise NotImplementedError


class _Made(Env[Any, Any]):
    """A Gymnasium environment with old manners."""

    def __init__(self, env: Any) -> None:
        self._env, self._seed = env, None
        self.action_space, self.observation_space, self.spec = env.action_space, env.observation_space, env.spec

    def reset(self) -> Any:
        """Begin an episode, the first one with the seed."""
        seen, _ = self._env.reset(seed=self._seed)
        self._seed = None
        return seen

    def step(self, action: Any) -> tuple[Any, float, bool, dict[str, Any]]:
        """Act once; a cut by the clock stands in the info as it used to."""
        seen, reward, terminated, truncated, info = self._env.step(action)
        if truncated:
            info = {**info, "TimeLimit.truncated": not terminated}
        return seen, float(reward), terminated or truncated, info

    def seed(self, seed: Any = None) -> Any:
        """Fix chance from the next reset on."""
        self._seed = seed
        return [seed]

    def render(self, mode: str = "human") -> Any:
        """Show the environment."""
        return self._env.render()

    def close(self) -> None:
        """Close it."""
        self._env.close()


def with_old_manners(new: Any) -> type[Env[Any, Any]]:
    """Return a class of Gymnasium's as the old gym had it."""

    class Old(_Made):
        def __init__(self, **words: Any) -> None:
            super().__init__(new(**words))

    Old.__name__ = Old.__qualname__ = new.__name__
    return Old


def make(id: str, **words: Any) -> Env[Any, Any]:
    """Make a registered Gymnasium environment and give it old manners."""
    return _Made(gymnasium.make(id, **words))


def register(id: str, entry_point: Any, **words: Any) -> None:
    """Register an environment; see `envs.registration`, which needs this module."""
    from racecraft.compat.names.gym.envs import registration

    registration.register(id, entry_point, **words)


__all__ = [
    "ActionWrapper", "Env", "ObservationWrapper", "RewardWrapper", "Wrapper", "error", "make", "register", "spaces",
    "utils",
]  # fmt: skip
