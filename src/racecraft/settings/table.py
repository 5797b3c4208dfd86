"""A setting: default, type, unit, range and one sentence, kept with the dataclass field it describes.

A group is a frozen dataclass whose fields are made by `setting`. Its class docstring is the group's caption. Values are
checked when the group is built, so a group that exists is a group that is legal.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from racecraft.contract.errors import SettingError, nearest

Group = TypeVar("Group")


@dataclass(frozen=True)
class Setting:
    """One row of the table."""

    group: str
    name: str
    kind: Any
    """The field's type: int, float, bool, str, a tuple of them, or `X | None`."""
    default: Any
    doc: str
    unit: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]

    @property
    def full_name(self) -> str:
        """The name a user types: "ppo.learning_rate"."""
        return f"{self.group}.{self.name}"

    @property
    def range_text(self) -> str:
        """What values are legal, in words; empty where anything of the type is.

        >>> Setting("ppo", "clip", float, 0.2, "", "", 0.0, 1.0, ()).range_text
        '0 to 1'
        """
        if self.choices:
            return " | ".join(self.choices)
        if self.low is not None and self.high is not None:
            return f"{self.low:g} to {self.high:g}"
        if self.low is not None:
            return f"{self.low:g} or more"
        return f"{self.high:g} or less" if self.high is not None else ""


def setting(
    default: Any,
    doc: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """Return a dataclass field that carries its row of the table."""
    row = {"doc": doc, "unit": unit, "low": low, "high": high, "choices": choices}
    return dataclasses.field(default=default, metadata=row)


def rows_of(group: type | Any, group_name: str = "") -> tuple[Setting, ...]:
    """Return the rows of a group, in the order of declaration."""
    return _rows(group if isinstance(group, type) else type(group), group_name)


@lru_cache(maxsize=512)
def _rows(cls: type, group_name: str) -> tuple[Setting, ...]:
    kinds = typing.get_type_hints(cls)
    return tuple(
        Setting(group_name, field.name, kinds[field.name], field.default, **field.metadata)
        for field in dataclasses.fields(cls)
    )


def check_group(group: Any) -> None:
    """Refuse a group with a value of the wrong type or outside its range. Call it from `__post_init__`."""
    name = type(group).__name__
    for row in rows_of(group, name):
        check_value(row, getattr(group, row.name))


def check_value(row: Setting, value: Any) -> None:
    """Refuse a value of the wrong type or outside the setting's range."""
    if not _is_kind(value, row.kind):
        raise _kind_error(row, value)
    if value is None:
        return
    for part in value if isinstance(value, tuple) else (value,):
        if row.choices and part not in row.choices:
            hint = nearest(str(part), row.choices)
            fields = {"setting": row.full_name, "found": part, "choices": row.choices}
            raise SettingError("{setting} is {found!r}. {hint}", hint=hint, **fields)
        if isinstance(part, int | float) and not isinstance(part, bool):
            _check_range(row, part)


def _check_range(row: Setting, value: float) -> None:
    """Refuse a number outside the setting's range; the error's fields name the range, its unit and what was found."""
    low, high = row.low, row.high
    if (low is None or value >= low) and (high is None or value <= high):
        return
    fields = {"setting": row.full_name, "found": value, "low": low, "high": high, "unit": row.unit}
    if high is None:
        raise SettingError(
            "{setting} is {found!r}; expected {low:g} {unit} or more."
            if row.unit
            else "{setting} is {found!r}; expected {low:g} or more.",
            **fields,
        )
    if low is None:
        raise SettingError(
            "{setting} is {found!r}; expected {high:g} {unit} or less."
            if row.unit
            else "{setting} is {found!r}; expected {high:g} or less.",
            **fields,
        )
    raise SettingError(
        "{setting} is {found!r}; expected {low:g} to {high:g} {unit}."
        if row.unit
        else "{setting} is {found!r}; expected {low:g} to {high:g}.",
        **fields,
    )


def _kind_error(row: Setting, found: Any) -> SettingError:
    expected = kind_text(row.kind)
    return SettingError(
        "{setting} is {found!r}; expected {expected}.", setting=row.full_name, found=found, expected=expected
    )


def parse_value(row: Setting, text: str) -> Any:
    """Read a value as a user types it.

    Tuples are written with commas ("16,32"), booleans as true/false, yes/no, on/off, 1/0, and nothing as "none".

    Raises:
        SettingError: The text is no value of the setting's type, or outside its range.
    """
    try:
        value = _parse(text.strip(), row.kind)
    except ValueError:
        raise _kind_error(row, text) from None
    check_value(row, value)
    return value


def kind_text(kind: Any) -> str:
    """Return a type in a user's words.

    >>> kind_text(tuple[int, ...]), kind_text(float | None)
    ('whole numbers with commas between', 'a number or none')
    """
    plain = {int: "a whole number", float: "a number", bool: "true or false", str: "a word", Path: "a path"}
    if kind in plain:
        return plain[kind]
    if typing.get_origin(kind) is tuple:
        return plain[typing.get_args(kind)[0]].removeprefix("a ") + "s with commas between"
    inner = [part for part in typing.get_args(kind) if part is not types.NoneType]
    return f"{kind_text(inner[0])} or none"


def _is_kind(value: Any, kind: Any) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if kind in (bool, str, Path):
        return isinstance(value, kind)
    if typing.get_origin(kind) is tuple:
        return isinstance(value, tuple) and all(_is_kind(part, typing.get_args(kind)[0]) for part in value)
    return any(value is None if part is types.NoneType else _is_kind(value, part) for part in typing.get_args(kind))


def _parse(text: str, kind: Any) -> Any:
    if kind is bool:
        words = {
            "true": True,
            "yes": True,
            "on": True,
            "1": True,
            "false": False,
            "no": False,
            "off": False,
            "0": False,
        }
        if text.casefold() not in words:
            raise ValueError(text)
        return words[text.casefold()]
    if kind in (int, float, str):
        return kind(text)
    if typing.get_origin(kind) is tuple:
        inner = typing.get_args(kind)[0]
        if not text and inner is int:
            return ()  # no layers, as `describe.value_text` writes it
        return tuple(_parse(part.strip(), inner) for part in text.split(","))
    if text.casefold() in ("none", ""):
        return None
    others = [part for part in typing.get_args(kind) if part is not types.NoneType]
    return _parse(text, others[0])
