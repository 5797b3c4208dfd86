"""Every command in one table, imported when it is asked for. Begin with `commands`, then `app_with`.

What belongs to no world stands here; a world's commands stand in its `WorldKind`. To import all of them takes a quarter
of a second, which a command that is named does not wait for.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any

import typer

from racecraft.contract.kind import EXCHANGE, JUDGE, PANELS, TRAIN, UNDERSTAND, WORKSHOP, Command
from racecraft.contract.kinds import kinds

GENERAL = (
    Command("stop", "racecraft.cli.runs.stop:stop", TRAIN),
    Command("tune", "racecraft.cli.jobs.tune:tune", TRAIN),
    Command("algorithms", "racecraft.cli.algorithms:algorithms", TRAIN),
    Command("settings", "racecraft.cli.settings:settings", TRAIN),
    Command("watch", "racecraft.cli.runs.watch:watch", JUDGE),
    Command("checkpoints", "racecraft.cli.runs.checkpoints:checkpoints", JUDGE),
    Command("report", "racecraft.cli.runs.report:report", UNDERSTAND),
    Command("export", "racecraft.cli.runs.export:export", EXCHANGE),
    Command("serve", "racecraft.cli.runs.serve:serve", EXCHANGE),
    Command("record", "racecraft.cli.runs.record:record", EXCHANGE),
    Command("bucket", "racecraft.cli.buckets.buckets:app", EXCHANGE),
    Command("jobs", "racecraft.cli.jobs.jobs:app", WORKSHOP),
    Command("run", "racecraft.cli.run:run", WORKSHOP),
    Command("sandbox", "racecraft.cli.jobs.sandbox:sandbox", WORKSHOP),
)
"""Commands of no world."""


def commands() -> list[Command]:
    """Return every command that is installed, in the order of `racecraft --help`; within a panel worlds come first."""
    found = [*(command for kind in kinds() for command in kind.commands), *GENERAL]
    return sorted(found, key=lambda command: PANELS.index(command.panel))


def app_for(words: list[str]) -> typer.Typer:
    """Return a command line that has what these words name; where they begin with no command's name, all of it.

    >>> [one.name for one in app_for(["logs", "--help"]).registered_commands]
    ['logs']
    """
    first = words[0] if words else ""
    general = [one for one in GENERAL if one.name == first]  # which no world need be looked for
    return app_with(general or [one for one in commands() if one.name == first] or commands())


def add(command: Command, app: typer.Typer) -> None:
    """Import a command and add it."""
    name, _, attribute = command.target.partition(":")
    module: Any = import_module(name)
    found, context = getattr(module, attribute), getattr(module, "CONTEXT", None)
    if isinstance(found, typer.Typer):
        app.add_typer(found, name=command.name, rich_help_panel=command.panel)
    else:
        app.command(name=command.name, rich_help_panel=command.panel, context_settings=context)(found)


def app_with(commands: Iterable[Command]) -> typer.Typer:
    """Return a command line with these commands."""
    app = typer.Typer(
        name="racecraft",
        help="Train, watch, judge and race reinforcement-learning agents on your own machine.",
        epilog="Begin with: racecraft train",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="markdown",
    )
    app.callback(invoke_without_command=True)(root)
    for command in commands:
        add(command, app)
    return app


def root(version: bool = typer.Option(False, "--version", help="Say the version and stop.")) -> None:
    """Train, watch, judge and race reinforcement-learning agents on your own machine."""
    if version:
        from racecraft import __version__

        print(__version__)
        raise typer.Exit
