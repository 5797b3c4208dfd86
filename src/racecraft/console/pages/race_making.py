"""Forms of a new race, of its copy, of what changes in it, and of a season; each says its command."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.actions.league.managing import copy_race, edit_race
from racecraft.actions.league.seasons import create_season
from racecraft.console.action_form import ActionForm
from racecraft.console.pages.race_parts import league_of, log_act, open_league, race_of
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.kinds import kinds

SHOW_COMMAND = "command"
"""What the button says that makes nothing and shows the command."""
EMPTY: Mapping[str, Any] = {}
CLEARED: Mapping[str, Any] = {"opens": "", "closes": "", "season": "", "submissions": 0}
"""What an edited field means that was emptied."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the forms."""
    return [
        *page_routes(console, "/races/new", new_page),
        act_route(console, "/races/new", make),
        *page_routes(console, "/races/{id}/copy", copy_page),
        act_route(console, "/races/{id}/copy", copy),
        *page_routes(console, "/races/{id}/edit", edit_page),
        act_route(console, "/races/{id}/edit", edit),
        *page_routes(console, "/seasons/new", season_page),
        act_route(console, "/seasons/new", make_season),
    ]


def new_page(console: Console, request: Request) -> Page:
    """Return the form of a race."""
    return _page(_new(console, request.query_params.get("kind", _race_kinds()[0])))


def make(console: Console, request: Request, fields: Fields) -> Page | str:
    """Make a race; what cannot be is said on the form."""

    def made(done: Any) -> str:
        log_act(console, request, "make race", done.race.id)
        return f"/races/{done.race.id}"

    return _answer(_new(console, one(fields, "kind")), fields, made)


def copy_page(console: Console, request: Request) -> Page:
    """Return the form of a race with the same tracks and rules."""
    return _page(_copy(console, request))


def copy(console: Console, request: Request, fields: Fields) -> Page | str:
    """Make a race with the same tracks and rules, open and without entries."""

    def made(done: Any) -> str:
        log_act(console, request, "copy race", done.race.id, of=request.path_params["id"])
        return f"/races/{done.race.id}"

    return _answer(_copy(console, request), fields, made)


def edit_page(console: Console, request: Request) -> Page:
    """Return the form of what may change in a race."""
    return _page(_edit(console, request))


def edit(console: Console, request: Request, fields: Fields) -> Page | str:
    """Change a race; a field that was emptied means none."""

    def changed(done: Any) -> str:
        log_act(console, request, "edit race", done.race.id)
        return f"/races/{done.race.id}"

    return _answer(_edit(console, request), fields, changed)


def season_page(console: Console, request: Request) -> Page:
    """Return the form of a season."""
    return _page(_season(console))


def make_season(console: Console, request: Request, fields: Fields) -> Page | str:
    """Make a season; races join it by their own forms."""

    def made(done: Any) -> str:
        log_act(console, request, "make season", done.season.id)
        return f"/seasons/{done.season.id}"

    return _answer(_season(console), fields, made)


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """A form, and what its page says around it."""

    form: ActionForm
    title: str
    about: str
    path: str
    done: str
    """Of the button."""
    back: str = "/races"
    back_title: str = "All races"
    known: Mapping[str, Any]
    """What the action is told beside the form's values."""
    words: tuple[str, ...] = ()
    """Behind the command's name."""
    wanted: Callable[[Mapping[str, Any]], Mapping[str, Any]] = dict
    """Returns what the action is told of the values that were read."""
    kind: str = ""
    """Of the world, where it can be chosen."""


def _answer(asked: _Asked, fields: Fields, done: Callable[[Any], str]) -> Page | str:
    """Do what a form asks, or show its command; what cannot be is said on the form."""
    values, wrong = asked.form.read(fields)
    if wrong:
        return _page(asked, fields, wrong)
    wanted = asked.wanted(values)
    if one(fields, "go") == SHOW_COMMAND:
        return _page(asked, fields, command=asked.form.command(wanted, *asked.words))
    try:
        return done(asked.form.do(wanted, **asked.known))
    except UserInputError as error:
        return _page(asked, fields, message=str(error))


