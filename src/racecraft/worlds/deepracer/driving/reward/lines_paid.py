"""Which lines of a reward paid, and where on the track. Begin with `lines_paid`.

The function is asked again about rows that were driven, and each line is told as it runs. Where a variable is built up
line by line and returned, every line's part is what it added to that variable; the rest stands with the `return`. The
parts of a row add up to its pay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.paying import Pay, Payer
from racecraft.worlds.deepracer.files.reward_trace import Step, Term, line_of
from racecraft.worlds.deepracer.tracks.track import Track

PARTS = 10
"""The lap is told in tenths."""


@dataclass(frozen=True, eq=False)
class PaidLine:
    """A line and what it paid."""

    line: int
    text: str
    """As it is written."""
    total: float
    """Over all rows."""
    share: float
    """Of the sum of all lines' sizes, 0 to 1."""
    by_part: Array
    """(PARTS,) in each tenth of the lap."""
    rows: int
    """In how many rows it paid anything."""


@dataclass(frozen=True, eq=False)
class LinesPaid:
    """What every line paid."""

    lines: tuple[PaidLine, ...]
    """The one that paid most first, whatever its sign."""
    total: float
    rows: int
    variable: str | None
    """The variable that is built up and returned; None: there is none, and the `return` lines pay all."""
    values: dict[str, float]
    """Mean of every other number that a line gave a name."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "rows": self.rows, "total": self.total, "variable": self.variable, "values": self.values,
            "lines": [
                {"line": one.line, "text": one.text, "total": one.total, "share": one.share, "rows": one.rows,
                 "by_tenth_of_the_lap": one.by_part.tolist()} for one in self.lines
            ],
        }  # fmt: skip


def lines_paid(payer: Payer, track: Track, reports: Array) -> LinesPaid:
    """Ask a reward function again about driven rows, and tell which lines paid.

    Args:
        payer: The reward function.
        track: The circuit, in driving direction.
        reports: TICK_REPORT (T,), in the order in which they happened.
    """
    pay = payer.compute_rewards(track, reports, is_traced=True, is_reversed=track.is_reversed)
    variable = _built_up(pay)
    part = np.minimum((reports["arc"] / track.length * PARTS).astype(int), PARTS - 1)
    totals: dict[int, Array] = {}
    counts: Counter[int] = Counter()
    values: dict[str, list[float]] = {}
    for row, (earned, steps, last) in enumerate(zip(pay.rewards.tolist(), pay.traces, pay.last_lines, strict=False)):
        if np.isnan(earned):
            continue
        for line, amount in _parts(earned, steps, last, variable).items():
            totals.setdefault(line, np.zeros(PARTS))[part[row]] += amount
            counts[line] += amount != 0.0
        for name, value in {name: value for _, name, _, value in steps}.items():
            if name != variable:
                values.setdefault(name, []).append(value)
    size = sum(abs(one.sum()) for one in totals.values()) or 1.0
    source = payer.process.source
    lines = [
        PaidLine(line, line_of(source, Term(line, "")), float(one.sum()),
                 float(abs(one.sum()) / size), one, counts[line])
        for line, one in totals.items() if one.any()
    ]  # fmt: skip
    return LinesPaid(
        tuple(sorted(lines, key=lambda one: -abs(one.total))), float(np.nansum(pay.rewards)),
        int(np.isfinite(pay.rewards).sum()), variable, {name: float(np.mean(one)) for name, one in values.items()},
    )  # fmt: skip


def _built_up(pay: Pay) -> str | None:
    """Return the variable whose last value is the pay in most rows; None where none is in half of them."""
    hits: Counter[str] = Counter()
    for earned, steps in zip(pay.rewards.tolist(), pay.traces, strict=False):
        last = {name: value for _, name, _, value in steps}
        hits.update(name for name, value in last.items() if abs(value - earned) <= 1e-9 * max(1.0, abs(earned)))
    if not hits:
        return None
    name, count = hits.most_common(1)[0]
    return name if 2 * count >= len(pay.traces) else None


def _parts(earned: float, steps: tuple[Step, ...], last_line: int, variable: str | None) -> dict[int, float]:
    """Return what each line added; what the variable does not hold at the end is the last line's."""
    parts: dict[int, float] = {}
    now = 0.0
    for line, name, _, value in steps:
        if name == variable:
            parts[line] = parts.get(line, 0.0) + value - now
            now = value
    if earned != now:
        parts[last_line] = parts.get(last_line, 0.0) + earned - now
    return parts
