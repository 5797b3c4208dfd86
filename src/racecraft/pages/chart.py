"""Charts on pages, as data: `<rc-chart>` draws them, and a table with the same figures stands beside each.

    chart = Chart("Lap time", "iteration", "s", [Series("car 1", iterations, laps)])
    render("page.html", …)      with {{ parts.chart(chart.shown()) }} in the template

Series may have x of their own. A value that is None or NaN is a gap.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from racecraft.contract.world import Array

Look = Literal["line", "both", "dots", "dashed", "bars", "steps"]
"""How a series is drawn; "both": a line with its points."""
MAX_ROWS = 60
"""Of the table beside a chart; of more rows every second, third, … is written, and the table says so."""


@dataclass(frozen=True)
class Series:
    """One line of a chart."""

    name: str
    x: Sequence[float] | Array
    y: Sequence[float | None] | Array
    look: Look = "line"
    right: bool = False
    """Whether it is read from the axis on the right."""
    colour: int | None = None
    """1 to 6 of the tokens' series; None: by its place in the chart."""
    faint: bool = False
    """Whether it stands back, as single seeds behind their median."""


@dataclass(frozen=True)
class Band:
    """A band between two lines, as an interval around a median."""

    name: str
    x: Sequence[float] | Array
    low: Sequence[float | None] | Array
    high: Sequence[float | None] | Array
    colour: int = 1


@dataclass(frozen=True)
class Mark:
    """A place on the x axis: a line, or with `end` a region, as a corner of a track."""

    x: float
    text: str
    end: float | None = None


@dataclass(frozen=True)
class Level:
    """A value to compare with, drawn across the chart, as the best known lap."""

    y: float
    text: str


@dataclass(frozen=True)
class Chart:
    """What one chart shows.

    `words` says to those who cannot see it what there is to see; by default title, axes and names.
    """

    title: str
    x: str
    """Name of the x axis, with its unit, such as "iteration" or "distance, m"."""
    y: str
    series: Sequence[Series]
    right: str = ""
    """Name of the axis on the right, where a series is read from it."""
    bands: Sequence[Band] = ()
    marks: Sequence[Mark] = ()
    levels: Sequence[Level] = ()
    low: float | None = None
    """Where the y axis begins at the latest, as 0 for shares."""
    high: float | None = None
    log: bool = False
    log_x: bool = False
    names: Sequence[str] = ()
    """What stands below x = 0, 1, 2, … where they are no numbers but things."""
    smooth: bool = False
    """Whether the reader may smooth; the true points stay in sight."""
    digits: int = 2
    """Decimals of values in the table and at the cursor."""
    words: str = ""

    def shown(self) -> dict[str, Any]:
        """Return what the macro `parts.chart` takes."""
        return {
            "title": self.title,
            "words": self.words or f"{self.title}: {self.y} by {self.x}; {', '.join(one.name for one in self.series)}",
            "table": self._table(),
            "plot": self.plot(),
        }

    def plot(self) -> dict[str, Any]:
        """Return what `<rc-chart>` draws, for JSON; a live page sends the same again when it has grown."""
        return {
            "x": self.x,
            "y": self.y,
            "right": self.right,
            "low": self.low,
            "high": self.high,
            "log": self.log,
            "logX": self.log_x,
            "names": list(self.names),
            "smooth": self.smooth,
            "digits": self.digits,
            "series": [
                {
                    "name": one.name,
                    "x": _plain(one.x),
                    "y": _plain(one.y),
                    "look": one.look,
                    "right": one.right,
                    "colour": one.colour or number,
                    "faint": one.faint,
                }
                for number, one in enumerate(self.series, 1)
            ],
            "bands": [
                {"name": b.name, "x": _plain(b.x), "low": _plain(b.low), "high": _plain(b.high), "colour": b.colour}
                for b in self.bands
            ],
            "marks": [{"x": mark.x, "end": mark.end, "text": mark.text} for mark in self.marks],
            "levels": [{"y": level.y, "text": level.text} for level in self.levels],
        }

    def _table(self) -> dict[str, Any]:
        """Return the figures by x, a column a series."""
        columns = [_by_place(one) for one in self.series]
        places = sorted({x for column in columns for x in column})
        found = [(x, k) for x in places for k in range(max(len(column.get(x, ())) for column in columns))]
        every = max(1, math.ceil(len(found) / MAX_ROWS))
        rows = [
            [self._place(x), *(_figure(c[x][k] if k < len(c.get(x, ())) else None, self.digits) for c in columns)]
            for x, k in found[::every]
        ]
        return {"heads": [self.x, *(one.name for one in self.series)], "rows": rows, "every": every}

    def _place(self, x: float) -> str:
        if self.names and float(x).is_integer() and 0 <= x < len(self.names):
            return self.names[int(x)]
        return _figure(x, 0 if float(x).is_integer() else 2)


def _by_place(one: Series) -> dict[float, list[float | None]]:
    """Return a series' values by x; there may be several at one."""
    found: dict[float, list[float | None]] = {}
    for x, y in zip(_plain(one.x), _plain(one.y), strict=True):
        if x is not None:
            found.setdefault(x, []).append(y)
    return found


def _plain(values: Iterable[Any]) -> list[float | None]:
    """Return numbers that JSON holds; whole ones stay whole."""
    listed = values.tolist() if hasattr(values, "tolist") else list(values)
    return [None if one is None or not math.isfinite(one) else round(one, 6) for one in listed]


def _figure(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:,.{digits}f}"
