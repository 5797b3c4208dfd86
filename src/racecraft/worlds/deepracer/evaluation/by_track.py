"""Several tracks judged at once, and what was driven where. Begin with `judge_tracks` or `results_by_track`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.settings.composition import Settings
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.evaluation.laps import LapReport, judge_starts
from racecraft.worlds.deepracer.files.generalisation import HELD_OUT, OTHER, TRAINED, TrackResult
from racecraft.worlds.deepracer.players.run_courses import LaidCourse, courses_of_run, held_out_of_run, of_race
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.catalogue import names as catalogue_names
from racecraft.worlds.deepracer.tracks.track import Track

ALL = "all"
STARTS = 5
"""Laps on each of several tracks, where nobody says otherwise."""


@dataclass(frozen=True)
class JudgedCourse:
    """A course that is judged, as a table names it."""

    label: str
    track: str
    role: str
    """One of `generalisation.ROLES`."""
    race: str
    reverse: bool
    starts: int
    """Laps that are driven on it, one from each start."""


def results_by_track(report: LapReport, judged: Sequence[JudgedCourse]) -> tuple[TrackResult, ...]:
    """Return what the laps of a report came to, course by course; they lie in the order of the courses.

    Two courses of one label are told apart by a number.
    """
    results, first = [], 0
    for place, one in enumerate(judged):
        part = LapReport(report.laps[first : first + one.starts])
        first += one.starts
        earlier = sum(other.label == one.label for other in judged[:place])
        results.append(
            TrackResult(
                label=f"{one.label} ({earlier + 1})" if earlier else one.label,
                track=one.track,
                role=one.role,
                race=one.race,
                reverse=one.reverse,
                laps=len(part),
                full_laps=part.full_laps,
                mean_progress_percent=round(part.mean_progress_percent, 3),
                best_lap_seconds=part.best_lap_seconds,
            )
        )
    return tuple(results)


def summary_of(results: Sequence[TrackResult]) -> dict[str, Any]:
    """Return the means of each role that a table has: tracks, lapped ones, laps and mean progress.

    Lapped is a track whose every lap was full.
    """
    summary: dict[str, Any] = {}
    for role in (TRAINED, HELD_OUT, OTHER):
        part = [one for one in results if one.role == role]
        if part:
            summary[role] = {
                "tracks": len(part),
                "lapped": sum(one.is_lapped for one in part),
                "laps": sum(one.laps for one in part),
                "full_laps": sum(one.full_laps for one in part),
                "mean_progress_percent": round(float(np.mean([one.mean_progress_percent for one in part])), 3),
            }
    return summary


def headline_of(results: Sequence[TrackResult]) -> str:
    """Return the table in a few words: how many tracks are lapped, which is the worst, and how it is elsewhere.

    >>> row = TrackResult("Oval_track", "Oval_track", TRAINED, "TIME_TRIAL", False, 5, 4, 91.0, 12.0)
    >>> headline_of([row])
    '0 of 1 lapped, worst Oval_track 91 %'
    """
    parts = []
    for role, words in ((TRAINED, ""), (HELD_OUT, "held out: "), (OTHER, "others: ")):
        part = [one for one in results if one.role == role]
        if part:
            worst = min(part, key=lambda one: one.mean_progress_percent)
            lapped = f"{words}{sum(one.is_lapped for one in part)} of {len(part)} lapped"
            beaten = not worst.is_lapped
            parts.append(lapped + (f", worst {worst.label} {worst.mean_progress_percent:.0f} %" if beaten else ""))
    return "; ".join(parts)


def figures_of(results: Sequence[TrackResult]) -> dict[str, float | None]:
    """Return the columns of metrics.jsonl: the worst and the lapped of each role, and every track's own progress."""
    figures: dict[str, float | None] = {}
    for role, row in summary_of(results).items():
        figures[f"{role}_tracks_lapped"] = row["lapped"] / row["tracks"]
        figures[f"{role}_progress"] = row["mean_progress_percent"]
        figures[f"{role}_worst_progress"] = min(one.mean_progress_percent for one in results if one.role == role)
    return figures | {f"{one.role}/{one.label}": one.mean_progress_percent for one in results}


def judge_tracks(car: TrainedCar, named: Sequence[Track], words: Sequence[str], starts: int) -> tuple[TrackResult, ...]:
    """Let a trained car drive one lap from each of several starts on many tracks.

    Args:
        car: Who drives, greedily; on a track that it was not trained on as its own race is.
        named: Tracks by themselves.
        words: ROLES of tracks that its run knows; those it was trained on as they were raced there.
        starts: Laps on each track, from starts spread evenly round it.

    Raises:
        RunFolderError: A track of the run is gone or has changed.
    """
    own = [way for course in courses_of_run(car.run) for way in course.ways]
    held_out = held_out_of_run(car.run)
    courses = [(one, TRAINED) for one in own if TRAINED in words]
    courses += [(LaidCourse(one, of_race(car.settings)), HELD_OUT) for one in held_out if HELD_OUT in words]
    roles = {one.name: HELD_OUT for one in held_out} | {one.track.name: TRAINED for one in own}
    known = {course.label for course, _ in courses}
    for track in named:
        course = LaidCourse(track, of_race(car.settings))
        if course.label not in known:
            known.add(course.label)
            courses.append((course, roles.get(track.name, OTHER)))
    worlds = [_with_race(car, course).world(course.track, starts) for course, _ in courses]
    report = judge_starts(car.policy, MultiCourseWorld(worlds))
    return results_by_track(report, [judged_course(course, role, starts) for course, role in courses])


def judge_named(car: TrainedCar, names: Sequence[str], starts: int) -> tuple[TrackResult, ...]:
    """Judge a car on tracks by name; "trained" and "held-out" are those of its run, "all" is the catalogue.

    Raises:
        TrackError: A track cannot be used; the nearest name is told.
        SettingError: Held-out tracks are asked for, and the run has none.
    """
    words = [role for role in (TRAINED, HELD_OUT) if role in names or role.replace("_", "-") in names]
    if HELD_OUT in words and not held_out_of_run(car.run):
        raise SettingError(
            "{path} holds no track out; expected names. A training does with --hold-out; --tracks trained "
            "are those it saw.",
            path=car.run.path,
        )
    roles = {TRAINED, HELD_OUT, HELD_OUT.replace("_", "-")}
    listed = [one for name in names if name not in roles for one in (catalogue_names() if name == ALL else [name])]
    return judge_tracks(car, [load_track(name) for name in listed], words, starts)


def told_of(car: TrainedCar, results: Sequence[TrackResult], starts: int) -> dict[str, Any]:
    """Return a judgement of several tracks as plain values, fit for JSON."""
    document = {"run": str(car.run.path), "checkpoint": car.checkpoint.iteration, "starts": starts}
    return {**document, "tracks": [one.as_dictionary() for one in results], "by_role": summary_of(results)}


def judged_course(course: LaidCourse, role: str, starts: int) -> JudgedCourse:
    """Return what a table says of a course."""
    return JudgedCourse(course.label, course.track.name, role, course.race.type, course.race.reverse, starts)


def _with_race(car: TrainedCar, course: LaidCourse) -> TrainedCar:
    race = {name: getattr(course.settings, name) for name in course.settings}
    return replace(car, settings=Settings(**race, camera=car.settings.camera))
