"""A run to watch in a browser, while it trains and after: one page and the JSON it is fed with.

    GET /                                                  the page (`analysis/watching/page.html`)
    GET /api/run                                           what is trained, and whether it still is
    GET /api/curves?after=12                               the figures of each iteration behind 12
    GET /api/track                                         a car's circuit
    GET /api/live?after=640                                the latest ticks behind tick 640; asking is watching
    GET /api/iterations                                    those whose ticks are kept
    GET /api/iteration?number=12                           its ticks, and its episodes
    GET /api/episode?iteration=12&world=0&agent=0&episode=3   one episode, whole
    GET /camera.jpg?x=1.2&y=0.3&yaw=0.1                    what a car sees there, for people
    GET /policy.png?x=1.2&y=0.3&yaw=0.1                    the same as the policy sees it

Everything comes from the run folder: the training is another process, and may be over. Only this machine is served.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

from racecraft.analysis.watching.facts import curves, run_facts
from racecraft.analysis.watching.page import watch_page
from racecraft.analysis.watching.reels import (
    episode_reel,
    iteration_reel,
    kept_iterations,
    live_reel,
    track_shape,
)
from racecraft.contract.errors import UserInputError
from racecraft.formats.live_ticks import say_watched
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.http_service import HttpError, HttpService, Reply, Request
from racecraft.serving.port import LOOPBACK
from racecraft.serving.service_thread import ServiceThread

FRESH = (("Cache-Control", "no-store"),)


class WatchServer:
    """Serves one run on this machine, in a thread of its own.

    Args:
        run: The run folder.

    Raises:
        TrackError: A car's circuit is gone.
    """

    def __init__(self, run: RunFolder) -> None:
        self._run, self._job = run, run.read_job()
        self._views = _CarViews(run, self._job) if self._job.get("kind") == "deepracer" else None
        self._page = watch_page(run.path.name).encode()
        self._thread = ServiceThread(HttpService(self._answer), "racecraft-watch")

    def start(self, port: int = 0) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return f"http://{LOOPBACK}:{self._thread.start(LOOPBACK, port)}/"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    async def _answer(self, request: Request) -> Reply:
        if request.method != "GET":
            raise HttpError(405, "wrong_method", "a run can only be watched: GET.")
        if request.path == "/":
            return Reply(self._page, "text/html; charset=utf-8", FRESH)
        if self._views is not None and request.path in self._views.pictures:
            render, kind = self._views.pictures[request.path]
            return Reply(render(*(_number(request, name) for name in ("x", "y", "yaw"))), kind, FRESH)
        told = self._about_any() | ({} if self._views is None else self._about_cars(self._views))
        if request.path not in told:
            raise HttpError(404, "no_such_page", f"there is no {request.path[:80]} for this run; begin at /.")
        try:
            value = told[request.path](request)
        except UserInputError as error:
            raise HttpError(404, "not_kept", str(error)) from error
        return Reply(json.dumps(value, separators=(",", ":"), allow_nan=False).encode(), headers=FRESH)

    def _about_any(self) -> dict[str, Callable[[Request], Any]]:
        run = self._run
        return {
            "/api/run": lambda request: run_facts(run, self._job),
            "/api/curves": lambda request: {"rows": curves(run, _whole(request, "after", 0))},
        }

    def _about_cars(self, views: _CarViews) -> dict[str, Callable[[Request], Any]]:
        run = self._run
        return {
            "/api/track": lambda request: views.shape,
            "/api/live": self._live,
            "/api/iterations": lambda request: {"iterations": kept_iterations(run)},
            "/api/iteration": lambda request: iteration_reel(run, _whole(request, "number")),
            "/api/episode": lambda request: episode_reel(
                run, *(_whole(request, name) for name in ("iteration", "world", "agent", "episode"))
            ),
        }

    def _live(self, request: Request) -> dict[str, Any]:
        say_watched(self._run)
        training = self._run.is_training()
        reel = live_reel(self._run, _whole(request, "after", 0)) if training else None
        return {"training": training, "reel": reel}


class _CarViews:
    """What a car's run has to look at beyond its curves."""

    def __init__(self, run: RunFolder, job: dict[str, Any]) -> None:
        from racecraft.analysis.watching.onboard import OnboardCamera
        from racecraft.players.deepracer.run_track import track_of_run

        track = track_of_run(run)
        self.shape = track_shape(track)
        camera = OnboardCamera(track.reversed() if job["settings"]["race"].get("reverse") else track, job)
        self.pictures = {"/camera.jpg": (camera.jpeg, "image/jpeg"), "/policy.png": (camera.policy_png, "image/png")}


def _whole(request: Request, name: str, usual: int | None = None) -> int:
    """Return a whole number of the address, or raise an `HttpError` (bad_number)."""
    text = request.query.get(name, "" if usual is None else str(usual))
    if not text.isascii() or not text.isdigit() or len(text) > 15:
        raise HttpError(400, "bad_number", f"{name} is {text[:40]!r}; expected a whole number, 0 or more.")
    return int(text)


def _number(request: Request, name: str) -> float:
    """Return a finite number of the address, or raise an `HttpError` (bad_number)."""
    text = request.query.get(name, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e6:
        raise HttpError(400, "bad_number", f"{name} is {text[:40]!r}; expected a number.")
    return value
