"""What a lesson is made of, as plain data. `reading.py` makes it from a text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from markupsafe import Markup

TASK, PREDICTION = "task", "prediction"
ExerciseKind = Literal["task", "prediction"]


@dataclass(frozen=True)
class Prose:
    """Paragraphs, headings, lists and tables, as HTML."""

    html: Markup


@dataclass(frozen=True)
class Figure:
    """A figure that computes in the browser: the element `<rc-KIND>`."""

    kind: str
    name: str
    """By which exercises take values from it; by default its kind."""
    settings: Mapping[str, Any]
    label: str = ""
    """What it shows, for people who do not see it."""


@dataclass(frozen=True)
class Field:
    """What an exercise asks for."""

    name: str
    kind: Literal["number", "choice", "code", "take", "model"]
    """A model is one that the reader has trained, by name."""
    label: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    """Of a choice: text by value."""
    low: float = 0.0
    high: float = 1.0
    """Range of a number; what lies outside is refused."""
    code: str = ""
    """What a pupil's code begins with."""
    figure: str = ""
    """Name of the figure whose value is taken."""
    later: bool = False
    """Whether it is asked once the run was seen, as the reason behind a prediction."""


@dataclass(frozen=True, kw_only=True)
class Exercise:
    """Something a pupil does, whose result a check reads."""

    id: str
    number: str
    """As a reader counts: "2.3"."""
    kind: ExerciseKind = "task"
    check: str
    """Name in the table of checks."""
    arguments: Mapping[str, float | str] = field(default_factory=dict)
    """What the check is given besides the answer."""
    ask: str
    fields: tuple[Field, ...]
    hint: str = ""
    worked: str = ""
    """The answer worked out; shown behind the second try."""
    why: str = ""
    """What a pupil reads who passed."""
    heads: str = ""
    """Of the table that shows the run, parted by " | "."""
    cases: Mapping[str, str] = field(default_factory=dict)
    """Feedback by case: what happened, why, what to try."""


@dataclass(frozen=True)
class Recall:
    """A question from two lessons before."""

    ask: str
    answer: str


@dataclass(frozen=True)
class Slide:
    """A section of the projector's page; the prose and figures that follow belong to it."""

    title: str


@dataclass(frozen=True)
class TeacherNote:
    """What a teacher reads: question to ask, misconception to wait for, what may be cut."""

    html: Markup


Block = Prose | Figure | Exercise | Recall | Slide | TeacherNote


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """One lesson."""

    id: str
    number: str
    """Within its path: "1" to "13", "S1", "U1"."""
    title: str
    goal: str
    minutes: int
    path: str
    """A key of `course.PATHS`."""
    sources: str = ""
    words: tuple[str, ...] = ()
    """Words of the glossary that it introduces."""
    needs: str = ""
    """What it needs beyond racecraft, a sentence; "": nothing."""
    blocks: tuple[Block, ...]

    @property
    def exercises(self) -> list[Exercise]:
        """Its exercises, in order."""
        return [block for block in self.blocks if isinstance(block, Exercise)]

    @property
    def figures(self) -> list[Figure]:
        """Its figures, in order."""
        return [block for block in self.blocks if isinstance(block, Figure)]
