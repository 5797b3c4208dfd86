"""A run to watch in a browser, while it trains and after: one page and the JSON it is fed with.

    GET /                                                  the page (`analysis/watching/page.html`)
    GET /api/run                                           what is trained, and whether it still is
    GET /api/curves?after=12                               the figures of each iteration behind 12
    GET /api/courses                                       where cars drive: which of them, and what is in their way
    GET /api/track?course=0                                the circuit of a course
    GET /api/live?after=640                                the latest ticks behind tick 640; where there are none yet,
                                                           the training is asked for some: ask again
    GET /api/iterations                                    those whose ticks are kept
    GET /api/iteration?number=12                           its ticks, and its episodes
    GET /api/episode?iteration=12&world=0&agent=0&episode=3   one episode, whole
    GET /camera.jpg?course=0&x=1.2&y=0.3&yaw=0.1           what a car sees there, for people; boxes and bots are where
                   &objects=1.5,0.3,0.1;2,0,0              it says so: x, y, yaw of each
    GET /policy.png?…                                      the same as the policy sees it

Everything comes from the run folder: the training is another process, and may be over. Only this machine is served.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.watching.facts import curves, run_facts
from racecraft.analysis.watching.page import watch_page
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.formats.live_ticks import wish_for_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.http_service import HttpError, HttpService, Reply, Request
from racecraft.serving.port import LOOPBACK
from racecraft.serving.service_thread import ServiceThread
from racecraft.worlds.deepracer.analysis.watching.reels import (
    episode_reel,
    iteration_reel,
    kept_iterations,
    live_reel,
    track_shape,
)

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.watching.onboard import OnboardCamera
    from racecraft.worlds.deepracer.players.run_courses import LaidCourse

FRESH = (("Cache-Control", "no-store"),)
PEOPLE, POLICY = "/camera.jpg", "/policy.png"
PICTURES = {PEOPLE: "image/jpeg", POLICY: "image/png"}


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
        if self._views is not None and request.path in PICTURES:
            x, y, yaw = (_number(request, name) for name in ("x", "y", "yaw"))
            camera = self._views.camera(_whole(request, "course", 0))
            places = _places(request, len(camera.objects.kinds))
            render = camera.jpeg if request.path == PEOPLE else camera.policy_png
            return Reply(render(x, y, yaw, places), PICTURES[request.path], FRESH)
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
            "/api/courses": lambda request: {"courses": views.courses()},
            "/api/track": lambda request: views.shape(_whole(request, "course", 0)),
            "/api/live": self._live,
            "/api/iterations": lambda request: {"iterations": kept_iterations(run)},
            "/api/iteration": lambda request: iteration_reel(run, _whole(request, "number")),
            "/api/episode": lambda request: episode_reel(
                run, *(_whole(request, name) for name in ("iteration", "world", "agent", "episode"))
            ),
        }

    def _live(self, request: Request) -> dict[str, Any]:
        training = self._run.is_training()
        reel = live_reel(self._run, _whole(request, "after", 0)) if training else None
        if training and reel is None:
            wish_for_ticks(self._run)
        return {"training": training, "reel": reel}


class _CarViews:
    """What a car's run has to look at beyond its curves, course by course; each is laid out when it is asked for."""

    def __init__(self, run: RunFolder, job: dict[str, Any]) -> None:
        from racecraft.worlds.deepracer.players.run_courses import cars_on, courses_of_run

        self._job, self._courses = job, courses_of_run(run)
        self._cameras: dict[int, OnboardCamera] = {}
        several = len(self._courses) > 1
        self._cars = cars_on(self._courses, job["settings"]["rollout"]["num_worlds"]) if several else [None]

    def courses(self) -> list[dict[str, Any]]:
        """Return each course: its name, its worlds (None: all there are), boxes and bots as a page draws them."""
        from racecraft.worlds.deepracer.analysis.watching.onboard import objects_on, objects_told

        told, first = [], 0
        for course, worlds in zip(self._courses, self._cars, strict=True):
            objects = objects_told(objects_on(course))
            told.append({"label": course.label, "first": first, "worlds": worlds, "objects": objects})
            first += worlds or 0
        return told

    def shape(self, number: int) -> dict[str, Any]:
        """Return the circuit of a course as a page draws it."""
        return track_shape(self._course(number).track)

    def camera(self, number: int) -> OnboardCamera:
        """Return what renders the views on a course."""
        from racecraft.worlds.deepracer.analysis.watching.onboard import OnboardCamera

        if number not in self._cameras:
            self._cameras[number] = OnboardCamera(self._course(number), self._job)
        return self._cameras[number]

    def _course(self, number: int) -> LaidCourse:
        """Return a course, or raise an `HttpError` (no_such_course)."""
        if number >= len(self._courses):
            raise HttpError(
                404, "no_such_course", f"there is no course {number}; expected 0 to {len(self._courses) - 1}."
            )
        return self._courses[number]


def _places(request: Request, count: int) -> Array | None:
    """Return where the objects of a course stand, (K, 3), or raise an `HttpError` (bad_objects); None: nobody says."""
    text = request.query.get("objects", "")
    if not text:
        return None
    try:
        places = np.array([[float(word) for word in part.split(",")] for part in text.split(";")])
    except ValueError:
        places = np.zeros(0)
    if places.shape != (count, 3) or not (np.abs(places) < 1e6).all():
        raise HttpError(400, "bad_objects", f"objects is {text[:40]!r}; expected x,y,yaw of {count}, a ; between two.")
    return places


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
