"""Train a car: from what was asked to a run folder. Begin with `train_car`.

read the racer's folder → settings → track → run folder → worlds, learner → the loop → the summary
"""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch

from racecraft import __version__
from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.world import EpisodeRecord, allocate
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.actions import ActionTable
from racecraft.envs.deepracer.world import RaceWorld, mount_for_version
from racecraft.evaluation.laps import judge_starts
from racecraft.formats.hyperparameters import write_hyperparameters
from racecraft.formats.model_metadata import ModelMetadata, as_aws_dict, write_model_metadata
from racecraft.formats.reward_file import RewardFunction, default_reward_source, load_reward_function
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.kernels.compile import is_warm, set_threads
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import as_dictionary, with_values
from racecraft.tracks.catalogue import load_track
from racecraft.tracks.track import Track
from racecraft.training.events import Listener, Verdict
from racecraft.training.keeping import RunKeeper
from racecraft.training.loop import Outcome, TrainingLoop
from racecraft.training.model_folder import ModelFolder, read_model_folder
from racecraft.training.presets import settings_for
from racecraft.training.recorder import EpisodeRecorder
from racecraft.training.stopping import Stop, parse_stops

DEFAULT_TRACK = "reinvent_base"
DEFAULT_STOPS = ("laps", "minutes=30")
NETWORK_NOTE = "preset fast: its own small network is trained; neural_network of model_metadata.json is not used"


@dataclass(frozen=True)
class RaceRequest:
    """What was asked: everything a training begins from."""

    folder: Path | None = None
    """Folder with reward_function.py, hyperparameters.json, model_metadata.json; None: defaults."""
    track: str = DEFAULT_TRACK
    """A name of the catalogue, or a waypoint file."""
    car: str | None = None
    """Vehicle profile; None: by the version in the metadata."""
    preset: str = "fast"
    stops: tuple[str, ...] = ()
    """As typed; none: DEFAULT_STOPS."""
    run: Path | None = None
    """Run folder to make; None: runs/<track>-<number>."""
    seed: int = 1
    overrides: tuple[str, ...] = ()
    """group.name=value, as typed."""


@dataclass(frozen=True)
class CarPlan:
    """A request made definite: every file read, every setting settled, nothing started."""

    request: RaceRequest
    model: ModelFolder
    settings: TrainSettings
    track: Track
    stops: tuple[Stop, ...]
    notes: tuple[str, ...] = field(default=())
    """What is worth saying before the first tick, a clause each."""

    @property
    def actions(self) -> ActionTable:
        """The car's action table."""
        return action_table(self.model.metadata)


