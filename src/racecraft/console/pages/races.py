"""Races: list, seasons and records; a board and what one may do there; an entry; the points of a season."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import sqlalchemy as sql
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.accounts.rights import Verb, may
from racecraft.actions.league.managing import close_race, open_race, reset_race, show_on_screen
from racecraft.actions.league.options import user_name
from racecraft.console.commands import CommandError, run_command
from racecraft.console.index_tables import MODELS
from racecraft.console.model_row import READY
from racecraft.console.pages.race_parts import (
    league_of,
    log_act,
    open_league,
    organises,
    race_of,
    shown_folder,
    snapshot_at,
)
from racecraft.console.pages.show import SCREEN
from racecraft.console.paging import page_of
from racecraft.console.parts import parts_of
from racecraft.console.race_judge import judge_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes, person_of
from racecraft.league.board import score_text, titles_of
from racecraft.league.race import SOLO, Race
from racecraft.league.records import fastest_laps
from racecraft.league.scoring import ranking_text
from racecraft.league.seasons import standings
from racecraft.league.site import board_csv
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League
from racecraft.league.world_part import league_world
from racecraft.web.errors import WebError

ACTS: Mapping[str, Callable[..., Any]] = {
    "close": close_race, "open": open_race, "reset": reset_race, "make link": show_on_screen,
    "end link": functools.partial(show_on_screen, end=True),
}  # fmt: skip
"""What an organiser does with a race by its page."""
OWN_ENTRIES = 20
"""Of one's own entries, the newest, that the page of a race lists."""
RECORDS = 3
"""The fastest laps of each track and type of race that are shown."""
NO_PLACE = 1e9
"""Stands for the place of who has no result that counts: they come last."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of races."""

    def csv_file(request: Request) -> Response:
        board = snapshot_at(console, request).board
        headers = {"Content-Disposition": f'attachment; filename="{board.race.id}.csv"'}
        return Response(board_csv(board), media_type="text/csv; charset=utf-8", headers=headers)

    return [
        *page_routes(console, "/races", races_page),
        Route("/races/{id}/board.csv", csv_file),
        *page_routes(console, "/races/{id}", race_page),
        *page_routes(console, "/races/{id}/enter", enter_page),
        act_route(console, "/races/practice", practise),
        act_route(console, "/races/{id}/enter", enter),
        act_route(console, "/races/{id}/act", act_on_race),
        act_route(console, "/races/{id}/withdraw", withdraw),
        *page_routes(console, "/seasons/{id}", season_page),
    ]


def races_page(console: Console, request: Request) -> Page:
    """Return all races, seasons and fastest laps."""
    league, now = open_league(console), time.time()
    races, seasons, records = [], [], []
    page = page_of("/races", request.query_params, league.races() if league else [], lambda one: (-one.created, one.id))
    if league is not None:
        for race in page.rows:
            board = snapshot_of(league, race).board
            first = next((row for row in board.rows[:1] if row.place == 1), None)
            races.append({
                "race": asdict(race), "is_open": race.is_open(now),
                "has_picture": parts_of(race.kind).has_picture(race.tracks[0]), "closes": race.closes,
                "racers": len(board.rows), "waiting": board.waiting, "leader": first.racer if first else "",
                "best": score_text(race, first.score) if first else "",
            })  # fmt: skip
        for season in league.seasons():
            found = standings(league, season, now)
            seasons.append({"season": asdict(season), "races": len(found.races), "is_over": found.is_over,
                            "leader": ", ".join(found.leaders),
                            "points": found.rows[0].points if found.rows else 0})  # fmt: skip
        records = [asdict(record) for record in fastest_laps(league, each=RECORDS)]
    data = {"races": races, "pages": page.links, "seasons": seasons, "records": records,
            "organises": organises(request)}  # fmt: skip
    return Page("races.html", "Races", data, here="/races")


