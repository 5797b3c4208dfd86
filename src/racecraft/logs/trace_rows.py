"""Rows of simulation traces: sound files in one sweep, damaged ones line by line, with each bad line named.

Begin with `read_traces`. A sweep takes files with the same header together and lets Polars read them on every core. It
tells nothing of where a file is damaged, so a file that spoils a sweep, or leaves gaps in it, is read again by
`careful.py`, which loses only the rows that are broken.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.formats.aws.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.formats.episodes import STATUSES
from racecraft.logs.careful import read_carefully
from racecraft.logs.errors import Damage
from racecraft.logs.sources import Source

if TYPE_CHECKING:
    import polars as pl

_FOLDED = {name.casefold(): name for name in NAMES}
_REQUIRED = [column.name for column in TRACE_COLUMNS if column.required]
_PATH = "__path"

Read = tuple["pl.DataFrame", list[Damage]]


def read_traces(sources: Sequence[tuple[int, Source]]) -> Read:
    """Read traces, given with their index among the table's files.

    Returns:
        AWS's columns in AWS's units and `file`, `line`; and what was damaged.
    """
    import polars as pl

    frames: list[pl.DataFrame] = []
    damage: list[Damage] = []
    for header, group in itertools.groupby(sources, key=lambda pair: _header(pair[1])):
        pairs = list(group)
        lacking = [name for name in _REQUIRED if name not in header]
        if not "".join(header):
            damage += [Damage(source.name, None, "the file is empty") for _, source in pairs]
        elif lacking:
            damage += [Damage(source.name, 1, f"no column {', '.join(lacking)}; left out") for _, source in pairs]
        else:
            frame, wrong = _sweep(header, pairs)
            frames += frame
            damage += wrong
    return (pl.concat(frames, how="diagonal") if frames else pl.DataFrame()), damage


def _header(source: Source) -> tuple[str, ...]:
    """Return our names of the columns in the file's order; the file's own name for those that we do not know."""
    if isinstance(source.file, Path):
        with open(source.file, "rb") as file:
            line = file.readline(4096)
    else:
        line = source.read().split(b"\n", 1)[0]
    words = line.decode("utf-8-sig", errors="replace").rstrip("\r\n").split(",")
    return tuple(_FOLDED.get(word.strip().casefold(), f"__{k}" if word else "") for k, word in enumerate(words))


def trace_schema(header: Sequence[str]) -> dict[str, pl.DataType]:
    """Return the types with which a trace's columns are read; actions as text where they are continuous."""
    import polars as pl

    types = {
        "float64": pl.Float64(), "int64": pl.Int32(), "bool": pl.Boolean(), "str": pl.Enum(STATUSES),
    }  # fmt: skip
    known = {column.name: types[column.dtype] for column in TRACE_COLUMNS}
    return {name: known.get(name, pl.String()) for name in header}


def _sweep(header: tuple[str, ...], pairs: list[tuple[int, Source]]) -> tuple[list[pl.DataFrame], list[Damage]]:
    """Read files of one header together; whichever is not sound is read carefully."""
    import polars as pl

    schema = trace_schema(header)
    for continuous in (False, True):
        if continuous:
            schema["action"] = pl.String()
        try:
            frame = _read_together(pairs, schema)
        except (pl.exceptions.PolarsError, OSError):
            continue
        unsound = set(unsound_files(frame, header))
        if not unsound:
            return [tidy(frame, header)], []
        if len(unsound) < len(pairs):
            sound = frame.filter(~pl.col("file").is_in(sorted(unsound)))
            whole, damage = _one_by_one(header, [pair for pair in pairs if pair[0] in unsound])
            return [pl.concat([tidy(sound, header), *whole]).sort("file", "line")], damage
        break
    if len(pairs) == 1:
        return _one_by_one(header, pairs)
    half = len(pairs) // 2  # somewhere is a file that no sweep can take; halving finds it
    left, right = _sweep(header, pairs[:half]), _sweep(header, pairs[half:])
    return left[0] + right[0], left[1] + right[1]


