"""`racecraft train`: train a car."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.from_request import TerminalProgress, takes_requests
from racecraft.cli.options import Cluster, Json
from racecraft.cli.output import print_next_steps, word
from racecraft.cli.training import Left, Road
from racecraft.settings.request import option_names
from racecraft.worlds.deepracer.actions.train import RACES, CarOptions, CarTraining, TrackOptions, car_request

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback
    from racecraft.training.trainer import Trained
    from racecraft.worlds.deepracer.training.plan import RaceRequest


KEPT_BY_A_RUN = ("folder", *option_names(TrackOptions), *option_names(CarOptions))


@takes_requests
def train(
    context: typer.Context,
    folder: Annotated[
        Path | None,
        typer.Argument(help="reward_function.py, hyperparameters.json, model_metadata.json; any may be absent."),
    ] = None,
    *,
    where: TrackOptions,
    who: CarOptions,
    options: CarTraining,
    cluster: Cluster = None,
    json: Json = False,
) -> None:
    """Train a car from its camera until it laps.

    Examples:

        racecraft train

        racecraft train --watch

        racecraft train my-car --track Oval_track --stop laps --stop minutes=5

        racecraft train --tracks Oval_track,Vegas_track,reinvent_base --hold-out LGSWide

        racecraft train my-car --group cars=16 --group 'race=OBJECT_AVOIDANCE boxes.number=3 cars=16'

        racecraft train my-car --against self --against runs/reinvent_base-1 --stop minutes=10

        racecraft train my-car --set ppo.learning_rate=1e-4 --seed 3 --json

        racecraft train --run runs/reinvent_base-1 --resume --stop minutes=10

        racecraft train my-car --from s3://models/fast-car-1 --mirror s3://models/fast-car-2
    """

    def request() -> RaceRequest:
        return car_request(folder, where, who, options, TerminalProgress(quiet_stdout=json))

    def page(shown: TrainingCallback) -> AbstractContextManager[TrainingCallback]:
        from racecraft.cli.runs.watch_process import watched

        return watched(shown, options.watch, TerminalProgress(quiet_stdout=json), stays=not json)

    road = Road(
        "deepracer",
        "runs/reinvent_base-1",
        KEPT_BY_A_RUN,
        kept_as=dict.fromkeys(("group", "groups"), ("groups", list(where.shares))),
        folder=folder,
        model=None if folder is None else folder.name,
        cluster=cluster,
        beside=page,
        again={"trust_reward": options.trust_reward},
    )
    road.train(context, options, request, _tell_trained, json)


def _tell_trained(trained: Trained, left: Left) -> None:
    _say_what_came_of_it(trained, {kind: path for kind, path in left.items() if kind != RACES})
    if RACES in left:
        _say_who_is_better(left[RACES])


def _say_who_is_better(races: dict[str, Any]) -> None:
    gain = races["last_over_first"]
    print(
        f"\nAgainst others: {gain['points']:+.0f} Elo over its first self ({gain['low']:+.0f} to {gain['high']:+.0f})."
    )
    for one in races["selves"]:
        print(f"  {one['name']:20} {one['points']:6.0f}   {one['wins']} of {one['races']} races won, ", end="")
        print(f"{one['overtakes']} overtakes, {one['crashes']} crashes")
    passing = races["against_a_slower_self"]
    told = f"against itself at {passing['pace']:.0%} of its pace"
    print(f"  {told}: {passing['overtakes_per_race']:.2f} overtakes a race, ", end="")
    print(f"{passing['wins']} of {passing['races']} races won, {passing['crashes']} crashes")
    for kind, place in races["files"].items():
        print(f"  {kind:8} {place}")


def what_came_of_it(stable_seconds: float | None, best_lap_seconds: float | None) -> str:
    """Return what a training came to, a line; the lap is the fastest of the best checkpoint's own evaluation.

    >>> what_came_of_it(21.5, 20.8)
    'It laps: stable after 21.5 s of training; best lap of the best checkpoint 20.80 s.'
    """
    lap = "" if best_lap_seconds is None else f"best lap of the best checkpoint {best_lap_seconds:.2f} s"
    if stable_seconds is not None:  # compared by reward, the best checkpoint need not be one that laps
        return f"It laps: stable after {stable_seconds:.1f} s of training; {lap or 'the best checkpoint does not lap'}."
    return f"It drives full laps, but it is not stable yet; {lap}." if lap else "It does not lap yet."


def _say_what_came_of_it(trained: Trained, files: dict[str, Any]) -> None:
    summary, path = trained.summary(), word(trained.run.path)
    stable = summary["seconds_to_stable_laps"]
    print(f"\n{what_came_of_it(stable, summary['best_lap_seconds'])}")
    for kind, place in files.items():
        print(f"  {kind:8} {place}")
    print("\nWhat to try next:")
    if stable is None:
        print_next_steps(("go on", f"racecraft train --run {path} --resume --stop minutes=10"))
    print_next_steps(
        ("see every drive again, and each car's camera", f"racecraft watch {path}"),
        ("film three laps", f"racecraft evaluate {path} --laps 3 --video three-laps.mp4"),
        *next_trainings(trained.run.read_job()["asked"]),
    )


def next_trainings(asked: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what to train next, purpose and command; whoever trained a folder has a reward of their own already.

    Args:
        asked: What job.json says was asked for.

    >>> next_trainings({"folder": "my-car", "track": "Oval_track"})[0]
    ('change the reward and train it again', 'racecraft train my-car --track Oval_track')
    >>> next_trainings({"folder": "my-car", "track": "Oval_track", "tracks": ["Oval_track", "LGSWide"]})[0][1]
    'racecraft train my-car --tracks Oval_track,LGSWide'
    """
    from racecraft.worlds.deepracer.training.plan import DEFAULT_TRACK

    folder, track = asked.get("folder"), asked.get("track", DEFAULT_TRACK)
    train = "racecraft train" if folder is None else f"racecraft train {word(folder)}"
    elsewhere = ("try another track", f"{train} --track {'Oval_track' if track != 'Oval_track' else DEFAULT_TRACK}")
    if folder is None:
        return [("write a reward function of your own", "racecraft new my-car"), elsewhere]
    again = train if track == DEFAULT_TRACK else f"{train} --track {word(track)}"
    if many := asked.get("tracks"):
        again = f"{train} --tracks {word(','.join(many))}"
    return [("change the reward and train it again", again), elsewhere]