def _page(
    asked: _Asked, fields: Fields = EMPTY, wrong: Mapping[str, str] = EMPTY, message: str = "", command: str = ""
) -> Page:
    data = {
        "panels": asked.form.panels(fields, wrong), "message": message, "command": command, "about": asked.about,
        "path": asked.path, "done": asked.done, "back": asked.back, "back_title": asked.back_title,
        "kind": asked.kind,
        "kinds": [(name, parts_of(name).kind.title) for name in _race_kinds()] if asked.kind else [],
    }  # fmt: skip
    return Page("race_form.html", asked.title, data, here="/races", status=422 if wrong or message else 200)


def _race_kinds() -> list[str]:
    """Return the worlds that have races, those in which a beginner trains first."""
    found = [kind.name for kind in kinds() if parts_of(kind.name).race_making() is not None]
    return sorted(found, key=lambda name: not parts_of(name).lesson)


def _new(console: Console, kind: str) -> _Asked:
    making = parts_of(kind).race_making() if kind in _race_kinds() else None
    if making is None:
        raise SettingError("the world {kind!r} has no races; expected one of {kinds}.", kind=kind[:40],
                           kinds=", ".join(_race_kinds()))  # fmt: skip
    choices = {**making.choices, "season": _seasons(console), "qualifier": _qualifiers(console)}
    return _Asked(
        form=ActionForm(making.action, making.command, making.first, choices), title="New race", about="",
        path="/races/new", done="Create", known={"league": console.league}, kind=kind,
    )  # fmt: skip


def _copy(console: Console, request: Request) -> _Asked:
    race = race_of(league_of(console), request.path_params["id"])
    return _Asked(
        form=ActionForm(copy_race, "league copy", values={"title": f"{race.title} 2"}), title=f"Copy {race.title}",
        about="The same tracks and rules; open, and without entries.", path=f"/races/{race.id}/copy", done="Copy",
        back=f"/races/{race.id}", back_title=race.title, known={"league": console.league, "race": race.id},
        words=(race.id,),
    )  # fmt: skip


def _edit(console: Console, request: Request) -> _Asked:
    race = race_of(league_of(console), request.path_params["id"])
    shown = {
        "title": race.title, "opens": _moment(race.opens), "closes": _moment(race.closes),
        "submissions": str(race.max_submissions or ""), "season": race.season,
    }  # fmt: skip

    def changed(values: Mapping[str, Any]) -> Mapping[str, Any]:
        return {name: value for name, value in {**CLEARED, **values}.items() if str(value or "") != shown[name]}

    form = ActionForm(edit_race, "league edit", choices={"season": _seasons(console)}, values=shown)
    return _Asked(
        form=form, title=f"Change {race.title}", path=f"/races/{race.id}/edit", done="Change",
        about="Its tracks and rules stay, since results were driven by them; a copy can be another race.",
        back=f"/races/{race.id}", back_title=race.title, known={"league": console.league, "race": race.id},
        words=(race.id,), wanted=changed,
    )  # fmt: skip


def _season(console: Console) -> _Asked:
    return _Asked(
        form=ActionForm(create_season, "league season"), title="New season", path="/seasons/new", done="Create",
        about="The places of a race give points; races join a season by their own forms.",
        known={"league": console.league},
    )  # fmt: skip


def _seasons(console: Console) -> list[tuple[str, str]]:
    league = open_league(console)
    return [(season.id, season.title) for season in league.seasons()] if league else []


def _qualifiers(console: Console) -> list[tuple[str, str]]:
    league = open_league(console)
    return [(race.id, race.title) for race in league.races() if not race.is_practice] if league else []


def _moment(seconds: float | None) -> str:
    """Return a moment as it is typed, in the machine's zone; "" where there is none."""
    return "" if seconds is None else datetime.datetime.fromtimestamp(seconds).isoformat(timespec="minutes")


SECTION = Section(routes=routes)
