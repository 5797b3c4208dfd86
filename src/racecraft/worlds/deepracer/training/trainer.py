"""Train a car: what its world brings along to the common steps. Begin with `build_experiment`.

plan (`plan.py`) → reward function → worlds that are driven and judged in → `Experiment` → `training/trainer.py`
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from racecraft.algorithms.learner import Learner
from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import Array, allocate
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import RunFolder
from racecraft.kernels.compile import is_warm
from racecraft.players.trained import GreedyPolicy
from racecraft.training.loop import Outcome
from racecraft.training.opponent_pool import OpponentPool
from racecraft.training.partition import Block
from racecraft.training.resume import MessageCallback
from racecraft.training.stopping import GAP, LAP
from racecraft.training.trainer import Experiment, RunObservers
from racecraft.training.versions import versions
from racecraft.worlds.deepracer.driving.lines import classical_line
from racecraft.worlds.deepracer.env.alternating import AlternatingWorld
from racecraft.worlds.deepracer.env.camera import mount_for_version
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.reward_caller import CarRewards
from racecraft.worlds.deepracer.env.reward_process import CALL_SECONDS, RewardProcess, open_reward
from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL, TIME_TRIAL, objects_of
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.by_track import JudgedCourse, judged_course
from racecraft.worlds.deepracer.evaluation.compiled_drive import compiled_drive
from racecraft.worlds.deepracer.files.generalisation import HELD_OUT, TRAINED
from racecraft.worlds.deepracer.files.hyperparameters import write_hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict, write_model_metadata
from racecraft.worlds.deepracer.files.reward_examples import default_reward_source, racing_reward_source
from racecraft.worlds.deepracer.files.reward_source import RewardSource, read_reward_source, write_reward
from racecraft.worlds.deepracer.players.run_courses import LaidCourse, of_race
from racecraft.worlds.deepracer.tracks.importer import route_file, travels
from racecraft.worlds.deepracer.training.aws.files import AwsFiles
from racecraft.worlds.deepracer.training.aws.setup import aws_setup
from racecraft.worlds.deepracer.training.courses import both_ways, starts
from racecraft.worlds.deepracer.training.evaluator import (
    FLYING_LAPS,
    CarEvaluator,
    LatestReports,
    begins_where_training_does,
)
from racecraft.worlds.deepracer.training.expectations import require_expectations
from racecraft.worlds.deepracer.training.live import LivePublisher
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld
from racecraft.worlds.deepracer.training.opponents import against_world, require_racing
from racecraft.worlds.deepracer.training.plan import (
    KIND,
    CarPlan,
    RaceRequest,
    job_of,
    known_lap_of,
    plan_car,
    plan_resume,
    request_values,
)
from racecraft.worlds.deepracer.training.presets import default_settings
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder
from racecraft.worlds.deepracer.training.remote_live import RemoteLiveTicks
from racecraft.worlds.deepracer.training.weight_transfer import fit_critic, require_same_shape

KERNEL = "race.tick"
"""What a car's world compiles last and longest."""

__all__ = [
    "KIND",
    "RaceRequest",
    "Request",
    "default_settings",
    "build_experiment",
    "plan",
    "plan_car",
    "plan_resume",
    "summary",
]

Request = RaceRequest
plan = plan_car

TRAINING_LAPS = 1.2
"""A car in training drives for so many laps at its fastest command, where no time is set: over the finish, and then it
learns another standing start, which is where cars fail. Where that is longer, for one lap at the speeds that the car
can hold along the centre line: else no drive on a slow track is a full lap, which rewards and telemetry look at."""

AWS_STAYS = (
    "with fidelity aws every evaluation begins where training's next episode would, and cars in several processes have "
    "no such one place; --fidelity sane has none of it."
)


