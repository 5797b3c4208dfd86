"""`racecraft train`: train a car."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def train(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="Folder with reward_function.py, hyperparameters.json, model_metadata.json; any may be absent."
        ),
    ] = None,
    track: Annotated[
        str, typer.Option(help="A name from `racecraft tracks list`, or a waypoint file (.npy).")
    ] = "reinvent_base",
    car: Annotated[
        str | None, typer.Option(help="v4, v6 or kinematic; by default what the metadata's version asks for.")
    ] = None,
    preset: Annotated[str, typer.Option(help="fast: the learner and network that lap soonest.")] = "fast",
    stop: Annotated[
        list[str] | None,
        typer.Option(
            help="laps, minutes=10, iterations=50, steps=200000; may be repeated; the first that holds ends it."
        ),
    ] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/<track>-<number>.")] = None,
    seed: Annotated[int, typer.Option(help="Same seed, same machine, same training.")] = 1,
    set_: Annotated[
        list[str] | None, typer.Option("--set", help="group.name=value; `racecraft settings` lists them all.")
    ] = None,
    video: Annotated[bool, typer.Option(help="Draw picture, curves and video of the best policy at the end.")] = True,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Train a car from its camera until it laps.

    Examples:
        racecraft train

        racecraft train my-car --track Oval_track --stop laps --stop minutes=5

        racecraft train my-car --set ppo.learning_rate=1e-4 --seed 3 --json
    """
    from racecraft.cli.output import print_json, say
    from racecraft.training.progress import watcher
    from racecraft.training.racing import RaceRequest, plan_car, train_car

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    request = RaceRequest(
        folder=folder, track=track, car=car, preset=preset, stops=tuple(stop or ()), run=run, seed=seed,
        overrides=tuple(set_ or ()),
    )  # fmt: skip
    plan = plan_car(request)
    for note in plan.notes:
        tell(f"- {note}")
    stream = sys.stderr if json else sys.stdout
    trained = train_car(plan, watcher(stream), tell)
    if json:
        print_json(trained.summary())
        return
    _say_what_came_of_it(trained.summary(), tell)


def _say_what_came_of_it(summary, tell) -> None:  # type: ignore[no-untyped-def]
    tell(str(summary))
