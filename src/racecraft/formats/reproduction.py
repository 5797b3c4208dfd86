"""What a comparison of trainings at equal wall-clock came to: `table.json`, version 1, and the same rows as CSV.

{"format": "racecraft reproduction", "version": 1, "asked": {…}, "machine": {…}, "rows": [{COLUMNS …, "curve": […]}, …]}
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.formats.whole import write_whole

FORMAT, VERSION = "racecraft reproduction", 1


@dataclass(frozen=True)
class Moment:
    """A policy at one moment of its training, judged over whole games."""

    minutes: float
    """Of training, evaluations out."""
    reward: float
    """Mean of what a game paid all its snakes together."""
    reward_error: float
    """Standard error of that mean."""
    length: float
    """Mean length of a game, in turns."""
    length_error: float


@dataclass(frozen=True)
class RowResult:
    """One row of the comparison."""

    row: str
    """Its name."""
    title: str
    algorithm: str
    """As `--algorithm` takes it; "": nothing was trained."""
    cores: int
    """That the training could use."""
    minutes: float | None
    """Trained, evaluations out; None: nothing was trained."""
    steps: int | None
    """Moves of living snakes that were learned from."""
    steps_per_second: float | None
    games: int
    """Whole games behind each mean."""
    reward: float
    """Mean of what a game paid all its snakes together, at the end of the training."""
    reward_error: float
    """Standard error of that mean."""
    length: float
    """Mean length of a game then, in turns."""
    length_error: float
    run: str
    """Run folder, in that of the comparison; "": none."""


COLUMNS = tuple(field.name for field in fields(RowResult))


def write_table(
    folder: Path, asked: Mapping[str, Any], machine: Mapping[str, Any], rows: Sequence[tuple[RowResult, list[Moment]]]
) -> tuple[Path, Path]:
    """Write `table.json` and `table.csv`; return where they lie.

    Raises:
        OutputFileError: One cannot be written.
    """
    told = [{**asdict(row), "curve": [asdict(moment) for moment in curve]} for row, curve in rows]
    whole = {"format": FORMAT, "version": VERSION, "asked": dict(asked), "machine": dict(machine), "rows": told}
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(asdict(row) for row, _ in rows)
    places = folder / "table.json", folder / "table.csv"
    write_whole(places[0], json.dumps(whole, indent=2) + "\n")
    write_whole(places[1], text.getvalue())
    return places


def read_table(path: Path) -> tuple[dict[str, Any], list[tuple[RowResult, list[Moment]]]]:
    """Return what was asked, and every row with its curve.

    Raises:
        RunFolderError: It is no such table.
    """
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        if told["format"] != FORMAT or told["version"] != VERSION:
            raise KeyError("format")
        rows = [
            (RowResult(**{name: one[name] for name in COLUMNS}), [Moment(**moment) for moment in one["curve"]])
            for one in told["rows"]
        ]
        return dict(told["asked"]), rows
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunFolderError(
            f"{path}: {error}; expected a table.json of version {VERSION} that `racecraft snakes reproduce` wrote."
        ) from error
