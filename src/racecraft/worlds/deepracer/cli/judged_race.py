"""The half of `racecraft evaluate` that judges a car as races do: trials, resets, penalties."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.judged_drive import Drive
    from racecraft.worlds.deepracer.evaluation.trial_race import RaceRecord, TrialRaceRules
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

REVERSE = "reverse_direction"
"""The option of a race that is no rule: which way round."""


@dataclass(frozen=True)
class RaceOptions:
    """How a race is judged, as it was typed; None where nothing was. Named like the variables of run.env."""

    PANEL: ClassVar[str] = "A judged race"

    number_of_trials: Annotated[
        int | None,
        typer.Option(help="Judge a race of so many trials, with resets and penalties (DR_EVAL_NUMBER_OF_TRIALS)."),
    ] = None
    is_continuous: Annotated[
        bool | None,
        typer.Option(
            "--is-continuous/--no-is-continuous",
            help="Of a race: trials are laps of one drive, as usual, or each begins at rest (DR_EVAL_IS_CONTINUOUS).",
        ),
    ] = None
    max_resets: Annotated[
        int | None,
        typer.Option(help="Of a race: how often the car is set back, 100 where nobody says (DR_EVAL_MAX_RESETS)."),
    ] = None
    off_track_penalty: Annotated[
        float | None,
        typer.Option(help="Of a race: seconds it waits then, 5 where nobody says (DR_EVAL_OFF_TRACK_PENALTY)."),
    ] = None
    collision_penalty: Annotated[
        float | None,
        typer.Option(help="Of a race: seconds it waits after hitting an object, 5 (DR_EVAL_COLLISION_PENALTY)."),
    ] = None
    reset_behind_dist: Annotated[
        float | None,
        typer.Option(help="Of a race: metres behind a box that it is set down, 1 (DR_EVAL_RESET_BEHIND_DIST)."),
    ] = None
    enable_mercy_reset: Annotated[
        bool | None,
        typer.Option(
            "--enable-mercy-reset/--no-enable-mercy-reset",
            help="Of a race: a car set down at one box again and again goes on ahead of it; off by default.",
        ),
    ] = None
    max_resets_after_crash: Annotated[
        int | None, typer.Option(help="With mercy: at the how-manieth reset in a row at one box, 3.")
    ] = None
    reset_ahead_dist: Annotated[
        float | None, typer.Option(help="With mercy: metres ahead of the box that it is set down, 1.")
    ] = None
    reverse_direction: Annotated[
        bool | None,
        typer.Option(
            "--reverse-direction/--no-reverse-direction",
            help="Of a race: its direction, by default as it was trained (DR_EVAL_REVERSE_DIRECTION).",
        ),
    ] = None

    def typed(self) -> dict[str, Any]:
        """Return what was typed, by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


def race_asked(typed: Mapping[str, Any], kept: Mapping[str, Any]) -> tuple[TrialRaceRules | None, bool | None]:
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
    said = {name: value for name, value in kept.items() if name in names} | dict(typed)
    if not said:
        return None, None
    if "laps" in kept:
        said.setdefault("number_of_trials", kept["laps"])
    reverse = said.pop(REVERSE, None)
    return TrialRaceRules(**said), reverse


def race_car(car: TrainedCar, circuit: Track, rules: TrialRaceRules, reverse: bool | None) -> tuple[Drive, str]:
    """Let a car drive a judged race; return the drive, and the digits under which its AWS files stand."""
    from racecraft.worlds.deepracer.analysis.judged_drive import drive_race
    from racecraft.worlds.deepracer.training.aws.race_evaluation import write_aws_race

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
