"""The fields in which a model is made: plain values, checked here, drawn by the page. Begin with `Step`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import SettingError, nearest


@dataclass(frozen=True, kw_only=True)
class Field:
    """One value that can be chosen."""

    name: str
    label: str
    default: Any
    kind: str = "number"
    """number, whole, choice, switch, line, text or code."""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[tuple[str, str], ...] = ()
    """(value, what people read) of a choice."""
    sentence: str = ""
    """What it does, and what one sees where it is too high or too low."""
    matters: bool = False
    """Whether it is shown first; the others are folded."""
    names: tuple[tuple[str, str], ...] = ()
    """What other files call it: ("JSON", "lr"), ("--set", "ppo.learning_rate"), ("DR_", …)."""

    def read(self, typed: Any) -> Any:
        """Return the value of what was typed; numbers have a point or a comma.

        Raises:
            SettingError: It is none, or out of range.
        """
        if self.kind == "switch":
            return typed in (True, "on", "true", "1")
        text = str(typed).strip()
        if self.kind == "choice":
            known = [value for value, _ in self.choices]
            if text not in known:
                raise SettingError(
                    "{label}: found {text!r}; expected one of the list. {hint}",
                    label=self.label,
                    text=text[:60],
                    hint=nearest(text, known),
                )
            return text
        if self.kind in ("number", "whole"):
            return self._number(text)
        return str(typed)

    def _number(self, text: str) -> float | int:
        try:
            value = float(text.replace(",", "."))
        except ValueError:
            value = math.nan
        is_whole = self.kind != "whole" or value == math.floor(value) if math.isfinite(value) else False
        low, high = -math.inf if self.low is None else self.low, math.inf if self.high is None else self.high
        if not is_whole or not low <= value <= high:
            raise SettingError(
                "{label}: found {text!r}; expected {expected}.",
                label=self.label,
                text=text[:60],
                expected=self.expected,
            )
        return int(value) if self.kind == "whole" else value

    @property
    def expected(self) -> str:
        """What may be typed, in words."""
        what = "a whole number" if self.kind == "whole" else "a number"
        if self.low is not None and self.high is not None:
            return f"{what} from {self.low:g} to {self.high:g}"
        if self.low is not None:
            return f"{what} of at least {self.low:g}"
        return what


@dataclass(frozen=True, kw_only=True)
class Step:
    """One page of the form."""

    key: str
    """In the address: "track"."""
    title: str
    fields: tuple[Field, ...]
    lead: str = ""
    """A sentence that says what is chosen here."""
    template: str = ""
    """The world's own template for this step; "": the fields one below the other."""
    data: Mapping[str, Any] | None = None
    """What that template shows beside the fields."""
    modules: tuple[str, ...] = ()
    styles: tuple[str, ...] = ()
    """Modules and styles that the template needs."""


def read_fields(steps: Sequence[Step], typed: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the values of what was typed, and what is wrong with the others, both by field name.

    What names no field is left out.
    """
    values: dict[str, Any] = {}
    wrong: dict[str, str] = {}
    for field in (field for step in steps for field in step.fields if field.name in typed):
        try:
            values[field.name] = field.read(typed[field.name])
        except SettingError as error:
            wrong[field.name] = str(error)
    return values, wrong


def common_fields(algorithms: Sequence[tuple[str, str]], minutes: float = 5.0) -> tuple[Field, ...]:
    """Return the fields of a training in any world: algorithm (name and label, the default first), time, seed."""
    return (
        Field(
            name="algorithm", label="Algorithm", default=algorithms[0][0], kind="choice", choices=tuple(algorithms),
            names=(("--algorithm", algorithms[0][0]),),
        ),
        Field(
            name="minutes", label="End after", default=minutes, low=0.1, high=1440.0, unit="min",
            names=(("--stop", "minutes=10"),),
        ),
        Field(
            name="seed", label="Seed", default=1, kind="whole", low=0, high=2**31 - 1,
            sentence="Same seed, same machine, same training.", names=(("--seed", "1"),),
        ),
    )  # fmt: skip


def common_words(values: Mapping[str, Any]) -> list[str]:
    """Return the options of `common_fields`, as typed; and `--from` of a clone that begins with weights."""
    return [
        f"--algorithm={values['algorithm']}",
        f"--stop=minutes={values['minutes']:g}",
        f"--seed={values['seed']}",
        *([f"--from={values['from']}"] if values.get("from") else []),
    ]
