"""Judge the greedy policy of a car in training: one episode from each of several starts, side by side.

With fidelity aws every episode of an evaluation begins where training's next one would, and what chance does to its
ticks and wheels is its own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import EpisodeRecord
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import EvaluationResult, ended_alike
from racecraft.training.stopping import LAPS
from racecraft.worlds.deepracer.driving.known_laps import gap_percent
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.by_track import (
    JudgedCourse,
    figures_of,
    headline_of,
    results_by_track,
    summary_of,
)
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport, judge_laps, judge_starts
from racecraft.worlds.deepracer.files.generalisation import TRAINED, TrackResult, write_generalisation
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld

POOLED, LUCK = 5, 0.05
"""By pace so many evaluations in a row are taken together, and what they come to differs by this share by chance: where
95 of 100 starts finish, it is 91 to 99. One evaluation of 20 says too little: the best of many was lucky."""
FLYING_LAPS = 3
"""Laps in a row that a policy drives before it is called stable."""


class LatestReports:
    """The latest evaluations, by which a checkpoint is chosen; a training that is resumed goes on with them.

    Args:
        best_by: What makes a checkpoint the best: by pace POOLED evaluations are kept, else the newest.
    """

    def __init__(self, best_by: str) -> None:
        self._reports: deque[LapReport] = deque(maxlen=POOLED if best_by == "pace" else 1)

    def with_newest(self, report: LapReport) -> LapReport:
        """Take in an evaluation, and return all of them as one."""
        self._reports.append(report)
        return LapReport(tuple(lap for one in self._reports for lap in one.laps))

    def state(self) -> list[list[dict[str, Any]]]:
        """Return the laps of each."""
        return [[asdict(lap) for lap in one.laps] for one in self._reports]

    def restore(self, state: list[list[dict[str, Any]]]) -> None:
        """Go on from what `state` gave."""
        self._reports.clear()
        self._reports.extend(LapReport(tuple(Lap(**lap) for lap in laps)) for laps in state)


class CarEvaluator:
    """Drives the policy on a world of its own.

    Args:
        world: As many cars as starts; no reward.
        policy: The policy, greedy; it follows its learner.
        trained_in: The training's own world; with fidelity aws, evaluations start where its next episode would.
        best_by: What makes a checkpoint the best: "progress", "reward", "laptime" or "pace".
        flying: One car on each course that drives FLYING_LAPS laps in one episode, to confirm that it is stable; none:
            no such proof.
        by_track: What is judged, course by course, where there are several; those that are held out stand last and
            count neither for the score nor for the best checkpoint. Empty: one track.
        times_flying: Whether the fastest flying lap is measured where every start brings a full lap.
        known_lap_seconds: The best known lap, which it is compared with; None: nobody knows one.
        latest: What evaluations before this one came to; None: there were none.
        drives_on: Whether cars in training drive on over the finish until the clock cuts them.

    The score is the mean over the tracks that are trained on, each with as many laps; it is solved where all are full.
    """

    score_name = "progress %"
    stop_kinds = LAPS

    def __init__(
        self,
        world: RaceWorld | MultiCourseWorld,
        policy: Policy,
        trained_in: RaceWorld | MultiCourseWorld | OpponentWorld | None = None,
        best_by: str = "progress",
        flying: Sequence[RaceWorld] = (),
        by_track: Sequence[JudgedCourse] = (),
        times_flying: bool = False,
        known_lap_seconds: float | None = None,
        latest: LatestReports | None = None,
        drives_on: bool = False,
    ) -> None:
        self._world, self._policy, self._trained_in, self._best_by = world, policy, trained_in, best_by
        self._flying, self._by_track = tuple(flying), tuple(by_track)
        self._latest = latest or LatestReports(best_by)
        self._times_flying, self._known_lap = times_flying, known_lap_seconds
        self._drives_on = drives_on

    def score(self, episode: EpisodeRecord) -> float | None:
        """Return the progress of an episode, per cent; None where the clock cut a drive that goes over the finish."""
        is_cut = self._drives_on and episode.status == race.TRUNCATED
        return None if is_cut else episode.facts["progress_percent"]

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode was a full lap."""
        return episode.status == race.STATUSES[race.LAP_COMPLETE]

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Training's episodes change nothing here."""

    def evaluate(self) -> EvaluationResult:
        """Drive from every start."""
        episodes = 0
        if self._trained_in is not None and begins_where_training_does(self._world):
            self._world.move_starts(np.full(self._world.spec.num_worlds, self._trained_in.next_start_share))
            episodes = self._trained_in.episodes_started
        every = judge_starts(self._policy, self._world, seed=episodes)
        results = results_by_track(every, self._by_track)
        report = LapReport(every.laps[: len(every) - sum(one.laps for one in results if one.role != TRAINED)])
        best = report.best_lap_seconds
        timed = self._flying_lap() if report.all_full and self._times_flying else {}
        flying = timed.get("flying_lap_seconds")
        headlines = [
            "" if best is None else f"best lap {best:.2f} s",
            "" if flying is None else f"flying lap {flying:.2f} s",
            headline_of(results),
        ]
        return EvaluationResult(
            report.mean_progress_percent,
            report.all_full,
            goal_reached=best is not None,
            figures={"best_lap_seconds": best, **timed, **figures_of(results)},
            headline=" | ".join(filter(None, headlines)),
            details=report.as_dictionary() | _table(results),
            steps=sum(lap.steps for lap in every.laps),
            selection=self._selection(report),
            luck=LUCK if self._best_by == "pace" else 0.0,
            write_files=partial(_write_generalisation, results),
            by_status=ended_alike((lap.status, lap.reward, lap.progress_percent, _seconds(lap)) for lap in every.laps),
        )

    def _selection(self, report: LapReport) -> tuple[float, ...]:
        """Return what a checkpoint is best by; of equals the faster is, at AWS the newest (facts: deepracer.md 8.6)."""
        merit, best = self._latest.with_newest(report).merit(self._best_by), report.best_lap_seconds
        if self._world.habits.newest_of_equals:
            return (merit,)
        return (merit, -float("inf") if best is None else -best)

    def confirm(self) -> bool:
        """Drive three laps one after the other: what laps from every start need not survive its own finish line."""
        return all(judge_laps(self._policy, one, FLYING_LAPS).all_full for one in self._flying)

    def _flying_lap(self) -> dict[str, float | None]:
        """Return the fastest flying lap on the first course and its gap to the best known lap.

        An open track has no flying laps: there it is the fastest drive from rest, as in the table of known laps.
        """
        is_open = not self._flying[0].track.closed
        laps = judge_laps(self._policy, self._flying[0], FLYING_LAPS).laps[0 if is_open else 1 :]
        best = min((lap.seconds for lap in laps if lap.seconds is not None), default=None)
        gap = None if best is None or self._known_lap is None else gap_percent(best, self._known_lap)
        return {"flying_lap_seconds": best, "gap_percent": gap}


def _seconds(lap: Lap) -> float:
    """Return how long a lap was driven, s of simulated time, finished or not."""
    return lap.steps * TICK_SECONDS


def _write_generalisation(results: Sequence[TrackResult], run: RunFolder, iteration: int) -> None:
    """Write how it went on each of several tracks; nothing where there is one."""
    if results:
        write_generalisation(run.generalisation, iteration, results)


def _table(results: Sequence[TrackResult]) -> dict[str, Any]:
    """Return what evaluations/N.json says of each track; nothing where there is one."""
    return {"tracks": [one.as_dictionary() for one in results], "by_role": summary_of(results)} if results else {}


def begins_where_training_does(judged: RaceWorld | MultiCourseWorld) -> bool:
    """Tell whether every evaluation begins where training's next episode would: it asks the world that trains."""
    return judged.habits.evaluation_follows_training
