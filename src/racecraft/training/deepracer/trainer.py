"""Train a car: from a plan to a run folder. Begin with `train_car`.

    run folder → reward function → worlds → learner → the loop → what came of it

`car_plan.py` reads what was asked; `resume_car` goes on with a run that was broken off.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import torch

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.world import Array, allocate
from racecraft.envs.deepracer.world import RaceWorld, mount_for_version
from racecraft.formats.aws.hyperparameters import write_hyperparameters
from racecraft.formats.aws.model_metadata import write_model_metadata
from racecraft.formats.aws.reward_file import RewardFunction, default_reward_source, load_reward_function
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.kernels.compile import is_warm, set_threads
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.training.callbacks import Listener
from racecraft.training.deepracer.aws.files import AwsFiles
from racecraft.training.deepracer.aws.setup import aws_setup
from racecraft.training.deepracer.cloning import weights_of
from racecraft.training.deepracer.evaluator import CarJudge
from racecraft.training.deepracer.plan import (
    CarPlan,
    RaceRequest,
    job_card,
    plan_car,
    plan_resume,
    policy_card,
    versions,
)
from racecraft.training.deepracer.recorder import EpisodeRecorder
from racecraft.training.loop import Outcome, TrainingLoop
from racecraft.training.resume import restore_run
from racecraft.training.run_writer import RunKeeper

__all__ = ["RaceRequest", "TrainedCar", "plan_car", "plan_resume", "resume_car", "train_car"]

Say = Callable[[str], None]


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


def train_car(plan: CarPlan, listener: Listener, say: Say) -> TrainedCar:
    """Train as planned, in a run folder of its own.

    Args:
        plan: From `plan_car`.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: The run folder cannot be made or is taken.
        RewardFileError, RewardError: The reward function cannot be loaded, or failed.
    """
    prepare_processor(plan.settings.runtime.threads, plan.settings.runtime.device)
    reward = load_reward(plan.model.reward_path)
    weights = weights_of(plan) if plan.request.clone_from else None
    run = make_run(plan, reward)
    with run.lock(), open_log(run) as log:
        crew = Crew(plan, run, reward, log, listener, say)
        if weights is not None:
            crew.learner.load_state_dict({"network": weights})
        return crew.train()


def resume_car(plan: CarPlan, listener: Listener, say: Say) -> TrainedCar:
    """Go on with a run from its last whole iteration, as if it had never stopped.

    Args:
        plan: From `plan_resume`.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: The folder is taken by a running training.
        RewardFileError, RewardError: The reward function cannot be loaded, or failed.
    """
    assert plan.request.run is not None
    prepare_processor(plan.settings.runtime.threads, plan.settings.runtime.device)
    run = RunFolder.open(plan.request.run)
    with run.lock(), open_log(run) as log:
        reward = load_reward(run.reward_function)
        crew = Crew(plan, run, reward, log, listener, say)
        iteration = crew.restore()
        say(f"goes on after iteration {iteration}" if iteration else "no whole iteration was saved: starts fresh")
        return crew.train()


class Crew:
    """Everybody a car's training needs, each in their place."""

    def __init__(
        self, plan: CarPlan, run: RunFolder, reward: RewardFunction, log: TextIO, listener: Listener, say: Say
    ) -> None:
        settings = plan.settings
        reward.output = log
        log.writelines(f"{note}\n" for note in plan.notes)
        cars = settings.rollout.num_worlds
        world = race_world(plan, cars, reward.call, (settings.race.start_offset + np.arange(cars) / cars) % 1.0)
        judged = judged_world(plan, reward)
        warm_up(world, judged, say)
        self.plan, self.run = plan, run
        self.learner = PpoLearner(
            world.spec, settings.network, settings.ppo, plan.request.seed, settings.runtime.device
        )
        recorder = EpisodeRecorder()
        self._collector = Collector(
            world, self.learner, settings.rollout.horizon, plan.request.seed, observers=[recorder]
        )
        setup = aws_setup(
            plan.track.name, settings, plan.model.metadata, plan.model.hyperparameters, run.path.name, plan.env
        )
        aws = AwsFiles(run.path, setup)
        self._keeper = RunKeeper(run, self.learner, self._collector, policy_card(plan), recorder, aws)
        self._loop = TrainingLoop(
            self._collector,
            self.learner,
            CarJudge(judged, GreedyPolicy(self.learner), world, settings.evaluation.best_by),
            self._keeper,
            listener,
            settings.rollout,
            settings.evaluation,
            plan.stops,
        )

    def train(self) -> TrainedCar:
        """Train until a stop holds."""
        plan = self.plan
        title = f"{plan.track.title or plan.track.name}, car {plan.settings.race.car}, run {self.run.path}"
        return TrainedCar(plan, self.run, self._loop.run(title))

    def restore(self) -> int:
        """Take up the last whole iteration; return its number, 0 where none was saved."""
        return restore_run(self.run, self.learner, self._collector, self._loop, self._keeper)[0]


