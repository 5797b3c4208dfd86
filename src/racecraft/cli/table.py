"""Every command in one table, imported when it is asked for. Begin with `COMMANDS`, then `app_with`.

To import all of them takes a quarter of a second, which a command that is named does not wait for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import typer

TRAIN, JUDGE, UNDERSTAND = "Train", "Watch and judge", "Understand"
WORLDS, EXCHANGE, WORKSHOP = "Worlds", "In and out", "Workshop"


@dataclass(frozen=True)
class Command:
    """What stands behind a word of the command line."""

    name: str
    module: str
    """Below racecraft.cli; a CONTEXT in it holds the settings of the command's context."""
    attribute: str
    """Its function; of a group its `app`."""
    panel: str
    """Heading below which `--help` lists it."""

    def add_to(self, app: typer.Typer) -> None:
        """Import it and add it."""
        module: Any = import_module(f"racecraft.cli.{self.module}")
        found, context = getattr(module, self.attribute), getattr(module, "CONTEXT", None)
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=self.name, rich_help_panel=self.panel)
        else:
            app.command(name=self.name, rich_help_panel=self.panel, context_settings=context)(found)


COMMANDS = (
    Command("new", "deepracer.new", "new", TRAIN),
    Command("train", "deepracer.train", "train", TRAIN),
    Command("stop", "runs.stop", "stop", TRAIN),
    Command("tune", "jobs.tune", "tune", TRAIN),
    Command("algorithms", "algorithms", "algorithms", TRAIN),
    Command("settings", "settings", "settings", TRAIN),
    Command("explain", "explain", "explain", TRAIN),
    Command("watch", "runs.watch", "watch", JUDGE),
    Command("evaluate", "deepracer.evaluate", "evaluate", JUDGE),
    Command("race", "deepracer.race", "race", JUDGE),
    Command("checkpoints", "runs.checkpoints", "checkpoints", JUDGE),
    Command("leaderboards", "deepracer.leaderboards", "leaderboards", JUDGE),
    Command("report", "runs.report", "report", UNDERSTAND),
    Command("why", "runs.why", "why", UNDERSTAND),
    Command("look", "runs.look", "look", UNDERSTAND),
    Command("sensors", "deepracer.sensors", "sensors", UNDERSTAND),
    Command("logs", "deepracer.logs", "logs", UNDERSTAND),
    Command("notebooks", "runs.notebooks", "notebooks", UNDERSTAND),
    Command("replay", "deepracer.replay", "replay", UNDERSTAND),
    Command("tracks", "deepracer.tracks", "app", WORLDS),
    Command("snakes", "battlesnake.snakes", "app", WORLDS),
    Command("unity", "unity.unity", "app", WORLDS),
    Command("gym", "gym.gym", "app", WORLDS),
    Command("import", "runs.import_model", "import_", EXCHANGE),
    Command("export", "runs.export", "export", EXCHANGE),
    Command("serve", "runs.serve", "serve", EXCHANGE),
    Command("record", "runs.record", "record", EXCHANGE),
    Command("bucket", "buckets.buckets", "app", EXCHANGE),
    Command("init", "deepracer.init", "init", EXCHANGE),
    Command("dr", "deepracer.dr.group", "app", EXCHANGE),
    Command("jobs", "jobs.jobs", "app", WORKSHOP),
    Command("run", "run", "run", WORKSHOP),
    Command("sandbox", "jobs.sandbox", "sandbox", WORKSHOP),
    Command("bench", "bench", "app", WORKSHOP),
)
"""In the order of `racecraft --help`."""


def app_for(words: list[str]) -> typer.Typer:
    """Return a command line that has what these words name; where they begin with no command's name, all of it.

    >>> [one.name for one in app_for(["logs", "--help"]).registered_commands]
    ['logs']
    """
    named = [one for one in COMMANDS if words[:1] == [one.name]]
    return app_with(named or COMMANDS)


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
        command.add_to(app)
    return app


def root(version: bool = typer.Option(False, "--version", help="Say the version and stop.")) -> None:
    """Train, watch, judge and race reinforcement-learning agents on your own machine."""
    if version:
        from racecraft import __version__

        print(__version__)
        raise typer.Exit
