"""`RemoteRegistryEntry`: a scene that lies behind an address.

It is looked for in ML-Agents' own cache, then fetched. Where that cannot be done, Basic is our stand-in, and that is
said.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.compat.names.mlagents_envs.environment import UnityEnvironment
from racecraft.compat.names.mlagents_envs.exception import UnityEnvironmentException
from racecraft.compat.names.mlagents_envs.registry.base_registry_entry import BaseRegistryEntry
from racecraft.worlds.unity.env.builds import (
    BUILTIN,
    Build,
    RegistryEntry,
    build_cache,
    executable_in,
    fetch_entry,
    find_build,
)
from racecraft.worlds.unity.env.errors import BuildError


class RemoteRegistryEntry(BaseRegistryEntry):
    """A scene as a zip for each platform.

    Args:
        identifier: Its name.
        expected_reward: What a trained agent earns.
        description: What the scene is.
        linux_url: A zip with one player for Linux, an address or a file; None where there is none.
        darwin_url: For macOS.
        win_url: For Windows.
        additional_args: Arguments that the scene always gets, behind those of `make`.
        tmp_dir: Where the cache lies; None for the folder of temporary files.
    """

    def __init__(
        self,
        identifier: str,
        expected_reward: float | None,
        description: str | None,
        linux_url: str | None,
        darwin_url: str | None,
        win_url: str | None,
        additional_args: Sequence[str] | None = None,
        tmp_dir: str | None = None,
    ) -> None:
        super().__init__(identifier, expected_reward, description)
        self._url = {"darwin": darwin_url, "win32": win_url}.get(sys.platform, linux_url)
        self._args, self._tmp_dir = tuple(additional_args or ()), tmp_dir

    def make(self, **kwargs: Any) -> UnityEnvironment:
        """Open the scene.

        Args:
            kwargs: The words of `UnityEnvironment`, without `file_name`.

        Raises:
            UnityEnvironmentException: It can neither be fetched nor started.
        """
        kwargs.pop("file_name", None)
        kwargs["additional_args"] = [*(kwargs.get("additional_args") or ()), *self._args]
        return UnityEnvironment(self._build(), **kwargs)

    def _build(self) -> Build:
        entry = RegistryEntry(self.identifier, self._url)
        cache = Path(self._tmp_dir) / "ml-agents-binaries" if self._tmp_dir else build_cache()
        try:
            return Build(f"registry:{self.identifier}", (str(executable_in(fetch_entry(entry, cache))),))
        except BuildError as cause:
            return stand_in_for(self.identifier, cause)


def stand_in_for(identifier: str, cause: BuildError) -> Build:
    """Return our stand-in of a scene that cannot be had, and say so.

    Raises:
        UnityEnvironmentException: We have none.
    """
    if identifier not in BUILTIN:
        raise UnityEnvironmentException(str(cause)) from cause
    ours = f"builtin:{identifier}"
    print(f"racecraft: {identifier} cannot be fetched; {ours} plays instead. {cause}", file=sys.stderr)
    return find_build(ours)


__all__ = ["RemoteRegistryEntry"]
