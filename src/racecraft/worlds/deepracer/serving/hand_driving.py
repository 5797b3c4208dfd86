"""Driving by hand over a WebSocket: physics here, 15 ticks a second; pictures in the browser. Begin with `DriveTracks`.

A page sends, as JSON:  {"steer": -1…1 left positive, "gas": 0…1, "n": number of the input}
                        {"go": true}   {"pause": true}   {"restart": true}   {"drop": 0}
                        {"ghost": "best" | "known" | a run's name}
and is sent:            {"track": …}   {"laps": […], "command": "…"}   {"ghost": … or null}
                        {"at": [x, y, yaw, speed, steering, progress, lap seconds], "n": …, "ended": "…"}
                        {"message": "…"}

`n` is the newest input that the tick obeyed, so that a page can tell how long an input takes to its picture.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocket, WebSocketDisconnect

from racecraft.contract.errors import UserInputError
from racecraft.pages.plain_json import plain_json
from racecraft.worlds.deepracer.analysis.ghosts import run_ghost
from racecraft.worlds.deepracer.analysis.watching.playback import track_shape
from racecraft.worlds.deepracer.driving.by_hand import HandDrive, Moment
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLap, DrivenLaps
from racecraft.worlds.deepracer.driving.ghosts import Ghost, own_ghost, planned_ghost
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.training.driven_world import world_by_hand

MAX_DRIVERS = 40
"""A class drives side by side; more would slow the ticks of all."""
MAX_BEHIND_SECONDS = 0.25
"""A server that was kept from ticking for so long goes on from now instead of hurrying after the clock."""
BEST, KNOWN = "best", "known"
"""Ghosts that every page can ask for."""


@dataclass(frozen=True)
class DrivenTrack:
    """A track that people drive on, and the file that keeps their laps."""

    folder: Path | None
    """The racer's folder; None: the default car that races."""
    track: str
    reverse: bool
    laps: DrivenLaps
    teach_command: str
    """What trains a car with these laps, as it is typed."""
    runs: Callable[[], Mapping[str, Path]] = dict
    """Runs of this track that can be driven against, by the names that a page shows."""

    def world(self) -> RaceWorld:
        """Return a car of one's own on the track."""
        return world_by_hand(self.folder, self.track, self.reverse)


class DriveTracks:
    """Everybody who drives: their tracks, and how many they are.

    Args:
        open_track: Returns a track of a name; raises a `UserInputError` where there is none.
    """

    def __init__(self, open_track: Callable[[str, bool], DrivenTrack]) -> None:
        self._open, self._tracks = open_track, dict[tuple[str, bool], DrivenTrack]()
        self._planned: dict[tuple[str, bool], Ghost | None] = {}
        self._drivers = 0

    def track(self, name: str, reverse: bool) -> DrivenTrack:
        """Return a track, opened once.

        Raises:
            UserInputError: There is none, or its laps cannot be read.
        """
        key = (name, reverse)
        if key not in self._tracks:
            self._tracks[key] = self._open(name, reverse)
        return self._tracks[key]

    def planned(self, driven: DrivenTrack) -> Ghost | None:
        """Return the planned lap of a track, planned once; takes seconds."""
        key = (driven.track, driven.reverse)
        if key not in self._planned:
            self._planned[key] = planned_ghost(driven.world())
        return self._planned[key]

    async def answer(self, socket: WebSocket, name: str, reverse: bool) -> None:
        """Let the page of a WebSocket drive until it goes."""
        await socket.accept()
        if self._drivers >= MAX_DRIVERS:
            await _send(socket, {"message": f"{MAX_DRIVERS} people drive here already; try again later."})
            await socket.close()
            return
        self._drivers += 1
        try:
            with contextlib.suppress(WebSocketDisconnect):
                driven = await run_in_threadpool(self.track, name, reverse)
                driver = await run_in_threadpool(_Driver, self, driven, socket)
                await driver.drive()
        except UserInputError as error:
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await _send(socket, {"message": str(error)})
                await socket.close()
        finally:
            self._drivers -= 1


