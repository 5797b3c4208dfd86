"""A request: what a verb needs to know, as a frozen dataclass. Begin with `Request`.

Its fields are one table: the options of the command line, the keywords of Python, the JSON schema and the reference
pages are made from it. A field is made by `option` or `argument`. A field whose type is itself a dataclass of options
is a group, made by `group`, and its options stand among the others:

    @dataclass(frozen=True, kw_only=True)
    class LineRequest(Request):
        track: str = argument("A name or a waypoint file.")
        top_speed: float | None = option(None, "Fastest command.", unit="m/s", low=0.5)
        film: FilmOptions = group(FilmOptions)

    racecraft line Oval_track --top-speed 3         rc.line("Oval_track", top_speed=3.0)
"""

from __future__ import annotations

import contextlib
import dataclasses
import shlex
import typing
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, TypeVar

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.message import Message
from racecraft.settings.describe import value_text
from racecraft.settings.table import Setting, check_value

T = TypeVar("T")


@dataclass(frozen=True)
class Option(Setting):
    """One field of a request; `default` is `MISSING` where it is required."""

    spellings: tuple[str, ...] = ()
    """As it is typed, where its name does not say so: ("--width", "-W")."""
    is_argument: bool = False
    """Whether it is typed without its name."""
    metavar: str = ""
    """What `--help` shows for its value; empty: its type."""
    variable: str = ""
    """Environment variable that gives it where it is not typed."""
    is_hidden: bool = False
    """Whether `--help` leaves it out."""
    panel: str = ""
    """Heading of `--help` that it stands below."""

    @property
    def flag(self) -> str:
        """Its first spelling: "--top-speed"."""
        return self.spellings[0] if self.spellings else f"--{self.name.strip('_').replace('_', '-')}"

    @property
    def full_name(self) -> str:
        """The name a user types, for messages."""
        return (self.metavar or self.name.strip("_").upper()) if self.is_argument else self.flag.split("/")[0]

    @property
    def switch_off(self) -> str:
        """The spelling that switches it off, "--no-pictures"; empty where it is off unless it is typed."""
        if self.spellings:
            return self.spellings[0].partition("/")[2]
        is_switch = self.kind is bool or bool in typing.get_args(self.kind)
        return f"--no-{self.flag[2:]}" if is_switch and self.default is not False else ""

    @property
    def is_required(self) -> bool:
        """Whether there is no default."""
        return self.default is MISSING

    def args(self, value: Any) -> list[str]:
        """Return how a value of it is typed.

        >>> Option("", "top_speed", float, None, "", "", None, None, ()).args(3.0)
        ['--top-speed=3.0']
        """
        if isinstance(value, bool):
            return [self.full_name if value else self.switch_off]
        values = [str(one) for one in (value if isinstance(value, tuple) else (value,))]
        if self.is_argument:
            return values
        long = next((one for one in self.spellings if one.startswith("--")), self.flag)
        return [f"{long}={one}" for one in values]


def option(
    default: Any,
    doc: str,
    *spellings: str,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    metavar: str = "",
    variable: str = "",
    is_hidden: bool = False,
    panel: str = "",
) -> Any:
    """Return a field of a request that is typed by its name, `--top-speed`; see `Option`."""
    return dataclasses.field(
        default=default,
        metadata={
            "doc": doc, "unit": unit, "low": low, "high": high, "choices": choices, "spellings": spellings,
            "metavar": metavar, "variable": variable, "is_hidden": is_hidden, "panel": panel,
        },
    )  # fmt: skip


def argument(doc: str, default: Any = MISSING, *, metavar: str = "") -> Any:
    """Return a field of a request that is typed without a name, in the order of declaration."""
    metadata = {
        "doc": doc, "unit": "", "low": None, "high": None, "choices": (), "metavar": metavar, "is_argument": True,
    }  # fmt: skip
    return dataclasses.field(default=default, metadata=metadata)


def group(of: type[T]) -> T:
    """Return a field that holds a dataclass of options; its PANEL names their heading in `--help`."""
    made: T = dataclasses.field(default_factory=of)
    return made


