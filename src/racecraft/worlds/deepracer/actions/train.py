"""Train a car: its options, the request they make, and what is left in the run folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from racecraft.actions.action import action
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import Planned, TrainedRun, train_run
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option

if TYPE_CHECKING:
    from racecraft.serving.watch_process import WatchProcess
    from racecraft.training.trained import Trained
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

    kind: ClassVar[str] = "deepracer"
    example: ClassVar[str] = "runs/reinvent_base-1"
    free: ClassVar[tuple[str, ...]] = ("trust_reward", "watch")

    folder: Path | None = argument(
        "reward_function.py, hyperparameters.json, model_metadata.json; any may be absent.", None
    )
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
    where: TrackOptions = group(TrackOptions)
    who: CarOptions = group(CarOptions)

    @property
    def model(self) -> str | None:
        """The folder's name."""
        return None if self.folder is None else self.folder.name

    @property
    def installation(self) -> Path | None:
        """The racer's folder."""
        return self.folder

    def kept_as(self) -> Mapping[str, tuple[str, Any]]:
        """Groups are kept whole, wherever they stood."""
        return dict.fromkeys(("group", "groups"), ("groups", list(self.where.shares)))

    def fields_as_given(self) -> Mapping[str, Any]:
        """Whether the reward function is trusted."""
        return {"trust_reward": self.trust_reward}

    def open_page(self, progress: Callable[[str], None]) -> WatchProcess | None:
        """Return the page of `watch`."""
        from racecraft.serving.watch_process import WatchProcess

        return WatchProcess(progress) if self.watch else None

    def request(self, progress: Callable[[str], None]) -> RaceRequest:
        """Return the request of a new run."""
        from racecraft.worlds.deepracer.training.plan import RaceRequest

        one, several = self.where.one_or_several()
        return RaceRequest(
            self.folder,
            one,
            tracks=several,
            groups=self.where.shares,
            hold_out=self.where.hold_out,
            **self.who.values(),
            trust_reward=self.trust_reward,
            **self.for_request(self.source(progress, self.folder)),
        )


@action
def train(request: CarTraining, progress: Progress = quiet) -> TrainedRun | TrainedSeeds | Submitted | Planned:
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
    return train_run(request, progress)


RACES = "races"
"""What a car that races others is told by, beside pictures."""


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
