"""A racer over all races: entries, personal bests and counts."""

from __future__ import annotations

from dataclasses import asdict

from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.accounts.people import AccountError
from racecraft.console.pages.race_parts import league_of, open_league
from racecraft.console.section import Section
from racecraft.console.service import Console, Page, page_routes
from racecraft.contract.errors import UserInputError
from racecraft.league.board import score_text, titles_of
from racecraft.league.records import Career, career_of, fastest_laps
from racecraft.web.errors import WebError


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of a racer's page."""
    return [*page_routes(console, "/racers/{name}", racer_page)]


def racer_page(console: Console, request: Request) -> Page:
    """Return what a racer has entered and driven, in every race of this console."""
    name = request.path_params["name"]
    career = _career(console, name)
    if career is None:
        return Page("racer.html", _known(console, name), {"name": name, "career": None}, here="/races")
    league = league_of(console)
    races = {race.id: race for race in league.races()}
    first = {(one.track, one.type): one.seconds for one in fastest_laps(league, each=1)}
    return Page(
        "racer.html",
        career.racer,
        {
            "name": career.racer,
            "career": asdict(career),
            "races": [
                {
                    **asdict(one),
                    "unit": titles_of(races[one.race])[0],
                    "score_text": score_text(races[one.race], one.score),
                    "gap_text": f"+{score_text(races[one.race], one.gap)}" if one.gap else "",
                }
                for one in career.races
            ],
            "best_laps": [{**asdict(one), "gap": one.seconds - first[one.track, one.type]} for one in career.best_laps],
        },
        here="/races",
    )


def _career(console: Console, name: str) -> Career | None:
    league = open_league(console)
    try:
        return career_of(league, name) if league else None
    except UserInputError:
        return None


def _known(console: Console, name: str) -> str:
    """Return the name of somebody who was invited and has entered nothing yet.

    Raises:
        WebError: There is no such person.
    """
    try:
        assert console.accounts is not None
        return console.accounts.named(name).name
    except AccountError as error:
        raise WebError(404, "no_such_racer", "There is no such racer; begin at /races.") from error


SECTION = Section(routes=routes)
