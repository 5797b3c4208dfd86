"""`default_registry`: ML-Agents' example scenes by name.

A scene is looked for in ML-Agents' own cache, then fetched as its manifest says (`RACECRAFT_UNITY_MANIFEST` names
another). Where that cannot be had, Basic is our stand-in of it, and that is said.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Any

from racecraft.compat.names.mlagents_envs.environment import UnityEnvironment
from racecraft.compat.names.mlagents_envs.exception import UnityEnvironmentException
from racecraft.envs.unity.builds import BUILTIN, Build, find_build, read_manifest
from racecraft.envs.unity.errors import BuildError


class UnityEnvRegistryEntry:
    """One scene; nothing is fetched before `make`."""

    def __init__(self, identifier: str) -> None:
        self.identifier = identifier

    @property
    def expected_reward(self) -> float | None:
        """What a trained agent earns, as the manifest says."""
        return read_manifest()[self.identifier].expected_reward

    @property
    def description(self) -> str | None:
        """What the scene is, as the manifest says."""
        return read_manifest()[self.identifier].description

    def make(self, **words: Any) -> UnityEnvironment:
        """Open the scene; the words are those of `UnityEnvironment`."""
        return UnityEnvironment(self._build(), **words)

    def _build(self) -> Build:
        try:
            return find_build(f"registry:{self.identifier}")
        except BuildError as cause:
            if self.identifier not in BUILTIN:
                raise UnityEnvironmentException(str(cause)) from cause
            stand_in = f"builtin:{self.identifier}"
            print(f"racecraft: {self.identifier} cannot be fetched; {stand_in} plays instead. {cause}", file=sys.stderr)
            return find_build(stand_in)


class UnityEnvRegistry(Mapping[str, UnityEnvRegistryEntry]):
    """Scenes by name."""

    def __getitem__(self, identifier: str) -> UnityEnvRegistryEntry:
        return UnityEnvRegistryEntry(identifier)

    def __iter__(self) -> Iterator[str]:
        try:
            return iter(read_manifest())
        except BuildError:
            return iter(BUILTIN)

    def __len__(self) -> int:
        return len(list(iter(self)))


default_registry = UnityEnvRegistry()

__all__ = ["UnityEnvRegistry", "UnityEnvRegistryEntry", "default_registry"]
