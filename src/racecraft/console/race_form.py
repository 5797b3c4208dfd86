"""The form of a race, made of the options of the world's own action. Begin with `RaceForm`."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.console.parts import parts_of
from racecraft.console.service import Fields, one
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds
from racecraft.league.race import Race
from racecraft.settings.request import Option, options_of
from racecraft.settings.table import check_value, parse_value

FIRST = ("title", "track", "type", "laps", "ranking", "format", "closes")
"""What stands unfolded at the top."""


def race_kinds() -> list[str]:
    """Return the kinds of worlds that have races."""
    return [kind.name for kind in kinds() if parts_of(kind.name).race_action() is not None]


class RaceForm:
    """The fields of a new race.

    Args:
        kind: Of its world.

    Raises:
        SettingError: The world has no races.
    """

    def __init__(self, kind: str) -> None:
        action = parts_of(kind).race_action()
        if action is None:
            raise SettingError("the world {kind!r} has no races; expected one of {kinds}.", kind=kind,
                               kinds=", ".join(race_kinds()))  # fmt: skip
        self.kind, self._action = kind, action
        self._choices = parts_of(kind).race_choices()
        self._rows = [row for row in options_of(action.request) if row.name not in ("league",) and not row.is_hidden]

    def panels(self, fields: Fields, wrong: Mapping[str, str]) -> list[dict[str, Any]]:
        """Return the fields by panel, the first one without a title."""
        first = [row for name in FIRST for row in self._rows if row.name == name]
        found: list[dict[str, Any]] = [{"title": "", "fields": first}]
        for row in self._rows:
            if row.name in FIRST:
                continue
            title = row.panel or "Further"
            if found[-1]["title"] != title:
                found.append({"title": title, "fields": []})
            found[-1]["fields"].append(row)
        return [
            {
                "title": panel["title"],
                "fields": [self._shown(row, fields, wrong.get(row.name, "")) for row in panel["fields"]],
                "is_wrong": any(row.name in wrong for row in panel["fields"]),
            }
            for panel in found
        ]

    def read(self, fields: Fields) -> tuple[dict[str, Any], dict[str, str]]:
        """Return the values that were typed, and what is wrong with others, both by name; empty ones are left out."""
        values: dict[str, Any] = {}
        wrong: dict[str, str] = {}
        for row in self._rows:
            text = one(fields, row.name).strip()
            if not text:
                if row.is_required:
                    wrong[row.name] = "found nothing; expected a value."
                continue
            try:
                label = dataclasses.replace(row, group="", name=_label(row))
                values[row.name] = parse_value(label, text)
                check_value(label, values[row.name])
            except SettingError as error:
                wrong[row.name] = str(error)
        return values, wrong

    def make(self, values: Mapping[str, Any], league: Path) -> Race:
        """Make the race.

        Raises:
            UserInputError: The values contradict each other.
        """
        race: Race = self._action(league=league, **values).race
        return race

    def _shown(self, row: Option, fields: Fields, wrong: str) -> dict[str, Any]:
        value = one(fields, row.name) if row.name in fields else _text(row.default)
        choices = self._choices_of(row)
        return {
            "name": row.name, "label": _label(row), "value": value, "hint": row.doc, "unit": row.unit, "wrong": wrong,
            "choices": choices, "required": row.is_required,
        }  # fmt: skip

    def _choices_of(self, row: Option) -> Sequence[tuple[str, str]]:
        if row.name in self._choices:
            return self._choices[row.name]
        is_optional = types.NoneType in typing.get_args(row.kind)
        empty = [("", "as usual")] if is_optional else []
        if row.choices:
            return [*empty, *((one, one.replace("_", " ").capitalize()) for one in row.choices)]
        if row.kind is bool or bool in typing.get_args(row.kind):
            return [*empty, ("false", "No"), ("true", "Yes")]
        return []


def _label(row: Option) -> str:
    return row.name.strip("_").replace("_", " ").capitalize()


def _text(default: Any) -> str:
    if default is None or default is dataclasses.MISSING:
        return ""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return ", ".join(map(str, default))
    return str(default)
