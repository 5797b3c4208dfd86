"""`UnityEnvRegistry`: scenes by name. `default_registry` has ML-Agents' own example scenes.

Manifests are read when somebody first asks for a name, not before. `RACECRAFT_UNITY_MANIFEST` names another manifest
than ML-Agents' own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from racecraft.compat.names.mlagents_envs.environment import UnityEnvironment
from racecraft.compat.names.mlagents_envs.exception import UnityEnvironmentException
from racecraft.compat.names.mlagents_envs.registry.base_registry_entry import BaseRegistryEntry
from racecraft.compat.names.mlagents_envs.registry.remote_registry_entry import stand_in_for
from racecraft.contract.errors import nearest
from racecraft.worlds.unity.env.builds import (
    BUILTIN,
    Build,
    RegistryEntry,
    cached_scenes,
    find_build,
    manifest_source,
    read_manifest,
)
from racecraft.worlds.unity.env.errors import BuildError


class UnknownSceneError(UnityEnvironmentException, KeyError):
    """No registry entry has this name."""

    __str__ = Exception.__str__  # a KeyError shows its letter in quotes


class UnityEnvRegistry(Mapping[str, BaseRegistryEntry]):
    """Scenes by name."""

    def __init__(self) -> None:
        self._registered: dict[str, BaseRegistryEntry] = {}
        self._manifests: list[str | None] = []
        self._listed: dict[str, dict[str, BaseRegistryEntry]] = {}
        self._unread: dict[str, str] = {}

    def register(self, new_entry: BaseRegistryEntry) -> None:
        """Add a scene; one of the same name is replaced."""
        self._registered[new_entry.identifier] = new_entry

    def register_from_yaml(self, path_to_yaml: str | None) -> None:
        """Add every scene of a manifest, a file or an address of one; it is read when a name is first asked for.

        Args:
            path_to_yaml: None for ML-Agents' own, or the one that `RACECRAFT_UNITY_MANIFEST` names at that time.
        """
        self._manifests.append(path_to_yaml)

    def clear(self) -> None:
        """Forget every scene."""
        self._registered.clear()
        self._manifests.clear()

    def __getitem__(self, identifier: str) -> BaseRegistryEntry:
        entries = self._entries()
        if identifier not in entries:
            raise UnknownSceneError(
                " ".join([f"no scene is named '{identifier}'. {nearest(identifier, entries)}", *self._unread.values()])
            )
        return entries[identifier]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries())

    def __len__(self) -> int:
        return len(self._entries())

    def _entries(self) -> dict[str, BaseRegistryEntry]:
        found: dict[str, BaseRegistryEntry] = {}
        for manifest in self._manifests:
            found |= self._list(manifest)
        return found | self._registered

    def _list(self, manifest: str | None) -> dict[str, BaseRegistryEntry]:
        """Return the scenes of a manifest, read once; one that cannot be read is tried again the next time."""
        source = manifest_source(manifest)
        if source not in self._listed:
            self._unread.pop(source, None)
            try:
                entries = read_manifest(source).values()
            except BuildError as cause:
                self._unread[source] = str(cause)
                at_hand = [] if manifest else dict.fromkeys([*BUILTIN, *cached_scenes()])
                return {name: _ListedEntry(RegistryEntry(name, None), None) for name in at_hand}
            self._listed[source] = {entry.name: _ListedEntry(entry, manifest) for entry in entries}
        return self._listed[source]


class _ListedEntry(BaseRegistryEntry):
    """A scene as a manifest lists it."""

    def __init__(self, entry: RegistryEntry, manifest: str | None) -> None:
        super().__init__(entry.name, entry.expected_reward, entry.description)
        self._manifest = manifest

    def make(self, **kwargs: Any) -> UnityEnvironment:
        """Open the scene; the words are those of `UnityEnvironment`."""
        kwargs.pop("file_name", None)
        return UnityEnvironment(self._build(), **kwargs)

    def _build(self) -> Build:
        try:
            return find_build(f"registry:{self.identifier}", manifest=self._manifest)
        except BuildError as cause:
            return stand_in_for(self.identifier, cause)


default_registry = UnityEnvRegistry()
default_registry.register_from_yaml(None)

__all__ = ["UnityEnvRegistry", "UnknownSceneError", "default_registry"]
