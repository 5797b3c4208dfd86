"""`racecraft gym`: any Gymnasium environment on the same loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.from_request import TerminalProgress, takes_requests
from racecraft.cli.options import Cluster, Json
from racecraft.cli.training import Left, Road, verdict
from racecraft.worlds.gymnasium.actions.train import GymTraining, gym_request

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.gymnasium.training.trainer import GymRequest

app = typer.Typer(help="Train on any registered Gymnasium environment.", no_args_is_help=True)


@app.callback()
def gym() -> None:
    """Train on any registered Gymnasium environment."""


@app.command()
@takes_requests
def train(
    context: typer.Context,
    environment: Annotated[
        str | None, typer.Argument(metavar="ID", help="A registered id, such as CartPole-v1.")
    ] = None,
    *,
    options: GymTraining,
    cluster: Cluster = None,
    json: Json = False,
) -> None:
    """Train until the environment is solved.

    Examples:

        racecraft gym train CartPole-v1

        racecraft gym train Pendulum-v1 --stop score=-200 --stop minutes=5

        racecraft gym train --run runs/CartPole-v1-1 --resume --stop minutes=5
    """

    def request() -> GymRequest:
        return gym_request(environment, options, TerminalProgress(quiet_stdout=json))

    road = Road("gymnasium", "runs/CartPole-v1-1", ("environment",), model=environment, cluster=cluster)
    road.train(context, options, request, _tell_trained, json)


def _tell_trained(trained: Trained, left: Left) -> None:
    summary = trained.summary()
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps; run: {trained.run.path}"
    if judged is None:
        print(f"{summary['environment']}: stopped before its first evaluation, after {steps}")
        return
    told = f"{verdict(summary)}mean return {judged['mean_return']:.1f} over {judged['episodes']} greedy episodes"
    print(f"{summary['environment']}: {told} after {steps}")