@dataclass(frozen=True)
class TrainedCar:
    """A training that ended, and where it lies."""

    plan: CarPlan
    run: RunFolder
    outcome: Outcome

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft train --json`."""
        outcome, judged = self.outcome, self.outcome.last
        return {
            "seconds_to_first_full_lap": _rounded(outcome.seconds_to_first_full_lap),
            "seconds_to_stable_laps": _rounded(outcome.seconds_to_stable_laps),
            "seconds": _rounded(outcome.seconds),
            "env_steps": outcome.steps,
            "iterations": outcome.iterations,
            "env_steps_per_second": _rounded(outcome.steps / outcome.seconds) if outcome.seconds else None,
            "best_lap_seconds": _rounded(outcome.best_lap_seconds),
            "evaluation": judged.details if judged else None,
            "stopped_by": outcome.reason,
            "run": str(self.run.path),
            "track": self.plan.track.name,
            "seed": self.plan.request.seed,
            "versions": versions(),
        }


def plan_car(request: RaceRequest) -> CarPlan:
    """Read and check everything a request names; nothing is written.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
    """
    stops = parse_stops(request.stops or DEFAULT_STOPS)
    model = read_model_folder(request.folder)
    settings, notes = settings_for(request.preset, model.hyperparameters, request.overrides)
    if not any(override.startswith("race.car=") for override in request.overrides):
        settings = with_values(settings, "race", {"car": request.car or model.metadata.car})
    track = load_track(request.track)
    return CarPlan(request, model, settings, track, stops, (*model.notes, *notes, NETWORK_NOTE))


def train_car(plan: CarPlan, listener: Listener, say: Callable[[str], None]) -> TrainedCar:
    """Train as planned, in a run folder of its own.

    Args:
        plan: From `plan_car`.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: The run folder cannot be made or is taken.
        RewardFileError, RewardError: The reward function cannot be loaded, or failed.
    """
    use_threads(plan.settings.runtime.threads)
    reward = load_reward(plan.model.reward_path)
    run = make_run(plan, reward)
    with run.lock(), open(run.log, "a", encoding="utf-8", buffering=1) as log_file:
        reward.output = log_file
        for note in plan.notes:
            log_file.write(f"{note}\n")
        world = training_world(plan, reward.call)
        judge = CarJudge(plan)
        warm_up(world, judge.world, say)
        learner = PpoLearner(
            world.spec, plan.settings.network, plan.settings.ppo, plan.request.seed, plan.settings.runtime.device
        )
        judge.policy = GreedyPolicy(learner)
        recorder = EpisodeRecorder()
        collector = Collector(world, learner, plan.settings.rollout.horizon, plan.request.seed, observers=[recorder])
        keeper = RunKeeper(run, learner, collector, policy_card(plan), recorder)
        loop = TrainingLoop(
            collector, learner, judge, keeper, listener, plan.settings.rollout, plan.settings.evaluation, plan.stops
        )
        outcome = loop.run(f"{plan.track.title or plan.track.name}, car {plan.settings.race.car}, run {run.path}")
    return TrainedCar(plan, run, outcome)


class CarJudge:
    """Judges the greedy policy: one episode from each of several starts round the track, side by side."""

    score_name = "progress %"

    def __init__(self, plan: CarPlan) -> None:
        settings = plan.settings
        self.world = RaceWorld(
            plan.track,
            plan.actions,
            race_config=settings.race,
            camera_config=settings.camera,
            num_cars=settings.evaluation.episodes,
            mount=mount_for_version(plan.model.metadata.version),
        )
        self.policy: GreedyPolicy | None = None

    def score(self, episode: EpisodeRecord) -> float:
        """Return the progress of an episode, per cent."""
        return episode.facts["progress_percent"]

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode was a full lap."""
        return episode.status == race.STATUSES[race.LAP_COMPLETE]

    def judge(self) -> Verdict:
        """Drive from every start."""
        assert self.policy is not None
        report = judge_starts(self.policy, self.world)
        return Verdict(report.mean_progress_percent, report.all_full, report.best_lap_seconds, report.as_dictionary())


def training_world(plan: CarPlan, reward: Callable[[dict[str, Any]], float] | None) -> RaceWorld:
    """Return the cars that learn, their first starts spread evenly round the track."""
    settings = plan.settings
    return RaceWorld(
        plan.track,
        plan.actions,
        reward,
        race_config=settings.race,
        camera_config=settings.camera,
        num_cars=settings.rollout.num_worlds,
        mount=mount_for_version(plan.model.metadata.version),
    )


def action_table(metadata: ModelMetadata) -> ActionTable:
    """Return the action table of a car with discrete actions."""
    return ActionTable.of([(action.steering_rad, action.speed_mps) for action in metadata.actions])


def load_reward(path: Path | None) -> RewardFunction:
    """Load the racer's reward function, or the default one where there is none."""
    if path is not None:
        return load_reward_function(path)
    with tempfile.TemporaryDirectory() as folder:
        default = Path(folder) / "reward_function.py"
        default.write_text(default_reward_source(), encoding="utf-8")
        return load_reward_function(default)


def make_run(plan: CarPlan, reward: RewardFunction) -> RunFolder:
    """Make the run folder and lay copies of the racer's files into it."""
    job = job_card(plan)
    if plan.request.run is None:
        run = RunFolder.create_numbered(Path("runs"), plan.track.name, job)
    else:
        run = RunFolder.create(plan.request.run, job)
    write_whole(run.reward_function, reward.source)
    write_model_metadata(plan.model.metadata, run.model_metadata)
    write_hyperparameters(plan.model.hyperparameters, run.hyperparameters)
    return run


def job_card(plan: CarPlan) -> dict[str, Any]:
    """Return what job.json holds: what was asked, with settings, seed, versions and the track's hash."""
    request = plan.request
    return {
        "kind": "deepracer",
        "asked": {
            "folder": None if request.folder is None else str(request.folder),
            "track": request.track,
            "preset": request.preset,
            "stops": [str(stop) for stop in plan.stops],
            "set": list(request.overrides),
        },
        "track": {"name": plan.track.name, "hash": plan.track.hash(), "length_m": plan.track.length},
        "settings": as_dictionary(plan.settings),
        "model_metadata": as_aws_dict(plan.model.metadata),
        "seed": request.seed,
        "versions": versions(),
        "threads": torch.get_num_threads(),
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }


def policy_card(plan: CarPlan) -> dict[str, Any]:
    """Return what a stranger needs to rebuild the policy."""
    return {
        "kind": "deepracer",
        "settings": as_dictionary(plan.settings),
        "model_metadata": as_aws_dict(plan.model.metadata),
        "track": plan.track.name,
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    names = ("torch", "numba", "numpy")
    return {"racecraft": __version__, "python": platform.python_version(), **{name: version(name) for name in names}}


def use_threads(count: int | None) -> None:
    """Share the cores: worlds and learner take turns, so both may use all of them."""
    wanted = count or os.cpu_count() or 1
    set_threads(wanted)
    torch.set_num_threads(wanted)


def warm_up(world: RaceWorld, judged: RaceWorld, say: Callable[[str], None]) -> None:
    """Compile the kernels before the clock starts; on the first run ever that takes a while and is said."""
    if not is_warm():
        say("First run on this machine: compiling the simulator (once, under a minute) …")
    for one in (world, judged):
        reward, one.reward = one.reward, None
        buffers = allocate(one.spec)
        one.reset(buffers, seed=0)
        one.step(np.zeros((one.spec.num_worlds, 1), np.int64), buffers)
        one.reward = reward


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
