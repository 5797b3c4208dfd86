"""Edit, copy, close, open and reset a race."""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass, replace

from racecraft.actions.action import action
from racecraft.actions.league.options import RaceNamed, moment, require_dates, title_of
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.league.race import Race
from racecraft.settings.request import argument, option


@dataclass(frozen=True)
class ChangedRace:
    """A race as it is now."""

    race: Race


@dataclass(frozen=True, kw_only=True)
class EditRequest(RaceNamed):
    """What changes; what is not given stays."""

    title: str | None = option(None, "Its new title; the id stays.")
    opens: str | None = option(None, 'Entries are accepted from then on; "": at once.')
    closes: str | None = option(None, 'Entries are accepted until then; "": without end.')
    submissions: int | None = option(None, "Entries of one racer; 0: any number.", low=0)
    season: str | None = option(None, 'The season that its points count for; "": none.')


@action
def edit_race(request: EditRequest, progress: Progress = quiet) -> ChangedRace:
    """Change a race's title, dates, submissions or season. Its rules stay: copy it for others.

    Example: racecraft league edit club-evening --closes +2h
    """
    league = request.open()
    race = league.race(request.race)
    if request.title is not None:
        race = replace(race, title=title_of(request.title, "race"))
    if request.opens is not None:
        race = replace(race, opens=moment(request.opens, "--opens"))
    if request.closes is not None:
        race = replace(race, closes=moment(request.closes, "--closes"))
    if request.submissions is not None:
        race = replace(race, max_submissions=request.submissions or None)
    if request.season is not None:
        race = replace(race, season=league.season(request.season).id if request.season else "")
    require_dates(race.is_practice, race.opens, race.closes, race.season)
    league.save_race(race)
    return ChangedRace(race)


@dataclass(frozen=True, kw_only=True)
class CopyRequest(RaceNamed):
    """Which race is copied, under which title."""

    title: str = argument("Of the new race.", metavar="TITLE")
    closes: str | None = option(None, "Entries of the new race are accepted until then.")


@action
def copy_race(request: CopyRequest, progress: Progress = quiet) -> ChangedRace:
    """Make a new race with the same tracks and rules, open and without entries.

    Example: racecraft league copy club-evening "Club evening 2"
    """
    league = request.open()
    before = league.race(request.race)
    race = replace(
        before,
        title=title_of(request.title, "race"),
        created=time.time(),
        opens=None,
        closes=moment(request.closes, "--closes"),
        is_closed=False,
        screen="",
    )
    return ChangedRace(league.add_race(race, league.tracks(before.id)))


@action
def close_race(request: RaceNamed, progress: Progress = quiet) -> ChangedRace:
    """Close a race: it takes no entries any more; those that wait are still judged.

    Example: racecraft league close club-evening
    """
    return _set_closed(request, True)


@action
def open_race(request: RaceNamed, progress: Progress = quiet) -> ChangedRace:
    """Open a race that was closed.

    Example: racecraft league open club-evening

    Raises:
        UserInputError: Its deadline has passed.
    """
    race = request.open().race(request.race)
    if race.closes is not None and race.closes <= time.time():
        raise SettingError(
            "the deadline of {race} has passed; expected a later one, or none. racecraft league edit {race} "
            '--closes +2h, or --closes ""',
            race=race.id,
        )
    return _set_closed(request, False)


def _set_closed(request: RaceNamed, is_closed: bool) -> ChangedRace:
    league = request.open()
    race = league.race(request.race)
    if race.is_practice:
        raise SettingError("{race} is a practice race, which is always open; expected another one.", race=race.id)
    race = replace(race, is_closed=is_closed)
    league.save_race(race)
    return ChangedRace(race)


@dataclass(frozen=True, kw_only=True)
class ScreenRequest(RaceNamed):
    """Whose screen gets a link, or loses it."""

    end: bool = option(False, "End the link; whoever opens it sees the race no more.")
    address: str = option("", "Address of the console for the link. [default: this machine's name, port 8200]")


@dataclass(frozen=True)
class RaceScreen:
    """The link of a race's screens."""

    race: str
    link: str
    """"": there is none."""


@action
def show_on_screen(request: ScreenRequest, progress: Progress = quiet) -> RaceScreen:
    """Make the link of a projector's screen: it shows a race's live page without sign-in, and nothing else.

    The same link is shown again until `--end` ends it; the next one is another.

    Examples:

        racecraft league screen club-evening

        racecraft league screen club-evening --end
    """
    from racecraft.actions.people import console_link

    league = request.open()
    race = league.race(request.race)
    if request.end != (not race.screen):
        race = replace(race, screen="" if request.end else secrets.token_hex(8))
        league.save_race(race)
    token = league.screen_token(race)
    return RaceScreen(race.id, console_link(request.address, f"screen/{race.id}/{token}") if token else "")


@dataclass(frozen=True, kw_only=True)
class ResetRequest(RaceNamed):
    """Which results are put aside."""

    heat: str | None = option(None, "One heat, as `board --json` names it; by default all.")


@dataclass(frozen=True)
class ResetRace:
    """What was put aside."""

    race: str
    results: int
    """How many."""


@action
def reset_race(request: ResetRequest, progress: Progress = quiet) -> ResetRace:
    """Put results aside, so that their entries are judged again; the old files are kept below past/.

    Example: racecraft league reset club-evening
    """
    league = request.open()
    race = league.race(request.race)
    with league.judging(race.id):
        return ResetRace(race.id, league.reset(race.id, request.heat))