def race_page(console: Console, request: Request) -> Page:
    """Return a race's board, its rules, and what one may do."""
    league, now = league_of(console), snapshot_at(console, request)
    race, board, person = now.race, now.board, person_of(request)
    judge = judge_of(league.path)
    mine = [entry for entry in now.entries.values() if entry.person == person.owned][::-1]
    own = {entry.racer for entry in mine}
    own = own if len(own) == 1 else set()  # the owner of the machine may have entered several people's cars
    score, gap = titles_of(race)
    token = league.screen_token(race) if organises(request) else ""
    page = page_of(
        f"/races/{race.id}", request.query_params, board.rows, lambda one: (one.place or NO_PLACE, one.racer)
    )
    shown, further = page.rows, [row for racer in own if (row := board.row_of(racer))]
    rows = [
        {
            **vars(row), "score_text": score_text(race, row.score), "is_own": row.racer in own,
            "gap_text": "" if row.gap is None or row.place == 1 else f"+{score_text(race, row.gap)}",
        }
        for row in (*shown, *(row for row in further if row not in shown))
    ]  # fmt: skip
    data = {
        "race": asdict(race),
        "rows": rows,
        "pages": page.links,
        "heads": (score, gap),
        "leader": next(
            (
                f"{row.racer} leads with {score_text(race, row.score)} {score}."
                for row in board.rows[:1]
                if row.place == 1
            ),
            "",
        ),
        "waiting": board.waiting,
        "own": next((row for row in rows if row["is_own"]), None),
        "is_open": race.is_open(time.time()),
        "rules": [*league_world(race.kind).describe(race.rules, race.tracks), f"ranked by {ranking_text(race)}"],
        "records": [asdict(one) for track in race.tracks for one in fastest_laps(league, track, RECORDS)],
        "organises": organises(request),
        "enters": may(person, Verb.ENTER),
        "judge_fault": judge.faults.get(race.id, ""),
        "is_solo": race.format == SOLO,
        "season": _season_title(league, race),
        "picture": race.tracks[0] if parts_of(race.kind).has_picture(race.tracks[0]) else "",
        "path": f"/races/{race.id}",
        "own_entries": [{"number": entry.number, "model": entry.model} for entry in mine[:OWN_ENTRIES]],
        "older_entries": max(0, len(mine) - OWN_ENTRIES),
        "screen": f"{str(request.base_url).rstrip('/')}{SCREEN}{race.id}/{token}" if token else "",
        "command": _commands(race, organises(request), shown_folder(request, league.path)),
    }
    return Page("race.html", race.title, data, here="/races")


def enter_page(console: Console, request: Request) -> Page:
    """Return the form of an entry; a process warms up for it meanwhile."""
    league = league_of(console)
    race = race_of(league, request.path_params["id"])
    judge_of(league.path).expect(race.kind)
    return _entry_page(console, request, league, race, "", {})


def enter(console: Console, request: Request, fields: Fields) -> Page | str:
    """Enter a model, and have it judged."""
    league = league_of(console)
    return _entered(console, request, fields, league, race_of(league, request.path_params["id"]))


def practise(console: Console, request: Request, fields: Fields) -> Page | str:
    """Enter a model into the practice race of its track, which is made where there is none."""
    row = console.index.row(console.workspace.model(one(fields, "model")).name)
    kind, track = str(row["kind"]), one(fields, "track") or str(row["picture"])
    making, league = parts_of(kind).race_making(), open_league(console)
    if making is None or not track:
        raise WebError(404, "no_practice", f"{row['name']} drives on no track that has races; begin at /races.")
    practice = (
        [race for race in league.races() if race.is_practice and (race.kind, race.tracks) == (kind, (track,))]
        if league
        else []
    )
    if not practice:
        title = parts_of(kind).note({"track": track}).place or track
        made: Any = making.action(f"Practice on {title}", track=[track], practice=True, league=console.league)
        practice = [made.race]
    return _entered(console, request, fields, league_of(console), practice[0])


