"""The courses of a run: on which tracks its cars drove, in which races, how many on each. Begin with `courses_of_run`.

A run of one course has that of its own track and settings; one that says `courses` in job.json has those.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError, SettingError, TrackError
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import as_dictionary, from_dictionary, with_values
from racecraft.worlds.deepracer.env.settings import (
    HEAD_TO_BOT,
    OBJECT_AVOIDANCE,
    TIME_TRIAL,
    RaceConfig,
    race_groups,
    with_race_groups,
)
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.players.run_track import KIND, track_of_run
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import import_track
from racecraft.worlds.deepracer.tracks.track import Track

IN_SHORT = {TIME_TRIAL: "", OBJECT_AVOIDANCE: " boxes", HEAD_TO_BOT: " bots"}
"""What a label says of a type of race."""


@dataclass(frozen=True)
class LaidCourse:
    """A course made definite."""

    track: Track
    settings: Settings
    """Its race, what differs from episode to episode, and what stands or drives in the way: the groups `race` and
    `variation`, and the one that the race's type brings along."""
    cars: int | None = None
    """As `Course.cars`."""
    alternates: bool = False
    """As `Course.alternates`."""

    @property
    def label(self) -> str:
        """What people call it: the track, what is not the usual way round, what is no time trial."""
        way = " both ways" if self.alternates else " reversed" if self.race.reverse else ""
        return f"{self.track.name}{way}{IN_SHORT.get(self.race.type, f' {self.race.type}')}"

    @property
    def race(self) -> RaceConfig:
        """How episodes start and end."""
        race: RaceConfig = self.settings.race
        return race

    @property
    def judged(self) -> LaidCourse:
        """The course as evaluations of a training drive it."""
        if self.settings.variation.in_evaluations:
            return self
        return replace(self, settings=self.settings.with_group("variation", VariationConfig()))

    @property
    def ways(self) -> tuple[LaidCourse, ...]:
        """Itself; where directions alternate, the course in each."""
        if not self.alternates:
            return (self,)
        turned = with_values(self.settings, "race", {"reverse": not self.race.reverse})
        return (replace(self, alternates=False), replace(self, settings=turned, alternates=False))

    def as_dictionary(self) -> dict[str, Any]:
        """Return what job.json says of it."""
        document = {"track": self.track.name, "hash": self.track.hash(), "settings": as_dictionary(self.settings)}
        cars = {} if self.cars is None else {"cars": self.cars}
        return document | cars | ({"alternates": True} if self.alternates else {})


def courses_of_run(run: RunFolder) -> tuple[LaidCourse, ...]:
    """Return the courses that a run's cars are trained on, in the order of its worlds; of one alone that one.

    Raises:
        RunFolderError: No run of a car, or a track is gone or has changed.
        TrackError: The run's own track is gone.
    """
    job, track = run.read_job_of(KIND), track_of_run(run)
    race = job["settings"]["race"]
    own = with_race_groups(of_race(Settings(race=RaceConfig(type=race.get("type", TIME_TRIAL)))))
    settings = from_dictionary(own, job["settings"])
    courses = job.get("courses", [])
    return courses_of_job(courses, settings, track, run.tracks) if courses else (LaidCourse(track, settings),)


def held_out_of_run(run: RunFolder) -> tuple[Track, ...]:
    """Return the tracks that a run is judged on and never trained on.

    Raises:
        RunFolderError: A track is gone or has changed.
    """
    return held_out_of_job(run.read_job_of(KIND).get("held_out", []), run.tracks)


def of_race(settings: Settings) -> Settings:
    """Return the groups of a training's settings that say what its race is."""
    groups = ("race", "variation", *race_groups(settings.race.type))
    own = {name: getattr(settings, name) for name in groups if name in settings}
    return Settings(**{"variation": VariationConfig()} | own)


def courses_of_job(
    courses: list[dict[str, Any]], settings: Settings, track: Track, folder: Path
) -> tuple[LaidCourse, ...]:
    """Return the courses that a run was begun on.

    Args:
        courses: "courses" of job.json.
        settings: The training's own.
        track: Likewise.
        folder: Where the run keeps its own copies of tracks.

    Raises:
        RunFolderError: A track is gone or has changed.
    """
    laid = []
    for one in courses:
        is_user_file = one["track"] == track.name and one["hash"] == track.hash()
        there = track if is_user_file else load_again(one["track"], one["hash"], folder)
        kind = with_values(of_race(settings), "race", {"type": one["settings"]["race"]["type"]})
        raced = from_dictionary(with_race_groups(kind), one["settings"])
        laid.append(LaidCourse(there, raced, one.get("cars"), bool(one.get("alternates"))))
    return tuple(laid)


def held_out_of_job(courses: list[dict[str, Any]], folder: Path) -> tuple[Track, ...]:
    """Return the tracks that a run judges on.

    Args:
        courses: "held_out" of job.json.
        folder: Where the run keeps its own copies of tracks.

    Raises:
        RunFolderError: A track is gone or has changed.
    """
    return tuple(load_again(one["track"], one["hash"], folder) for one in courses)


def load_again(name: str, was: str, folder: Path) -> Track:
    """Return a track that a run was begun on: its own copy, or the catalogue's.

    Raises:
        RunFolderError: It is gone, or no longer what it was (`was` is its hash).
    """
    copy = folder / f"{name}.npy"
    try:
        track = import_track(copy, name) if copy.is_file() else load_track(name)
    except TrackError as error:
        raise RunFolderError(
            "its course on {name!r} cannot be driven any more: {error} Restore the track, or begin a new run with "
            "--from.",
            name=name,
            error=error,
        ) from error
    if track.hash() != was:
        raise RunFolderError(
            "its course on {name!r} has changed since the run began; expected the same waypoints. Restore the track, "
            "or begin a new run with --from.",
            name=name,
        )
    return track


def shares(num_cars: int, courses: int) -> list[int]:
    """Return how many cars drive on each course: as evenly as may be, the first ones one more.

    Raises:
        SettingError: There are fewer cars than courses.

    >>> shares(32, 3)
    [11, 11, 10]
    """
    if num_cars < courses:
        raise SettingError(
            "rollout.num_worlds is {num_cars}, and {courses} courses are to be driven; expected at least one car for "
            "each. Raise rollout.num_worlds, or let there be fewer courses.",
            num_cars=num_cars,
            courses=courses,
        )
    return [num_cars // courses + (place < num_cars % courses) for place in range(courses)]


def cars_on(courses: tuple[LaidCourse, ...], num_cars: int) -> list[int]:
    """Return how many cars drive on each course: as many as it says, the others share what is left evenly.

    Raises:
        SettingError: Too few cars are left for the others, or some for nobody.
    """
    total, silent = sum(course.cars or 0 for course in courses), sum(course.cars is None for course in courses)
    left = num_cars - total
    if left < silent or (left and not silent):
        others = f" and {silent} more are to be driven on" if silent else ""
        raise SettingError(
            "rollout.num_worlds is {num_cars}, the groups ask for {said} cars{others}; expected "
            "{note}{said_2}. Leave rollout.num_worlds out, or change the groups' cars.",
            num_cars=num_cars,
            said=total,
            others=others,
            note="at least " if silent else "",
            said_2=total + silent,
        )
    rest = iter(shares(left, silent) if silent else [])
    return [next(rest) if course.cars is None else course.cars for course in courses]
