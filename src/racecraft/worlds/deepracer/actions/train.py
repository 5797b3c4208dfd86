"""Train a car: its options, the request they make, and what is left in the run folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.deepracer.training.groups import Group
    from racecraft.worlds.deepracer.training.plan import RaceRequest


@dataclass(frozen=True, kw_only=True)
class TrackOptions(Request):
    """Where the cars drive, in training and beside it."""

    PANEL: ClassVar[str] = "Tracks and groups"
    track: tuple[str, ...] = option(
        (),
        "A name from `racecraft tracks list`, or a waypoint file (.npy); by default reinvent_base. "
        "Several: one model learns them together.",
    )
    tracks: str | None = option(None, "The same as a comma list; all: every circuit of the catalogue.")
    group: tuple[str, ...] = option(
        (),
        "Cars that race otherwise: 'track=Oval_track race=OBJECT_AVOIDANCE boxes.number=3 direction=both "
        "cars=8'; may be repeated. One without track= races on every --track.",
    )
    groups: Path | None = option(None, "A JSON file: a list of such groups, by word.")
    hold_out: tuple[str, ...] = option(
        (), "A track, or a comma list, that is never trained on and judged at every evaluation."
    )

    @cached_property
    def shares(self) -> tuple[Group, ...]:
        """The groups of --groups and of every --group, read once."""
        from racecraft.worlds.deepracer.training.groups import read_groups

        return (*(read_groups(self.groups) if self.groups else ()), *(self.group))

    def one_or_several(self) -> tuple[str | None, tuple[str, ...]]:
        """Return the only track that --track names, or all that it and --tracks name.

        Raises:
            SettingError: Both were given.
        """
        if self.track and self.tracks is not None:
            raise SettingError("--track and --tracks were given; expected all names after one of them.")
        if self.track and len(self.track) == 1:
            return self.track[0], ()
        return None, self.track if self.tracks is None else (self.tracks,)


@dataclass(frozen=True, kw_only=True)
class CarOptions(Request):
    """What drives, how it learns, and whom it races."""

    PANEL: ClassVar[str] = "The car and whom it races"
    car: str | None = option(
        None, "v4, v5-classic, v6, v6-unlimited or kinematic; by default what the metadata's version asks for."
    )
    preset: str | None = option(
        None,
        "race: the fastest laps within a budget of steps; fast: laps soonest, at 1 m/s; aws: AWS's learner, "
        "figure by figure. By default race for one car on one track with PPO, else fast.",
    )
    fidelity: str | None = option(
        None, "sane, or aws with the original's habits; by default what goes with the preset."
    )
    against: tuple[str, ...] = option(
        (),
        "Race others: self (past selves), RUN[:best|last|N], a model of AWS's, or a folder of runs; may be repeated.",
    )


@dataclass(frozen=True, kw_only=True)
class CarTraining(TrainingOptions):
    """What a training of cars is asked."""

    stop: tuple[str, ...] = option(
        (), "laps, minutes=10, iterations=50, steps=200000; may be repeated; the first that holds ends it."
    )
    run: Path | None = option(None, "Run folder to make; by default runs/TRACK-N.")
    pictures: bool = option(True, "Leave a film, the path, the curves and the report in the run folder.")
    trust_reward: bool = option(
        False,
        "Give the reward function all your rights: files, network, programs. Without it, it can compute, "
        "print and read files beside it.",
    )
    watch: bool = option(False, "Open a page that shows it while it trains, as `racecraft watch` does.")


RACES = "races"
"""What a car that races others is told by, beside pictures."""


def car_request(
    folder: Path | None, where: TrackOptions, who: CarOptions, options: CarTraining, progress: Callable[[str], None]
) -> RaceRequest:
    """Return the request of a new run."""
    from racecraft.worlds.deepracer.training.plan import RaceRequest

    one, several = where.one_or_several()
    return RaceRequest(
        folder,
        one,
        tracks=several,
        groups=where.shares,
        hold_out=where.hold_out,
        car=who.car,
        preset=who.preset,
        fidelity=who.fidelity,
        against=who.against,
        trust_reward=options.trust_reward,
        **options.for_request(options.source(progress, folder)),
    )


def leave_pictures(trained: Trained, pictures: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """Leave pictures, where they are asked for, and of a car that races others how good it became at that."""
    from racecraft.worlds.deepracer.analysis.report import paint_run

    painted = paint_run(trained.run, progress) if pictures else {}
    races = _race_selves(trained, pictures, progress)
    return {kind: str(path) for kind, path in painted.items()} | ({} if races is None else {RACES: races})


def _race_selves(trained: Trained, film: bool, tell: Callable[[str], None]) -> dict[str, Any] | None:
    """Race the last self of a car that was trained against others against earlier ones; None of any other car."""
    rivals = trained.run.read_job()["asked"].get("against", [])
    if not rivals:
        return None
    from racecraft.worlds.deepracer.training.opponents import models_among
    from racecraft.worlds.deepracer.training.self_rating import rate_selves

    rated, files = rate_selves(trained.run, models_among(rivals), tell, film)
    return {**rated.as_dictionary(), "files": {kind: str(path) for kind, path in files.items()}}
