"""A command made from an action: its options are the fields of the action's request. Begin with `command`.

    app.command()(command(record, show))        racecraft record RUN --episodes 3 [--json]

What remains for a command's own module is `show`, which prints a result for people; `--json` prints the same result as
one JSON object.
"""

from __future__ import annotations

import inspect
import re
import sys
import typing
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.actions.action import Action, Served
from racecraft.cli.output import counting, echo, print_json
from racecraft.contract.progress import Count, Progress
from racecraft.settings.describe import value_text
from racecraft.settings.request import Option, make_request, option_names, options_of
from racecraft.settings.table import parse_value
from racecraft.training.signals import interrupts_stop

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback

Json = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]

SECTIONS = re.compile(r"\n\s*\n\s*(Args|Returns|Raises):\n")
"""Where the help ends and the sections for programmers begin."""


class TerminalProgress(Progress):
    """Prints messages, and a bar for what is counted; on standard error where standard output belongs to `--json`."""

    def __init__(self, *, quiet_stdout: bool, json: bool = False) -> None:
        self.quiet_stdout, self.json = quiet_stdout or json, json

    def __call__(self, message: str) -> None:
        """Print a line."""
        echo(message, quiet_stdout=self.quiet_stdout)

    @property
    def is_before_person(self) -> bool:
        """Whether a person at a terminal reads it."""
        return not self.json and sys.stdout.isatty()

    @property
    def child_output(self) -> int | None:
        """Standard error where standard output belongs to `--json`."""
        return sys.stderr.fileno() if self.quiet_stdout else None

    def training_callback(self) -> TrainingCallback:
        """Return the display of a training: live on a terminal, else one line an iteration."""
        from racecraft.training.progress import watcher

        return watcher(sys.stderr if self.quiet_stdout else sys.stdout)

    def confirm(self, question: str) -> None:
        """Ask a person; the answer no ends the command with code 1."""
        if not sys.stdin.isatty():
            super().confirm(question)
        typer.confirm(question, abort=True, err=self.quiet_stdout)

    @contextmanager
    def counting(self, unit: str) -> Iterator[Count]:
        """Yield a callback that shows how much is done on a terminal."""
        with counting(unit, quiet_stdout=self.quiet_stdout) as count:
            yield count


def command(
    action: Action[Any],
    show: Callable[[Any], None],
    *,
    messages_aside: bool = False,
    help: str = "",
    shared: type | None = None,
) -> Callable[..., None]:
    """Return a command that Typer understands.

    Args:
        action: What it does. A result with an `exit_code` ends the process with it, unless it is 0.
        show: Prints a result for people.
        messages_aside: Whether messages always go to standard error.
        help: Its help; empty: the action's docstring.
        shared: Options that are typed before the command's name, with `shared_options`.
    """
    before = () if shared is None else option_names(shared)

    def run(context: typer.Context, **typed: Any) -> None:
        json = typed.pop("json")
        named = {**(context.obj or {}), **_given(context, action.request, typed)}
        request: Any = make_request(action.request, **named)
        progress = TerminalProgress(quiet_stdout=messages_aside, json=json)

        def ready() -> None:
            print_json(result) if json else show(result)

        with interrupts_stop():  # Typer would end without a word
            result = action(request, progress=progress)
            result.serve(ready, progress) if isinstance(result, Served) else ready()
        if code := getattr(result, "exit_code", 0):
            raise typer.Exit(code)

    parameters = [inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)]
    parameters += [parameter_of(row) for row in options_of(action.request) if row.name not in before]
    parameters.append(inspect.Parameter("json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Json))
    run.action = action  # type: ignore[attr-defined]  # `racecraft schema` describes it
    return with_parameters(run, parameters, help or str(action.__doc__), action.__name__)


def shared_options(of: type, help: str) -> Callable[..., None]:
    """Return the callback of a group of commands that share options, which are typed before the command's name."""

    def keep(context: typer.Context, **typed: Any) -> None:
        context.obj = _given(context, of, typed)

    parameters = [inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)]
    return with_parameters(keep, [*parameters, *map(parameter_of, options_of(of))], help, of.__name__)


def _given(context: typer.Context, of: type, typed: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that were typed or stand in the environment.

    Raises:
        SettingError: A number is none, or outside its option's range.
    """
    rows = {row.name: row for row in options_of(of)}
    sources = {name: context.get_parameter_source(name) for name in typed}
    given = ("COMMANDLINE", "ENVIRONMENT")
    return {
        name: _read(rows[name], typed[name])
        for name, source in sources.items()
        if source is not None and source.name in given
    }


def _read(row: Option, typed: Any) -> Any:
    """Return a value as its option's type; Typer, which has messages of its own, gives numbers as texts."""
    if not _is_number(row.kind):
        return typed
    if isinstance(typed, list):
        return tuple(value for text in typed for value in parse_value(row, text))
    return parse_value(row, typed)


def with_parameters(
    run: Callable[..., None], parameters: list[inspect.Parameter], help: str, name: str
) -> Callable[..., None]:
    """Return a function of keywords under a signature that Typer reads."""
    run.__signature__ = inspect.Signature(parameters, return_annotation=None)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    run.__doc__ = SECTIONS.split(inspect.cleandoc(help))[0]
    run.__name__ = name
    return run


def parameter_of(row: Option) -> inspect.Parameter:
    """Return an option as a parameter of a command; a number is a text here, which `_read` reads."""
    kind, default = row.kind, row.default
    shared: dict[str, Any] = {"help": row.doc, "metavar": row.metavar or None, "rich_help_panel": row.panel or None}
    if _is_number(kind):
        shared["metavar"] = row.metavar or ("<int>" if int in _kinds_in(kind) else "<float>")
        shared["help"] = f"{row.doc} [{f'{row.range_text} {row.unit}'.strip()}]" if row.range_text else row.doc
    if typing.get_origin(kind) is tuple:
        kind = list[str if _is_number(kind) else typing.get_args(kind)[0]]  # type: ignore[misc]
        if not row.is_required:
            kind, default = kind | None, [str(one) for one in row.default] or None
    elif _is_number(kind):
        kind, default = str | None, default if row.is_required or default is None else value_text(default)
    told: Any
    if row.is_argument:
        told = typer.Argument(**shared)
    else:
        told = typer.Option(*_spellings(row), hidden=row.is_hidden, envvar=row.variable or None, **shared)
    return inspect.Parameter(
        row.name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if row.is_required else default,
        annotation=Annotated[kind, told],
    )


def _spellings(row: Option) -> tuple[str, ...]:
    """Return how an option is typed; a switch that is on where nothing is typed can be switched off."""
    return row.spellings or ((f"{row.flag}/{row.switch_off}",) if row.switch_off else (row.flag,))


def _is_number(kind: Any) -> bool:
    return bool({int, float} & _kinds_in(kind)) and bool not in _kinds_in(kind)


def _kinds_in(kind: Any) -> set[Any]:
    return {kind, *typing.get_args(kind)}
