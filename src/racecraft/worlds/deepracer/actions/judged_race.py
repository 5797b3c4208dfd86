"""Judge a car as races do: trials, resets, penalties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

from racecraft.settings.request import Request, group, option
from racecraft.worlds.deepracer.actions.mishap_options import MishapOptions

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.judged_drive import Drive
    from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

REVERSE = "reverse_direction"
"""The option of a race that is no rule: which way round."""


@dataclass(frozen=True, kw_only=True)
class RaceOptions(Request):
    """How a race is judged as it was given; None: not given. Named like the variables of run.env."""

    PANEL: ClassVar[str] = "A judged race"
    number_of_trials: int | None = option(
        None, "Judge a race of so many trials, with resets and penalties (DR_EVAL_NUMBER_OF_TRIALS)."
    )
    is_continuous: bool | None = option(
        None, "Of a race: trials are laps of one drive, the default, or each begins at rest (DR_EVAL_IS_CONTINUOUS)."
    )
    mishaps: MishapOptions = group(MishapOptions)
    reset_behind_dist: float | None = option(
        None, "Of a race: metres behind a box that it is set down, 1 (DR_EVAL_RESET_BEHIND_DIST)."
    )
    enable_mercy_reset: bool | None = option(
        None, "Of a race: a car set down at one box again and again goes on ahead of it; off by default."
    )
    max_resets_after_crash: int | None = option(None, "With mercy: at the how-manieth reset in a row at one box, 3.")
    reset_ahead_dist: float | None = option(None, "With mercy: metres ahead of the box that it is set down, 1.")
    reverse_direction: bool | None = option(
        None, "Of a race: its direction, by default as it was trained (DR_EVAL_REVERSE_DIRECTION)."
    )

    def typed(self) -> dict[str, Any]:
        """Return what was typed, by name."""
        return {name: value for name, value in self.values().items() if value is not None} | self.mishaps.typed()

    def given(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, those of mishaps too, by their spelling."""
        return super().given() | self.mishaps.given()


def requested_race(typed: Mapping[str, Any], kept: Mapping[str, Any]) -> tuple[TrialRaceRules | None, bool | None]:
    """Return how a race is judged, and whether in the opposite direction (None: as the car was trained).

    What was typed outweighs what the run keeps of its run.env; what neither says is as at DeepRacer for Cloud.

    Args:
        typed: A race's options by name, those that were given.
        kept: "evaluate" of job.json; "laps" and "checkpoint" alone ask for no race.

    Returns:
        No rules where nobody asks for a race.

    Raises:
        SettingError: A number is out of its range.
    """
    from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules

    names = {REVERSE, *(one.name for one in fields(TrialRaceRules))}
    rules = {name: value for name, value in kept.items() if name in names} | dict(typed)
    if not rules:
        return None, None
    if "laps" in kept:
        rules.setdefault("number_of_trials", kept["laps"])
    reverse = rules.pop(REVERSE, None)
    return TrialRaceRules(**rules), reverse


def race_car(car: TrainedCar, circuit: Track, rules: TrialRaceRules, reverse: bool | None) -> tuple[Drive, str]:
    """Let a car drive a judged race; return the drive, and the digits under which its AWS files stand."""
    from racecraft.worlds.deepracer.analysis.judged_drive import drive_race
    from racecraft.worlds.deepracer.training.aws.race_evaluation import write_aws_race

    record, drive = drive_race(car, circuit, rules, reverse)
    return drive, write_aws_race(car.run.path, record, drive.track.length)
