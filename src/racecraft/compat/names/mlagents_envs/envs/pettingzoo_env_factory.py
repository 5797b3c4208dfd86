"""`PettingZooEnvFactory`: a registered scene as a PettingZoo environment."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.mlagents_envs import logging_util
from racecraft.compat.names.mlagents_envs.envs.unity_aec_env import UnityAECEnv
from racecraft.compat.names.mlagents_envs.registry import default_registry

logger = logging_util.get_logger(__name__)


class PettingZooEnvFactory:
    """Makes one scene of `default_registry`."""

    def __init__(self, env_id: str) -> None:
        self.env_id = env_id

    def env(self, seed: int | None = None, **words: Any) -> UnityAECEnv:
        """Open the scene; further words are those of `UnityEnvironment`."""
        opened = default_registry[self.env_id].make(**({} if seed is None else {"seed": seed}), **words)
        return UnityAECEnv(opened, seed)


__all__ = ["PettingZooEnvFactory", "logger"]
