"""Rows of simulation traces out of text, from CSV files and logs alike. Begin with `read_rows`.

The compiled reader (`compiled_rows.py`) leaves out what is not plainly sound; `careful.py` looks at those rows one by
one, takes what can be taken and names the rest. So a damaged row costs itself and no more. Little text is read
carefully as a whole: that is sooner done than compiled code is loaded.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.files.sim_trace import NAMES
from racecraft.worlds.deepracer.logs.careful import read_carefully
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.texts import Text
from racecraft.worlds.deepracer.logs.units import in_our_units

if TYPE_CHECKING:
    import polars as pl

MARK = "SIM_TRACE_LOG:"
LITTLE_BYTES = 8 << 20
"""Text up to which Polars alone is sooner done than compiled code is loaded."""


@dataclass(frozen=True)
class Rows:
    """What texts hold."""

    frame: pl.DataFrame
    """AWS's columns in AWS's order and our units, then `file` and `line`; continuous actions are -1."""
    damage: list[Damage]
    between: bytes
    """The other lines of logs."""


def read_rows(
    header: Sequence[str],
    texts: Sequence[Text],
    marked: bool = False,
    wanted: Collection[str] | None = None,
    versions: Mapping[int, Sequence[str]] | None = None,
) -> Rows:
    """Read the rows of texts.

    Args:
        header: AWS's names of the columns in the order of the fields; other names are passed over.
        texts: Files whose rows have these fields, in order.
        marked: Whether rows stand behind SIM_TRACE_LOG: among other lines; else every line is a row.
        wanted: AWS's names of the columns that are asked for, None: all; others may be left out where that saves time.
            Which rows are sound does not depend on it.
        versions: How many values other versions of rows have → their columns, where texts mix them.

    Raises:
        OtherHeadError: A text does not begin with its `head`.
    """
    versions = versions or {}
    if sum(text.size for text in texts) <= LITTLE_BYTES:
        return _joined(NAMES, [_carefully(header, text, marked, versions) for text in texts])
    from racecraft.worlds.deepracer.logs.compiled_rows import read_sound_rows

    found = read_sound_rows(header, texts, marked, wanted)
    sound = Rows(found.frame, [], found.between)
    unasked = set(header) - set(sound.frame.columns)
    asked = [name for name in NAMES if name not in unasked]
    rows = _joined(asked, [sound, *(_odd_rows(header, text, odd, versions) for text, odd in found.odd)])
    more = rows.frame.height > sound.frame.height
    return replace(rows, frame=rows.frame.sort("file", "line")) if more else rows


def _carefully(header: Sequence[str], text: Text, marked: bool, versions: Mapping[int, Sequence[str]]) -> Rows:
    """Read a text without compiled code."""
    lines = text.read().decode("utf-8", errors="replace").split("\n")
    numbers: Sequence[int] = range(text.line, text.line + len(lines))
    between = b""
    if marked:
        numbers = [number for number, line in zip(numbers, lines, strict=True) if MARK in line]
        between = "\n".join(line for line in lines if MARK not in line).encode()
        lines = [line.split(MARK, 1)[1].split("\t", 1)[0] for line in lines if MARK in line]
    return Rows(*_every_version(header, text, numbers, lines, versions), between)


def _every_version(
    header: Sequence[str],
    text: Text,
    numbers: Sequence[int],
    lines: Sequence[str],
    versions: Mapping[int, Sequence[str]],
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read rows of one text carefully, each by the version that has as many values as it."""
    import polars as pl

    usual: dict[int, str] = {}
    others: dict[int, dict[int, str]] = {}
    for number, line in zip(numbers, lines, strict=True):
        count = line.count(",") + 1 if versions else len(header)
        known = count != len(header) and count in versions
        (others.setdefault(count, {}) if known else usual)[number] = line
    groups = [(header, usual), *((versions[count], rows) for count, rows in others.items())]
    read = [read_carefully(text.source.name, names, list(rows), list(rows.values())) for names, rows in groups]
    frame = pl.concat([frame for frame, _ in read], how="diagonal") if others else read[0][0]
    damage = [one for _, more in read for one in more]
    return in_our_units(frame.sort("line")).with_columns(pl.lit(text.place, pl.UInt32).alias("file")), damage


def _joined(names: Sequence[str], pieces: Sequence[Rows]) -> Rows:
    """Put these columns, `file` and `line` of texts and blocks one below the other."""
    import polars as pl

    frames = [
        piece.frame.select(name for name in (*names, "file", "line") if name in piece.frame.columns)
        for piece in pieces
        if piece.frame.height
    ]
    damage = list(itertools.chain.from_iterable(piece.damage for piece in pieces))
    frame = pl.concat(frames, how="diagonal", rechunk=True) if frames else pl.DataFrame()
    return Rows(frame, damage, b"".join(piece.between for piece in pieces))


def _odd_rows(
    header: Sequence[str], text: Text, odd: Sequence[tuple[int, str]], versions: Mapping[int, Sequence[str]]
) -> Rows:
    """Read the rows of a text carefully that are not plainly sound."""
    return Rows(*_every_version(header, text, [line for line, _ in odd], [row for _, row in odd], versions), b"")
