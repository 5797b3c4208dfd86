"""`racecraft gym`: any Gymnasium environment on the same loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Train on any registered Gymnasium environment.", no_args_is_help=True)


@app.callback()
def gym() -> None:
    """Train on any registered Gymnasium environment."""


@app.command()
def train(
    environment: Annotated[str, typer.Argument(metavar="ID", help="A registered id, such as CartPole-v1.")],
    stop: Annotated[
        list[str] | None,
        typer.Option(help="score=475, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/<id>-<number>.")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same machine, same training.")] = 1,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="group.name=value; `racecraft settings` lists them all.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Train until the environment is solved.

    Examples:

        racecraft gym train CartPole-v1

        racecraft gym train Pendulum-v1 --stop score=-200 --stop minutes=5
    """
    from racecraft.cli.output import print_json
    from racecraft.training.gym_training import GymRequest, train_gym
    from racecraft.training.progress import watcher

    request = GymRequest(environment, tuple(stop or ()), run, seed, tuple(set_ or ()))
    trained = train_gym(request, watcher(sys.stderr if json else sys.stdout))
    if json:
        print_json(trained.summary())
        return
    summary = trained.summary()
    judged, steps = summary["evaluation"], f"{summary['env_steps']:,} steps; run: {trained.run.path}"
    if judged is None:
        print(f"{environment}: stopped before its first evaluation, after {steps}")
        return
    verdict = "solved" if summary["solved"] else "not solved"
    mean, episodes = judged["mean_return"], judged["episodes"]
    print(f"{environment}: {verdict}, mean return {mean:.1f} over {episodes} greedy episodes after {steps}")