@contextlib.contextmanager
def build_experiment(planned: CarPlan, on_message: MessageCallback) -> Iterator[Experiment]:
    """Line up the cars that are driven and those that are judged.

    Raises:
        RewardFileError: The reward function cannot be loaded.
        RewardError: A case of the racer's does not hold.
    """
    settings = planned.settings
    is_trusted = planned.request.trust_reward
    with contextlib.closing(
        load_reward(
            planned.model.reward,
            settings.race.reward_seconds,
            settings.race.type,
            is_trusted,
            is_racing=planned.request.preset == "race",
        )
    ) as reward:
        require_expectations(reward)
        yield _experiment(planned, reward)


def _experiment(planned: CarPlan, reward: RewardProcess) -> Experiment:
    settings, seed = planned.settings, planned.seed
    is_racing = planned.request.preset == "race"
    world, pool = learned_world(planned, reward)
    judged = judged_world(planned, reward)
    latest = LatestReports(settings.evaluation.best_by)
    flying = [race_world(planned, 1, None, np.zeros(1), FLYING_LAPS, course) for course in planned.judged_courses]
    drives_on = any(drive_seconds(planned, way) is not None for course in planned.all_courses for way in course.ways)

    def evaluator(learner: Learner, run: RunFolder) -> CarEvaluator:
        by_track = judged_courses(planned)
        policy = GreedyPolicy(learner)
        for course in _courses_of((judged, *flying)):
            if (drive := compiled_drive(policy, course)) is not None:
                drive.compile()
        times_flying = is_racing or any(stop.kind in (LAP, GAP) for stop in planned.stops)
        return CarEvaluator(
            judged,
            policy,
            world,
            settings.evaluation.best_by,
            flying,
            by_track,
            times_flying,
            known_lap_of(planned),
            latest,
            drives_on,
        )

    return Experiment(
        kind=KIND,
        world=world,
        algorithm=planned.algorithm,
        settings=settings,
        seed=seed,
        stops=planned.stops,
        evaluator=evaluator,
        request=request_values(planned),
        metadata={"model_metadata": as_aws_dict(planned.model.metadata), "track": planned.track.name},
        title=f"{_where(planned)}, car {settings.race.car}",
        folder_name=planned.track.name if len(_names(planned)) == 1 else f"{len(_names(planned))}-tracks",
        job=job_of(planned),
        notes=(*planned.notes, restrictions_of(reward)),
        after_update=lambda learner: None if pool is None else pool.learned(learner),
        parts={"evaluations": latest} | ({} if pool is None else {"opponents": pool}),
        copy_user_files=lambda run: copy_user_files(planned, reward, run),
        warm_up=lambda tell: warm_up((world, judged, *flying), tell),
        open_observers=lambda run, notes: car_observers(planned, reward, run, notes),
        same_shape=lambda path, metadata: require_same_shape(planned, path, metadata),
        fitted=fit_critic,
        recorder=EpisodeRecorder,
        stays=AWS_STAYS if begins_where_training_does(judged) else "",
    )


