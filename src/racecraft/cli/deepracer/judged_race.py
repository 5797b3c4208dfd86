"""The half of `racecraft evaluate` that judges a car as races do: trials, resets, penalties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.evaluation.deepracer.judged_race import JudgedRace, RaceRecord
    from racecraft.players.deepracer.trained_car import TrainedCar
    from racecraft.reporting.gallery import Drive
    from racecraft.tracks.track import Track


REVERSE = "reverse_direction"
"""The option of a race that is no rule: which way round."""


def race_asked(typed: Mapping[str, Any], kept: Mapping[str, Any]) -> tuple[JudgedRace | None, bool | None]:
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
    from racecraft.evaluation.deepracer.judged_race import JudgedRace

    names = {REVERSE, *(one.name for one in fields(JudgedRace))}
    said = {name: value for name, value in kept.items() if name in names} | dict(typed)
    if not said:
        return None, None
    if "laps" in kept:
        said.setdefault("number_of_trials", kept["laps"])
    reverse = said.pop(REVERSE, None)
    return JudgedRace(**said), reverse


def race_car(car: TrainedCar, circuit: Track, rules: JudgedRace, reverse: bool | None) -> tuple[Drive, str]:
    """Let a car drive a judged race; return the drive, and the digits under which its AWS files stand."""
    from racecraft.reporting.gallery import drive_race
    from racecraft.training.deepracer.aws.race_evaluation import write_aws_race

    record, drive = drive_race(car, circuit, rules, reverse)
    return drive, write_aws_race(car.run.path, record, drive.track.length)


def print_race(record: RaceRecord) -> None:
    """Print a row a trial."""
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("trial", "seconds", "progress", "resets", "penalty", "ended"):
        table.add_column(title, justify="left" if title == "ended" else "right")
    for one in record.trials:
        seconds = "-" if one.seconds is None else f"{one.seconds:.2f}"
        resets, penalty = str(one.reset_count), f"{one.penalty_seconds:.0f} s"
        ended = one.status.replace("_", " ")
        table.add_row(str(one.trial), seconds, f"{one.progress_percent:.1f} %", resets, penalty, ended)
    print_table(table)
