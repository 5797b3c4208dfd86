"""Begin trials, look after them, give up the hopeless ones; until so many have been tried. Begin with `search`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from racecraft.formats.tuning import COMPLETE, FAILED, PRUNED, RUNNING, TrialRecord
from racecraft.jobs.tuning.study import Study, TuningError

LOOK_SECONDS = 0.5
BROKEN_OFF = "the search was broken off"


@dataclass(frozen=True)
class TrialStatus:
    """How a trial stands."""

    scores: tuple[tuple[int, float], ...] = ()
    """(iteration, score so far) of every iteration that has one, in order."""
    ended: bool = False
    failure: str = ""
    """Why it failed; "": it did not."""


class Trial(Protocol):
    """A training under way."""

    def poll(self) -> TrialStatus:
        """Tell how it stands."""

    def stop(self) -> None:
        """Ask it to end; what it has learned stays."""


Launch = Callable[[int, Mapping[str, Any]], Trial]
"""Begins a trial of a number and its values."""
FindTrial = Callable[[int], Trial | None]
"""Finds the training of a trial that a killed search left behind; None where it never started one."""
TrialCallback = Callable[[TrialRecord], None]


def search(
    study: Study,
    launch: Launch,
    trials: int,
    parallel: int,
    on_trial: TrialCallback,
    early_stopping: bool = True,
    find: FindTrial = lambda number: None,
) -> None:
    """Try until the study holds so many trials of its own that have ended.

    Args:
        study: Decides what is tried.
        launch: Begins a trial.
        trials: How many in all, those that lie in the study already among them, but not what it took over of others.
        parallel: How many at a time.
        on_trial: Is called with every trial that ends.
        early_stopping: Whether trials that the study gives up are stopped.
        find: Finds trainings that went on after an earlier process of this search was killed: they count.

    Raises:
        TuningError: Every one of the first trials failed.
    """
    under_way = _left_behind(study, find)
    trials = min(trials, study.most_trials or trials)
    try:
        while True:
            while len(under_way) < parallel and len(_tried(study)) < trials:
                number, values = study.ask()
                under_way[number] = _Watched(number, launch(number, values))
            if not under_way:
                return
            time.sleep(LOOK_SECONDS)
            for number in list(under_way):
                if under_way[number].poll(study, early_stopping):
                    del under_way[number]
                    on_trial(next(one for one in study.trials() if one.number == number))
            _require_hope(study)
    finally:
        for one in under_way.values():
            one.trial.stop()
            study.finish(one.number, FAILED, note=BROKEN_OFF)


class _Watched:
    """A trial, and how much of it the study has heard."""

    def __init__(self, number: int, trial: Trial, reported: int = 0) -> None:
        self.number, self.trial = number, trial
        self._heard = reported
        self._given_up = False

    def poll(self, study: Study, early_stopping: bool) -> bool:
        """Tell the study what is new; return whether the trial has ended."""
        standing = self.trial.poll()
        for iteration, score in standing.scores[self._heard :]:
            hopeless = study.report(self.number, score, iteration)
            if hopeless and early_stopping and not self._given_up and not standing.ended:
                self._given_up = True
                self.trial.stop()
        self._heard = len(standing.scores)
        if not standing.ended:
            return False
        if self._given_up:
            study.finish(self.number, PRUNED)
        elif standing.failure or not standing.scores:
            study.finish(self.number, FAILED, note=standing.failure or "it ended without a score")
        else:
            study.finish(self.number, COMPLETE, standing.scores[-1][1])
        return True


def _tried(study: Study) -> list[TrialRecord]:
    """Return the trials that were tried here."""
    return [one for one in study.trials() if not one.taken_from]


def _left_behind(study: Study, find: FindTrial) -> dict[int, _Watched]:
    """Return the trials of a killed search whose training goes on, or has ended since; end the others as failed."""
    watched: dict[int, _Watched] = {}
    for number in [one.number for one in study.trials() if one.state == RUNNING]:
        trial = find(number)
        if trial is None:
            study.finish(number, FAILED, note=BROKEN_OFF)
        else:
            watched[number] = _Watched(number, trial, study.reported(number))
    return watched


def _require_hope(study: Study) -> None:
    """Raise where nothing but failures has come: what was asked for cannot be trained."""
    ended = [one for one in _tried(study) if one.state != RUNNING and one.note != BROKEN_OFF]
    if len(ended) >= 2 and all(one.state == FAILED for one in ended):
        raise TuningError(
            "The first {count} trials failed. Number {number}: {note}",
            count=len(ended),
            number=ended[-1].number,
            note=ended[-1].note,
        )
