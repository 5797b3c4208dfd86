"""`racecraft corridor`."""

from __future__ import annotations

import typer

from fifth_world.actions import train
from racecraft.actions.train_run import TrainedRun
from racecraft.cli.train import train_command

app = typer.Typer(help="Train a walker to find the exit of a corridor.", no_args_is_help=True)


@app.callback()
def corridor() -> None:
    """Train a walker to find the exit of a corridor."""


def show(trained: TrainedRun) -> None:
    """Print what a training came to."""
    print(f"corridor: {trained.outcome.steps} steps; run: {trained.run.path}")


app.command("train")(train_command(train, show))
