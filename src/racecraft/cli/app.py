"""The command line: one command per verb a person would say.

Every command imports what it needs when it runs, so that `--help` answers at once. With `--json` exactly one JSON
object on one line goes to standard output, and everything else to standard error. What the user gave and cannot be used
ends with a letter and exit code 2.
"""

from __future__ import annotations

import os
import sys

import typer

from racecraft.cli import algorithms, bench, explain, run, settings
from racecraft.cli.battlesnake import snakes
from racecraft.cli.buckets import buckets
from racecraft.cli.deepracer import evaluate, init, leaderboards, logs, new, race, replay, sensors, tracks, train
from racecraft.cli.deepracer.dr import group
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
from racecraft.contract.errors import RacecraftError, UserInputError

app = typer.Typer(
    name="racecraft",
    help="Train, watch, judge and race reinforcement-learning agents on your own machine.",
    epilog="Begin with: racecraft train",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)

app.command(name="train")(train.train)
app.command(name="evaluate")(evaluate.evaluate)
app.command(name="race")(race.race)
app.command(name="report")(report.report)
app.command(name="checkpoints")(checkpoints.checkpoints)
app.command(name="look")(look.look)
app.command(name="why")(why.why)
app.command(name="notebooks")(notebooks.notebooks)
app.command(name="watch")(watch.watch)
app.command(name="stop")(stop.stop)
app.command(name="replay")(replay.replay)
app.command(name="logs")(logs.logs)
app.command(name="leaderboards")(leaderboards.leaderboards)
app.command(name="new")(new.new)
app.command(name="init")(init.init)
app.add_typer(group.app, name="dr")
app.command(name="sensors")(sensors.sensors)
app.add_typer(tracks.app, name="tracks")
app.add_typer(gym.app, name="gym")
app.add_typer(snakes.app, name="snakes")
app.add_typer(unity.app, name="unity")
app.add_typer(jobs.app, name="jobs")
app.command(name="tune", context_settings=tune.CONTEXT)(tune.tune)
app.command(name="sandbox")(sandbox.sandbox)
app.add_typer(buckets.app, name="bucket")
app.command(name="serve")(serve.serve)
app.command(name="import")(import_model.import_)
app.command(name="export")(export.export)
app.command(name="run", context_settings=run.CONTEXT)(run.run)
app.command(name="record")(record.record)
app.command(name="algorithms")(algorithms.algorithms)
app.command(name="settings")(settings.settings)
app.command(name="explain")(explain.explain)
app.add_typer(bench.app, name="bench")


@app.callback(invoke_without_command=True)
def root(version: bool = typer.Option(False, "--version", help="Say the version and stop.")) -> None:
    """Train, watch, judge and race reinforcement-learning agents on your own machine."""
    if version:
        from racecraft import __version__

        print(__version__)
        raise typer.Exit


def main() -> None:
    """Run the command line; errors of ours become letters and exit codes."""
    # Threads that wait shall spin briefly and then sleep: beside another busy program long spinning costs many times
    # what it saves. OpenMP reads this when torch and Numba load it, which no import has done yet.
    os.environ.setdefault("GOMP_SPINCOUNT", "5000")
    if "RACECRAFT_LIFELINE" in os.environ:  # a job's process; everybody else is spared the import
        from racecraft.jobs import lifeline

        lifeline.hold()
    try:
        app()
    except UserInputError as error:
        print(f"racecraft: {error}", file=sys.stderr)
        sys.exit(2)
    except RacecraftError as error:
        print(f"racecraft: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("racecraft: stopped.", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(141)
