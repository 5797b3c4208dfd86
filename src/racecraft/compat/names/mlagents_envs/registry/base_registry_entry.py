"""`BaseRegistryEntry`: one scene of a registry; derive from it for a source of your own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from racecraft.compat.names.mlagents_envs.base_env import BaseEnv


class BaseRegistryEntry(ABC):
    """One scene; nothing is fetched before `make`."""

    def __init__(self, identifier: str, expected_reward: float | None, description: str | None) -> None:
        self.identifier = identifier
        """Its name."""
        self.expected_reward = expected_reward
        """What a trained agent earns."""
        self.description = description
        """What the scene is."""

    @abstractmethod
    def make(self, **kwargs: Any) -> BaseEnv:
        """Open the scene."""


__all__ = ["BaseRegistryEntry"]
