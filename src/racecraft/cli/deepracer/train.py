"""`racecraft train`: train a car."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.buckets.training import MirrorAt
from racecraft.cli.metrics_beside import MetricsPort, measured
from racecraft.cli.options import DEFAULT, AlgorithmName, Detach, From, Json, Overrides, Resume, asked
from racecraft.cli.resuming import refuse_changes
from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained

TRACKS, CARS = "Tracks and groups", "The car and whom it races"
"""How --help groups the options."""
STOP_HELP = "laps, minutes=10, iterations=50, steps=200000; may be repeated; the first that holds ends it."
UNCHANGEABLE = (
    "folder", "track", "tracks", "group", "groups", "hold_out", "car", "preset", "fidelity", "seed", "algorithm",
    "set_", "from_", "against",
)  # fmt: skip


def train(
    context: typer.Context,
    folder: Annotated[
        Path | None,
        typer.Argument(help="reward_function.py, hyperparameters.json, model_metadata.json; any may be absent."),
    ] = None,
    track: Annotated[
        list[str] | None,
        typer.Option(
            help="A name from `racecraft tracks list`, or a waypoint file (.npy); by default reinvent_base. "
            "Several: one model learns them together.",
            rich_help_panel=TRACKS,
        ),
    ] = None,
    tracks: Annotated[
        str | None,
        typer.Option(help="The same as a comma list; all: every circuit of the catalogue.", rich_help_panel=TRACKS),
    ] = None,
    group: Annotated[
        list[str] | None,
        typer.Option(
            help="Cars that race otherwise: 'track=Oval_track race=OBJECT_AVOIDANCE boxes.number=3 direction=both "
            "cars=8'; may be repeated. One without track= races on every --track.",
            rich_help_panel=TRACKS,
        ),
    ] = None,
    groups: Annotated[
        Path | None, typer.Option(help="A JSON file: a list of such groups, by word.", rich_help_panel=TRACKS)
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            help="A track, or a comma list, that is never trained on and judged at every evaluation.",
            rich_help_panel=TRACKS,
        ),
    ] = None,
    car: Annotated[
        str | None,
        typer.Option(
            help="v4, v5-classic, v6 or kinematic; by default what the metadata's version asks for.",
            rich_help_panel=CARS,
        ),
    ] = None,
    preset: Annotated[
        str,
        typer.Option(
            help="fast: the learner and network that lap soonest; aws: those of AWS, figure by figure.",
            rich_help_panel=CARS,
        ),
    ] = "fast",
    fidelity: Annotated[
        str | None,
        typer.Option(
            help="sane, or aws with the original's habits; by default what goes with the preset.", rich_help_panel=CARS
        ),
    ] = None,
    against: Annotated[
        list[str] | None,
        typer.Option(
            help="Race others: self (past selves), RUN[:best|last|N], a model of AWS's, or a folder of runs; may be "
            "repeated.",
            rich_help_panel=CARS,
        ),
    ] = None,
    stop: Annotated[list[str] | None, typer.Option(help=STOP_HELP)] = None,
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/TRACK-N.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same machine, same training.")] = 1,
    algorithm: AlgorithmName = DEFAULT,
    set_: Overrides = None,
    from_: From = None,
    resume: Resume = False,
    detach: Detach = False,
    mirror: MirrorAt = None,
    pictures: Annotated[
        bool, typer.Option(help="Leave a film, the path, the curves and the report in the run folder.")
    ] = True,
    metrics_port: MetricsPort = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="Open a page that shows it while it trains, as `racecraft watch` does.")
    ] = False,
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
    from racecraft.cli.buckets.training import fetch_run, mirrored, place_of_mirror
    from racecraft.cli.jobs.detaching import detach_training
    from racecraft.cli.output import print_json, say
    from racecraft.cli.runs.watch_beside import watched
    from racecraft.training.deepracer.groups import read_groups
    from racecraft.training.deepracer.plan import RaceRequest
    from racecraft.training.progress import watcher
    from racecraft.training.worlds import resume as resume_run
    from racecraft.training.worlds import train as train_world

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    shares = (*(read_groups(groups) if groups else ()), *(group or ()))
    kept_as = dict.fromkeys(("group", "groups"), ("groups", list(shares)))
    begun = refuse_changes(context, run, UNCHANGEABLE, "runs/reinvent_base-1", kept_as) if resume else None
    place = place_of_mirror(mirror, folder, begun, tell)
    request = None
    if begun is None:
        from_ = None if from_ is None else fetch_run(from_, tell, folder)
        one, several = one_or_several(track, tracks)
        request = RaceRequest(
            folder,
            one,
            tracks=several,
            groups=shares,
            hold_out=tuple(hold_out or ()),
            car=car,
            preset=preset,
            fidelity=fidelity,
            against=tuple(against or ()),
            **asked(algorithm, stop, run, seed, set_, from_),
        )
    named, shown = run or folder, watcher(sys.stderr if json else sys.stdout)
    shown = measured(shown, metrics_port, None if named is None else named.name, tell, detach)
    if detach:
        return detach_training(context, run, request, json)
    with watched(shown, watch, tell, stays=not json) as watching:
        with mirrored(watching, place, tell, begun) as mirroring:
            if begun is not None:
                trained = resume_run(begun, tuple(stop or ()), mirroring, tell, "deepracer")
            else:
                assert request is not None
                trained = train_world(request, mirroring, tell)
        files = _paint(trained, tell) if pictures else {}
        races = _race_selves(trained, pictures, tell)
        if json:
            print_json({**trained.summary(), **files, **({} if races is None else {"races": races})})
        else:
            _say_what_came_of_it(trained, files)
            if races is not None:
                _say_who_is_better(races)


def one_or_several(track: list[str] | None, tracks: str | None) -> tuple[str | None, tuple[str, ...]]:
    """Return the only track that --track names, or all that it and --tracks name.

    Raises:
        SettingError: Both were given.
    """
    if track and tracks is not None:
        raise SettingError("--track and --tracks were given; expected all names after one of them.")
    if track and len(track) == 1:
        return track[0], ()
    return None, tuple(track or ()) if tracks is None else (tracks,)


def _paint(trained: Trained, tell: Callable[[str], None]) -> dict[str, str]:
    from racecraft.reporting.gallery import paint_run

    return {kind: str(path) for kind, path in paint_run(trained.run, tell).items()}


def _race_selves(trained: Trained, film: bool, tell: Callable[[str], None]) -> dict[str, Any] | None:
    """Race the last self of a car that was trained against others against earlier ones; None of any other car."""
    rivals = trained.run.read_job()["asked"].get("against", [])
    if not rivals:
        return None
    from racecraft.reporting.self_rating import rate_selves
    from racecraft.training.deepracer.rivals import models_among

    rated, files = rate_selves(trained.run, models_among(rivals), tell, film)
    return {**rated.as_dictionary(), "files": {kind: str(path) for kind, path in files.items()}}


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
    summary, path = trained.summary(), trained.run.path
    stable = summary["seconds_to_stable_laps"]
    print(f"\n{what_came_of_it(stable, summary['best_lap_seconds'])}")
    for kind, place in files.items():
        print(f"  {kind:8} {place}")
    print("\nWhat to try next:")
    if stable is None:
        print(f"  racecraft train --run {path} --resume --stop minutes=10      # go on")
    print(f"  racecraft watch {path}          # every drive again, and every car's camera")
    print(f"  racecraft evaluate {path} --laps 3 --video three-laps.mp4")
    print("  racecraft new my-car          # a folder with a reward function of your own")
    print("  racecraft train --track Oval_track")
