"""Where cars of one training drive differently: several tracks, several races, both directions at once.

Begin with `Course`: what was written, in worker-N.env (`requested_courses`) or typed (`groups.py`). `load_courses`
makes it definite: a track and a `RaceConfig` each, over which the cars of a training are shared out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from racecraft.contract.errors import SettingError, TrackError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, with_values
from racecraft.worlds.deepracer.env.settings import (
    TIME_TRIAL,
    with_race_groups,
)
from racecraft.worlds.deepracer.files.run_env import EnvFolder, RunEnv
from racecraft.worlds.deepracer.players.run_courses import LaidCourse, cars_on, of_race
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

MAX_WORKERS = 64
ALTERNATES = "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION"


@dataclass(frozen=True)
class Course:
    """A course as it was asked for; what it does not say is as in the rest of the training."""

    worker: int = 1
    """Number of the worker; 1 is run.env itself."""
    track: str | None = None
    overrides: tuple[str, ...] = ()
    """group.name=value, as after --set; of the race and of what stands or drives in its way."""
    alternates: bool = False
    """Whether each car drives one way in one episode and the other way in the next."""
    env: RunEnv | None = None
    """The file in which it was written, for letters."""
    location: str = ""
    """Where else it was said, for letters."""
    cars: int | None = None
    """How many cars drive there; None: as many as on any other that does not say."""


def requested_courses(
    whole: EnvFolder, track_variable: str, overrides_of: Callable[[RunEnv], tuple[str, ...]]
) -> tuple[Course, ...]:
    """Return the courses that an installation asks for; none where all drive on one, one way.

    Args:
        whole: run.env and the worker files.
        track_variable: The variable that names the track.
        overrides_of: Reads the settings of a worker's race from its file.

    Raises:
        RunEnvError: DR_WORKERS is no number, a worker's file is missing, or a value in one cannot be used.
    """
    courses = [Course(alternates=whole.run.flag(ALTERNATES), env=whole.run)]
    if whole.run.flag("DR_TRAIN_MULTI_CONFIG"):
        for number in range(2, workers_asked(whole.run) + 1):
            if number not in whole.workers:
                raise whole.run.error_at(
                    "DR_TRAIN_MULTI_CONFIG",
                    Message("a file worker-{number}.env beside run.env", number=number),
                    "Write it, lower DR_WORKERS, or set DR_TRAIN_MULTI_CONFIG=False.",
                    found=Message(
                        "DR_WORKERS asks for {workers} courses and there is no worker-{number}.env",
                        workers=workers_asked(whole.run),
                        number=number,
                    ),
                )
            env = whole.workers[number]
            alternates = env.flag(ALTERNATES, courses[0].alternates)
            courses.append(Course(number, env.values.get(track_variable), overrides_of(env), alternates, env))
    return tuple(courses) if len(courses) > 1 or courses[0].alternates else ()


def workers_asked(env: RunEnv) -> int:
    """Return DR_WORKERS, 1 to `MAX_WORKERS`; 1 where it is not said.

    Raises:
        RunEnvError: It is no whole number of that range.
    """
    workers = env.number("DR_WORKERS", 1, 1, MAX_WORKERS)
    if workers != int(workers):
        raise env.error_at("DR_WORKERS", Message("a whole number from 1 to {max_workers}", max_workers=MAX_WORKERS))
    return int(workers)


def load_courses(
    courses: tuple[Course, ...], track: Track, settings: Settings, track_variable: str
) -> tuple[LaidCourse, ...]:
    """Return the courses with their tracks loaded, the training's own first.

    Args:
        courses: As `requested_courses` gives them.
        track: The training's own.
        settings: Likewise.
        track_variable: Names the track in a worker's file.

    Raises:
        RunEnvError: A worker's track cannot be used.
    """
    return tuple(_prepared(course, track, of_race(settings), track_variable) for course in courses)


def notes_on_courses(courses: tuple[LaidCourse, ...], settings: Settings) -> tuple[str, ...]:
    """Say how many cars drive on which course; nothing where all is one."""
    if not courses:
        return ()
    counts = cars_on(courses, settings.rollout.num_worlds)
    text = ", ".join(
        f"{count} on {course.track.name}{_way(course)}"
        + ("" if course.race.type == TIME_TRIAL else f" ({course.race.type})")
        for count, course in zip(counts, courses, strict=True)
    )
    return (f"cars side by side: {text}; each course is judged from {settings.evaluation.episodes} starts",)


def both_ways(courses: tuple[LaidCourse, ...]) -> bool:
    """Tell whether one track is driven in both directions."""
    ways = {(course.track.name, course.race.reverse) for one in courses for course in one.ways}
    return any((name, not reverse) in ways for name, reverse in ways)


def starts(course: LaidCourse, cars: int) -> Array:
    """Return where the cars of a course first start, shares of the lap (N,), spread evenly from its first start."""
    return (course.race.start_offset + np.arange(cars) / cars) % 1.0


def _prepared(course: Course, track: Track, settings: Settings, track_variable: str) -> LaidCourse:
    settings = _with_overrides(settings, course)
    if course.track is None:
        return LaidCourse(track, settings, course.cars, course.alternates)
    try:
        return LaidCourse(load_track(course.track), settings, course.cars, course.alternates)
    except TrackError as error:
        if course.env is None:
            raise
        found = Message("'{track}': {found}", track=course.track, found=error.found)
        raise course.env.error_at(track_variable, error.expected, error.hint, found) from error


def _with_overrides(settings: Settings, course: Course) -> Settings:
    """Return the settings of a course's race: the training's own, or where its type differs, that type's own."""
    overrides = course.overrides
    types = [one.partition("=")[2] for one in overrides if one.startswith("race.type=")]
    if types and types[-1] != settings.race.type:
        bare = Settings(race=settings.race, variation=settings.variation)
        settings = with_race_groups(with_values(bare, "race", {"type": types[-1]}))
    try:
        return apply_overrides(settings, overrides)
    except SettingError as error:
        if not course.location:
            raise
        raise SettingError("{place}: {error}", place=course.location, error=error) from error


def _way(course: LaidCourse) -> str:
    other = " the other way" if course.race.reverse else ""
    return " in turn each way, episode by episode" if course.alternates else other
