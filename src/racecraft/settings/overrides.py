"""Settings by name: "ppo.learning_rate=1e-4" from the command line, a dictionary from a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from racecraft.contract.errors import SettingError, nearest
from racecraft.settings.groups import group_names
from racecraft.settings.table import Setting, parse_value, rows_of

Settings = TypeVar("Settings")


def apply_overrides(settings: Settings, overrides: Iterable[str]) -> Settings:
    """Return the settings with each "group.name=value" applied, in order.

    Raises:
        SettingError: No equals sign, an unknown group or name, or a value that is not legal.

    >>> from racecraft.settings.groups import TrainSettings
    >>> apply_overrides(TrainSettings(), ["rollout.horizon=128"]).rollout.horizon
    128
    >>> apply_overrides(TrainSettings(), ["rollout.horizn=128"])
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: rollout has no setting 'horizn'. Did you mean 'horizon'?
    """
    for override in overrides:
        full_name, equals, text = override.partition("=")
        if not equals:
            raise SettingError(f"--set {override!r} has no '='; expected group.name=value, such as ppo.epochs=4.")
        row = find_setting(settings, full_name.strip())
        settings = with_values(settings, row.group, {row.name: parse_value(row, text)})
    return settings


def find_setting(settings: Any, full_name: str) -> Setting:
    """Return the row of "group.name", or refuse it with the nearest known name."""
    group, dot, name = full_name.partition(".")
    groups = group_names(settings)
    if not dot or group not in groups:
        known = [row.full_name for part in groups for row in rows_of(getattr(settings, part), part)]
        bare = [candidate for candidate in known if candidate.endswith(f".{full_name}")]
        hint = f"Did you mean '{bare[0]}'?" if bare else nearest(full_name, known)
        if hint.startswith("Known:"):
            hint = f"Groups: {', '.join(groups)}; `racecraft settings` lists them all."
        raise SettingError(f"There is no setting '{full_name}'. {hint}")
    rows = {row.name: row for row in rows_of(getattr(settings, group), group)}
    if name not in rows:
        raise SettingError(f"{group} has no setting '{name}'. {nearest(name, rows)}")
    return rows[name]


def with_values(settings: Settings, group: str, values: Mapping[str, Any]) -> Settings:
    """Return the settings with some values of one group replaced (and checked)."""
    changed = dataclasses.replace(getattr(settings, group), **values)
    return dataclasses.replace(settings, **{group: changed})  # type: ignore[type-var]


def as_dictionary(settings: Any) -> dict[str, dict[str, Any]]:
    """Return the settings as nested plain values, fit for JSON."""
    return {name: dataclasses.asdict(getattr(settings, name)) for name in group_names(settings)}


def from_dictionary(kind: type[Settings], groups: Mapping[str, Mapping[str, Any]]) -> Settings:
    """Return settings from what `as_dictionary` wrote; unknown names are refused, absent ones keep their defaults."""
    settings = kind()
    for group, values in groups.items():
        legal: dict[str, Any] = {}
        for name, value in values.items():
            find_setting(settings, f"{group}.{name}")
            legal[name] = tuple(value) if isinstance(value, list) else value
        settings = with_values(settings, group, legal)
    return settings
