"""What installed packages add under racecraft's entry point groups, besides whole worlds (`kinds.py`).

docs/extend.md shows each group with an example.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from racecraft.contract.errors import SettingError


def offered(group: str) -> dict[str, EntryPoint]:
    """Return what packages offer in a group ("tracks" for `racecraft.tracks`), by name, sorted."""
    found = entry_points(group=f"racecraft.{group}")
    return {entry.name: entry for entry in sorted(found, key=lambda entry: entry.name)}


def load_offered(group: str, name: str) -> Any:
    """Return what a package offers under a name; None where none does.

    Raises:
        SettingError: Its package cannot be imported.
    """
    entry = offered(group).get(name)
    if entry is None:
        return None
    try:
        return entry.load()
    except Exception as error:
        raise SettingError(
            "{group}: {name} = {value} cannot be imported ({error!r}); expected a package that is whole. "
            "Install it again, or remove it.",
            group=entry.group,
            name=name,
            value=entry.value,
            error=error,
        ) from error
