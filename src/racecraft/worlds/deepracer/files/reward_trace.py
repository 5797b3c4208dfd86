"""How a reward came about: every number that the racer's function assigned on the way. Begin with `RewardTrace`.

The function runs unchanged, under the interpreter's own tracing, which tells of every line before it is run; what a
line changed is seen at the next one.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from types import FrameType
from typing import Any

from racecraft.worlds.deepracer.files.reward_examples import Params
from racecraft.worlds.deepracer.files.reward_file import RewardFunction
from racecraft.worlds.deepracer.files.reward_flow import Call, Step, flow_of
from racecraft.worlds.deepracer.files.reward_source import RewardSource


@dataclass(frozen=True, order=True)
class Term:
    """A line that gave a variable a number."""

    line: int
    """Of the racer's file, counted from 1."""
    name: str
    """Of the variable."""


@dataclass(frozen=True)
class Traced:
    """How a reward came about; its size grows with the file, not with how often a line ran."""

    terms: Mapping[Term, float]
    """What each line gave each variable last, the latest at the end."""
    by_line: Mapping[int, float]
    """What each line paid of the reward; see `reward_flow.py`."""
    built_up: frozenset[str]
    """The variables that several lines built up."""

    @property
    def values(self) -> dict[str, float]:
        """The last number of each variable."""
        return {term.name: value for term, value in self.terms.items()}

    def as_list(self) -> list[Any]:
        """Return it as JSON takes it."""
        terms = [[term.line, term.name, value] for term, value in self.terms.items()]
        return [terms, list(self.by_line.items()), sorted(self.built_up)]

    @classmethod
    def of(cls, told: Sequence[Any]) -> Traced:
        """Return what `as_list` returned elsewhere."""
        terms, by_line, built_up = told
        return cls(
            {Term(int(line), str(name)): float(value) for line, name, value in terms},
            {int(line): float(paid) for line, paid in by_line}, frozenset(map(str, built_up)),
        )  # fmt: skip


class RewardTrace:
    """A reward function that also tells how it came to its last answer.

    Args:
        reward: The racer's, loaded.
    """

    def __init__(self, reward: RewardFunction) -> None:
        self.reward = reward
        self.steps: list[Step] = []
        """Of the last call, in the order in which they ran."""
        self.lines: set[int] = set()
        """Which lines the last call ran."""
        self.calls: list[Call] = []
        """Of functions of the file, in the order in which they began; the first is the reward function itself."""
        self.open: list[_Lines] = []
        """Calls that have not returned."""

    @property
    def traced(self) -> Traced:
        """How the last answer came about."""
        latest: dict[Term, float] = {}
        for line, name, _, value, _ in reversed(self.steps):
            latest.setdefault(Term(line, name), value)
        parts = flow_of(self.reward.source.text).follow(self.steps, self.calls)
        return Traced(dict(reversed(latest.items())), dict(parts.by_line), frozenset(parts.built_up))

    def call(self, params: Params) -> float:
        """Return the reward of one tick, as `RewardFunction.call` does.

        Raises:
            RewardError: The function failed.
        """
        self.steps, self.lines, self.calls, self.open = [], set(), [], []
        before = sys.gettrace()
        sys.settrace(self._tracer())
        try:
            return self.reward.call(params)
        finally:
            sys.settrace(before)

    def _tracer(self) -> Any:
        """Return the function that the interpreter tells of every frame; it looks into those of one file."""
        path = str(self.reward.path)

        def enter(frame: FrameType, event: str, arg: Any) -> Any:
            is_theirs = frame.f_code.co_filename == path and not frame.f_code.co_name.startswith("<")
            return _Lines(frame, self).see if is_theirs else None

        return enter


def line_of(source: RewardSource, term: Term) -> str:
    """Return the line of a term as it is written, without the space around it."""
    lines = source.text.splitlines()
    return lines[term.line - 1].strip() if term.line <= len(lines) else ""


class _Lines:
    """Sees one frame's lines and keeps what each of them changed."""

    def __init__(self, frame: FrameType, trace: RewardTrace) -> None:
        self._trace, self._line, self._number = trace, frame.f_lineno, len(trace.calls)
        self._before = _numbers(frame.f_locals)
        parent = trace.open[-1] if trace.open else None
        place = (-1, 0) if parent is None else (parent._number, parent._line)
        trace.calls.append(Call(*place, frame.f_code.co_name, 0, None, 0))
        trace.open.append(self)

    def see(self, frame: FrameType, event: str, arg: Any) -> Any:
        """Keep what the line before this one changed, and what the function returns."""
        if event not in ("line", "return"):
            return self.see
        trace, now = self._trace, _numbers(frame.f_locals)
        for name, value in now.items():
            if (before := self._before.get(name)) != value:
                trace.steps.append((self._line, name, before, value, self._number))
        self._before, self._line = now, frame.f_lineno
        if event == "line":
            trace.lines.add(frame.f_lineno)
        else:
            returned = _number(arg) if isinstance(arg, Real) else None
            trace.calls[self._number] = trace.calls[self._number]._replace(
                last_line=frame.f_lineno, value=returned, steps=len(trace.steps)
            )
            trace.open.remove(self)
        return self.see


def _numbers(names: Mapping[str, Any]) -> dict[str, float]:
    """Return the variables that hold numbers, and the fields of `self` that do."""
    fields = getattr(names.get("self"), "__dict__", {})
    named = [*names.items(), *((f"self.{name}", value) for name, value in fields.items())]
    found = {name: _number(value) for name, value in named if isinstance(value, Real)}
    return {name: value for name, value in found.items() if value is not None}


def _number(value: Real) -> float | None:
    """Return a number as a float; None where it is too large for one, or a class of the racer's own fails."""
    try:
        return float(value)
    except Exception:
        return None
