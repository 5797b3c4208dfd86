"""The command line, of the commands that are asked for. Begin with `app_for`.

To import all of them takes a quarter of a second, which a command that is named does not wait for.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any

import typer

from racecraft.cli.commands import command_named, commands
from racecraft.contract.kind import Command


def app_for(words: list[str]) -> typer.Typer:
    """Return a command line that has what these words name; where they begin with no command's name, all of it.

    >>> [one.name for one in app_for(["logs", "--help"]).registered_commands]
    ['logs']
    """
    named = command_named(words[0]) if words else None
    return app_with(commands() if named is None else [named])


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
