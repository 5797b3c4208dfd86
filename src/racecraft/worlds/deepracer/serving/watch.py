"""What the live page of a car's run asks for beyond curves. Begin with `watch`.

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
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from racecraft.contract.world import Array
from racecraft.formats.live_ticks import request_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.watch_server import Answer, WatchSource
from racecraft.web.answers import picture_answer
from racecraft.web.errors import WebError
from racecraft.web.query import number, whole_number
from racecraft.worlds.deepracer.analysis.watching.onboard import OnboardCamera, objects_on, objects_on_page
from racecraft.worlds.deepracer.analysis.watching.playback import (
    episode_playback,
    iteration_playback,
    kept_iterations,
    live_playback,
    track_shape,
)
from racecraft.worlds.deepracer.players.run_courses import LaidCourse, cars_on, courses_of_run

PAGE = "racecraft.worlds.deepracer.pages/watch.html"


def watch(run: RunFolder) -> WatchSource:
    """Return the page of a run of cars, and what answers for each of its paths.

    Raises:
        TrackError: The circuit is gone.
    """
    views = CarViews(run)
    answers: dict[str, Answer] = {
        "camera.jpg": _picture(views, OnboardCamera.jpeg, "image/jpeg"),
        "policy.png": _picture(views, OnboardCamera.policy_png, "image/png"),
        "api/courses": lambda request: {"courses": views.courses()},
        "api/track": lambda request: views.shape(whole_number(request, "course", 0)),
        "api/live": lambda request: _live(run, whole_number(request, "after", 0)),
        "api/iterations": lambda request: {"iterations": kept_iterations(run)},
        "api/iteration": lambda request: iteration_playback(run, whole_number(request, "number")),
        "api/episode": lambda request: episode_playback(
            run, *(whole_number(request, name) for name in ("iteration", "world", "agent", "episode"))
        ),
    }
    return WatchSource(PAGE, answers, lambda: {"kept": kept_iterations(run)})


def _picture(views: CarViews, render: Callable[..., bytes], kind: str) -> Answer:
    """Return what answers with a view from the pose that a request gives."""

    def answer(request: Request) -> Response:
        pose = [number(request, name) for name in ("x", "y", "yaw")]
        with views.lock:
            camera = views.camera(whole_number(request, "course", 0))
            return picture_answer(render(camera, *pose, _places(request, len(camera.objects.kinds))), kind)

    return answer


def _live(run: RunFolder, after: int) -> dict[str, Any]:
    training = run.is_training()
    reel = live_playback(run, after) if training else None
    if training and reel is None:
        request_ticks(run)
    return {"training": training, "reel": reel}


class CarViews:
    """What a car's run has to look at beyond its curves, course by course; each is laid out when it is asked for.

    Whoever renders holds `lock`: requests are answered in several threads.
    """

    def __init__(self, run: RunFolder) -> None:
        job = run.read_job()
        self._job, self._courses = job, courses_of_run(run)
        self.lock = threading.Lock()
        self._cameras: dict[int, OnboardCamera] = {}
        several = len(self._courses) > 1
        self._cars = cars_on(self._courses, job["settings"]["rollout"]["num_worlds"]) if several else [None]

    def courses(self) -> list[dict[str, Any]]:
        """Return each course: its name, its worlds (None: all there are), boxes and bots as a page draws them."""
        courses, first = [], 0
        for course, worlds in zip(self._courses, self._cars, strict=True):
            objects = objects_on_page(objects_on(course))
            courses.append({"label": course.label, "first": first, "worlds": worlds, "objects": objects})
            first += worlds or 0
        return courses

    def shape(self, number: int) -> dict[str, Any]:
        """Return the circuit of a course as a page draws it."""
        return track_shape(self.course(number).track)

    def camera(self, number: int) -> OnboardCamera:
        """Return what renders the views on a course."""
        if number not in self._cameras:
            self._cameras[number] = OnboardCamera(self.course(number), self._job)
        return self._cameras[number]

    def course(self, number: int) -> LaidCourse:
        """Return a course, or raise an `WebError` (no_such_course)."""
        if number >= len(self._courses):
            raise WebError(
                404, "no_such_course", f"there is no course {number}; expected 0 to {len(self._courses) - 1}."
            )
        return self._courses[number]


def _places(request: Request, count: int) -> Array | None:
    """Return where the objects of a course stand, (K, 3), or raise an `WebError` (bad_objects); None: nobody says."""
    text = request.query_params.get("objects", "")
    if not text:
        return None
    try:
        places = np.array([[float(word) for word in part.split(",")] for part in text.split(";")])
    except ValueError:
        places = np.zeros(0)
    if places.shape != (count, 3) or not (np.abs(places) < 1e6).all():
        raise WebError(400, "bad_objects", f"objects is {text[:40]!r}; expected x,y,yaw of {count}, a ; between two.")
    return places
