"""The settings table as text, for docs/reference/settings.md and `racecraft settings`."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from racecraft.settings.composition import Settings
from racecraft.settings.table import Setting, kind_text, rows_of


def settings_markdown(composed: Mapping[str, Settings]) -> str:
    """Return one section a group, one table row a setting.

    Args:
        composed: The settings of every kind of training, by a name for people; the first that has a group gives its
            default, the others are named where theirs differ.
    """
    parts = []
    for name in dict.fromkeys(group for settings in composed.values() for group in settings):
        groups = {title: getattr(settings, name) for title, settings in composed.items() if name in settings}
        first = next(iter(groups.values()))
        parts += [f"## {name}", "", inspect.cleandoc(type(first).__doc__ or ""), ""]
        parts += [f"In trainings of: {'; '.join(groups)}.", ""]
        parts += ["| setting | default | unit | legal | what it does |", "|---|---|---|---|---|"]
        for row in rows_of(first, name):
            legal = (row.range_text or kind_text(row.kind)).replace("|", "or")
            parts.append(f"| `{row.full_name}` | {_defaults(row, groups)} | {row.unit} | {legal} | {row.doc} |")
        parts.append("")
    return "\n".join(parts)


def _defaults(row: Setting, groups: Mapping[str, Any]) -> str:
    told = {title: value_text(getattr(group, row.name)) for title, group in groups.items()}
    usual = next(iter(told.values()))
    others: dict[str, list[str]] = {}
    for title, value in told.items():
        if value != usual:
            others.setdefault(value, []).append(title)
    return f"`{usual}`" + "".join(f"; `{value}`: {', '.join(titles)}" for value, titles in others.items())


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
