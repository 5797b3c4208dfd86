"""What a pupil answered, and what a check says of it. Begin with `Verdict`.

A check is a function of an `Answer` that runs something and reads its result. It names a case; the lesson's text holds
the words for it. No check reads the text of code, and none compares with one right string.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from racecraft.contract.errors import UserInputError
from racecraft.lessons.lesson import Exercise

State = Literal["passed", "seen", "run", "tried"]
"""passed: done. seen: a prediction whose run was seen. run: the run is shown, its reason is still asked. tried: not
yet."""


@dataclass(frozen=True)
class Verdict:
    """What a check found."""

    state: State
    case: str = ""
    """Which feedback the text holds for it; "": why it passed."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Numbers of the run, for the feedback's {names}."""
    rows: Sequence[Sequence[Any]] = ()
    """What the run showed; the exercise's text has the heads."""


class AnswerError(UserInputError):
    """An answer lacks something, or holds what cannot be read; it counts as no try."""


class Answer:
    """What a pupil gave, by the names of the exercise's fields.

    Args:
        exercise: What was asked.
        given: As it came, from JSON.
        models: Run folders of what the pupil has trained, by name.
    """

    def __init__(
        self, exercise: Exercise, given: Mapping[str, Any], models: Mapping[str, Path] = MappingProxyType({})
    ) -> None:
        self.exercise, self._given, self._models = exercise, given, models
        self.arguments = exercise.arguments
        self._fields = {one.name: one for one in exercise.fields}

    def require(self) -> None:
        """Read every field that is asked before the run.

        Raises:
            AnswerError: One is missing or cannot be read.
        """
        for one in self.exercise.fields:
            if not one.later:
                getattr(self, "taken" if one.kind == "take" else one.kind)(one.name)

    def has(self, name: str) -> bool:
        """Tell whether a field was filled in."""
        return self._given.get(name) not in (None, "", [])

    def number(self, name: str) -> float:
        """Return a number within the field's range.

        Raises:
            AnswerError: It is missing, no number, or outside.
        """
        value, field = self._given.get(name), self._fields[name]
        try:
            found = float(str(value).replace(",", ".").replace("−", "-").strip())
        except ValueError:
            found = math.nan
        if not field.low <= found <= field.high:
            raise AnswerError(
                "{label}: found {value!r}; expected a number from {low:g} to {high:g}.",
                label=field.label, value=value, low=field.low, high=field.high,
            )  # fmt: skip
        return found

    def choice(self, name: str) -> str:
        """Return the value of a chosen option.

        Raises:
            AnswerError: None was chosen.
        """
        value, field = self._given.get(name), self._fields[name]
        if value not in field.options:
            raise AnswerError("{label}: nothing is chosen; choose one.", label=field.label)
        return str(value)

    def code(self, name: str) -> str:
        """Return a pupil's code.

        Raises:
            AnswerError: There is none, or more than 20,000 characters.
        """
        value = self._given.get(name)
        if not isinstance(value, str) or not value.strip() or len(value) > 20_000:
            raise AnswerError("{label}: no code; write it into the field.", label=self._fields[name].label)
        return value

    def model(self, name: str) -> Path:
        """Return the run folder of a chosen model.

        Raises:
            AnswerError: None was chosen, or there is none of this name.
        """
        if not self._models:
            raise AnswerError(
                "There is no trained model in this folder yet; train one in the console, or by racecraft train."
            )
        run = self._models.get(str(self._given.get(name)))
        if run is None:
            raise AnswerError("{label}: nothing is chosen; choose one.", label=self._fields[name].label)
        return run

    def two_models(self, one: str, other: str) -> dict[str, Path]:
        """Return the run folders of two models by the fields that they were chosen in.

        Raises:
            AnswerError: One was not chosen, or both are the same.
        """
        found = {name: self.model(name) for name in (one, other)}
        if found[one] == found[other]:
            raise AnswerError("That is the same model twice; choose two.")
        return found

    def taken(self, name: str) -> Any:
        """Return what a figure gave.

        Raises:
            AnswerError: Nothing was done in the figure.
        """
        if not self.has(name):
            raise AnswerError("Nothing has happened in the figure yet; use it, then check.")
        return self._given[name]


Check = Callable[[Answer], Verdict]


@cache
def material(package: str, name: str) -> dict[str, Any]:
    """Return what was trained for a package's lessons: a JSON file of its folder `material`."""
    found: dict[str, Any] = json.loads((files(package) / "material" / name).read_text("utf-8"))
    return found


def passed(**values: Any) -> Verdict:
    """Return that the exercise is done."""
    return Verdict("passed", values=values)


def tried(case: str, **values: Any) -> Verdict:
    """Return that it is not done yet, and which feedback says what to try."""
    return Verdict("tried", case, values)


Numbers = float | Sequence[float]


def compared(
    given: Numbers,
    right: Numbers,
    near: float,
    wrong: Mapping[str, Numbers],
    otherwise: str = "other",
    /,
    names: Sequence[str] = (),
    **values: Any,
) -> Verdict:
    """Return the verdict of a number, or of several together.

    Args:
        given: By the pupil.
        right: As it was computed.
        near: How far from a number counts as that number.
        wrong: What misconceptions give, by case.
        otherwise: Case of anything else.
        names: Of the numbers in the feedback: as they were given or, to a pupil who passed, as they were computed.
        values: For the feedback besides.
    """

    def numbers(one: Numbers) -> Sequence[float]:
        return one if isinstance(one, Sequence) else [one]

    def is_given(other: Numbers) -> bool:
        return all(abs(one - two) <= near for one, two in zip(numbers(given), numbers(other), strict=True))

    if is_given(right):
        return passed(**values, **dict(zip(names, numbers(right), strict=False)))
    case = next((case for case, one in wrong.items() if is_given(one)), otherwise)
    return tried(case, **values, **dict(zip(names, numbers(given), strict=False)))


def predicted(answer: Answer, reason: str, right: str, rows: Sequence[Sequence[Any]] = (), **values: Any) -> Verdict:
    """Return the verdict of a prediction whose run is done: a wrong prediction counts as well, once its reason is told.

    Args:
        answer: Holds the reason, once the run was shown.
        reason: Name of the field.
        right: The reason that the run shows.
        rows: What the run showed.
        values: Numbers of the run.
    """
    if not answer.has(reason):
        return Verdict("run", "run", values, rows)
    chosen = answer.choice(reason)
    if chosen == right:
        return Verdict("seen", values=values, rows=rows)
    return Verdict("run", chosen, values, rows)
