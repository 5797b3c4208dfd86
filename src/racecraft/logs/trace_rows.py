"""Rows of simulation traces, file by file. Begin with `read_traces`; files with the same header are read together."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from racecraft.formats.aws.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.logs.errors import Damage
from racecraft.logs.rows_of_text import Text, read_rows
from racecraft.logs.sources import Source

if TYPE_CHECKING:
    import polars as pl

_FOLDED = {name.casefold(): name for name in NAMES}
_REQUIRED = [column.name for column in TRACE_COLUMNS if column.required]
_MOST_HEADER_BYTES = 4096


def read_traces(
    sources: Sequence[tuple[int, Source]], wanted: Collection[str] | None = None
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read traces, given with their index among the table's files; `wanted` as in `read_rows`.

    Returns:
        AWS's columns in AWS's units and `file`, `line`; and what was damaged.
    """
    import polars as pl

    frames: list[pl.DataFrame] = []
    damage: list[Damage] = []
    for header, group in itertools.groupby(map(_headed, sources), key=lambda headed: headed[0]):
        texts = [text for _, text in group]
        lacking = [name for name in _REQUIRED if name not in header]
        if not "".join(header):
            damage += [Damage(text.source.name, None, "the file is empty") for text in texts]
        elif lacking:
            damage += [Damage(text.source.name, 1, f"no column {', '.join(lacking)}; left out") for text in texts]
        else:
            rows = read_rows(header, texts, wanted=wanted)
            frames.append(rows.frame)
            damage += rows.damage
    return (pl.concat(frames, how="diagonal") if frames else pl.DataFrame()), damage


def _headed(pair: tuple[int, Source]) -> tuple[tuple[str, ...], Text]:
    """Return our names of a trace's columns, its own for those that we do not know; and the text below them."""
    place, source = pair
    with source.open() as file:
        line = file.readline(_MOST_HEADER_BYTES)
    words = line.decode("utf-8-sig", errors="replace").rstrip("\r\n").split(",")
    header = tuple(_FOLDED.get(word.strip().casefold(), f"__{k}" if word else "") for k, word in enumerate(words))
    return header, Text(place, source, begin=len(line), line=2)
