"""Every lesson that is installed, in the order of the paths. Begin with `course`.

Lessons about one world stand in that world's package: `WorldKind.lessons` names a package with `TEXTS` (a folder of
texts), `CHECKS` (functions by name), `MODULES` (ES modules by kind of figure) and perhaps `MATERIAL` (a
folder of JSON files).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources.abc import Traversable
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import kinds
from racecraft.contract.message import Message
from racecraft.lessons import own
from racecraft.lessons.checking import Check
from racecraft.lessons.lesson import Exercise, Figure, Lesson
from racecraft.lessons.reading import read_lesson

PATHS: Mapping[str, tuple[Message, Message]] = {
    "car": (
        Message("From nothing to a race"),
        Message("Ninety minutes alone: a car that learns, a grid world, rewards, exploring, a step by hand, a race."),
    ),
    "snake": (
        Message("Battlesnake"),
        Message("The rules of the board by playing and losing, then a snake in ten lines of code."),
    ),
    "unity": (
        Message("A Unity scene"),
        Message("A scene by hand, as its agent has it, and the two numbers that decide which way it goes."),
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
    lessons = [_with_material(read_lesson(file.read_text("utf-8"), file.name), part)
               for part in parts for file in texts(part.TEXTS)]  # fmt: skip
    order = {path: number for number, path in enumerate(PATHS)}
    lessons.sort(key=lambda one: (order[one.path], int(one.number.lstrip("SU"))))
    return Course(
        tuple(lessons),
        {name: check for part in parts for name, check in part.CHECKS.items()},
        {kind: module for part in parts for kind, module in part.MODULES.items()},
    )


def _with_material(lesson: Lesson, part: Any) -> Lesson:
    """Return a lesson whose figures hold what was trained for them: their setting `material` names a JSON file."""
    blocks = [
        replace(block, settings={**block.settings, "data": json.loads((part.MATERIAL / name).read_text("utf-8"))})
        if isinstance(block, Figure) and (name := block.settings.get("material"))
        else block
        for block in lesson.blocks
    ]
    return replace(lesson, blocks=tuple(blocks))


def texts(folder: Traversable) -> Sequence[Traversable]:
    """Return the texts of a folder, by name."""
    return sorted((one for one in folder.iterdir() if one.name.endswith(".md")), key=lambda one: one.name)
