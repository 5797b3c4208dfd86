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
    """Below racecraft; a CONTEXT in it holds the settings of the command's context."""
    attribute: str
    """Its function; of a group its `app`."""
    panel: str
    """Heading below which `--help` lists it."""

    def add_to(self, app: typer.Typer) -> None:
        """Import it and add it."""
        module: Any = import_module(f"racecraft.{self.module}")
        found, context = getattr(module, self.attribute), getattr(module, "CONTEXT", None)
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=self.name, rich_help_panel=self.panel)
        else:
            app.command(name=self.name, rich_help_panel=self.panel, context_settings=context)(found)


COMMANDS = (
    Command("new", "worlds.deepracer.cli.new", "new", TRAIN),
    Command("train", "worlds.deepracer.cli.train", "train", TRAIN),
    Command("stop", "cli.runs.stop", "stop", TRAIN),
    Command("tune", "cli.jobs.tune", "tune", TRAIN),
    Command("algorithms", "cli.algorithms", "algorithms", TRAIN),
    Command("settings", "cli.settings", "settings", TRAIN),
    Command("explain", "worlds.deepracer.cli.explain", "explain", TRAIN),
    Command("watch", "cli.runs.watch", "watch", JUDGE),
    Command("evaluate", "worlds.deepracer.cli.evaluate", "evaluate", JUDGE),
    Command("race", "worlds.deepracer.cli.race", "race", JUDGE),
    Command("checkpoints", "cli.runs.checkpoints", "checkpoints", JUDGE),
    Command("leaderboards", "worlds.deepracer.cli.leaderboards", "leaderboards", JUDGE),
    Command("report", "cli.runs.report", "report", UNDERSTAND),
    Command("why", "worlds.deepracer.cli.why", "why", UNDERSTAND),
    Command("look", "worlds.deepracer.cli.look", "look", UNDERSTAND),
    Command("sensors", "worlds.deepracer.cli.sensors", "sensors", UNDERSTAND),
    Command("logs", "worlds.deepracer.cli.logs", "logs", UNDERSTAND),
    Command("notebooks", "worlds.deepracer.cli.notebooks", "notebooks", UNDERSTAND),
    Command("replay", "worlds.deepracer.cli.replay", "replay", UNDERSTAND),
    Command("tracks", "worlds.deepracer.cli.tracks", "app", WORLDS),
    Command("snakes", "worlds.battlesnake.cli.snakes", "app", WORLDS),
    Command("unity", "worlds.unity.cli.unity", "app", WORLDS),
    Command("gym", "worlds.gymnasium.cli.gym", "app", WORLDS),
    Command("import", "worlds.deepracer.cli.import_model", "import_", EXCHANGE),
    Command("export", "cli.runs.export", "export", EXCHANGE),
    Command("serve", "cli.runs.serve", "serve", EXCHANGE),
    Command("record", "cli.runs.record", "record", EXCHANGE),
    Command("bucket", "cli.buckets.buckets", "app", EXCHANGE),
    Command("init", "worlds.deepracer.cli.init", "init", EXCHANGE),
    Command("dr", "worlds.deepracer.cli.dr.group", "app", EXCHANGE),
    Command("jobs", "cli.jobs.jobs", "app", WORKSHOP),
    Command("run", "cli.run", "run", WORKSHOP),
    Command("sandbox", "cli.jobs.sandbox", "sandbox", WORKSHOP),
    Command("bench", "worlds.deepracer.cli.bench", "app", WORKSHOP),
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
