"""Which worlds are installed, and the object that each brings along. Begin with `find_kind`."""

from __future__ import annotations

import contextlib
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kind import WorldKind
from racecraft.contract.message import Message

GROUP = "racecraft.worlds"
"""The entry point group; each entry names the `WorldKind` of its package."""


class MissingWorldError(SettingError):
    """A world is not installed."""


def find_kind(name: str, whose: str = "") -> WorldKind:
    """Return what the world of a name brings along.

    Args:
        name: Of the kind, as job.json and users call it.
        whose: What asks for it, for the message, such as the path of a run; "": a user's word.

    Raises:
        MissingWorldError: No installed package brings it, or the package that should is gone or broken.
    """
    entries = _entries()
    where = f"{whose}: " if whose else ""
    if name not in entries:
        raise MissingWorldError(
            "{where}found the kind of world {name!r}; expected an installed one. {hint}",
            where=where,
            name=name,
            hint=_hint(name),
        )
    return _loaded(entries[name], where)


def kind_names() -> list[str]:
    """Return the names of the kinds whose package is there, sorted."""
    return [kind.name for kind in kinds()]


def kinds() -> list[WorldKind]:
    """Return what is installed, by name; a package that cannot be imported is left out (`find_kind` says why)."""
    found = []
    for _, entry in sorted(_entries().items()):
        with contextlib.suppress(MissingWorldError):
            found.append(_loaded(entry, ""))
    return found


@cache
def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _loaded(entry: EntryPoint, where: str) -> WorldKind:
    package = entry.module.removesuffix(".kind")
    try:
        kind = entry.load()
    except ModuleNotFoundError as error:
        if error.name and entry.module.startswith(error.name):
            raise MissingWorldError(
                Message(
                    "{where}found a {capitalize} run; the package {package} is not installed.",
                    where=where,
                    capitalize=entry.name.capitalize(),
                    package=package,
                )
                if where
                else Message(
                    "the kind of world {name!r} is not available; the package {package} is not installed.",
                    name=entry.name,
                    package=package,
                )
            ) from error
        raise MissingWorldError(
            "{where}the package {package} cannot be imported: {error}.", where=where, package=package, error=error
        ) from error
    if not isinstance(kind, WorldKind):
        raise MissingWorldError(
            "{where}{value} is {type_name}; expected a WorldKind.",
            where=where,
            value=entry.value,
            type_name=type(kind).__name__,
        )
    return kind


def _hint(name: str) -> str:
    names = kind_names()
    if not names:
        return (
            f"No package registers any under the entry point group {GROUP}: racecraft's own metadata is older than its "
            "code. Install it again: pip install --no-deps -e . (in a checkout), or pip install racecraft."
        )
    return nearest(name, names)
