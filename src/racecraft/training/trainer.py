"""From a world to a run folder, for every world that needs no files of its racer's. Begin with `train`.

    settings, threads → learner → run folder → judge, collector, keeper → the loop → what came of it

Gymnasium environments, Unity scenes and snakes take this way; a car, with its reward function and AWS's files, has its
own in `racing.py`. What a world brings along is its `Course`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.algorithms.multi_policy import Learner
from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.weights import to_tensors
from racecraft.contract.errors import RacecraftError, RunFolderError
from racecraft.contract.world import World
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import write_whole
from racecraft.rollout.collector import Collector
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import as_dictionary
from racecraft.training.callbacks import Listener
from racecraft.training.deepracer.cloning import split_source
from racecraft.training.deepracer.plan import versions
from racecraft.training.deepracer.trainer import prepare_processor
from racecraft.training.loop import Judge, Outcome, TrainingLoop
from racecraft.training.resume import Say, restore_run, tell_resumed
from racecraft.training.run_writer import RunKeeper
from racecraft.training.stopping import Stop


@dataclass(frozen=True)
class Course:
    """A training made definite: all but its run folder and its learner."""

    kind: str
    """What job.json calls such a run."""
    world: World
    """What is learned in."""
    settings: TrainSettings
    seed: int
    stops: tuple[Stop, ...]
    judge: Callable[[Any, RunFolder], Judge]
    """Makes whoever says how good the learner is, from that learner."""
    asked: Mapping[str, Any]
    """What was asked, for job.json: enough to begin again from it."""
    card: Mapping[str, Any]
    """What a stranger needs beside kind and settings to rebuild the policy."""
    title: str
    """What is trained, for people."""
    folder_name: str
    """Run folders are called runs/<folder_name>-<number>."""
    notes: tuple[str, ...] = ()
    """What is worth saying before the first tick, a clause each."""
    files: Mapping[str, bytes] = field(default_factory=dict)
    """The user's own files, copied into the run folder by these names."""
    learner: Callable[[], Learner] | None = None
    """Makes the learner; None: PPO with these settings."""
    lasting: bool | None = True
    """Whether the world's state can be kept; None: nobody knows before it is tried."""
    after_update: Callable[[Any], None] | None = None
    """Hears of the learner after each of its updates."""


def train(
    course: Course, place: Path | None, listener: Listener, say: Say, source: str | None = None
) -> tuple[RunFolder, Outcome]:
    """Train in a run folder of its own until a stop holds.

    Args:
        course: What is trained.
        place: Where the run folder is made; None: the next number under runs/.
        listener: Watches the training.
        say: Says a line to a person.
        source: RUN, RUN:best, RUN:last or RUN:N, whose weights are begun with; None: fresh ones.

    Raises:
        RunFolderError: The place is taken, or the weights do not fit.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    learner = _learner(course)
    if source is not None:
        begin_with(learner, source, course.kind)
    _say_notes(course, say)
    run = _make_run(course, place)
    with run.lock():
        _, _, loop = _crew(course, run, learner, listener)
        return run, _run(loop, course, run, say)


def resume(course: Course, run: RunFolder, listener: Listener, say: Say) -> Outcome:
    """Go on with a run from its last whole iteration, until a stop holds.

    Raises:
        RunFolderError: The folder is taken by a running training.
    """
    learner = _learner(course)
    _say_notes(course, say)
    with run.lock():
        collector, keeper, loop = _crew(course, run, learner, listener)
        tell_resumed(*restore_run(run, learner, collector, loop, keeper, course.lasting), say)
        return _run(loop, course, run, say)


def begin_with(learner: Learner, source: str, kind: str) -> None:
    """Give a learner the weights of an earlier run; its optimiser starts from zero.

    Raises:
        RunFolderError: No such run, a run of another kind, or a network of another shape.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    path, which = split_source(source)
    run = RunFolder.open(path)
    run.read_job_of(kind)
    weights, _ = Checkpoints(run.checkpoints).load_policy(which)
    mine = learner.state_dict()["network"]
    for name in sorted(set(mine) | set(weights)):
        here = tuple(mine[name].shape) if name in mine else "absent"
        there = weights[name].shape if name in weights else "absent"
        if here != there:
            raise RunFolderError(
                f"{path}: its network is of another shape ({name} is {there} there and {here} here); expected the "
                "same observations, actions and network settings. Give --set network.… as it was, or train afresh."
            )
    learner.load_state_dict({"network": to_tensors(weights)})


def summary_of(outcome: Outcome, run: RunFolder, seed: int) -> dict[str, Any]:
    """Return the figures that `--json` prints of any such training."""
    judged = outcome.last
    return {
        "solved": bool(judged and judged.is_perfect),
        "seconds": round(outcome.seconds, 3),
        "env_steps": outcome.steps,
        "iterations": outcome.iterations,
        "env_steps_per_second": round(outcome.steps / outcome.seconds, 1) if outcome.seconds else None,
        "evaluation": judged.details if judged else None,
        "stopped_by": outcome.reason,
        "run": str(run.path),
        "seed": seed,
        "versions": versions(),
    }


def _learner(course: Course) -> Learner:
    settings = course.settings
    prepare_processor(settings.runtime.threads, settings.runtime.device)
    if course.learner is not None:
        return course.learner()
    return PpoLearner(course.world.spec, settings.network, settings.ppo, course.seed, settings.runtime.device)


def _run(loop: TrainingLoop, course: Course, run: RunFolder, say: Say) -> Outcome:
    """Train; where that fails, say what is left of it."""
    try:
        return loop.run(f"{course.title}, run {run.path}")
    except RacecraftError:
        say(f"what was learned until then stands in {run.path}; --run {run.path} --resume goes on from there")
        raise


def _say_notes(course: Course, say: Say) -> None:
    for note in course.notes:
        say(f"- {note}")


def _crew(
    course: Course, run: RunFolder, learner: Learner, listener: Listener
) -> tuple[Collector, RunKeeper, TrainingLoop]:
    settings = course.settings
    judge = course.judge(learner, run)
    collector = Collector(course.world, learner, settings.rollout.horizon, course.seed)
    card = {"kind": course.kind, **course.card, "settings": as_dictionary(settings)}
    keeper = RunKeeper(run, learner, collector, card)
    told = course.after_update
    hears = None if told is None else lambda _: told(learner)
    loop = TrainingLoop(
        collector, learner, judge, keeper, listener, settings.rollout, settings.evaluation, course.stops, hears
    )
    return collector, keeper, loop


def _make_run(course: Course, place: Path | None) -> RunFolder:
    """Make the run folder and lay copies of the user's files into it."""
    job = {
        "kind": course.kind,
        "title": course.title,
        "asked": {**course.asked, "stops": [str(stop) for stop in course.stops]},
        "settings": as_dictionary(course.settings),
        "notes": list(course.notes),
        "seed": course.seed,
        "versions": versions(),
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }

    def fill(run: RunFolder) -> None:
        for name, data in course.files.items():
            write_whole(run.path / name, data)

    if place is None:
        return RunFolder.create_numbered(Path("runs"), course.folder_name, job, fill)
    return RunFolder.create(place, job, fill)
