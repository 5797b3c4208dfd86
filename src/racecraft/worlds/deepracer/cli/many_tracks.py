"""The half of `racecraft evaluate` that judges a car on several tracks: a table of how it generalises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.generalisation import TrackResult


def tracks_asked(track: Sequence[str] | None, tracks: str | None, of_one: Mapping[str, Any]) -> list[str]:
    """Return the names of --track or --tracks, each once.

    Args:
        track: As typed.
        tracks: As typed, a comma list.
        of_one: What else was given and is of one track only, by option.

    Raises:
        SettingError: Both were given, none is named, or an option says nothing of several tracks.
    """
    if track and tracks is not None:
        raise SettingError("--track and --tracks were given; expected all names after one of them.")
    for option, value in of_one.items():
        if value is not None:
            raise SettingError(
                "{option} shows one track, and several are judged; expected one --track, or no {option}.", option=option
            )
    parts = [tracks] if tracks is not None else list(track or ())
    names = list(dict.fromkeys(name.strip() for part in parts for name in part.split(",") if name.strip()))
    if not names:
        raise SettingError("--tracks {tracks!r} names none; expected names, trained, held-out or all.", tracks=tracks)
    return names


def judge_and_tell(run: Path, checkpoint: str | None, names: Sequence[str], laps: int | None, json: bool) -> None:
    """Judge a car on tracks by name, from `laps` starts on each, and print the table.

    Raises:
        TrackError: A track cannot be used; the nearest name is told.
        SettingError: Held-out tracks are asked for, and the run has none.
    """
    from racecraft.cli.output import print_json
    from racecraft.formats.run_folder import RunFolder
    from racecraft.worlds.deepracer.evaluation.by_track import STARTS, judge_named, summary_of, told_of
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    asked = RunFolder.open(run).read_job().get("evaluate", {})
    car, starts = load_trained_car(run, checkpoint or asked.get("checkpoint", "best")), laps or STARTS
    results = judge_named(car, names, starts)
    if json:
        print_json(told_of(car, results, starts))
        return
    print(f"{car.run.path}, checkpoint {car.checkpoint.iteration}, {starts} laps on each of {len(results)} tracks:")
    _print_table(results)
    for role, part in summary_of(results).items():
        print(
            f"{role.replace('_', ' ')}: {part['lapped']} of {part['tracks']} lapped from every start, "
            f"{part['full_laps']} of {part['laps']} laps full, mean progress {part['mean_progress_percent']:.1f} %"
        )


def _print_table(results: Sequence[TrackResult]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("track", "", "full laps", "mean progress", "best lap"):
        table.add_column(title, justify="left" if title in ("track", "") else "right", no_wrap=True)
    for one in results:
        lap = "-" if one.best_lap_seconds is None else f"{one.best_lap_seconds:.2f} s"
        laps, progress = f"{one.full_laps} of {one.laps}", f"{one.mean_progress_percent:.1f} %"
        table.add_row(one.label, one.role.replace("_", " "), laps, progress, lap)
    print_table(table)
