"""Pages of the course and answers to exercises. Begin with `lesson_routes`.

The console and `racecraft lessons` share the routes; each hands in the frame that its pages stand in.

    /lessons                     the paths, with what is done
    /lessons/LESSON              a lesson;  ?slides=1 for the projector
    /lessons/LESSON/EXERCISE     POST: an answer as JSON, back comes what the check says
    /lessons/words               every word of the course
    /lessons/sheet/PATH          the teacher's sheet
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import msgspec
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.contract.errors import UserInputError
from racecraft.contract.message import translate
from racecraft.lessons.checking import Answer, Verdict
from racecraft.lessons.course import PATHS, Course, course
from racecraft.lessons.lesson import PREDICTION, Exercise, Lesson
from racecraft.lessons.progress import Progress
from racecraft.pages.render import render
from racecraft.training.glossary import WORDS, words_of
from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.application import make_application
from racecraft.web.errors import WebError

TEMPLATES = "racecraft.lessons"
STYLES = ("racecraft.lessons/lessons.css",)


class Frame(Protocol):
    """Puts a page into its frame: side bar, what the machine does."""

    def __call__(self, request: Request, template: str, title: str, **data: Any) -> Response:
        """Return the page."""


@dataclass(frozen=True)
class Lessons:
    """What the routes answer with."""

    frame: Frame
    progress: Progress = field(default_factory=Progress)
    course: Callable[[], Course] = course
    models: Callable[[], Mapping[str, Path]] = dict
    """Run folders of what the reader has trained, by name."""


def make_lessons(
    access: Access = ONLY_HERE,
    progress: Progress | None = None,
    models: Callable[[], Mapping[str, Path]] = dict,
) -> Starlette:
    """Return the application of the course by itself.

    Args:
        access: Who may ask.
        progress: Where it is kept what a pupil did; None: the account's data folder.
        models: Run folders of what the reader has trained, by name.
    """
    home, lessons = (
        Route("/", lambda request: RedirectResponse("/lessons")),
        Lessons(_own_frame, progress or Progress(), models=models),
    )
    # The first page shall not wait for texts, templates and modules: read them once before anybody asks.
    render(
        f"{TEMPLATES}/lesson.html", title="", menu=(), machine="", **_lesson_data(lessons, lessons.course().lessons[0])
    )
    return make_application([home, *lesson_routes(lessons)], access)


def lesson_routes(lessons: Lessons) -> list[BaseRoute]:
    """Return the routes of the course."""

    def overview(request: Request) -> Response:
        paths = [
            {
                "id": path, "title": str(title), "about": str(about),
                "lessons": [_row(lessons, one) for one in lessons.course().of_path(path)],
            }
            for path, (title, about) in PATHS.items()
            if lessons.course().of_path(path)
        ]  # fmt: skip
        return lessons.frame(request, f"{TEMPLATES}/course.html", translate("Lessons"), paths=paths)

    def page(request: Request) -> Response:
        return _lesson_page(lessons, request)

    async def check(request: Request) -> Response:
        given = await _given(request)
        names = request.path_params["lesson"], request.path_params["exercise"]
        return json_answer(await run_in_threadpool(checked, lessons, *names, given))

    async def begin_anew(request: Request) -> Response:
        lessons.progress.clear(request.path_params["lesson"])
        return json_answer({})

    def words(request: Request) -> Response:
        return lessons.frame(request, f"{TEMPLATES}/words.html", translate("Words"), words=WORDS)

    def sheet(request: Request) -> Response:
        path = request.path_params["path"]
        if path not in PATHS:
            raise WebError(404, "not_found", f"There is no path {path[:40]}; begin at /lessons.")
        own = lessons.course().of_path(path)
        return lessons.frame(request, f"{TEMPLATES}/sheet.html", str(PATHS[path][0]), lessons=own, path=path)

    return [
        Route("/lessons", overview),
        Route("/lessons/words", words),
        Route("/lessons/sheet/{path}", sheet),
        Route("/lessons/{lesson}", page),
        Route("/lessons/{lesson}", begin_anew, methods=["DELETE"]),
        Route("/lessons/{lesson}/{exercise}", check, methods=["POST"]),
    ]


def checked(lessons: Lessons, lesson: str, id: str, given: dict[str, Any]) -> dict[str, Any]:
    """Run the check of an exercise and keep what it said; return what the page shows.

    Raises:
        SettingError: There is no such exercise.
    """
    exercise = lessons.course().exercise(lesson, id)
    if exercise.kind == PREDICTION:
        locked = lessons.progress.of(lesson).get(id, {}).get("prediction", {})
        given = {**given, **locked}
    try:
        answer = Answer(exercise, given, lessons.models())
        answer.require()
        verdict = lessons.course().checks[exercise.check](answer)
    except UserInputError as error:
        return {"state": "unusable", "text": str(error)}
    prediction = None
    if exercise.kind == PREDICTION:
        prediction = {one.name: given[one.name] for one in exercise.fields if not one.later and one.name in given}
    tries = lessons.progress.add(lesson, id, verdict, prediction)
    return verdict_fields(exercise, verdict, tries)


def verdict_fields(exercise: Exercise, verdict: Verdict, tries: int) -> dict[str, Any]:
    """Return what a page shows of a verdict."""
    text = exercise.cases.get(verdict.case, "") if verdict.case else exercise.why
    values = {name: _written(value) for name, value in verdict.values.items()}
    shows_answer = tries >= 2 and verdict.state == "tried"
    return {
        "state": verdict.state,
        "case": verdict.case,
        "text": text.format(**values),
        "table": [exercise.heads.format(**values).split(" | "), verdict.rows] if verdict.rows else None,
        "worked": exercise.worked if shows_answer else "",
        "tries": tries,
    }


def _lesson_page(lessons: Lessons, request: Request) -> Response:
    lesson = lessons.course().find(request.path_params["lesson"])
    template = f"{TEMPLATES}/{'slides' if 'slides' in request.query_params else 'lesson'}.html"
    return lessons.frame(request, template, f"{lesson.number}. {lesson.title}", **_lesson_data(lessons, lesson))


def _lesson_data(lessons: Lessons, lesson: Lesson) -> dict[str, Any]:
    found = lessons.course()
    before, behind = found.neighbours(lesson)
    return {
        "lesson": lesson, "before": before, "behind": behind, "done": lessons.progress.of(lesson.id),
        "words": words_of(lesson.words), "models": list(lessons.models()), "styles": STYLES,
        "modules": [f"{TEMPLATES}/lesson.js", *dict.fromkeys(found.modules[one.kind] for one in lesson.figures)],
    }  # fmt: skip


def _row(lessons: Lessons, lesson: Lesson) -> dict[str, Any]:
    count, done = len(lesson.exercises), lessons.progress.done(lesson.id)
    return {"lesson": lesson, "count": count, "done": min(done, count)}


def _own_frame(request: Request, template: str, title: str, **data: Any) -> Response:
    path = request.url.path
    menu = [
        {"label": translate("Lessons"), "href": "/lessons", "icon": "book", "here": path != "/lessons/words"},
        {"label": translate("Words"), "href": "/lessons/words", "icon": "board", "here": path == "/lessons/words"},
    ]
    return page_answer(request, template, **{"title": title, "menu": menu, "machine": "", "styles": STYLES} | data)


async def _given(request: Request) -> dict[str, Any]:
    try:
        value = msgspec.json.decode(await request.body())
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        raise WebError(
            400, "bad_json", "the body is not JSON; expected an answer by the names of its fields."
        ) from None
    if not isinstance(value, dict):
        raise WebError(400, "bad_json", f"the body is {type(value).__name__}; expected an object.")
    return value


def _written(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.4f}".rstrip("0").rstrip(".").replace("-", "−")
    return value
