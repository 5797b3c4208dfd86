"""`racecraft train`: train a car."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

from racecraft.cli.option_groups import option_names, takes_groups
from racecraft.cli.options import Cluster
from racecraft.cli.output import print_next_steps, word
from racecraft.cli.training import Left, Road, TrainingOptions
from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback
    from racecraft.training.trainer import Trained
    from racecraft.worlds.deepracer.training.plan import RaceRequest


@dataclass(frozen=True)
class TrackOptions:
    """Where the cars drive, in training and beside it."""

    PANEL: ClassVar[str] = "Tracks and groups"

    track: Annotated[
        list[str] | None,
        typer.Option(
            help="A name from `racecraft tracks list`, or a waypoint file (.npy); by default reinvent_base. "
            "Several: one model learns them together."
        ),
    ] = None
    tracks: Annotated[
        str | None, typer.Option(help="The same as a comma list; all: every circuit of the catalogue.")
    ] = None
    group: Annotated[
        list[str] | None,
        typer.Option(
            help="Cars that race otherwise: 'track=Oval_track race=OBJECT_AVOIDANCE boxes.number=3 direction=both "
            "cars=8'; may be repeated. One without track= races on every --track."
        ),
    ] = None
    groups: Annotated[Path | None, typer.Option(help="A JSON file: a list of such groups, by word.")] = None
    hold_out: Annotated[
        list[str] | None,
        typer.Option(help="A track, or a comma list, that is never trained on and judged at every evaluation."),
    ] = None

    @cached_property
    def shares(self) -> tuple[str, ...]:
        """The groups of --groups and of every --group, read once."""
        from racecraft.worlds.deepracer.training.groups import read_groups

        return (*(read_groups(self.groups) if self.groups else ()), *(self.group or ()))

    def one_or_several(self) -> tuple[str | None, tuple[str, ...]]:
        """Return the only track that --track names, or all that it and --tracks name.

        Raises:
            SettingError: Both were given.
        """
        if self.track and self.tracks is not None:
            raise SettingError("--track and --tracks were given; expected all names after one of them.")
        if self.track and len(self.track) == 1:
            return self.track[0], ()
        return None, tuple(self.track or ()) if self.tracks is None else (self.tracks,)


@dataclass(frozen=True)
class CarOptions:
    """What drives, how it learns, and whom it races."""

    PANEL: ClassVar[str] = "The car and whom it races"

    car: Annotated[
        str | None,
        typer.Option(
            help="v4, v5-classic, v6, v6-unlimited or kinematic; by default what the metadata's version asks for."
        ),
    ] = None
    preset: Annotated[
        str | None,
        typer.Option(
            help="race: the fastest laps within a budget of steps; fast: laps soonest, at 1 m/s; aws: AWS's learner, "
            "figure by figure. By default race for one car on one track with PPO, else fast."
        ),
    ] = None
    fidelity: Annotated[
        str | None,
        typer.Option(help="sane, or aws with the original's habits; by default what goes with the preset."),
    ] = None
    against: Annotated[
        list[str] | None,
        typer.Option(
            help="Race others: self (past selves), RUN[:best|last|N], a model of AWS's, or a folder of runs; may be "
            "repeated."
        ),
    ] = None


@dataclass(frozen=True)
class CarTraining(TrainingOptions):
    """What a training of cars is asked."""

    stop: Annotated[
        list[str] | None,
        typer.Option(
            help="laps, minutes=10, iterations=50, steps=200000; may be repeated; the first that holds ends it."
        ),
    ] = None
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/TRACK-N.")] = None
    pictures: Annotated[
        bool, typer.Option(help="Leave a film, the path, the curves and the report in the run folder.")
    ] = True
    trust_reward: Annotated[
        bool,
        typer.Option(
            "--trust-reward",
            help="Give the reward function all your rights: files, network, programs. Without it, it can compute, "
            "print and read files beside it.",
        ),
    ] = False
    watch: Annotated[
        bool, typer.Option("--watch", help="Open a page that shows it while it trains, as `racecraft watch` does.")
    ] = False

    def page(self, shown: TrainingCallback) -> AbstractContextManager[TrainingCallback]:
        """Watch with a page beside, where that is asked for."""
        from racecraft.cli.runs.watch_process import watched

        return watched(shown, self.watch, self.tell, stays=not self.json)


RACES = "races"
"""What a car that races others is told by, beside pictures."""
KEPT_BY_A_RUN = ("folder", *option_names(TrackOptions), *option_names(CarOptions))


@takes_groups
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
        return _request(folder, where, who, options)

    def leave(trained: Trained) -> Left:
        return _leave(trained, options)

    road = Road(
        "deepracer",
        "runs/reinvent_base-1",
        KEPT_BY_A_RUN,
        kept_as=dict.fromkeys(("group", "groups"), ("groups", list(where.shares))),
        folder=folder,
        model=None if folder is None else folder.name,
        cluster=cluster,
        beside=options.page,
        again={"trust_reward": options.trust_reward},
    )
    road.train(context, options, request, _tell_trained, leave)


def _request(folder: Path | None, where: TrackOptions, who: CarOptions, options: CarTraining) -> RaceRequest:
    from racecraft.worlds.deepracer.training.plan import RaceRequest

    one, several = where.one_or_several()
    return RaceRequest(
        folder,
        one,
        tracks=several,
        groups=where.shares,
        hold_out=tuple(where.hold_out or ()),
        car=who.car,
        preset=who.preset,
        fidelity=who.fidelity,
        against=tuple(who.against or ()),
        trust_reward=options.trust_reward,
        **options.asked(options.source(folder)),
    )


def _leave(trained: Trained, options: CarTraining) -> Left:
    """Leave pictures, where they are asked for, and of a car that races others how good it became at that."""
    from racecraft.worlds.deepracer.analysis.report import paint_run

    painted = paint_run(trained.run, options.tell) if options.pictures else {}
    races = _race_selves(trained, options.pictures, options.tell)
    return {kind: str(path) for kind, path in painted.items()} | ({} if races is None else {RACES: races})


def _tell_trained(trained: Trained, left: Left) -> None:
    _say_what_came_of_it(trained, {kind: path for kind, path in left.items() if kind != RACES})
    if RACES in left:
        _say_who_is_better(left[RACES])


def _race_selves(trained: Trained, film: bool, tell: Callable[[str], None]) -> dict[str, Any] | None:
    """Race the last self of a car that was trained against others against earlier ones; None of any other car."""
    rivals = trained.run.read_job()["asked"].get("against", [])
    if not rivals:
        return None
    from racecraft.worlds.deepracer.training.opponents import models_among
    from racecraft.worlds.deepracer.training.self_rating import rate_selves

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
