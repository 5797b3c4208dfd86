"""The half of `racecraft evaluate` that judges a car as races do: trials, resets, penalties."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.evaluation.deepracer.judged_race import JudgedRace, RaceRecord
    from racecraft.players.deepracer.trained_car import TrainedCar
    from racecraft.reporting.gallery import Drive
    from racecraft.tracks.track import Track


def rules_asked(reverse: bool | None, **asked: Any) -> JudgedRace | None:
    """Return how a race is judged, DeepRacer for Cloud's own way where an option is None; None where all are.

    Raises:
        SettingError: A number is out of its range.
    """
    from racecraft.evaluation.deepracer.judged_race import JudgedRace

    given = {name: value for name, value in asked.items() if value is not None}
    return JudgedRace(**given) if given or reverse is not None else None


def race_car(car: TrainedCar, circuit: Track, rules: JudgedRace, reverse: bool | None) -> tuple[Drive, str]:
    """Let a car drive a judged race; return the drive, and the digits under which its AWS files stand."""
    from racecraft.reporting.gallery import drive_race
    from racecraft.training.deepracer.aws.race_evaluation import write_aws_race

    record, drive = drive_race(car, circuit, rules, reverse)
    return drive, write_aws_race(car.run.path, record, drive.track.length)


def print_race(record: RaceRecord) -> None:
    """Print a row a trial."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("trial", "seconds", "progress", "resets", "penalty", "ended"):
        table.add_column(title, justify="left" if title == "ended" else "right")
    for one in record.trials:
        seconds = "-" if one.seconds is None else f"{one.seconds:.2f}"
        resets, penalty = str(one.reset_count), f"{one.penalty_seconds:.0f} s"
        ended = one.status.replace("_", " ")
        table.add_row(str(one.trial), seconds, f"{one.progress_percent:.1f} %", resets, penalty, ended)
    Console().print(table)