def _entered(console: Console, request: Request, fields: Fields, league: League, race: Race) -> Page | str:
    """Enter the model of a form; return where the race is, or the form of an entry with what is wrong."""
    person = person_of(request)
    model, which = console.workspace.model(one(fields, "model")), one(fields, "which", "best")
    runs, racer = model.runs(), person.name if person.owned else one(fields, "racer", user_name()).strip()
    try:
        if which not in ("best", "last") or not runs:
            raise CommandError("{model} has no such checkpoint; expected best or last.", model=model.name)
        run_command(
            ["league", "enter", race.id, f"{runs[-1].resolve()}:{which}", "--racer", racer, "--model-name", model.name,
             "--person", person.owned, "--league", str(league.path.resolve())],
            console.workspace.path,
        )  # fmt: skip
    except CommandError as error:
        return _entry_page(console, request, league, race, str(error), fields)
    if race.format == SOLO:
        judge_of(league.path).judge(race.id)
    return f"/races/{race.id}"


def act_on_race(console: Console, request: Request, fields: Fields) -> str:
    """Judge, close, open or reset a race; the log keeps who did."""
    league = league_of(console)
    race, act = race_of(league, request.path_params["id"]), one(fields, "act")
    if act == "judge":
        judge_of(league.path).judge(race.id)
    elif act in ACTS:
        ACTS[act](race.id, league=league.path)
    else:
        raise WebError(400, "no_such_act", f"expected judge, {', '.join(ACTS)}.")
    log_act(console, request, f"{act} race", race.id)
    return f"/races/{race.id}"


def withdraw(console: Console, request: Request, fields: Fields) -> str:
    """Take an entry back: one's own, or as an organiser another person's."""
    league, person = league_of(console), person_of(request)
    race, number = race_of(league, request.path_params["id"]), one(fields, "entry")
    entry = league.entries(race.id).get(int(number)) if number.isascii() and number.isdigit() else None
    if entry is None:
        raise WebError(404, "no_such_entry", "this race has no such entry; load the page again.")
    if not may(person, Verb.ENTER, entry.person):
        raise WebError(403, "not_allowed", "this entry is another person's; only they and organisers withdraw it.")
    league.withdraw(race.id, entry.number)
    if entry.person != person.owned:
        log_act(console, request, "withdraw entry", race.id, entry=entry.number, racer=entry.racer)
    return f"/races/{race.id}"


def season_page(console: Console, request: Request) -> Page:
    """Return the points of a season."""
    league = league_of(console)
    found = standings(league, league.season(request.path_params["id"]), time.time())
    data = {
        "season": asdict(found.season),
        "races": [asdict(race) for race in found.races],
        "rows": [asdict(row) for row in found.rows],
        "leaders": found.leaders,
        "is_over": found.is_over,
        "command": f"racecraft league standings {found.season.id}",
    }
    return Page("season.html", found.season.title, data, here="/races")


def _entry_page(
    console: Console, request: Request, league: League, race: Race, wrong: str, fields: Fields | dict[str, Any]
) -> Page:
    query = sql.select(MODELS).where(MODELS.c.status == READY, MODELS.c.kind == race.kind).order_by(MODELS.c.name)
    person = person_of(request)
    data = {
        "race": asdict(race),
        "models": [row["name"] for row in console.index.query(query)],
        "rules": league_world(race.kind).describe(race.rules, race.tracks),
        "wrong": wrong,
        "model": one(fields, "model", request.query_params.get("model", "")),
        "racer": one(fields, "racer", "" if person.owned else person.name),
        "names_itself": not person.owned,
        "waiting": snapshot_of(league, race).board.waiting,
        "path": f"/races/{race.id}",
        "command": f"racecraft league enter {race.id} MODEL --racer NAME",
    }
    return Page("race_enter.html", f"Enter {race.title}", data, here="/races", status=422 if wrong else 200)


def _commands(race: Race, for_organisers: bool, league: str) -> str:
    """Return the commands that do what the page shows, one a line."""
    verbs = ["board", "edit", "copy", "judge", "open" if race.is_closed else "close", "screen", "reset", "audit"]
    rest = {"board": f" --league {league}", "copy": ' "NEW TITLE"', "edit": " --closes +2h"}
    return "\n".join(
        f"racecraft league {verb} {race.id}{rest.get(verb, '')}" for verb in (verbs if for_organisers else verbs[:1])
    )


def _season_title(league: League, race: Race) -> str:
    return next((season.title for season in league.seasons() if season.id == race.season), "")


SECTION = Section(routes=routes, label="Races", href="/races", icon="flag", order=20)