class _Driver:
    """One page that drives one car."""

    def __init__(self, tracks: DriveTracks, driven: DrivenTrack, socket: WebSocket) -> None:
        self._tracks, self._driven, self._socket = tracks, driven, socket
        world = driven.world()
        self._track, self._shape = world.track, track_shape(world.track)
        self._drive = HandDrive(world)
        self._steer = self._gas = 0.0
        self._number = 0
        self._going = asyncio.Event()

    async def drive(self) -> None:
        """Tell the page what there is, then hear it and tick until it goes."""
        moment = await run_in_threadpool(self._drive.restart)
        await _send(self._socket, {"track": self._shape, "at": _numbers(moment)})
        await self._send_laps()
        await self._send_ghost(BEST)
        ticking = asyncio.create_task(self._tick())
        try:
            await self._receive()
        finally:
            ticking.cancel()
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
                await ticking

    async def _receive(self) -> None:
        while True:
            try:
                message = json.loads(await self._socket.receive_text())
            except (ValueError, KeyError):
                continue
            if isinstance(message, dict):
                await self._apply(message)

    async def _apply(self, message: Mapping[str, Any]) -> None:
        if {"steer", "gas"} <= message.keys():
            self._steer, self._gas = _number(message["steer"]), _number(message["gas"])
            self._number = int(_number(message.get("n", 0)))
        if message.get("go"):
            self._going.set()
        if message.get("pause"):
            self._going.clear()
        if message.get("restart"):
            self._going.clear()
            moment = await run_in_threadpool(self._drive.restart)
            await _send(self._socket, {"at": _numbers(moment), "n": self._number, "ended": "", "jump": True})
        if isinstance(message.get("drop"), int):
            with contextlib.suppress(UserInputError):  # a lap that another page dropped meanwhile
                await run_in_threadpool(self._driven.laps.drop, message["drop"])
            await self._send_laps()
        if isinstance(message.get("ghost"), str):
            await self._send_ghost(message["ghost"])

    async def _tick(self) -> None:
        """Drive a tick each 1/15 s while the page wants to."""
        due = time.monotonic()
        while True:
            if not self._going.is_set():
                await self._going.wait()
                due = time.monotonic()
            moment, lap = await run_in_threadpool(self._drive.tick, self._steer, self._gas)
            if moment.ended and lap is None:
                self._going.clear()
            await _send(
                self._socket,
                {"at": _numbers(moment), "n": self._number, "ended": moment.ended, "lap": lap and lap.seconds},
            )
            if lap is not None:
                await run_in_threadpool(self._driven.laps.add, lap)
                await self._send_laps()
            due = max(due + TICK_SECONDS, time.monotonic() - MAX_BEHIND_SECONDS)
            await asyncio.sleep(due - time.monotonic())

    async def _send_laps(self) -> None:
        laps = [_lap(lap) for lap in self._driven.laps.laps]
        await _send(self._socket, {"laps": laps, "command": self._driven.teach_command})

    async def _send_ghost(self, name: str) -> None:
        if name == KNOWN:
            await _send(self._socket, {"message": "Planning a lap to drive against …"})
            ghost = await run_in_threadpool(self._tracks.planned, self._driven)
            await _send(self._socket, {"message": "" if ghost else "No lap could be planned on this track."})
        elif name == BEST:
            ghost = own_ghost(self._driven.laps.best)
        else:
            try:
                ghost = await run_in_threadpool(self._of_run, name)
            except UserInputError as error:  # its folder vanished, or it laps no more
                ghost = None
                await _send(self._socket, {"message": str(error)})
        await _send(self._socket, {"ghost": None if ghost is None else ghost.as_dictionary()})

    def _of_run(self, name: str) -> Ghost | None:
        run = self._driven.runs().get(name)
        return None if run is None else run_ghost(run, self._track, name)


async def _send(socket: WebSocket, message: Mapping[str, Any]) -> None:
    await socket.send_text(plain_json(message))


def _numbers(moment: Moment) -> list[float]:
    exact = (moment.x, moment.y, moment.yaw, moment.speed, moment.steering, moment.progress, moment.lap_seconds)
    return [round(value, 4) for value in exact]


def _lap(lap: DrivenLap) -> dict[str, Any]:
    return {"seconds": lap.seconds, "flying": lap.is_flying, "driven": lap.driven}


def _number(value: Any) -> float:
    """Return a number of a message; what is none counts as 0."""
    return float(value) if isinstance(value, int | float) and abs(value) < 1e9 else 0.0
