"""Settings by name: "ppo.learning_rate=1e-4" from the command line, a dictionary from a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.settings.composition import Settings
from racecraft.settings.table import Setting, parse_value, rows_of


def apply_overrides(settings: Settings, overrides: Iterable[str]) -> Settings:
    """Return the settings with each "group.name=value" applied, in order.

    Raises:
        SettingError: No equals sign, an unknown group or name, or a value that is not legal.

    >>> from racecraft.rollout.settings import RolloutConfig
    >>> apply_overrides(Settings(rollout=RolloutConfig()), ["rollout.horizon=128"]).rollout.horizon
    128
    >>> apply_overrides(Settings(rollout=RolloutConfig()), ["rollout.horizn=128"])
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: rollout has no setting 'horizn'. Did you mean 'horizon'?
    """
    for override in overrides:
        full_name, equals, text = override.partition("=")
        if not equals:
            raise SettingError(
                "--set {override!r} has no '='; expected group.name=value, such as rollout.num_worlds=16.",
                override=override,
            )
        row = find_setting(settings, full_name.strip())
        settings = with_values(settings, row.group, {row.name: parse_value(row, text)})
    return settings


def find_setting(settings: Settings, full_name: str) -> Setting:
    """Return the row of "group.name", or refuse it with the nearest known name."""
    group, dot, name = full_name.partition(".")
    known = [row.full_name for part in settings for row in rows_of(getattr(settings, part), part)]
    elsewhere = [one for one in known if one.endswith(f".{name if dot else full_name}")]
    if not dot or group not in settings:
        hint = f"Did you mean '{elsewhere[0]}'?" if elsewhere else nearest(full_name, known)
        if hint.startswith("Known:"):
            hint = f"Groups of this training: {', '.join(settings)}; `racecraft settings` lists them all."
        raise SettingError("There is no setting '{full_name}' here. {hint}", full_name=full_name, hint=hint)
    rows = {row.name: row for row in rows_of(getattr(settings, group), group)}
    if name not in rows:
        hint = f"Did you mean '{elsewhere[0]}'?" if elsewhere else nearest(name, rows)
        raise SettingError("{group} has no setting '{name}'. {hint}", group=group, name=name, hint=hint)
    return rows[name]


def with_values(settings: Settings, group: str, values: Mapping[str, Any]) -> Settings:
    """Return the settings with some values of one group replaced (and checked)."""
    return settings.with_group(group, dataclasses.replace(getattr(settings, group), **values))


def as_dictionary(settings: Settings) -> dict[str, dict[str, Any]]:
    """Return the settings as nested plain values, fit for JSON."""
    return {name: dataclasses.asdict(getattr(settings, name)) for name in settings}


def from_dictionary(defaults: Settings, groups: Mapping[str, Mapping[str, Any]]) -> Settings:
    """Return settings from what `as_dictionary` wrote; unknown names are refused, absent ones stay as they are.

    Args:
        defaults: The groups that are wanted, with the values of what is absent.
        groups: What was written; groups that are not wanted are passed over, for older runs wrote those of every world.
    """
    settings = defaults
    for group in defaults:
        legal: dict[str, Any] = {}
        for name, value in groups.get(group, {}).items():
            find_setting(settings, f"{group}.{name}")
            legal[name] = tuple(value) if isinstance(value, list) else value
        settings = with_values(settings, group, legal)
    return settings
