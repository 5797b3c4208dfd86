"""The first page of an empty workspace, and the garage: all models, what runs, and what can be done with some."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from urllib.parse import urlencode

import psutil
import sqlalchemy as sql
from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.console.index_tables import MODELS
from racecraft.console.model_row import ERROR, QUEUED, READY, STOPPING, TRAINING
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes
from racecraft.console.training import begin_training
from racecraft.console.workspace import Note
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds

PAGE = 50
"""Rows on one page of the list."""
CHIPS = (
    ("All", ()),
    ("Training", (TRAINING, STOPPING)),
    ("Queued", (QUEUED,)),
    ("Ready", (READY,)),
    ("Error", (ERROR,)),
)
SORTS: Mapping[str, Any] = {
    "changed": MODELS.c.changed.desc(), "name": MODELS.c.name, "track": MODELS.c.place, "status": MODELS.c.status,
    "best": MODELS.c.rank.is_(None), "gap": MODELS.c.gap_percent.is_(None), "trained": MODELS.c.seconds.desc(),
}  # fmt: skip
THEN = {"best": MODELS.c.rank, "gap": MODELS.c.gap_percent}
FIRST = "first-car"
DOORS = (
    ("Drive it myself", "Keyboard, gamepad or a phone. A car can learn from your laps.", "/drive"),
    ("Learn how it works", "Lessons whose figures compute and whose exercises run something.", "/lessons"),
)
"""Other ways to begin, where the side bar has them."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the garage."""
    return [
        *page_routes(console, "/", garage),
        *page_routes(console, "/models", garage),
        act_route(console, "/models/first", train_first),
        act_route(console, "/models/act", act_on_some),
    ]


def garage(console: Console, request: Request) -> Page:
    """Return the garage, or the first page where there is no model."""
    counts = console.counts()
    query = request.query_params
    if request.url.path == "/" and not sum(counts.values()) and not query:
        return first_page(console)
    chosen = query.get("status", "")
    statement = _filtered(query)
    found = console.index.query(sql.select(sql.func.count().label("n")).select_from(statement.subquery()))[0]["n"]
    sort = query.get("sort", "changed") if query.get("sort") in SORTS else "changed"
    first = int(query["from"]) if re.fullmatch(r"[0-9]{1,9}", query.get("from", "")) else 0
    ordered = statement.order_by(SORTS[sort], *([THEN[sort]] if sort in THEN else []), MODELS.c.name)
    rows = console.index.query(ordered.limit(PAGE).offset(first))
    running = console.index.query(sql.select(MODELS).where(MODELS.c.status.in_((TRAINING, STOPPING))).limit(4))
    return Page(
        "garage.html",
        "Garage",
        {
            "rows": rows,
            "running": running,
            "query": query.get("q", ""),
            "chosen": chosen,
            "chips": [
                {
                    "label": label,
                    "count": sum(counts.values()) if not of else sum(counts.get(one, 0) for one in of),
                    "href": _address(query, status=label.lower() if of else "", **{"from": ""}),
                    "here": chosen == (label.lower() if of else ""),
                }
                for label, of in CHIPS
            ],
            "sort": sort,
            "sorts": {name: _address(query, sort=name, **{"from": ""}) for name in SORTS},
            "found": found,
            "first": first,
            "before": _address(query, **{"from": str(max(0, first - PAGE))}) if first else "",
            "behind": _address(query, **{"from": str(first + PAGE)}) if first + PAGE < found else "",
            "archived": query.get("archived", ""),
            "tag": query.get("tag", ""),
            "deleted": query.get("deleted", ""),
            "empty": not sum(counts.values()),
        },
    )


def first_page(console: Console) -> Page:
    """Return the page of a workspace without a model."""
    offers = [
        {"kind": kind.name, "lesson": parts_of(kind.name).lesson} for kind in kinds() if parts_of(kind.name).lesson
    ]
    room = shutil.disk_usage(console.workspace.path).free
    return Page(
        "first.html",
        "Begin",
        {
            "offers": offers,
            "doors": [door for door in DOORS if door[2] in {one.href for one in console.entries}],
            "cores": psutil.cpu_count() or 1,
            "room_gb": room / 1e9,
            "folder": str(console.workspace.path),
        },
    )


def train_first(console: Console, request: Request, fields: Fields) -> str:
    """Make a model with every default of a world and train it."""
    parts = parts_of(one(fields, "kind"))
    if not parts.lesson:
        raise SettingError("{title} offers no first training; expected a world that does.", title=parts.kind.title)
    values = parts.defaults()
    model = console.workspace.create(console.workspace.free(FIRST), parts.files(values), parts.note(values))
    begin_training(console.home, model, parts.words(values))
    console.watcher.refresh()
    return f"/models/{model.name}"


def act_on_some(console: Console, request: Request, fields: Fields) -> str:
    """Archive, tag or delete the models that were selected."""
    names, what = fields.get("m", []), one(fields, "act")
    models = [console.workspace.model(name) for name in names]
    gone = []
    for model in models:
        note = model.note()
        if what == "archive":
            model.write_note(_with(note, archived=not note.archived))
        elif what == "tag":
            tag = one(fields, "tag").strip()[:32]
            tags = tuple(sorted({*note.tags, tag} - {""}))
            model.write_note(_with(note, tags=tags))
        elif what == "delete":
            row = console.index.row(model.name)
            if row["status"] in (TRAINING, STOPPING, QUEUED):
                raise SettingError(
                    "{name}: is {row}; expected a model that rests. Stop it first.", name=model.name, row=row["status"]
                )
            gone.append(console.workspace.delete(model))
    if what == "restore":
        for place in fields.get("place", []):
            console.workspace.restore(place)
    console.watcher.refresh()
    return "/?" + urlencode([("deleted", place) for place in gone]) if gone else "/"


def _with(note: Note, **changes: Any) -> Note:
    return replace(note, **changes)


def _filtered(query: Mapping[str, str]) -> sql.Select[Any]:
    """Return the rows that an address asks for."""
    statement = sql.select(MODELS).where(MODELS.c.archived.is_(query.get("archived") == "1"))
    of = {label.lower(): of for label, of in CHIPS}.get(query.get("status", ""), ())
    if of:
        statement = statement.where(MODELS.c.status.in_(of))
    for word in query.get("q", "").casefold().split():
        statement = statement.where(MODELS.c.search.contains(word, autoescape=True))
    if tag := query.get("tag", ""):
        statement = statement.where(MODELS.c.search.contains(f"#{tag.casefold()} ", autoescape=True))
    if place := query.get("track", ""):
        statement = statement.where(MODELS.c.place == place)
    return statement


def _address(query: Mapping[str, str], **changes: str) -> str:
    """Return the address of the list with some of its words changed; "" takes one out."""
    words = {name: value for name, value in {**query, **changes}.items() if value}
    return f"/models?{urlencode(words)}" if words else "/"


SECTION = Section(routes=routes, label="Garage", href="/", icon="car", order=0)
