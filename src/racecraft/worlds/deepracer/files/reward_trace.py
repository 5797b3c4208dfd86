"""How a reward came about: every number that the racer's function assigned on the way. Begin with `RewardTrace`.

The function runs unchanged, under the interpreter's own tracing, which tells of every line before it is run; what a
line changed is seen at the next one.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from types import FrameType
from typing import Any

from racecraft.worlds.deepracer.files.reward_examples import Params
from racecraft.worlds.deepracer.files.reward_file import RewardFunction
from racecraft.worlds.deepracer.files.reward_source import RewardSource


@dataclass(frozen=True, order=True)
class Term:
    """A line that gave a variable a number."""

    line: int
    """Of the racer's file, counted from 1."""
    name: str
    """Of the variable."""


Step = tuple[int, str, float | None, float]
"""A line, a variable, what it held before the line ran (None: no number) and after."""


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
        self.last_line = 0
        """The line at which the last call returned; 0 where it is not of the file."""

    @property
    def terms(self) -> dict[Term, float]:
        """What each line gave each variable last, in the order of lines."""
        return dict(sorted((Term(line, name), value) for line, name, _, value in self.steps))

    def call(self, params: Params) -> float:
        """Return the reward of one tick, as `RewardFunction.call` does.

        Raises:
            RewardError: The function failed.
        """
        self.steps, self.lines, self.last_line = [], set(), 0
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
        self._trace, self._line = trace, frame.f_lineno
        self._before = _numbers(frame.f_locals)

    def see(self, frame: FrameType, event: str, arg: Any) -> Any:
        """Keep what the line before this one changed."""
        if event not in ("line", "return"):
            return self.see
        if event == "line":
            self._trace.lines.add(frame.f_lineno)
        else:
            self._trace.last_line = frame.f_lineno
        now = _numbers(frame.f_locals)
        for name, value in now.items():
            if (before := self._before.get(name)) != value:
                self._trace.steps.append((self._line, name, before, value))
        self._before, self._line = now, frame.f_lineno
        return self.see


def _numbers(names: Mapping[str, Any]) -> dict[str, float]:
    found = {name: _number(value) for name, value in names.items() if isinstance(value, Real)}
    return {name: value for name, value in found.items() if value is not None}


def _number(value: Real) -> float | None:
    """Return a number as a float; None where it is too large for one, or a class of the racer's own fails."""
    try:
        return float(value)
    except Exception:
        return None
