"""`gym.envs.registration`: environments of a script's own by name, for `gym.make` and RLlib's experiments."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import gymnasium

from racecraft.compat.names.gym import make
from racecraft.compat.old_gym import FromOldGym
from racecraft.compat.rllib_training import register_env
from racecraft.contract.arguments import require_arguments

registry = gymnasium.registry
spec = gymnasium.spec
UNUSED = ("tags", "local_only", "timestep_limit", "trials", "wrapper_config_path", "autoreset", "order_enforce",
          "disable_env_checker", "apply_api_compatibility", "additional_wrappers", "vector_entry_point")  # fmt: skip
"""What some gym takes, and what changes nothing here."""


def register(
    id: str,
    entry_point: str | Callable[..., Any],
    reward_threshold: float | None = None,
    nondeterministic: bool = False,
    max_episode_steps: int | None = None,
    kwargs: dict[str, Any] | None = None,
    **unused: Any,
) -> None:
    """Register an environment, of old or new manners.

    Args:
        id: Such as "Portfolio-v0".
        entry_point: "module:Class", or what makes one.
        reward_threshold: Mean return that counts as solved.
        nondeterministic: Whether seed and actions do not fix an episode.
        max_episode_steps: Ticks after which an episode is cut.
        kwargs: What it is made with.
        **unused: `UNUSED`.

    Raises:
        SettingError: An argument that no gym takes.
    """
    require_arguments("register", unused, UNUSED)
    registry.pop(id, None)  # a script may be run once more in one process
    gymnasium.register(
        id,
        entry_point=lambda **words: FromOldGym(load(entry_point)(**words)),
        reward_threshold=reward_threshold,
        nondeterministic=nondeterministic,
        max_episode_steps=max_episode_steps,
        kwargs=kwargs or {},
        disable_env_checker=True,
        order_enforce=False,
    )
    register_env(id, lambda env_config: gymnasium.make(id, **env_config))


def load(name: str | Callable[..., Any]) -> Callable[..., Any]:
    """Return what "module:Class" names; what is no text stands for itself."""
    if not isinstance(name, str):
        return name
    module, _, attribute = name.partition(":")
    made: Callable[..., Any] = getattr(importlib.import_module(module), attribute)
    return made


__all__ = ["load", "make", "register", "registry", "spec"]
