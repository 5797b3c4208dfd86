"""Every lesson that is installed, in the order of the paths. Begin with `course`.

Lessons about one world stand in that world's package, which `WorldKind.lessons` names::

    CHECKS             modules; each public function of theirs that returns a verdict is the check of its name, and
                       `facts()` gives what their texts say of the material, by the names in braces
    texts/*.md         one a lesson
    modules/rc_*.js    one a kind of figure
    material/*.json    what was trained for the figures
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass, replace
from dataclasses import fields as dataclass_fields
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import kinds
from racecraft.contract.message import Message
from racecraft.lessons import own
from racecraft.lessons.checking import Check, material
from racecraft.lessons.lesson import Exercise, Figure, Lesson
from racecraft.lessons.reading import read_lesson

PATHS: Mapping[str, tuple[Message, Message]] = {
    "car": (
        Message("From nothing to a race"),
        Message("Ninety minutes alone: a car that learns, a grid world, rewards, exploring, a step by hand, a race."),
    ),
    "snake": (
        Message("Battlesnake"),
        Message("The rules of the board, a snake in ten lines of code, one that learns, and how good they are."),
    ),
    "unity": (
        Message("A Unity scene"),
        Message("A scene by hand, learned, with a configuration of its own, back in Unity and behind an address."),
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
    lessons = [lesson for part in parts for lesson in _lessons_of(part)]
    order = {path: number for number, path in enumerate(PATHS)}
    lessons.sort(key=lambda one: (order[one.path], int(one.number.lstrip("SU"))))
    figures = ((part, file.name) for part in parts for file in _files(part, "modules", ".js"))
    return Course(
        tuple(lessons),
        {name: check for part in parts for module in part.CHECKS for name, check in _checks(module)},
        {name[3:-3]: f"{part.__package__}/{name}" for part, name in figures if name.startswith("rc_")},
    )


def _checks(module: Any) -> Iterator[tuple[str, Check]]:
    for name, one in vars(module).items():
        is_own = getattr(one, "__module__", "") == module.__name__ and not name.startswith("_")
        if is_own and getattr(one, "__annotations__", {}).get("return") == "Verdict":
            yield name, one


def _lessons_of(part: Any) -> Iterator[Lesson]:
    """Yield a part's lessons with what was trained for them: in figures whose `material` names a file, and in texts."""
    facts = {name: str(value) for module in part.CHECKS
             for name, value in getattr(module, "facts", dict)().items()}  # fmt: skip
    for file in _files(part, "texts", ".md"):
        lesson = read_lesson(file.read_text("utf-8"), file.name)
        blocks = [
            replace(block, settings={**block.settings, "data": _recorded(part, wanted)})
            if isinstance(block, Figure) and (wanted := block.settings.get("material"))
            else _filled(block, facts)
            for block in lesson.blocks
        ]
        yield replace(lesson, blocks=tuple(blocks))


def _recorded(part: Any, wanted: str) -> dict[str, Any]:
    """Return a part's material: "FILE", or "FILE KEY…" where a figure needs no more."""
    name, *keys = wanted.split()
    found = material(part.__package__, name)
    return {key: found[key] for key in keys} if keys else found


def _filled(part: Any, facts: Mapping[str, str]) -> Any:
    """Return a part of a lesson with facts in place of their names in braces, however deep they stand."""
    if isinstance(part, str):
        for name, value in facts.items():
            part = part.replace(f"{{{name}}}", value)
    elif isinstance(part, Mapping):
        return {key: _filled(value, facts) for key, value in part.items()}
    elif isinstance(part, tuple):
        return tuple(_filled(one, facts) for one in part)
    elif is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{one.name: _filled(getattr(part, one.name), facts) for one in dataclass_fields(part)})
    return part


def _files(part: Any, folder: str, ending: str) -> list[Traversable]:
    """Return the files of a part's folder, by name."""
    found = (files(part.__package__) / folder).iterdir()
    return sorted((one for one in found if one.name.endswith(ending)), key=lambda one: one.name)
