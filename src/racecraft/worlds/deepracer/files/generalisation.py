"""How one policy drives on several tracks, those it was trained on and those it never saw: a table, a row each.

`generalisation.csv` in a run folder is that of the latest evaluation, written whole. Its columns are the fields of
`TrackResult`, behind the number of the iteration; nothing stands where a number is missing.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.formats.atomic import write_atomic

TRAINED, HELD_OUT, OTHER = ROLES = ("trained", "held_out", "other")
"""Whether a policy was trained on a track, was to be judged there while it trained, or neither."""


@dataclass(frozen=True)
class TrackResult:
    """What an evaluation on one track came to."""

    label: str
    """The track with its direction and race, as people say it; two of one table differ."""
    track: str
    role: str
    """One of ROLES."""
    race: str
    """Type of the race, in AWS's words."""
    reverse: bool
    """Driven in the opposite direction."""
    laps: int
    """Laps begun, one from each start."""
    full_laps: int
    """Of them, those driven to the end."""
    mean_progress_percent: float
    """Mean share of the lap driven, 0 to 100."""
    best_lap_seconds: float | None
    """Simulated seconds of the fastest full lap; None without one."""

    @property
    def is_lapped(self) -> bool:
        """Every lap was driven to the end."""
        return self.full_laps == self.laps

    def as_dictionary(self) -> dict[str, Any]:
        """Return the fields as plain values."""
        return asdict(self)


NAMES = tuple(field.name for field in fields(TrackResult))
COLUMNS = ("iteration", *NAMES)


def write_generalisation(path: Path, iteration: int, results: Sequence[TrackResult]) -> None:
    """Write a table, whole.

    Raises:
        OutputFileError: It cannot be written.
    """
    text = io.StringIO()
    rows = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    rows.writeheader()
    for one in results:
        rows.writerow({"iteration": iteration, **one.as_dictionary(), "reverse": str(one.reverse).lower()})
    write_atomic(path, text.getvalue())


def read_generalisation(path: Path) -> tuple[int, tuple[TrackResult, ...]] | None:
    """Return the iteration and the rows of a table; None where there is none.

    Raises:
        RunFolderError: It is damaged.
    """
    try:
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        results = tuple(_result(row) for row in rows)
        return (int(rows[0]["iteration"]), results) if rows else None
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise RunFolderError(
            "{path}: cannot be read ({error}); expected the columns {columns}. Take the file out.",
            path=path,
            error=error,
            columns=", ".join(COLUMNS),
        ) from error


def _result(row: dict[str, str]) -> TrackResult:
    if row["role"] not in ROLES or row["reverse"] not in ("true", "false"):
        raise ValueError(f"{row['role']}, {row['reverse']}")
    return TrackResult(
        label=row["label"],
        track=row["track"],
        role=row["role"],
        race=row["race"],
        reverse=row["reverse"] == "true",
        laps=int(row["laps"]),
        full_laps=int(row["full_laps"]),
        mean_progress_percent=float(row["mean_progress_percent"]),
        best_lap_seconds=float(row["best_lap_seconds"]) if row["best_lap_seconds"] else None,
    )
