"""A race of several cars as a film: seen from one of them, with the others on the road. See `film_race`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.drive import Drive, as_drive
from racecraft.worlds.deepracer.analysis.films.film import FilmStyle, OtherCar, PictureCount, write_film
from racecraft.worlds.deepracer.analysis.films.shells import DEEPRACER, paint_of
from racecraft.worlds.deepracer.analysis.films.tower import Standings
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.evaluation.head_to_head import RaceResult
from racecraft.worlds.deepracer.evaluation.mishap_rules import MISHAPS
from racecraft.worlds.deepracer.players.driver import Driver
from racecraft.worlds.deepracer.tracks.track import Track

OWN_COLOUR = "Purple"
OTHER_COLOURS = ("Orange", "Blue", "White", "Red", "Black", "Grey", "Orange")
"""The original paints its two cars purple and orange (facts: deepracer.md 6.3); further ones are ours."""


def film_race(
    result: RaceResult,
    drivers: Sequence[Driver],
    track: Track,
    video: Path,
    style: FilmStyle,
    shells: Sequence[str] = (),
    count: PictureCount | None = None,
    number: int = 0,
) -> dict[str, Path]:
    """Film a race from the first driver's car; return the film and its strip by kind.

    Args:
        result: The races.
        drivers: Who drove.
        track: The circuit as it was driven.
        video: Where the film goes.
        style: Camera, size and pace; name and colour are the race's own.
        shells: Of the others, by the original's names; the plain one where none is given.
        count: Hears how many pictures are painted, and of how many.
        number: Which race, counted from 0; one whose ticks were kept.
    """
    drives = [drive_of(result.ticks[number][:, one]) for one in range(len(drivers))]
    worn = [*shells, *[DEEPRACER] * len(drives)]
    others = [OtherCar(*car) for car in zip(drives[1:], worn, OTHER_COLOURS, strict=False)]
    own = drivers[0]
    style = replace(style, name=own.name, colour=OWN_COLOUR)
    title = " against ".join(result.drivers)
    paints = (paint_of(style.shell, style.colour), *(paint_of(one.shell, one.colour) for one in others))
    standings = Standings(places_in(result.ticks[number]), result.drivers, paints)
    film, strip = write_film(
        video, drives[0], track, style, own.mount, own.light, others, title, count=count, standings=standings
    )
    return {"video": film, "strip": strip}


def places_in(ticks: Array) -> Array:
    """Return each car's place in every tick, (T, M): by how far it has driven of its own laps.

    Who is carried off the road stays as far as it came; of several that finished, the first to do so is ahead.

    Args:
        ticks: TICK_REPORT (T, M) of a race.
    """
    parked = ticks["status"] == race.PARK
    rows = np.where(parked, 0, np.arange(len(ticks))[:, None])
    latest = np.take_along_axis(ticks, np.maximum.accumulate(rows, axis=0), axis=0)
    share = np.where(latest["status"] == race.LAP_COMPLETE, 0.0, np.clip(latest["progress"], 0.0, 100.0) / 100.0)
    driven = latest["laps"] + share + np.cumsum(parked, axis=0) / (1e3 * len(ticks))
    ahead: Array = driven[:, None, :] > driven[:, :, None]
    return 1 + ahead.sum(axis=2)


def drive_of(ticks: Array) -> Drive:
    """Return what a car did until it was carried off the road, TICK_REPORT (T,)."""
    parked = np.flatnonzero(ticks["status"] == race.PARK)
    ticks = ticks[: parked[0]] if len(parked) else ticks
    status = ticks["status"]
    return replace(
        as_drive(ticks),
        lap=1 + ticks["laps"] - (status == race.LAP_COMPLETE),
        resets=np.cumsum(np.isin(status, list(MISHAPS))),
        penalty_seconds=np.cumsum(status == race.PAUSE) * TICK_SECONDS,
    )
