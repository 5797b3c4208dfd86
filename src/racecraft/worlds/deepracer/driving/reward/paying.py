"""Ask a reward function about many rows at once, in its limited process. Begin with `Payer`.

A row that fails does not end the rest: it is paid NaN, its error is kept, and the next row is asked.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.reward_caller import PaidCourse
from racecraft.worlds.deepracer.env.reward_process import FailedRowError, RewardCopies, RewardProcess
from racecraft.worlds.deepracer.files.reward_trace import Traced
from racecraft.worlds.deepracer.tracks.track import Track

MAX_FAILURES = 20
"""After so many failed rows the rest is not asked."""
ROWS_A_MESSAGE, TRACED_ROWS_A_MESSAGE = 20_000, 50


@dataclass(frozen=True)
class Failure:
    """A row that a reward function could not pay."""

    row: int
    line: int | None
    """Of the racer's file; None where it is not known."""
    message: str
    """What happened, in one line."""


@dataclass(frozen=True, eq=False)
class Pay:
    """What T rows earned."""

    rewards: Array
    """float64 (T,); NaN where a row failed or was not asked."""
    failures: tuple[Failure, ...] = ()
    traces: tuple[Traced, ...] = ()
    """How each row's reward came about, where it was traced."""
    lines: frozenset[int] = frozenset()
    """Which lines of the file ran in any row, where rows were traced."""


class Payer:
    """A copy of a reward function, and the tracks it is asked about.

    Args:
        process: Where it runs.
        copies: The copy that answers; None: a new one.
    """

    def __init__(self, process: RewardProcess, copies: RewardCopies | None = None) -> None:
        self.process = process
        self._copies = process.copies(1) if copies is None else copies
        self._courses: dict[tuple[int, bool], tuple[Track, PaidCourse]] = {}

    def compute_rewards(self, track: Track, reports: Array, is_traced: bool = False, is_reversed: bool = False) -> Pay:
        """Return what rows earned.

        Args:
            track: The circuit, in driving direction.
            reports: TICK_REPORT (T,), in the order in which they happened.
            is_traced: Whether to tell what each line did.
            is_reversed: What the parameter of this name says.

        Raises:
            RewardError: The function hung or ended its process.
        """
        course = self._course(track, is_reversed)
        rewards = np.full(len(reports), np.nan)
        failures: list[Failure] = []
        traces: list[Traced] = []
        lines: set[int] = set()
        self._copies.is_traced = is_traced
        most = TRACED_ROWS_A_MESSAGE if is_traced else ROWS_A_MESSAGE
        first = 0
        while first < len(reports) and len(failures) < MAX_FAILURES:
            rows = reports[first : first + most]
            reply: dict[str, Any] = {}
            try:
                paid, reply = self._copies.ask(course, np.zeros(len(rows), np.int64), rows)
                count = len(paid)
            except FailedRowError as error:
                paid, reply, count = error.paid, dict(error.told), len(error.paid) + 1
                failures.append(_failure(first + len(paid), str(error)))
            rewards[first : first + len(paid)] = paid
            traces += map(Traced.of, reply.get("traces", ()))
            lines.update(reply.get("lines", ()))
            first += count
        return Pay(rewards, tuple(failures), tuple(traces), frozenset(lines))

    def call(self, situations: Iterator[dict[str, Any]]) -> Pay:
        """Return what made-up dictionaries earned; for what rows cannot hold, such as objects.

        Raises:
            RewardError: The function hung or ended its process.
        """
        rewards, failures = [], []
        for row, params in enumerate(situations):
            try:
                rewards.append(self.process.call(params))
            except FailedRowError as error:
                rewards.append(np.nan)
                failures.append(_failure(row, str(error)))
        return Pay(np.array(rewards), tuple(failures))

    def _course(self, track: Track, is_reversed: bool) -> PaidCourse:
        key = (id(track), is_reversed)
        if key not in self._courses:
            course = PaidCourse(np.asarray(track.centre, float), float(track.length), is_reversed, None)
            self._courses[key] = (track, course)
        return self._courses[key][1]


_PLACE = re.compile(r":(\d+): reward_function (.*)")


def _failure(row: int, text: str) -> Failure:
    """Return a failed row, its error cut down to what happened and where."""
    first = text.splitlines()[0]
    match = _PLACE.search(first)
    if match is None:
        return Failure(row, None, first)
    return Failure(row, int(match[1]), match[2].partition("; expected")[0])
