"""Seasons, fastest laps, and a racer's career."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.actions.league.options import LeagueOptions, title_of
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.progress import Progress, quiet
from racecraft.league.race import Season
from racecraft.settings.request import argument, option

if TYPE_CHECKING:
    from racecraft.league.records import Career, Record
    from racecraft.league.seasons import Standings

POINTS = "25,18,15,12,10,8,6,4,2,1"


@dataclass(frozen=True, kw_only=True)
class CreateSeasonRequest(LeagueOptions):
    """A new season."""

    title: str = argument("Of the season, for people.", metavar="TITLE")
    points: str = option(POINTS, "Of the first place, the second and so on, with commas.")
    counted: int | None = option(None, "Only so many of a racer's best races count; by default all.", low=1)


@dataclass(frozen=True)
class MadeSeason:
    """A season that was made."""

    season: Season


@action
def create_season(request: CreateSeasonRequest, progress: Progress = quiet) -> MadeSeason:
    """Make a season; races join it by `create --season` or `edit --season`.

    Example: racecraft league season Winter --points 10,6,3,1
    """
    from racecraft.league.store import League

    try:
        points = tuple(int(part) for part in request.points.split(","))
    except ValueError as error:
        raise SettingError(
            "--points is {points!r}; expected whole numbers with commas, such as 10,6,3,1.", points=request.points
        ) from error
    title = title_of(request.title, "season")
    if min(points) < 0:
        raise SettingError("--points is {points!r}; expected no negative points.", points=request.points)
    league = League.open_or_create(request.league)
    season = Season(id="", title=title, points=points, counted=request.counted, created=time.time())
    return MadeSeason(league.add_season(season))


@dataclass(frozen=True, kw_only=True)
class StandingsRequest(LeagueOptions):
    """Whose points."""

    season: str = argument("A season's id or title.", metavar="SEASON")


@action
def show_standings(request: StandingsRequest, progress: Progress = quiet) -> Standings:
    """Show the points of a season, race by race.

    Example: racecraft league standings winter
    """
    from racecraft.league.seasons import standings

    league = request.open()
    return standings(league, league.season(request.season), time.time())


@dataclass(frozen=True, kw_only=True)
class RecordsRequest(LeagueOptions):
    """Which track's laps."""

    track: str | None = option(None, "Only this track's.")


@dataclass(frozen=True)
class Records:
    """Each racer's fastest lap on each track."""

    records: tuple[Record, ...]


@action
def show_records(request: RecordsRequest, progress: Progress = quiet) -> Records:
    """Show the fastest laps ever driven in races, by track.

    Example: racecraft league records --track Oval_track

    Raises:
        UserInputError: No race is on the track.
    """
    from racecraft.league.records import fastest_laps

    league = request.open()
    tracks = sorted({track for race in league.races() for track in race.tracks})
    if request.track is not None and request.track not in tracks:
        raise SettingError("no race is on {track!r}. {hint}", track=request.track, hint=nearest(request.track, tracks))
    return Records(tuple(fastest_laps(league, request.track)))


@dataclass(frozen=True, kw_only=True)
class RacerRequest(LeagueOptions):
    """Whose career."""

    racer: str = argument("Name on the boards.", metavar="RACER")


@action
def show_racer(request: RacerRequest, progress: Progress = quiet) -> Career:
    """Show a racer's races, places and personal bests.

    Example: racecraft league racer Mia
    """
    from racecraft.league.records import career_of

    return career_of(request.open(), request.racer)