def _read_together(pairs: list[tuple[int, Source]], schema: dict[str, pl.DataType]) -> pl.DataFrame:
    """Return the rows of files with one header; raises what Polars raises where a value is none of its type."""
    import polars as pl

    paths = [source.file for _, source in pairs if isinstance(source.file, Path)]
    if len(paths) == len(pairs):
        swept = pl.scan_csv(
            paths, schema=schema, quote_char=None, include_file_paths=_PATH, missing_columns="raise"
        ).collect()
        names = [str(path) for path in paths]
        counts = _counts(swept[_PATH], names)
        swept = swept.drop(_PATH)
    else:
        parts = [pl.read_csv(BytesIO(source.read()), schema=schema, quote_char=None) for _, source in pairs]
        counts = [part.height for part in parts]
        swept = pl.concat(parts)
    return swept.with_columns(*_places([place for place, _ in pairs], counts))


def _counts(paths: pl.Series, names: list[str]) -> list[int]:
    """Return how many rows each file gave; rows of a file stand together, in the order of the files."""
    lengths = paths.rle().struct.unnest() if len(paths) else None
    found = {} if lengths is None else dict(zip(lengths["value"].to_list(), lengths["len"].to_list(), strict=True))
    return [found.get(name, 0) for name in names]


def _places(files: list[int], counts: list[int]) -> Iterator[pl.Series]:
    """Yield the columns `file` and `line` of files of so many rows; the header is line 1."""
    import numpy as np
    import polars as pl

    yield pl.Series("file", np.repeat(np.array(files, np.uint32), counts))
    ends = np.cumsum(counts)
    starts = np.repeat(ends - counts, counts)
    yield pl.Series("line", (np.arange(ends[-1] if len(ends) else 0) - starts + 2).astype(np.int32))


def unsound_files(frame: pl.DataFrame, header: tuple[str, ...]) -> list[int]:
    """Return the files with gaps where a value must stand, or with numbers that are none."""
    import polars as pl

    known = [name for name in header if name in NAMES]
    gaps = [name for name in known if frame[name].null_count()]
    numbers = [name for name in known if frame.schema[name] == pl.Float64]
    nans = [name for name in numbers if not bool(frame[name].is_finite().all())]
    whole = [name for name in ("steps",) if not bool((frame[name] % 1 == 0).all())]
    if not (gaps or nans or whole):
        return []
    wrong = [pl.col(name).is_null() for name in gaps] + [~pl.col(name).is_finite() for name in nans]
    wrong += [pl.col(name) % 1 != 0 for name in whole]
    return frame.filter(pl.any_horizontal(wrong))["file"].unique().to_list()


def _one_by_one(header: tuple[str, ...], pairs: list[tuple[int, Source]]) -> tuple[list[pl.DataFrame], list[Damage]]:
    """Read damaged files, each by itself."""
    frames, damage = [], []
    for place, source in pairs:
        lines = source.read().decode("utf-8", errors="replace").removeprefix("\ufeff").split("\n")
        frame, wrong = read_carefully(source.name, header, range(2, len(lines) + 1), lines[1:])
        damage += wrong
        if frame.height:
            frames.append(in_file(tidy(frame, header), place))
    return frames, damage


def in_file(frame: pl.DataFrame, place: int) -> pl.DataFrame:
    """Say of which file the rows are."""
    import polars as pl

    return frame.with_columns(pl.lit(place, pl.UInt32).alias("file")).select(
        *(name for name in frame.columns if name not in ("file", "line")), "file", "line"
    )


def tidy(frame: pl.DataFrame, header: Sequence[str]) -> pl.DataFrame:
    """Return a trace's known columns in one order and type, continuous actions as -1."""
    import polars as pl

    if frame.schema.get("action") == pl.String:
        action = pl.when(pl.col("action").str.starts_with("[")).then(pl.lit("-1")).otherwise(pl.col("action"))
        frame = frame.with_columns(action.cast(pl.Int32).alias("action"))
    known = [name for name in NAMES if name in header]
    return frame.select(*known, *(name for name in ("file", "line") if name in frame.columns))
