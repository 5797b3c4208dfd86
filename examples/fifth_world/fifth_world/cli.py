"""`racecraft corridor`."""

from __future__ import annotations

from typing import Annotated

import typer

from racecraft.actions.training_options import TrainingOptions
from racecraft.cli.from_request import takes_requests
from racecraft.cli.options import Json
from racecraft.cli.training import Left, Road

app = typer.Typer(help="Train a walker to find the exit of a corridor.", no_args_is_help=True)


@app.callback()
def corridor() -> None:
    """Train a walker to find the exit of a corridor."""


@app.command()
@takes_requests
def train(
    context: typer.Context,
    length: Annotated[int, typer.Option(min=2, help="Cells.")] = 9,
    *,
    options: TrainingOptions,
    json: Json = False,
) -> None:
    """Train until the exit is found the short way."""
    from fifth_world.training import CorridorRequest

    def told(trained, left: Left) -> None:
        print(f"corridor: {trained.outcome.steps} steps; run: {trained.run.path}")

    road = Road("corridor", "runs/corridor-1", ("length",))

    def request() -> CorridorRequest:
        return CorridorRequest(length=length, **options.for_request(options.source(print)))

    road.train(context, options, request, told, json)
