"""What a comparison of trainings at equal wall-clock came to: `table.json`, version 1, and the same rows as CSV.

{"format": "racecraft reproduction", "version": 1, "asked": {…}, "machine": {…}, "best_over_old": [{…}, …],
"rows": [{COLUMNS …, "curve": […]}, …]}
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
OLD, OURS, RANDOM, MASKED_RANDOM = "old", "ours", "random", "masked-random"
"""Rows that are none of the source's new ones: its old trainer, ours, and what chance comes to."""


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
    processor_share: float | None = None
    """Of the time of its cores, how much the training had, 0 to 1: less where it waits, and where other work runs
    meanwhile. None: nothing was trained, or not in one go."""


COLUMNS = tuple(field.name for field in fields(RowResult))


@dataclass(frozen=True)
class OverOld:
    """The best of some rows beside the old trainer's."""

    among: str
    """Which rows."""
    row: str
    """The one of the largest reward."""
    reward: float | None
    """Times the old one's; None where a sign makes that mean nothing."""
    length: float


def best_over_old(rows: Sequence[RowResult]) -> list[OverOld]:
    """Return the source's own measure, its chart's best row over its old one: of its rows, with ours, and of chance.

    >>> old, apex, chance = (
    ...     RowResult(name, "", kind, 1, 1.0, 1, 1.0, 9, reward, 0.1, length, 0.1, "")
    ...     for name, kind, reward, length in (
    ...         ("old", "dqn", 2.0, 8.0),
    ...         ("a", "apex", 5.0, 16.0),
    ...         ("random", "", -1.0, 4.0),
    ...     )
    ... )
    >>> [(one.among, one.row, one.reward, one.length) for one in best_over_old([chance, old, apex])]
    [("the source's rows", 'a', 2.5, 2.0), ('chance', 'random', None, 0.5)]
    """
    by_name = {row.row: row for row in rows}
    old, ours = by_name.get(OLD), by_name.get(OURS)
    if old is None:
        return []
    theirs = [row for row in rows if row.algorithm and row not in (old, ours)]
    chance = [by_name[name] for name in (RANDOM, MASKED_RANDOM) if name in by_name]
    told = {"the source's rows": theirs, "all rows, ours among them": [*theirs, ours] if ours else [], "chance": chance}
    found = []
    for among, some in told.items():
        if some:
            best = max(some, key=lambda row: row.reward)
            reward = best.reward / old.reward if min(best.reward, old.reward) > 0 else None
            found.append(OverOld(among, best.row, reward, best.length / old.length))
    return found


def write_table(
    folder: Path, asked: Mapping[str, Any], machine: Mapping[str, Any], rows: Sequence[tuple[RowResult, list[Moment]]]
) -> tuple[Path, Path]:
    """Write `table.json` and `table.csv`; return where they lie.

    Raises:
        OutputFileError: One cannot be written.
    """
    told = [{**asdict(row), "curve": [asdict(moment) for moment in curve]} for row, curve in rows]
    whole = {
        "format": FORMAT, "version": VERSION, "asked": dict(asked), "machine": dict(machine),
        "best_over_old": [asdict(one) for one in best_over_old([row for row, _ in rows])], "rows": told,
    }  # fmt: skip
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
            (
                RowResult(**{name: one[name] for name in COLUMNS if name in one}),
                [Moment(**moment) for moment in one["curve"]],
            )
            for one in told["rows"]
        ]
        return dict(told["asked"]), rows
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunFolderError(
            f"{path}: {error}; expected a table.json of version {VERSION} that `racecraft snakes reproduce` wrote."
        ) from error
