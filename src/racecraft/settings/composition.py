"""The settings of one training: groups of its world, its algorithm and the loop, put together. Begin with `Settings`.

A group is a frozen dataclass and lives with what it sets (`settings/table.py` says what a group is). Only groups that a
training really asks are part of its settings, so that a foreign one is refused instead of changing nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


class Settings:
    """Groups by name; a group is an attribute. Nothing changes in place: `with_group` returns new settings.

    >>> from racecraft.rollout.settings import RolloutConfig
    >>> Settings(rollout=RolloutConfig(horizon=8)).rollout.horizon
    8
    """

    def __init__(self, **groups: Any) -> None:
        self._groups: Mapping[str, Any] = dict(groups)

    def __getattr__(self, name: str) -> Any:
        groups = self.__dict__.get("_groups", {})
        if name not in groups:
            raise AttributeError(f"these settings have no group '{name}', only {', '.join(groups)}")
        return groups[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __contains__(self, name: str) -> bool:
        return name in self._groups

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Settings) and self._groups == other._groups

    def __hash__(self) -> int:
        return hash(tuple(self._groups.items()))

    def __repr__(self) -> str:
        return f"Settings({', '.join(f'{name}={group!r}' for name, group in self._groups.items())})"

    def with_group(self, name: str, group: Any) -> Settings:
        """Return the settings with one group put in, in its place or behind the others."""
        return Settings(**{**self._groups, name: group})

    def without(self, name: str) -> Settings:
        """Return the settings without a group; one that is not there is no matter."""
        return Settings(**{key: group for key, group in self._groups.items() if key != name})
