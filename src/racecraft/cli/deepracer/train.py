"""`racecraft train`: train a car."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.options import DEFAULT, AlgorithmName, From, Json, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained

STOP_HELP = "laps, minutes=10, iterations=50, steps=200000; may be repeated; the first that holds ends it."
UNCHANGEABLE = ("folder", "track", "car", "preset", "fidelity", "seed", "algorithm", "set_", "from_")


def train(
    context: typer.Context,
    folder: Annotated[
        Path | None,
        typer.Argument(help="reward_function.py, hyperparameters.json, model_metadata.json; any may be absent."),
    ] = None,
    track: Annotated[
        str | None,
        typer.Option(help="A name from `racecraft tracks list`, or a waypoint file (.npy); by default reinvent_base."),
    ] = None,
    car: Annotated[
        str | None,
        typer.Option(help="v4, v5-classic, v6 or kinematic; by default what the metadata's version asks for."),
    ] = None,
    preset: Annotated[
        str, typer.Option(help="fast: the learner and network that lap soonest; aws: those of AWS, figure by figure.")
    ] = "fast",
    fidelity: Annotated[
        str | None, typer.Option(help="sane, or aws with the original's habits; by default what goes with the preset.")
    ] = None,
    stop: Annotated[list[str] | None, typer.Option(help=STOP_HELP)] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/TRACK-N.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same machine, same training.")] = 1,
    algorithm: AlgorithmName = DEFAULT,
    set_: Overrides = None,
    from_: From = None,
    resume: Resume = False,
    pictures: Annotated[
        bool, typer.Option(help="Leave a film, the path, the curves and the report in the run folder.")
    ] = True,
    json: Json = False,
) -> None:
    """Train a car from its camera until it laps.

    Examples:

        racecraft train

        racecraft train my-car --track Oval_track --stop laps --stop minutes=5

        racecraft train my-car --set ppo.learning_rate=1e-4 --seed 3 --json

        racecraft train --run runs/reinvent_base-1 --resume --stop minutes=10
    """
    from racecraft.cli.output import print_json, say
    from racecraft.training.deepracer.plan import RaceRequest
    from racecraft.training.progress import watcher
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    watching = watcher(sys.stderr if json else sys.stdout)
    if resume:
        begun = refuse_changes(context, run, UNCHANGEABLE, "runs/reinvent_base-1")
        trained = resume_run(begun, tuple(stop or ()), watching, tell, "deepracer")
    else:
        request = RaceRequest(folder, track, car, preset, fidelity, **asked(algorithm, stop, run, seed, set_, from_))
        trained = train_world(request, watching, tell)
    files = _paint(trained, tell) if pictures else {}
    if json:
        print_json({**trained.summary(), **files})
    else:
        _say_what_came_of_it(trained, files)


def _paint(trained: Trained, tell: Callable[[str], None]) -> dict[str, str]:
    from racecraft.reporting.gallery import paint_run

    return {kind: str(path) for kind, path in paint_run(trained.run, tell).items()}


def _say_what_came_of_it(trained: Trained, files: dict[str, Any]) -> None:
    summary, path = trained.summary(), trained.run.path
    stable, best = summary["seconds_to_stable_laps"], summary["best_lap_seconds"]
    if stable is not None:
        print(f"\nIt laps: stable after {stable:.1f} s of training; best lap {best:.2f} s.")
    elif best is not None:
        print(f"\nIt drove full laps, the best in {best:.2f} s, but it is not stable yet.")
    else:
        print("\nIt does not lap yet.")
    for kind, place in files.items():
        print(f"  {kind:8} {place}")
    print("\nWhat to try next:")
    if stable is None:
        print(f"  racecraft train --run {path} --resume --stop minutes=10      # go on")
    print(f"  racecraft evaluate {path} --laps 3 --video three-laps.mp4")
    print("  racecraft new my-car          # a folder with a reward function of your own")
    print("  racecraft train --track Oval_track")
