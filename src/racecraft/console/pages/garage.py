"""The first page of an empty workspace, and the garage: all models, what runs, and what can be done with some."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import urlencode

import psutil
import sqlalchemy as sql
from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.console.index_tables import MODELS
from racecraft.console.model_row import ERROR, GONE, QUEUED, READY, STOPPING, TRAINING
from racecraft.console.paging import Key, ListPage, list_address, one_page
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes
from racecraft.console.training import begin_training
from racecraft.console.workspace import Note
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds

START = {"after": "", "before": ""}
CHIPS = (
    ("All", ()),
    ("Training", (TRAINING, STOPPING)),
    ("Queued", (QUEUED,)),
    ("Ready", (READY,)),
    ("Error", (ERROR,)),
)
NEVER = 1e300
"""Stands for a best result or a distance that is not there: such rows come last."""
SORTS: Mapping[str, Any] = {
    "changed": -MODELS.c.changed, "name": MODELS.c.name, "track": MODELS.c.place, "status": MODELS.c.status,
    "best": sql.func.coalesce(MODELS.c.rank, NEVER), "gap": sql.func.coalesce(MODELS.c.gap_percent, NEVER),
    "trained": -MODELS.c.seconds,
}  # fmt: skip
"""What the list is sorted by, smaller first; names decide between equals."""
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
    page = _page_of(console, statement, sort, query)
    running = console.index.query(sql.select(MODELS).where(MODELS.c.status.in_((TRAINING, STOPPING))).limit(4))
    return Page(
        "garage.html",
        "Garage",
        {
            "rows": page.rows,
            "running": running,
            "query": query.get("q", ""),
            "chosen": chosen,
            "chips": [
                {
                    "label": label,
                    "count": sum(counts.values()) if not of else sum(counts.get(one, 0) for one in of),
                    "href": list_address("/models", query, status=label.lower() if of else "", **START),
                    "here": chosen == (label.lower() if of else ""),
                }
                for label, of in CHIPS
            ],
            "sort": sort,
            "sorts": {name: list_address("/models", query, sort=name, **START) for name in SORTS},
            "found": found,
            "pages": page.links,
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
    """Make a model with a world's defaults and train it, as long as its first training lasts."""
    parts = parts_of(one(fields, "kind"))
    if not parts.lesson:
        raise SettingError("{title} offers no first training; expected a world that does.", title=parts.kind.title)
    values = {**parts.defaults(), **parts.first}
    model = console.workspace.create(console.workspace.free(FIRST), parts.files(values), parts.note(values))
    begin_training(console.home, model, parts.words(values))
    console.watcher.refresh()
    return f"/models/{model.name}"


def act_on_some(console: Console, request: Request, fields: Fields) -> str:
    """Compare, archive, tag or delete the models that were selected."""
    names, what = fields.get("m", []), one(fields, "act")
    if what == "compare":
        return "/compare?" + urlencode([("m", name) for name in names])  # a link to keep: without the form's token
    if what == "delete":
        names = _forget_gone(console, names)
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


def _forget_gone(console: Console, names: Sequence[str]) -> list[str]:
    """Take models off the list whose folders are gone; return the others."""
    is_gone = {
        name: console.workspace.find(name) is None and console.index.row(name)["status"] == GONE for name in names
    }
    for name in (name for name in names if is_gone[name]):
        console.index.forget(name)
    return [name for name in names if not is_gone[name]]


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


def _page_of(console: Console, statement: sql.Select[Any], sort: str, query: Mapping[str, str]) -> ListPage[Any]:
    """Return a page of the rows of a statement."""
    value = SORTS[sort]

    def rows_beyond(at: Key | None, is_back: bool, most: int) -> list[dict[str, Any]]:
        found = statement
        if at is not None:
            beyond = value < at[0] if is_back else value > at[0]
            names = MODELS.c.name < at[1] if is_back else MODELS.c.name > at[1]
            found = found.where(sql.or_(beyond, sql.and_(value == at[0], names)))
        keys = [value.desc(), MODELS.c.name.desc()] if is_back else [value, MODELS.c.name]
        return console.index.query(found.add_columns(value.label("sorted_by")).order_by(*keys).limit(most))

    kind = str if sort in ("name", "track", "status") else float
    return one_page("/models", query, rows_beyond, lambda row: (row["sorted_by"], row["name"]), kind)


SECTION = Section(routes=routes, label="Garage", href="/", icon="car", order=0)
