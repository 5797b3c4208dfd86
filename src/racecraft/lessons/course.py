"""Every lesson that is installed, in the order of the paths. Begin with `course`.

Lessons about one world stand in that world's package: `WorldKind.lessons` names a package with `TEXTS` (a folder of
texts), `CHECKS` (functions by name), and perhaps `MODULES` (ES modules by kind of figure) and `ROUTES`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources.abc import Traversable
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import kinds
from racecraft.contract.message import Message
from racecraft.lessons import own
from racecraft.lessons.checking import Check
from racecraft.lessons.lesson import Exercise, Lesson
from racecraft.lessons.reading import read_lesson

PATHS: Mapping[str, tuple[Message, Message]] = {
    "car": (
        Message("From nothing to a race"),
        Message("Ninety minutes alone: a car that learns, a grid world, rewards, exploring, a step by hand, a race."),
    ),
    "snake": (
        Message("A snake that learns"),
        Message("From the board and ten lines of code to a snake that plays the official arena."),
    ),
    "unity": (
        Message("A Unity scene"),
        Message("A scene solved by hand, then by an agent, and back into Unity."),
    ),
}
"""Title and sentence of each path, in the order of the page."""


@dataclass(frozen=True)
class Course:
    """The lessons, their checks and the figures' modules."""

    lessons: tuple[Lesson, ...]
    checks: Mapping[str, Check]
    modules: Mapping[str, str]
    """ES module by kind of figure."""
    styles: tuple[str, ...] = ()
    routes: tuple[Any, ...] = ()
    """Routes that figures of worlds ask, below /lessons/."""

    def of_path(self, path: str) -> list[Lesson]:
        """Return a path's lessons, in order."""
        return [lesson for lesson in self.lessons if lesson.path == path]

    def find(self, id: str) -> Lesson:
        """Return a lesson.

        Raises:
            SettingError: There is none of this name.
        """
        names = [lesson.id for lesson in self.lessons]
        if id not in names:
            hint = f"Did you mean {near}?" if (near := nearest(id, names)) else "/lessons lists them."
            raise SettingError(
                "{id}: no such lesson; expected {names}. {hint}", id=id[:40], names=", ".join(names), hint=hint
            )
        return self.lessons[names.index(id)]

    def exercise(self, lesson: str, id: str) -> Exercise:
        """Return an exercise.

        Raises:
            SettingError: There is no such lesson or exercise.
        """
        found = next((one for one in self.find(lesson).exercises if one.id == id), None)
        if found is None:
            raise SettingError("{lesson}: no exercise {id}.", lesson=lesson, id=id[:40])
        return found

    def neighbours(self, lesson: Lesson) -> tuple[Lesson | None, Lesson | None]:
        """Return the lessons before and behind one, in its path."""
        path = self.of_path(lesson.path)
        at = path.index(lesson)
        return (path[at - 1] if at else None), (path[at + 1] if at + 1 < len(path) else None)


@cache
def course() -> Course:
    """Return every lesson that is installed."""
    parts = [own, *(piece for kind in kinds() if (piece := kind.piece("lessons")) is not None)]
    lessons = [read_lesson(file.read_text("utf-8"), file.name) for part in parts for file in texts(part.TEXTS)]
    order = {path: number for number, path in enumerate(PATHS)}
    lessons.sort(key=lambda one: (order[one.path], int(one.number.lstrip("SU"))))
    return Course(
        tuple(lessons),
        {name: check for part in parts for name, check in part.CHECKS.items()},
        {kind: module for part in parts for kind, module in part.MODULES.items()},
        tuple(style for part in parts for style in getattr(part, "STYLES", ())),
        tuple(route for part in parts for route in getattr(part, "ROUTES", ())),
    )


def texts(folder: Traversable) -> Sequence[Traversable]:
    """Return the texts of a folder, by name."""
    return sorted((one for one in folder.iterdir() if one.name.endswith(".md")), key=lambda one: one.name)
