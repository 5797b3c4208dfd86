"""Options that belong together, as one frozen dataclass that a command takes as one parameter.

A group's fields are annotated as Typer's parameters are; `PANEL` names where `--help` shows them. The command's own
signature stays short, and what a group checks, refuses and does stands with its fields:

    @dataclass(frozen=True)
    class Film:
        PANEL: ClassVar[str] = "Film and picture"
        fps: Annotated[int, typer.Option(help="Pictures a second.")] = 30

    @takes_groups
    def evaluate(run: Path, film: Film) -> None: ...     # racecraft evaluate RUN --fps 60
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import inspect
import typing
from collections.abc import Callable, Iterator
from typing import Annotated, Any

from typer.models import ParameterInfo

from racecraft.cli.from_request import parameter_of
from racecraft.settings.request import Request, make_request, options_of


def takes_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that is typed option by option, and takes them group by group.

    Called from Python it takes fields by their names, as from the command line; what is left out has its default.
    """
    signature = inspect.signature(command, eval_str=True)
    groups = {one.name: one.annotation for one in signature.parameters.values() if _is_group(one.annotation)}

    @functools.wraps(command)
    def run(*arguments: Any, **typed: Any) -> None:
        for name, group in groups.items():
            values = {field: typed.pop(field) for field in option_names(group) if field in typed}
            typed[name] = make_request(group, **values) if issubclass(group, Request) else group(**values)
        command(*arguments, **typed)

    options = [option for one in signature.parameters.values() for option in _options_of(one)]
    run.__signature__ = inspect.Signature(options, return_annotation=None)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in options}
    return run


def option_names(group: type) -> tuple[str, ...]:
    """Return the names of a group's options in Python."""
    return tuple(field.name for field in dataclasses.fields(group))


def flags(group: Any) -> dict[str, Any]:
    """Return what a group was given, by option as it is typed; None: it was not.

    >>> @dataclasses.dataclass(frozen=True)
    ... class Film:
    ...     save_mp4: bool = False
    ...     fps: int | None = None
    >>> flags(Film(fps=60))
    {'--save-mp4': None, '--fps': 60}
    """
    given: dict[str, Any] = {}
    for field in dataclasses.fields(group):
        value = getattr(group, field.name)
        given[f"--{field.name.rstrip('_').replace('_', '-')}"] = None if value == field.default else value
    return given


def _is_group(annotation: Any) -> bool:
    return isinstance(annotation, type) and dataclasses.is_dataclass(annotation)


def _options_of(parameter: inspect.Parameter) -> Iterator[inspect.Parameter]:
    """Yield a group's options as parameters of their own, and any other parameter as it is, all by keyword."""
    if not _is_group(parameter.annotation):
        yield parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        return
    group = parameter.annotation
    if issubclass(group, Request):
        yield from (parameter_of(row) for row in options_of(group))
        return
    hints = typing.get_type_hints(group, include_extras=True)
    for field in dataclasses.fields(group):
        annotation = _in_panel(hints[field.name], getattr(group, "PANEL", None))
        yield inspect.Parameter(
            field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default, annotation=annotation
        )


def _in_panel(annotation: Any, panel: str | None) -> Any:
    """Return the annotation of an option with its place in `--help`."""
    if panel is None:
        return annotation
    what, told = typing.get_args(annotation)
    assert isinstance(told, ParameterInfo)
    told = copy.copy(told)
    told.rich_help_panel = panel
    return Annotated[what, told]
