"""Which lines of a reward paid, and where on the track. Begin with `lines_paid`.

The function is called again on rows that were driven, each line is traced as it runs, and what it returns is followed
back to the lines that made it (`files/reward_flow.py`). The parts of a row add up to its pay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.paying import Failure, Payer
from racecraft.worlds.deepracer.files.reward_trace import Term, line_of
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
    """The variable that lines build up in half of the rows and more; None: there is none."""
    values: dict[str, float]
    """Mean of every other number that a line gave a name."""
    failures: tuple[Failure, ...]

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "rows": self.rows, "total": self.total, "variable": self.variable, "values": self.values,
            "lines": [
                {"line": one.line, "text": one.text, "total": one.total, "share": one.share, "rows": one.rows,
                 "by_tenth_of_the_lap": one.by_part.tolist()} for one in self.lines
            ],
            "failures": [asdict(one) for one in self.failures],
        }  # fmt: skip


def lines_paid(payer: Payer, track: Track, reports: Array) -> LinesPaid:
    """Call a reward function again on driven rows, and return which lines paid.

    Args:
        payer: The reward function.
        track: The circuit, in driving direction.
        reports: TICK_REPORT (T,), in the order in which they happened.
    """
    pay = payer.compute_rewards(track, reports, is_traced=True, is_reversed=track.is_reversed)
    part = np.minimum((reports["arc"] / track.length * PARTS).astype(int), PARTS - 1)
    totals: dict[int, Array] = {}
    counts: Counter[int] = Counter()
    built_up: Counter[str] = Counter()
    values: dict[str, list[float]] = {}
    for row, (earned, traced) in enumerate(zip(pay.rewards.tolist(), pay.traces, strict=False)):
        if np.isnan(earned):
            continue
        for line, amount in traced.by_line.items():
            totals.setdefault(line, np.zeros(PARTS))[part[row]] += amount
            counts[line] += amount != 0.0
        built_up.update(traced.built_up)
        for name, value in traced.values.items():
            values.setdefault(name, []).append(value)
    most, count = next(iter(built_up.most_common(1)), (None, 0))
    variable = most if 2 * count >= len(pay.traces) else None
    values.pop(variable or "", None)
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
        pay.failures,
    )  # fmt: skip
