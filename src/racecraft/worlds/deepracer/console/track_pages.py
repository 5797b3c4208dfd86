"""Tracks in the console: a gallery, a track's own page, and the maker of new ones. Begin with `SECTION`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sql
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.index_tables import MODELS
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, form_fields, form_with_file, one, page_routes
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.world import Array
from racecraft.web.answers import json_answer, picture_answer
from racecraft.worlds.deepracer.console.car_form import TEMPLATES
from racecraft.worlds.deepracer.console.circuits import circuits, own_circuits
from racecraft.worlds.deepracer.driving.drawn_bends import bend_remarks
from racecraft.worlds.deepracer.driving.known_laps import read_laps
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.drawings import Drawing, drawing_of, read_drawing
from racecraft.worlds.deepracer.tracks.floor_print import PAPERS_MM, print_floor, tape_of
from racecraft.worlds.deepracer.tracks.library import keep_track
from racecraft.worlds.deepracer.tracks.make import RoadPlan, make_track
from racecraft.worlds.deepracer.tracks.track import Track

HERE = "/tracks"
CAR = "v6"
DRAWN = "the drawing"
"""What messages call a line that was clicked."""
MAX_DRAWING_BYTES = 32 * 2**20
POINTS_SHOWN = 60
"""A line from a file is handed to the page with so many points, which a person can still move."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of tracks."""

    async def draft(request: Request) -> Response:
        fields = await form_fields(request)
        return json_answer(await run_in_threadpool(check_drawing, fields))

    async def read(request: Request) -> Response:
        async with form_with_file(request, "file") as (fields, file):
            if file is None:
                return json_answer({"wrong": "found no file; expected a drawing."})
            data = await file.read(MAX_DRAWING_BYTES)
            return json_answer(await run_in_threadpool(read_upload, str(file.filename), data, fields))

    def floor(request: Request) -> Response:
        return picture_answer(*printed(request))

    return [
        *page_routes(console, HERE, gallery_page),
        Route(f"{HERE}/new/check", draft, methods=["POST"]),
        Route(f"{HERE}/new/read", read, methods=["POST"]),
        act_route(console, f"{HERE}/new", save),
        *page_routes(console, f"{HERE}/new", maker_page),
        Route(f"{HERE}/{{track}}.pdf", floor),
        *page_routes(console, f"{HERE}/{{track}}", track_page),
    ]


def gallery_page(console: Console, request: Request) -> Page:
    """Return every circuit, one's own first."""
    return Page(f"{TEMPLATES}/tracks.html", "Tracks", {"circuits": [*own_circuits(), *circuits()]}, here=HERE)


def track_page(console: Console, request: Request) -> Page:
    """Return a track's facts, its best known laps, the models that drive on it, and what can be done there."""
    track = load_track(request.path_params["track"])
    laps = [
        (lap.car, f"{lap.top_speed_mps:g} m/s", lap.direction, f"{lap.lap_seconds:.2f} s", lap.how)
        for lap in read_laps()
        if lap.track == track.name
    ]
    tape = tape_of(track)
    x0, y0, x1, y1 = track.bounds
    is_here = sql.or_(MODELS.c.picture == track.name, MODELS.c.place == track.name)
    wanted = sql.select(MODELS).where(is_here, MODELS.c.archived.is_(False)).limit(50)
    return Page(
        f"{TEMPLATES}/track_page.html",
        track.title or track.name,
        {
            "name": track.name,
            "facts": [
                (f"{track.length:.2f}", "m a lap"),
                (f"{track.width_mean:.2f}", "m wide"),
                (f"{x1 - x0:.1f} × {y1 - y0:.1f}", "m of floor"),
                (track.direction, "direction"),
                (f"{tape.total_m:.0f}", "m of tape"),
            ],
            "laps": laps,
            "bends": [bend.text for bend in bend_remarks(track, PROFILES[CAR])],
            "models": console.index.query(wanted),
            "papers": list(PAPERS_MM),
            "command": f"racecraft tracks show {track.name}\nracecraft drive {track.name}\n"
            f"racecraft tracks print {track.name} --paper A4\nracecraft train --track {track.name}\n"
            f'racecraft league create "Practice on {track.title or track.name}" --track {track.name} --practice',
        },
        here=HERE,
    )


def printed(request: Request) -> tuple[bytes, str]:
    """Return a track's PDF."""
    track, paper = load_track(request.path_params["track"]), request.query_params.get("paper", "A4")
    with tempfile.TemporaryDirectory() as folder:
        return print_floor(track, Path(folder) / "floor.pdf", paper).file.read_bytes(), "application/pdf"


