"""The settings table as text, for docs/reference/settings.md and `racecraft settings`."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

from racecraft.settings.composition import Settings
from racecraft.settings.table import Setting, kind_text, rows_of

Training = tuple[str, str]
"""A kind of training: its world and its algorithm."""


def settings_markdown(composed: Mapping[Training, Settings]) -> str:
    """Return one section a group, one table row a setting.

    Args:
        composed: The settings of every kind of training; the first that has a group gives its default, the others are
            named where theirs differ.
    """
    parts = []
    for name in dict.fromkeys(group for settings in composed.values() for group in settings):
        groups = {one: getattr(settings, name) for one, settings in composed.items() if name in settings}
        first = next(iter(groups.values()))
        parts += [f"## {name}", "", inspect.cleandoc(type(first).__doc__ or ""), ""]
        parts += [f"In trainings of: {_named(groups, composed)}.", ""]
        parts += ["| setting | default | unit | legal | what it does |", "|---|---|---|---|---|"]
        for row in rows_of(first, name):
            legal = (row.range_text or kind_text(row.kind)).replace("|", "or")
            parts.append(f"| `{row.full_name}` | {_defaults(row, groups)} | {row.unit} | {legal} | {row.doc} |")
        parts.append("")
    return "\n".join(parts)


def _defaults(row: Setting, groups: Mapping[Training, Any]) -> str:
    values = {training: value_text(getattr(group, row.name)) for training, group in groups.items()}
    usual = next(iter(values.values()))
    others: dict[str, list[Training]] = {}
    for training, value in values.items():
        if value != usual:
            others.setdefault(value, []).append(training)
    return f"`{usual}`" + "".join(f"; `{value}`: {_named(those, groups)}" for value, those in others.items())


def _named(those: Iterable[Training], among: Iterable[Training]) -> str:
    """Return kinds of training in short: a world by its name alone where all of its algorithms among them are meant.

    >>> _named([("snakes", "ppo"), ("cars", "ppo")], [("snakes", "ppo"), ("cars", "ppo"), ("cars", "sac")])
    'snakes; cars (ppo)'
    """
    chosen, every = list(those), list(among)
    names = []
    for world in dict.fromkeys(world for world, _ in chosen):
        mine = [algorithm for one, algorithm in chosen if one == world]
        is_whole = len(mine) == sum(one == world for one, _ in every)
        names.append(world if is_whole else f"{world} ({', '.join(mine)})")
    return "; ".join(names)


def value_text(value: Any) -> str:
    """Return a value as a user would type it.

    >>> value_text((16, 32)), value_text(None), value_text(True)
    ('16,32', 'none', 'true')
    """
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ",".join(value_text(part) for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
