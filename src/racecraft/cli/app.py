"""The command line: one command per verb a person would say.

Every command imports what it needs when it runs, so that `--help` answers at once. With `--json` exactly one JSON
object on one line goes to standard output, and everything else to standard error. What the user gave and cannot be used
ends with a letter and exit code 2.
"""

from __future__ import annotations

import typer

from racecraft.cli import algorithms, bench, explain, run, settings
from racecraft.cli.battlesnake import snakes
from racecraft.cli.buckets import buckets
from racecraft.cli.deepracer import evaluate, init, leaderboards, logs, new, race, replay, sensors, tracks, train
from racecraft.cli.deepracer.dr import group
from racecraft.cli.entry import say_letters
from racecraft.cli.gym import gym
from racecraft.cli.jobs import jobs, sandbox, tune
from racecraft.cli.runs import (
    checkpoints,
    export,
    import_model,
    look,
    notebooks,
    record,
    report,
    serve,
    stop,
    watch,
    why,
)
from racecraft.cli.unity import unity

app = typer.Typer(
    name="racecraft",
    help="Train, watch, judge and race reinforcement-learning agents on your own machine.",
    epilog="Begin with: racecraft train",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)

TRAIN, JUDGE, UNDERSTAND = "Train", "Watch and judge", "Understand"
WORLDS, EXCHANGE, WORKSHOP = "Worlds", "In and out", "Workshop"

app.command(name="new", rich_help_panel=TRAIN)(new.new)
app.command(name="train", rich_help_panel=TRAIN)(train.train)
app.command(name="stop", rich_help_panel=TRAIN)(stop.stop)
app.command(name="tune", rich_help_panel=TRAIN, context_settings=tune.CONTEXT)(tune.tune)
app.command(name="algorithms", rich_help_panel=TRAIN)(algorithms.algorithms)
app.command(name="settings", rich_help_panel=TRAIN)(settings.settings)
app.command(name="explain", rich_help_panel=TRAIN)(explain.explain)

app.command(name="watch", rich_help_panel=JUDGE)(watch.watch)
app.command(name="evaluate", rich_help_panel=JUDGE)(evaluate.evaluate)
app.command(name="race", rich_help_panel=JUDGE)(race.race)
app.command(name="checkpoints", rich_help_panel=JUDGE)(checkpoints.checkpoints)
app.command(name="leaderboards", rich_help_panel=JUDGE)(leaderboards.leaderboards)

app.command(name="report", rich_help_panel=UNDERSTAND)(report.report)
app.command(name="why", rich_help_panel=UNDERSTAND)(why.why)
app.command(name="look", rich_help_panel=UNDERSTAND)(look.look)
app.command(name="sensors", rich_help_panel=UNDERSTAND)(sensors.sensors)
app.command(name="logs", rich_help_panel=UNDERSTAND)(logs.logs)
app.command(name="notebooks", rich_help_panel=UNDERSTAND)(notebooks.notebooks)
app.command(name="replay", rich_help_panel=UNDERSTAND)(replay.replay)

app.add_typer(tracks.app, name="tracks", rich_help_panel=WORLDS)
app.add_typer(snakes.app, name="snakes", rich_help_panel=WORLDS)
app.add_typer(unity.app, name="unity", rich_help_panel=WORLDS)
app.add_typer(gym.app, name="gym", rich_help_panel=WORLDS)

app.command(name="import", rich_help_panel=EXCHANGE)(import_model.import_)
app.command(name="export", rich_help_panel=EXCHANGE)(export.export)
app.command(name="serve", rich_help_panel=EXCHANGE)(serve.serve)
app.command(name="record", rich_help_panel=EXCHANGE)(record.record)
app.add_typer(buckets.app, name="bucket", rich_help_panel=EXCHANGE)
app.command(name="init", rich_help_panel=EXCHANGE)(init.init)
app.add_typer(group.app, name="dr", rich_help_panel=EXCHANGE)

app.add_typer(jobs.app, name="jobs", rich_help_panel=WORKSHOP)
app.command(name="run", rich_help_panel=WORKSHOP, context_settings=run.CONTEXT)(run.run)
app.command(name="sandbox", rich_help_panel=WORKSHOP)(sandbox.sandbox)
app.add_typer(bench.app, name="bench", rich_help_panel=WORKSHOP)


@app.callback(invoke_without_command=True)
def root(version: bool = typer.Option(False, "--version", help="Say the version and stop.")) -> None:
    """Train, watch, judge and race reinforcement-learning agents on your own machine."""
    if version:
        from racecraft import __version__

        print(__version__)
        raise typer.Exit


def main() -> None:
    """Run the command line; errors of ours become letters and exit codes."""
    say_letters(app)
