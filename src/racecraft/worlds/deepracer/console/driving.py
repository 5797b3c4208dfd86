"""Driving by hand in the console: choose a track, drive, and let a car learn from the laps. Begin with `SECTION`."""

from __future__ import annotations

import shlex
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sqlalchemy as sql
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket

from racecraft.console.index_tables import MODELS
from racecraft.console.pages.model import address
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, page_routes
from racecraft.console.training import begin_training
from racecraft.console.workspace import DRIVEN
from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.console.car_form import TEMPLATES
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLaps
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.library import own_names

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.serving.hand_driving import DrivenTrack, DriveTracks

HERE = "/drive"
LAPS = "laps.safetensors"
"""Their copy in the folder of a model that learns from them."""
MAX_GHOSTS = 20
"""Models on the list of ghosts, the fastest first."""
FIRST = ("reinvent_base", "Oval_track", "Bowtie_track", "2022_april_open", "2022_reinvent_champ", "Spain_track")
"""Tracks that the page offers first."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of driving."""

    @cache
    def tracks() -> DriveTracks:
        from racecraft.worlds.deepracer.serving.hand_driving import DriveTracks  # brings PyTorch along: a second

        return DriveTracks(lambda name, reverse: driven_track(console, name))

    async def wheel(socket: WebSocket) -> None:
        await (await run_in_threadpool(tracks)).answer(socket, socket.path_params["track"], reverse=False)

    return [
        *page_routes(console, HERE, choose_page),
        act_route(console, f"{HERE}/{{track}}/teach", teach),
        WebSocketRoute(f"{HERE}/{{track}}/wheel", wheel),
        *page_routes(console, f"{HERE}/{{track}}", drive_page),
    ]


def choose_page(console: Console, request: Request) -> Page:
    """Return the tracks to drive on: one's own, those with laps, and some that are good to begin with."""
    driven = sorted(path.stem for path in (console.workspace.path / DRIVEN).glob("*.safetensors"))
    names = list(dict.fromkeys([*own_names(), *driven, *FIRST]))
    return Page(
        f"{TEMPLATES}/choose_drive.html",
        "Drive",
        {"tracks": [_card(console, name) for name in names]},
        here=HERE,
    )


def drive_page(console: Console, request: Request) -> Page:
    """Return the page on which a track is driven."""
    name = request.path_params["track"]
    track = load_track(name)
    return Page(
        f"{TEMPLATES}/drive.html",
        f"Drive {track.title or track.name}",
        {
            "track": track.name,
            "wheel": f"{HERE}/{track.name}/wheel",
            "laps": len(_laps(console, track.name).laps),
            "runs": list(_runs(console, track.name)),
        },
        here=HERE,
    )


def teach(console: Console, request: Request, fields: Fields) -> str:
    """Make a car of the default kind, lay the laps into its folder, and train it from a clone of them."""
    track = load_track(request.path_params["track"])
    laps = _laps(console, track.name)
    if not laps.laps:
        raise SettingError("{track}: no lap was driven yet; expected one at least.", track=track.name)
    parts = parts_of("deepracer")
    values = parts.defaults() | {"track": track.name, "from": LAPS}
    model = console.workspace.create(
        console.workspace.free(f"taught-{track.name}"[:60]), parts.files(values), parts.note(values)
    )
    shutil.copyfile(laps.path, model.path / LAPS)
    begin_training(console.home, model, parts.words(values))
    console.watcher.refresh()
    return address(model.name)


def driven_track(console: Console, name: str) -> DrivenTrack:
    """Return a track and the laps that the workspace keeps of it.

    Raises:
        UserInputError: There is no such track, or its laps cannot be read.
    """
    from racecraft.worlds.deepracer.serving.hand_driving import DrivenTrack

    track = load_track(name)
    laps = _laps(console, track.name)
    command = shlex.join(["racecraft", "train", f"--track={track.name}", f"--from={laps.path}"])
    return DrivenTrack(None, track.name, False, laps, command, lambda: _runs(console, track.name))


def _runs(console: Console, track: str) -> dict[str, Path]:
    """Return the newest runs of the models that lap this track, by the model's name, the fastest first."""
    lapping = sql.select(MODELS.c.name, MODELS.c.run).where(MODELS.c.picture == track, MODELS.c.rank.is_not(None))
    rows = console.index.query(lapping.order_by(MODELS.c.rank).limit(MAX_GHOSTS))
    return {row["name"]: Path(row["run"]) for row in rows}


def _laps(console: Console, track: str) -> DrivenLaps:
    return DrivenLaps(_file(console, track), track)


def _file(console: Console, track: str) -> Path:
    return console.workspace.path / DRIVEN / f"{track}.safetensors"


def _card(console: Console, name: str) -> dict[str, Any]:
    track = load_track(name)
    return {
        "name": track.name,
        "title": track.title or track.name,
        "length": track.length,
        "has_laps": _file(console, track.name).is_file(),
    }


SECTION = Section(routes=routes, label="Drive", href=HERE, icon="wheel", order=40)
