"""A form made of the options of an action, and the command that says the same. Begin with `ActionForm`."""

from __future__ import annotations

import dataclasses
import shlex
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.actions.action import Action
from racecraft.console.service import Fields, one
from racecraft.contract.errors import SettingError
from racecraft.settings.request import Option, options_of
from racecraft.settings.table import check_value, parse_value

Choices = Mapping[str, Sequence[tuple[str, str]]]
"""(value, label) of options whose values are a list, by name."""
LEFT_OUT = ("league", "race")
"""What the page knows already."""


class ActionForm:
    """The fields of an action's request.

    Args:
        action: What the form does.
        command: What is typed for it, behind `racecraft`: "league create".
        first: Names of the options that stand unfolded at the top, in order; empty: all of them.
        choices: Of options whose values are a list that the option itself does not know.
        values: What the fields show at first, by name; options that are missing show their default.
    """

    def __init__(
        self,
        action: Action[Any],
        command: str,
        first: Sequence[str] = (),
        choices: Choices | None = None,
        values: Mapping[str, str] | None = None,
    ) -> None:
        self._action, self._command = action, command
        self._choices, self._values = choices or {}, values or {}
        self._rows = [row for row in options_of(action.request) if row.name not in LEFT_OUT and not row.is_hidden]
        self._first = first or [row.name for row in self._rows]

    def panels(self, fields: Fields, wrong: Mapping[str, str]) -> list[dict[str, Any]]:
        """Return the fields by panel, the first one without a title."""
        first = [row for name in self._first for row in self._rows if row.name == name]
        found: list[dict[str, Any]] = [{"title": "", "fields": first}]
        for row in self._rows:
            if row.name in self._first:
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
            text = ",".join(fields.get(row.name, ())).strip() if _is_list(row) else one(fields, row.name).strip()
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

    def do(self, values: Mapping[str, Any], **known: Any) -> Any:
        """Return what the action returns.

        Args:
            values: As from `read`.
            known: What the page knows: the league, the race.

        Raises:
            UserInputError: The values contradict each other.
        """
        return self._action(**known, **values)

    def command(self, values: Mapping[str, Any], *words: str) -> str:
        """Return the command that does the same.

        Args:
            values: As from `read`.
            words: Behind the command's name: the race.
        """
        named = [row for row in self._rows if row.name in values and values[row.name] != row.default]
        typed = [
            word for row in sorted(named, key=lambda row: not row.is_argument) for word in row.args(values[row.name])
        ]
        return shlex.join(["racecraft", *self._command.split(), *words, *typed])

    def _shown(self, row: Option, fields: Fields, wrong: str) -> dict[str, Any]:
        value: Any = self._values.get(row.name, _text(row.default))
        choices, is_list = self._choices_of(row), _is_list(row)
        if row.name in fields:
            value = ", ".join(fields[row.name]) if is_list else one(fields, row.name)
        return {
            "name": row.name, "label": _label(row), "hint": row.doc, "unit": row.unit, "wrong": wrong,
            "value": value.split(", ") if choices and is_list else value,
            "choices": choices, "is_several": bool(choices) and is_list, "required": row.is_required,
        }  # fmt: skip

    def _choices_of(self, row: Option) -> Sequence[tuple[str, str]]:
        is_optional = types.NoneType in typing.get_args(row.kind)
        empty = [("", "default")] if is_optional else []
        if row.name in self._choices:
            return [*empty, *self._choices[row.name]]
        if row.choices:
            return [*empty, *((one, one.replace("_", " ").capitalize()) for one in row.choices)]
        if row.kind is bool or bool in typing.get_args(row.kind):
            return [*empty, ("false", "No"), ("true", "Yes")]
        return []


def _is_list(row: Option) -> bool:
    return typing.get_origin(row.kind) is tuple


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
