"""A race for an audience: a large board, and each judged drive from above before its result moves the board."""

from __future__ import annotations

import heapq
import hmac
import time
from collections.abc import Mapping, Sequence
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.pages.race_parts import league_of, open_league, race_of, snapshot_at
from racecraft.console.race_watch import LOOK_SECONDS, RaceWatch
from racecraft.console.section import Section
from racecraft.console.service import TEMPLATES, Console, Page, page_routes
from racecraft.contract.errors import UserInputError
from racecraft.league.board import score_text, titles_of
from racecraft.league.heats import latest_of_each, solo_heat
from racecraft.league.race import SOLO, Entry, Race, Result
from racecraft.league.scoring import ranking_text
from racecraft.league.snapshot import Snapshot, snapshot_of
from racecraft.league.store import League
from racecraft.league.world_part import league_world
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.errors import WebError
from racecraft.web.push import Topic, events_answer

SCREEN = "/screen/"
"""Where the addresses begin that a screen's link opens without sign-in."""

ROWS = 12
"""Of the board; more cannot be read from ten metres."""
HEATS = 20
"""The newest ones, from which the page takes those that it has not shown yet."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the show for those who have signed in."""

    def drive(request: Request) -> Response:
        return json_answer(shown_drive(console, request))

    return [
        *page_routes(console, "/races/{id}/show", show_page),
        Route("/races/{id}/drives/{heat}/{number:int}", drive),
    ]


def screen_routes(console: Console) -> list[BaseRoute]:
    """Return the routes of a screen on which nobody signs in: the show of one race, as long as its link holds."""

    def page(request: Request) -> Response:
        race = require_link(console, request)
        league = league_of(console)
        data = show_data(league, snapshot_of(league, race), request.url.path, f"{request.url.path}/events")
        return page_answer(request, f"{TEMPLATES}/show.html", title=race.title, **data)

    def drive(request: Request) -> Response:
        require_link(console, request)
        return json_answer(shown_drive(console, request))

    def events(request: Request) -> Response:
        race = require_link(console, request)
        watch = RaceWatch(console.league, race.id)
        topics = [Topic("races", watch.changed, LOOK_SECONDS), Topic("drives", watch.driving, LOOK_SECONDS)]
        return events_answer(request, topics)

    return [
        Route(SCREEN + "{id}/{token}", page),
        Route(SCREEN + "{id}/{token}/drives/{heat}/{number:int}", drive),
        Route(SCREEN + "{id}/{token}/events", events),
    ]


def require_link(console: Console, request: Request) -> Race:
    """Return the race whose screen a link opens.

    Raises:
        WebError: It opens none, or none any more.
    """
    league = open_league(console)
    races = league.races() if league else []
    race = next((race for race in races if race.id == request.path_params["id"]), None)
    token = league.screen_token(race) if league and race else ""
    if race is None or not token or not hmac.compare_digest(token.encode(), request.path_params["token"].encode()):
        raise WebError(
            404, "no_such_screen", "This link shows nothing now; an organiser makes a new one on the race's page."
        )
    return race


def show_page(console: Console, request: Request) -> Page:
    """Return what a projector shows of a race."""
    now = snapshot_at(console, request)
    return Page(
        "show.html",
        now.race.title,
        show_data(league_of(console), now, f"/races/{now.race.id}", "/events"),
        here="/races",
    )


def show_data(league: League, now: Snapshot, base: str, events: str) -> dict[str, Any]:
    """Return what the page of the show draws.

    Args:
        league: Where the race is.
        now: The race.
        base: Address below which the page finds its drives.
        events: Address of the stream that says when to look again.
    """
    race, entries, results, board = now.race, now.entries, now.results, now.board
    newest = heapq.nlargest(HEATS, results.values(), key=lambda one: one.judged)[::-1]
    leader = next((row.heat for row in board.rows[:1] if row.place == 1), "")
    return {
        "race": race.id,
        "tracks": list(race.tracks),
        "ranking": ranking_text(race),
        "is_open": race.is_open(time.time()),
        "closes": race.closes,
        "heads": list(titles_of(race)),
        "rows": [
            {
                "place": row.place,
                "racer": row.racer,
                "score": score_text(race, row.score),
                "gap": "" if not row.gap else f"+{score_text(race, row.gap)}",
                "heat": row.heat,
            }
            for row in board.rows[:ROWS]
        ],
        "further": max(0, len(board.rows) - ROWS),
        "waiting": _waiting(race, entries, results),
        "told": {
            "race": race.id,
            "base": base,
            "events": events,
            "roads": [_road(league, race, track) for track in race.tracks],
            "heats": [_heat(one, entries) for one in newest if one.drives],
            "leader": _heat(results[leader], entries) if leader in results else None,
        },
        "theme": "dark",
    }


def _road(league: League, race: Race, track: str) -> dict[str, Any] | None:
    """Return a track from above; None where there is no road, or its file is gone."""
    try:
        return league_world(race.kind).road(league.track(race.id, track))
    except UserInputError:
        return None


def shown_drive(console: Console, request: Request) -> Mapping[str, Any]:
    """Return where the cars of a judged heat were on one of the race's tracks.

    Raises:
        WebError: There is no such heat, or its files are gone.
    """
    league = league_of(console)
    race = race_of(league, request.path_params["id"])
    result = league.results(race.id).get(request.path_params["heat"])
    number = request.path_params["number"]
    if result is None or number >= len(result.drives):
        raise WebError(404, "no_such_drive", "There is no such drive; load the page again.")
    drive = result.drives[number]
    try:
        return league_world(race.kind).shown(league.folder(race.id) / drive.folder)
    except (UserInputError, OSError) as error:
        raise WebError(404, "not_kept", f"The drive cannot be shown: {error}") from error


def _waiting(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> list[str]:
    """Return whose entries are still to be judged, in order."""
    if race.format != SOLO:
        met = {number for result in results.values() for number in result.entries}
        return [entries[number].racer for number in latest_of_each(entries) if number not in met]
    return [entry.racer for number, entry in entries.items() if solo_heat(number) not in results]


def _heat(result: Result, entries: Mapping[int, Entry]) -> dict[str, Any]:
    laps: Sequence[float | None] = result.drives[0].outcomes[0].laps if result.drives else ()
    return {
        "heat": result.heat,
        "racers": [entries[number].racer for number in result.entries if number in entries],
        "tracks": [drive.track for drive in result.drives],
        "laps": list(laps),
    }


SECTION = Section(routes=routes)
