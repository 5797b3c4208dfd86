"""The best known lap of a track: the fastest that was certainly driven with a car up to a top speed.

The table `known_laps.csv` beside this page is made by `scripts/plan_known_laps.py`; nothing here computes a lap. A lap
driven by a policy takes the place of a slower plan (`record_lap`). Begin with `best_known_lap`.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.user_file import read_user_text

TABLE = Path(__file__).with_name("known_laps.csv")
FORWARD, REVERSE = "forward", "reverse"
"""The direction in which the track's rows run, and against it."""


@dataclass(frozen=True)
class KnownLap:
    """A row of the table."""

    track: str
    direction: str
    """FORWARD or REVERSE."""
    car: str
    """Vehicle profile, a key of `vehicle.PROFILES`."""
    top_speed_mps: float
    """The fastest command, m/s."""
    table: str
    """The action table it was driven with, as `action_tables.read_table` takes it."""
    lap_seconds: float
    """The best flying lap, s; on an open track the lap from rest."""
    how: str
    """"plan", or the name of the policy that drove it."""
    version: str
    """Version of racecraft, whose physics it was driven in."""

    @property
    def key(self) -> tuple[str, str, str, float]:
        """What a lap is compared within."""
        return self.track, self.direction, self.car, round(self.top_speed_mps, 2)


def best_known_lap(track: str, car: str, top_speed_mps: float, direction: str = FORWARD) -> float | None:
    """Return the best known flying lap, s; None where the table has none.

    Args:
        track: Its name.
        car: Vehicle profile, a key of `vehicle.PROFILES`.
        top_speed_mps: The fastest command of the car's actions, m/s.
        direction: FORWARD or REVERSE.
    """
    lap = _known(TABLE).get((track, direction, car, round(top_speed_mps, 2)))
    return None if lap is None else lap.lap_seconds


def direction_of(is_reversed: bool) -> str:
    """Return the table's word for a race along the track's rows, or against them (`race.reverse`)."""
    return REVERSE if is_reversed else FORWARD


def gap_percent(lap_seconds: float, known_seconds: float) -> float:
    """Return how much longer a lap takes than the best known one, per cent.

    >>> round(gap_percent(5.25, 5.0), 3)
    5.0
    """
    return 100.0 * (lap_seconds / known_seconds - 1.0)


def record_lap(lap: KnownLap, path: Path = TABLE) -> bool:
    """Add a lap that was certainly driven to a table, unless an equal or faster one is known; return whether.

    Raises:
        InputFileError: The table cannot be read.
        OutputFileError: It cannot be written.
    """
    known = {one.key: one for one in read_laps(path)} if path.is_file() else {}
    if lap.key in known and known[lap.key].lap_seconds <= lap.lap_seconds + 1e-9:
        return False
    write_laps([*(known | {lap.key: lap}).values()], path)
    return True


def read_laps(path: Path = TABLE) -> list[KnownLap]:
    """Return the rows of a table.

    Raises:
        InputFileError: A row cannot be read; the error names its line.
    """
    laps = []
    text = read_user_text(path, InputFileError, "a table of laps")
    try:
        rows = list(csv.DictReader(text.splitlines(keepends=True)))
    except csv.Error as error:
        raise InputFileError(path, str(error), "a table of laps") from error
    for line, row in enumerate(rows, 2):
        try:
            values: dict[str, Any] = {**row}
            values |= {name: float(row[name]) for name in ("top_speed_mps", "lap_seconds")}
            laps.append(KnownLap(**values))
        except (KeyError, TypeError, ValueError) as error:
            expected = Message("a value for each of {columns}", columns=", ".join(COLUMNS))
            raise InputFileError(path, Message("the row {row}", row=row), expected, line=line) from error
    return laps


def write_laps(laps: Iterable[KnownLap], path: Path = TABLE) -> None:
    """Write a table, sorted by key.

    Raises:
        OutputFileError: It cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({**asdict(lap), "lap_seconds": f"{lap.lap_seconds:.4f}"} for lap in sorted(laps, key=_key))
    write_atomic(path, text.getvalue())


COLUMNS = tuple(field.name for field in fields(KnownLap))


def _key(lap: KnownLap) -> tuple[str, str, str, float]:
    return lap.key


@cache
def _known(path: Path) -> dict[tuple[str, str, str, float], KnownLap]:
    return {lap.key: lap for lap in read_laps(path)} if path.is_file() else {}