def maker_page(console: Console, request: Request) -> Page:
    """Return the page on which a track is drawn."""
    return Page(f"{TEMPLATES}/make_track.html", "Make a track", {"wrong": "", "values": _begin()}, here=HERE)


def check_drawing(fields: Fields) -> dict[str, Any]:
    """Return the road of what is drawn, or what is wrong with it."""
    try:
        points, track = _made(fields, DRAWN)
    except UserInputError as error:
        return {"wrong": str(error).removeprefix(f"{DRAWN}: ")}
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))  # a track lies around (0, 0)
    bends = [replace(bend, x=bend.x + middle[0], y=bend.y + middle[1]) for bend in bend_remarks(track, PROFILES[CAR])]
    return {
        "wrong": "",
        **{side: np.round(getattr(track, side) + middle, 3).tolist() for side in ("centre", "inner", "outer")},
        "length": round(track.length, 2),
        "tape": round(tape_of(track).total_m, 1),
        "remarks": [bend.text for bend in bends],
    }


def read_upload(name: str, data: bytes, fields: Fields) -> dict[str, Any]:
    """Return the line of a file as points in metres, few enough to be moved by hand."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"drawing{Path(name).suffix}"
            file.write_bytes(data)
            drawing = read_drawing(file)
    except UserInputError as error:
        return {"wrong": str(error)}
    line = np.concatenate([drawing.points, drawing.points[:1]]) if drawing.closed else drawing.points
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    length = arc[-1] if drawing.in_metres and not one(fields, "length") else _number(fields, "length", 12.0)
    stations = np.linspace(0.0, arc[-1], POINTS_SHOWN + 1)[: None if not drawing.closed else -1]
    points = np.column_stack([np.interp(stations, arc, line[:, k]) for k in (0, 1)]) * (length / arc[-1])
    points -= points.min(axis=0) - 0.6
    return {"wrong": "", "points": np.round(points, 2).tolist(), "closed": drawing.closed}


def save(console: Console, request: Request, fields: Fields) -> str | Page:
    """Keep a track in the user's library; what cannot be used is said on the page."""
    name = one(fields, "name").strip()
    try:
        keep_track(_made(fields, name)[1], DRAWN)
    except UserInputError as error:
        values = _begin() | {key: one(fields, key) for key in ("points", "width", "smooth", "name")}
        values |= {"closed": bool(one(fields, "closed"))}
        data = {"wrong": str(error).removeprefix(f"{DRAWN}: "), "values": values}
        return Page(f"{TEMPLATES}/make_track.html", "Make a track", data, here=HERE, status=422)
    return f"/drafts/new?kind=deepracer&track={name}" if one(fields, "go") == "train" else f"{HERE}/{name}"


def _begin() -> dict[str, Any]:
    """Return what the maker begins with: a loop on a floor of 6 by 4 m."""
    points = (
        "1.2, 0.8",
        "4.8, 0.8",
        "5.8, 1.6",
        "5.6, 2.8",
        "4.6, 3.4",
        "3.0, 2.9",
        "1.4, 3.4",
        "0.5, 2.7",
        "0.4, 1.5",
    )
    return {"points": "\n".join(points), "width": "0.6", "smooth": "0.2", "closed": True, "name": "garage"}


def _made(fields: Fields, name: str) -> tuple[Array, Track]:
    """Return the points of a form, (P, 2) m, and the track of that name."""
    rows = [line.split(",") for line in one(fields, "points").replace(";", "\n").splitlines() if line.strip()]
    try:
        points = np.array([[float(x), float(y)] for x, y in rows]).reshape(-1, 2)
    except ValueError:
        raise SettingError("points: found a line that is not x, y; expected two numbers in metres on each.") from None
    closed = bool(one(fields, "closed"))
    plan = RoadPlan(_number(fields, "width", 0.6), None, _number(fields, "smooth", 0.2), closed)
    drawing = drawing_of(Drawing(points, closed, in_metres=True), DRAWN)
    return drawing.points, make_track(drawing, plan, name, DRAWN)


def _number(fields: Mapping[str, list[str]], name: str, default: float) -> float:
    text = one(fields, name).strip().replace(",", ".")
    try:
        return float(text) if text else default
    except ValueError:
        raise SettingError("{name} is {text!r}; expected a number of metres.", name=name, text=text[:20]) from None


SECTION = Section(routes=routes, label="Tracks", href=HERE, icon="track", order=10)