def summary(planned: CarPlan, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
    """Return the figures of `racecraft train --json`."""
    judged, best = outcome.last, outcome.best
    return {
        "seconds_to_first_full_lap": _rounded(outcome.seconds_to_first_goal),
        "seconds_to_stable_laps": _rounded(outcome.seconds_to_stable),
        "seconds": _rounded(outcome.seconds),
        "env_steps": outcome.steps,
        "iterations": outcome.iterations,
        "env_steps_per_second": _rounded(outcome.steps / outcome.seconds) if outcome.seconds else None,
        "best_lap_seconds": _rounded(best.figures.get("best_lap_seconds")) if best else None,
        "evaluation": judged.details if judged else None,
        "stopped_by": outcome.reason,
        "run": str(run.path),
        "track": planned.track.name,
        "seed": planned.seed,
        "versions": versions(),
    }


@contextlib.contextmanager
def car_observers(
    planned: CarPlan, reward: RewardProcess, run: RunFolder, notes: Sequence[str]
) -> Iterator[RunObservers]:
    """Open the run's log, where the reward function prints, and whoever keeps ticks for us and for AWS's tools."""
    metadata, hyperparameters = planned.model.metadata, planned.model.hyperparameters
    with open_log(run) as log:
        reward.output = log
        log.writelines(f"{note}\n" for note in notes)
        recorder = EpisodeRecorder()
        setup = aws_setup(
            planned.track.name,
            planned.settings,
            metadata,
            hyperparameters,
            run.path.name,
            planned.env,
            both_ways(planned.courses),
        )
        yield RunObservers(recorder, AwsFiles(run.path, setup), [recorder, LivePublisher(run)], RemoteLiveTicks(run))


def copy_user_files(planned: CarPlan, reward: RewardProcess, run: RunFolder) -> None:
    """Lay copies of the racer's files into a new run folder."""
    write_reward(reward.source, run.path)
    write_model_metadata(planned.model.metadata, run.model_metadata)
    write_hyperparameters(planned.model.hyperparameters, run.hyperparameters)
    if travels(planned.track):
        write_atomic(run.track, route_file(planned.track))
    others = {track.name: track for track in (*(one.track for one in planned.courses), *planned.held_out)}
    for name, track in others.items():
        if travels(track):
            run.tracks.mkdir(exist_ok=True)
            write_atomic(run.tracks / f"{name}.npy", route_file(track))


def learned_world(
    planned: CarPlan, reward: RewardProcess
) -> tuple[RaceWorld | MultiCourseWorld | OpponentWorld, OpponentPool | None]:
    """Return what is learned in, and the pool of past selves where they are met there.

    Raises:
        UserInputError: Whoever is to be raced against cannot be.
    """
    if not planned.against:
        return driven_world(planned, reward), None
    require_racing(planned)
    return against_world(planned, reward.copies)


def driven_world(planned: CarPlan, reward: RewardProcess) -> RaceWorld | MultiCourseWorld:
    """Return the cars that are trained, shared out among the courses where there are several."""
    courses = planned.all_courses
    blocks = planned.blocks or tuple(Block(0, cars, cars) for cars in planned.parts)

    def driven(course: LaidCourse, block: Block) -> RaceWorld | AlternatingWorld:
        paid = reward.copies(block.count)
        first = starts(course, block.of)[block.first : block.first + block.count]
        ways = [
            race_world(planned, block.count, paid, first, course=way, drive_seconds=drive_seconds(planned, way))
            for way in course.ways
        ]
        return AlternatingWorld(ways[0], ways[1], block.first) if course.alternates else ways[0]

    worlds = [driven(course, block) for course, block in zip(courses, blocks, strict=True) if block.count]
    if not planned.courses and isinstance(worlds[0], RaceWorld):
        return worlds[0]
    return MultiCourseWorld(worlds, any(objects_of(course.settings) is not None for course in courses))


def race_world(
    planned: CarPlan,
    num_cars: int,
    reward: CarRewards | None = None,
    start_shares: Array | None = None,
    laps: int = 1,
    course: LaidCourse | None = None,
    drive_seconds: float | None = None,
) -> RaceWorld:
    """Return cars as planned, on a course of their own where one is given.

    Their first starts are spread evenly round the track unless given; with `drive_seconds` they drive on over the
    finish.
    """
    course = course or LaidCourse(planned.track, of_race(planned.settings))
    return RaceWorld(
        course.track,
        planned.actions,
        reward,
        race_config=course.race,
        camera_config=planned.settings.camera,
        num_cars=num_cars,
        start_shares=start_shares,
        laps=laps,
        mount=mount_for_version(planned.model.metadata.version),
        sensors=planned.sensors,
        objects=objects_of(course.settings),
        variation=course.settings.variation,
        drive_seconds=drive_seconds,
    )


def drive_seconds(planned: CarPlan, course: LaidCourse) -> float | None:
    """Return how long a car in training drives on over the finish, s; None where a lap ends its episode."""
    if habits(course.race.fidelity).lap_is_an_end or not course.track.closed:
        return None
    if course.race.max_training_seconds is not None:
        return course.race.max_training_seconds
    fastest = planned.actions.fastest
    along_centre = classical_line(course.track, PROFILES[course.race.car], fastest, "centre")
    return max(TRAINING_LAPS * course.track.length / fastest, along_centre.lap_seconds)


def judged_world(planned: CarPlan, reward: RewardProcess) -> RaceWorld | MultiCourseWorld:
    """Return the cars that are judged, so many on each course; they are rewarded where that makes a checkpoint best.

    Courses that are only judged on come last.
    """
    evaluation = planned.settings.evaluation

    def judged(course: LaidCourse) -> RaceWorld:
        paid = reward.copies(evaluation.episodes) if evaluation.best_by == "reward" else None
        return race_world(planned, evaluation.episodes, paid, course=course)

    courses = [judged(course) for course in (*planned.judged_courses, *planned.held_out_courses)]
    return MultiCourseWorld(courses) if len(courses) > 1 else courses[0]


def judged_courses(planned: CarPlan) -> list[JudgedCourse]:
    """Return what is judged, in the order of `judged_world`; none where it is one course and nothing is held out."""
    courses = [(one, TRAINED) for one in planned.judged_courses]
    courses += [(one, HELD_OUT) for one in planned.held_out_courses]
    if len(courses) == 1:
        return []
    starts = planned.settings.evaluation.episodes
    return [judged_course(course, role, starts) for course, role in courses]


def load_reward(
    source: RewardSource | None,
    seconds: float = CALL_SECONDS,
    race_type: str = TIME_TRIAL,
    is_trusted: bool = False,
    is_racing: bool = False,
) -> RewardProcess:
    """Load the racer's reward function, or the default one of the race where there is none.

    With `is_racing` a time trial pays for metres gained instead of for the centre line.
    """
    if source is not None:
        return open_reward(source, seconds=seconds, is_trusted=is_trusted)
    with tempfile.TemporaryDirectory() as folder:
        default = Path(folder) / "reward_function.py"
        others = default_reward_source(race_type != TIME_TRIAL, race_type == HEAD_TO_MODEL)
        own = racing_reward_source() if is_racing and race_type == TIME_TRIAL else others
        default.write_text(own, encoding="utf-8")
        return open_reward(read_reward_source(default), seconds=seconds, is_trusted=is_trusted)


def restrictions_of(reward: RewardProcess) -> str:
    """Return what restricts the reward function, as a note."""
    if reward.layers:
        layers = ", ".join(reward.layers)
        return f"the reward function can compute, print and read files beside it, nothing else ({layers})"
    why = "" if reward.is_trusted else ": racecraft cannot restrict it on this system"
    return f"the reward function has all your rights{why}"


def open_log(run: RunFolder) -> TextIO:
    """Open the run's log for more lines; the reward function prints there."""
    try:
        return open(run.log, "a", encoding="utf-8", buffering=1)
    except OSError as error:
        raise RunFolderError(
            "{log}: cannot be written ({strerror}); expected a log file.", log=run.log, strerror=error.strerror
        ) from error


def warm_up(worlds: Sequence[RaceWorld | MultiCourseWorld | OpponentWorld], on_message: MessageCallback) -> None:
    """Compile the kernels before the clock starts; on the first run ever that takes a while and is said."""
    if not is_warm(KERNEL):
        on_message("First run on this machine: compiling the simulator (once, about half a minute) …")
    for one in _courses_of(worlds):
        reward, one.reward = one.reward, None
        buffers = allocate(one.spec)
        one.reset(buffers, seed=0)
        actions = one.spec.actions
        one.step(np.zeros((*buffers.reward.shape, *actions.shape), actions.dtype), buffers)
        one.reward = reward


def _names(planned: CarPlan) -> list[str]:
    """Return the names of the tracks that are trained on, each once."""
    return list(dict.fromkeys(course.track.name for course in planned.all_courses))


def _where(planned: CarPlan) -> str:
    names = _names(planned)
    return f"{len(names)} tracks" if len(names) > 1 else planned.track.title or planned.track.name


def _courses_of(worlds: Sequence[RaceWorld | MultiCourseWorld | OpponentWorld]) -> list[RaceWorld]:
    courses = [course for one in worlds for course in ((one,) if isinstance(one, RaceWorld) else one.courses)]
    return [way for course in courses for way in (course.ways if isinstance(course, AlternatingWorld) else (course,))]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
