"""Films of judged drives, made when somebody asks for one. Begin with `film_cars`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
from racecraft.worlds.deepracer.analysis.judged_drive import Drive, show_drive
from racecraft.worlds.deepracer.analysis.race_film import film_race
from racecraft.worlds.deepracer.evaluation.head_to_head import RaceResult
from racecraft.worlds.deepracer.league.drives import CarDrive
from racecraft.worlds.deepracer.players.driver import driver_of


def film_cars(drives: Sequence[CarDrive], names: Sequence[str], video: Path, seen_from: int) -> None:
    """Film a heat.

    Args:
        drives: What each car did.
        names: Of the racers.
        video: The file to write.
        seen_from: Which car's film it is.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
    """
    own = drives[seen_from]
    if own.record is not None:
        show_drive(Drive(own.car, own.track, own.record, own.ticks, own.record.objects), video=video)
    if own.meeting is not None:
        order = [seen_from, *(number for number in range(len(drives)) if number != seen_from)]
        drivers = [driver_of(drives[number].car, names[number]) for number in order]
        film_race(_reordered(own.meeting, order), drivers, own.track, video, FilmStyle())


def _reordered(meeting: RaceResult, order: Sequence[int]) -> RaceResult:
    return replace(
        meeting,
        drivers=tuple(meeting.drivers[number] for number in order),
        races=tuple(tuple(one[number] for number in order) for one in meeting.races),
        ticks=tuple(ticks[:, order] for ticks in meeting.ticks),
    )
