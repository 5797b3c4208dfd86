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

    def look(self) -> TrialStatus:
        """Tell how it stands."""

    def stop(self) -> None:
        """Ask it to end; what it has learned stays."""


Launch = Callable[[int, Mapping[str, Any]], Trial]
"""Begins a trial of a number and its values."""
TrialCallback = Callable[[TrialRecord], None]


def search(
    study: Study, launch: Launch, trials: int, parallel: int, told: TrialCallback, early_stopping: bool = True
) -> None:
    """Try until the study holds so many trials of its own that have ended.

    Args:
        study: Decides what is tried.
        launch: Begins a trial.
        trials: How many in all, those that lie in the study already among them, but not what it took over of others.
        parallel: How many at a time.
        told: Is called with every trial that ends.
        early_stopping: Whether trials that the study gives up are stopped.

    Raises:
        TuningError: Every one of the first trials failed.
    """
    _bury(study)
    trials = min(trials, study.most_trials or trials)
    under_way: dict[int, _Watched] = {}
    try:
        while True:
            while len(under_way) < parallel and len(_tried(study)) < trials:
                number, values = study.ask()
                under_way[number] = _Watched(number, launch(number, values))
            if not under_way:
                return
            time.sleep(LOOK_SECONDS)
            for number in list(under_way):
                if under_way[number].look(study, early_stopping):
                    del under_way[number]
                    told(next(one for one in study.trials() if one.number == number))
            _require_hope(study)
    finally:
        for one in under_way.values():
            one.trial.stop()
            study.finish(one.number, FAILED, note=BROKEN_OFF)


class _Watched:
    """A trial, and how much of it the study has heard."""

    def __init__(self, number: int, trial: Trial) -> None:
        self.number, self.trial = number, trial
        self._heard = 0
        self._given_up = False

    def look(self, study: Study, early_stopping: bool) -> bool:
        """Tell the study what is new; return whether the trial has ended."""
        standing = self.trial.look()
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


def _bury(study: Study) -> None:
    """End what an earlier search left under way: nobody looks after it any more."""
    for one in study.trials():
        if one.state == RUNNING:
            study.finish(one.number, FAILED, note=BROKEN_OFF)


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