def race_world(
    plan: CarPlan,
    num_cars: int,
    reward: Callable[[dict[str, Any]], float] | None = None,
    start_shares: Array | None = None,
) -> RaceWorld:
    """Return cars as planned; their first starts are spread evenly round the track unless given."""
    return RaceWorld(
        plan.track,
        plan.actions,
        reward,
        race_config=plan.settings.race,
        camera_config=plan.settings.camera,
        num_cars=num_cars,
        start_shares=start_shares,
        mount=mount_for_version(plan.model.metadata.version),
    )


def judged_world(plan: CarPlan, reward: RewardFunction) -> RaceWorld:
    """Return the cars that are judged; they are rewarded where that makes a checkpoint the best."""
    evaluation = plan.settings.evaluation
    return race_world(plan, evaluation.episodes, reward.call if evaluation.best_by == "reward" else None)


def load_reward(path: Path | None) -> RewardFunction:
    """Load the racer's reward function, or the default one where there is none."""
    if path is not None:
        return load_reward_function(path)
    with tempfile.TemporaryDirectory() as folder:
        default = Path(folder) / "reward_function.py"
        default.write_text(default_reward_source(), encoding="utf-8")
        return load_reward_function(default)


def make_run(plan: CarPlan, reward: RewardFunction) -> RunFolder:
    """Make the run folder, copies of the racer's files in it."""

    def lay_copies(run: RunFolder) -> None:
        write_whole(run.reward_function, reward.source)
        write_model_metadata(plan.model.metadata, run.model_metadata)
        write_hyperparameters(plan.model.hyperparameters, run.hyperparameters)

    job = job_card(plan, torch.get_num_threads())
    if plan.request.run is None:
        return RunFolder.create_numbered(Path("runs"), plan.track.name, job, lay_copies)
    return RunFolder.create(plan.request.run, job, lay_copies)


def open_log(run: RunFolder) -> TextIO:
    """Open the run's log for more lines; the reward function prints there."""
    try:
        return open(run.log, "a", encoding="utf-8", buffering=1)
    except OSError as error:
        raise RunFolderError(f"{run.log}: cannot be written ({error.strerror}); expected a log file.") from error


def prepare_processor(count: int | None, device: str = "cpu") -> None:
    """Share the cores, worlds and learner taking turns with all of them; take numbers next to nothing for zero.

    The moments that Adam keeps of a weight that learns no more shrink by a tenth a step, and after some 700 steps are
    denormal numbers, which cost the processor a hundred times as much as others: the preset aws, with its many idle
    units, needed 1.7 times as long for a row from there on. Threads that begin later inherit it.

    Raises:
        SettingError: The device asked for is not there.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise SettingError("runtime.device is cuda, but this PyTorch sees no CUDA device; expected cpu here.")
    wanted = count or os.cpu_count() or 1
    set_threads(wanted)
    torch.set_num_threads(wanted)
    torch.set_flush_denormal(True)


def warm_up(world: RaceWorld, judged: RaceWorld, say: Say) -> None:
    """Compile the kernels before the clock starts; on the first run ever that takes a while and is said."""
    if not is_warm():
        say("First run on this machine: compiling the simulator (once, under a minute) …")
    for one in (world, judged):
        reward, one.reward = one.reward, None
        buffers = allocate(one.spec)
        one.reset(buffers, seed=0)
        actions = one.spec.actions
        one.step(np.zeros((*buffers.reward.shape, *actions.shape), actions.dtype), buffers)
        one.reward = reward


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