@dataclass(frozen=True, kw_only=True)
class Request:
    """Base of all requests and groups: values are converted and checked when one is made."""

    def __post_init__(self) -> None:
        for row in own_options(type(self)):
            object.__setattr__(self, row.name, _accepted(row, getattr(self, row.name)))

    def given(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, by their spelling."""
        return {
            row.full_name: getattr(self, row.name)
            for row in own_options(type(self))
            if getattr(self, row.name) != row.default
        }

    def values(self) -> dict[str, Any]:
        """Return the options by name, without those of groups."""
        return {row.name: getattr(self, row.name) for row in own_options(type(self))}

    def named(self) -> dict[Option, Any]:
        """Return the options that were named when `make_request` made this, those of groups too, with their values.

        Of a request made otherwise: those that differ from their defaults. An empty tuple names nothing.
        """
        names, found = getattr(self, "_names", None), {}
        for row in own_options(type(self)):
            value = getattr(self, row.name)
            if value != () and (value != row.default if names is None else row.name in names):
                found[row] = value
        for name in groups_of(type(self)):
            found |= getattr(self, name).named()
        return found


def own_options(request: type) -> tuple[Option, ...]:
    """Return the options of a request without those of its groups, in the order of declaration."""
    kinds, panel = typing.get_type_hints(request), getattr(request, "PANEL", "")
    return tuple(
        Option("", field.name, kinds[field.name], field.default, **{"panel": panel, **_stated(field.metadata)})
        for field in dataclasses.fields(request)
        if "doc" in field.metadata
    )


def _stated(metadata: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in metadata.items() if name != "panel" or value}


def groups_of(request: type) -> dict[str, type]:
    """Return the groups of a request by their field."""
    kinds = typing.get_type_hints(request)
    named = ((field.name, kinds[field.name]) for field in dataclasses.fields(request))
    return {name: kind for name, kind in named if dataclasses.is_dataclass(kind) and isinstance(kind, type)}


def options_of(request: type) -> tuple[Option, ...]:
    """Return every option of a request, those of its groups where the group stands."""
    own = {row.name: row for row in own_options(request)}
    groups = groups_of(request)
    found: list[Option] = []
    for field in dataclasses.fields(request):
        if field.name in own:
            found.append(own[field.name])
        elif field.name in groups:
            found += options_of(groups[field.name])
    return tuple(found)


def option_names(request: type) -> tuple[str, ...]:
    """Return the names of a request's options in Python."""
    return tuple(row.name for row in options_of(request))


def make_request(request: type[T], *arguments: Any, **values: Any) -> T:
    """Return a request of plain values: arguments in their order, options and those of groups by their names.

    Raises:
        SettingError: An unknown name, a missing argument, or a value that cannot be used.
    """
    rows = options_of(request)
    positions = [row.name for row in rows if row.is_argument]
    if len(arguments) > len(positions):
        raise SettingError(
            "{count} arguments were given; expected at most {count_2}.", count=len(arguments), count_2=len(positions)
        )
    values |= dict(zip(positions, arguments, strict=False))
    known = {row.name.strip("_"): row.name for row in rows}
    for name in values:
        if name.strip("_") not in known:
            raise SettingError("there is no option '{name}'. {hint}", name=name, hint=nearest(name, sorted(known)))
    named = {known[name.strip("_")]: value for name, value in values.items()}
    missing = [row.full_name for row in rows if row.is_required and row.name not in named]
    if missing:
        raise SettingError("{missing} was not given; expected a value.", missing=", ".join(missing))
    return _built(request, named)


def _built(request: type[T], values: dict[str, Any]) -> T:
    own = {row.name: values[row.name] for row in own_options(request) if row.name in values}
    made = request(**own, **{name: _built(kind, values) for name, kind in groups_of(request).items()})
    object.__setattr__(made, "_names", frozenset(own))
    return made


@contextlib.contextmanager
def options_as_typed(request: Any) -> Iterator[None]:
    """Let an error about a setting that took its value from an option name the option, as it is typed.

    Rules check themselves, wherever they come from, and know their own name alone: "CarRules.max_resets".
    """
    try:
        yield
    except SettingError as error:
        fields = error.message.fields
        for row, value in request.named().items() if isinstance(request, Request) else ():
            is_named = row.name.strip("_") == str(fields.get("setting")).rpartition(".")[2]
            if is_named and fields.get("found") in (value if isinstance(value, tuple) else (value,)):
                error.message = Message(error.message.template, **{**fields, "setting": row.full_name})
                error.args = (error.message,)
        raise


def _accepted(row: Option, value: Any) -> Any:
    """Return a value in the type of its option: a path of its text, a tuple of a list or of the only one.

    Raises:
        SettingError: It is of another type, or outside the option's range.
    """
    value = _converted(row.kind, value)
    check_value(row, value)
    return value


def _texts(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Yield name and text of each value; those of a mapping inside go by both names, "boxes.number"."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _texts(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value_text(tuple(value) if isinstance(value, list) else value)


def _converted(kind: Any, value: Any) -> Any:
    if typing.get_origin(kind) is tuple:
        parts = value if isinstance(value, list | tuple) else () if value is None else (value,)
        return tuple(_converted(typing.get_args(kind)[0], part) for part in parts)
    kinds = typing.get_args(kind) or (kind,)
    if Path in kinds and isinstance(value, str):
        return Path(value)
    if str in kinds and isinstance(value, Path):
        return str(value)
    if str in kinds and isinstance(value, Mapping):
        return " ".join(f"{name}={shlex.quote(part)}" for name, part in _texts(value))
    return float(value) if kinds[0] is float and isinstance(value, int) and not isinstance(value, bool) else value
