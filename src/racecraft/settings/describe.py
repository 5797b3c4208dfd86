"""The settings table as text, for `racecraft settings` and docs/settings.md."""

from __future__ import annotations

import inspect
from typing import Any

from racecraft.settings.groups import group_names
from racecraft.settings.table import kind_text, rows_of


def settings_markdown(settings: Any) -> str:
    """Return one section a group, one table row a setting."""
    parts = []
    for name in group_names(settings):
        group = getattr(settings, name)
        parts += [f"## {name}", "", inspect.cleandoc(type(group).__doc__ or ""), ""]
        parts += ["| setting | default | unit | legal | what it does |", "|---|---|---|---|---|"]
        for row in rows_of(group, name):
            legal = (row.range_text or kind_text(row.kind)).replace("|", "or")
            parts.append(
                f"| `{row.full_name}` | `{value_text(getattr(group, row.name))}` | {row.unit} | {legal} | {row.doc} |"
            )
        parts.append("")
    return "\n".join(parts)


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
