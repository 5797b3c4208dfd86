"""How a reward came about: every number that the racer's function assigned on the way. Begin with `RewardTrace`.

The function runs unchanged, under the interpreter's own tracing, which tells of every line before it is run; what a
line changed is seen at the next one. Only what a line can change is looked at (`Flow.changed_in`).
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
from racecraft.worlds.deepracer.files.reward_flow import FIELDS, Call, Step, flow_of
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
        self.open: list[int] = [-1]
        """Calls that have not returned; -1: outside the file."""

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
        self.steps, self.lines, self.calls, self.open = [], set(), [], [-1]
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
            return _Watched(frame, self).see if is_theirs else None

        return enter


def line_of(source: RewardSource, term: Term) -> str:
    """Return the line of a term as it is written, without the space around it."""
    lines = source.text.splitlines()
    return lines[term.line - 1].strip() if term.line <= len(lines) else ""


class _Watched:
    """Sees one frame's lines, and keeps what each of them changed and what the function returns."""

    __slots__ = ("_call", "_changed", "_held", "_number", "_trace")  # and no circle, which would have to be collected

    def __init__(self, frame: FrameType, trace: RewardTrace) -> None:
        self._trace, self._number, parent = trace, len(trace.calls), trace.open[-1]
        line = trace.calls[parent].last_line if trace.calls else 0
        self._call = Call(parent, line, frame.f_code.co_name, frame.f_lineno)
        trace.calls.append(self._call)
        trace.open.append(self._number)
        self._changed = flow_of(trace.reward.source.text).changed_in(frame.f_code)
        self._held: dict[str, float | None] = {}
        if self._changed:
            names, values = _values(frame, self._changed[0])
            self._held = {name: _number(values.get(name)) for name in names}

    def see(self, frame: FrameType, event: str, arg: Any) -> Any:
        """Keep what the line before this one changed, and what the function returns."""
        if event not in ("line", "return"):
            return self.see
        call = self._call
        if names := self._changed.get(call.last_line):
            self._keep(*_values(frame, names))
        call.last_line = frame.f_lineno
        if event == "line":
            self._trace.lines.add(call.last_line)
        else:
            call.value, call.steps = _number(arg), len(self._trace.steps)
            self._trace.open.remove(self._number)
        return self.see

    def _keep(self, names: Sequence[str], values: Mapping[str, Any]) -> None:
        for name in names:
            before, now = self._held.get(name), _number(values.get(name))
            if now != before:
                self._held[name] = now
                if now is not None:
                    self._trace.steps.append((self._call.last_line, name, before, now, self._number))


def _values(frame: FrameType, names: Sequence[str]) -> tuple[Sequence[str], Mapping[str, Any]]:
    """Return variables of a function and what they hold; for FIELDS the fields of `self`, by "self.name"."""
    values = frame.f_locals
    if FIELDS not in names:
        return names, values
    fields = {f"self.{name}": value for name, value in getattr(values.get("self"), "__dict__", {}).items()}
    return (*names, *fields), {**values, **fields}


def _number(value: Any) -> float | None:
    """Return a number as a float; None of anything else, where it is too large for one, or its class fails."""
    try:
        return float(value) if type(value) in (float, int) or isinstance(value, Real) else None
    except Exception:
        return None
