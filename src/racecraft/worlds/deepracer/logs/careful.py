"""Damaged rows, told one by one: which line, which value, why; the sound ones around them are kept.

Begin with `read_carefully`. It takes text apart column by column, so that a file with a few bad rows among many costs
no loop over its rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from racecraft.formats.episodes import STATUSES
from racecraft.worlds.deepracer.files.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.limits import HIGHEST, HIGHEST_WHOLE

if TYPE_CHECKING:
    import polars as pl

MOST_NAMED = 20
"""Bad rows of a file that are told one by one; of the others only how many there are."""
_KIND = {column.name: column.dtype for column in TRACE_COLUMNS}


def read_carefully(
    name: str, header: Sequence[str], numbers: Sequence[int], lines: Sequence[str]
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read the rows of one file.

    Args:
        name: The file, as the user would name it.
        header: AWS's names of the columns in the file's order.
        numbers: Line number of each row.
        lines: The rows, comma-separated.

    Returns:
        AWS's columns of the sound rows and `line`; and what was wrong with the others.
    """
    import polars as pl

    rows = pl.DataFrame({"line": pl.Series(numbers, dtype=pl.Int32), "text": pl.Series(lines, dtype=pl.String)})
    rows = rows.with_columns(pl.col("text").str.strip_chars_end("\r\t "))
    rows = rows.filter(pl.col("text") != "").with_columns(pl.col("text").str.split(",").alias("cells"))
    whole = pl.col("cells").list.len() == len(header)
    short = rows.filter(~whole)
    words = f"{{}} values where {len(header)} are expected"
    told = [(line, words.format(count)) for line, count in short.select("line", pl.col("cells").list.len()).iter_rows()]
    cells = rows.filter(whole).select(
        "line", *(pl.col("cells").list.get(k).alias(key) for k, key in enumerate(header) if key in NAMES)
    )
    read = cells.select("line", *(_taken(key).alias(key) for key in header if key in NAMES))
    broken = pl.any_horizontal(pl.all().exclude("line").is_null())
    bad = read.select("line", broken.alias("bad"))["bad"]
    told += list(_bad_cells(cells.filter(bad), read.filter(bad)))
    told.sort()
    damage = [Damage(name, line, f"{what}; the row was passed over") for line, what in told[:MOST_NAMED]]
    if len(told) > MOST_NAMED:
        damage.append(Damage(name, None, f"{len(told) - MOST_NAMED} more rows were passed over"))
    return read.filter(~bad), damage


def _taken(key: str) -> pl.Expr:
    """Return a column of text as values; null where it cannot be taken."""
    import polars as pl

    text = pl.col(key).str.strip_chars()
    kind = _KIND[key]
    if kind == "bool":
        word = text.str.to_lowercase()  # a spreadsheet writes TRUE
        return pl.when(word == "true").then(True).when(word == "false").then(False)
    if kind == "str":
        return text.cast(pl.Enum(STATUSES), strict=False)
    if key == "action":
        text = pl.when(text.str.contains(r"^\[.*\]$")).then(pl.lit("-1")).otherwise(text)
    number = text.cast(pl.Float64, strict=False)
    if kind == "int64" or key == "steps":
        return pl.when((number % 1 == 0) & (number.abs() < HIGHEST_WHOLE)).then(number).cast(pl.Int32, strict=False)
    return pl.when(number.abs() < HIGHEST).then(number)


def _bad_cells(cells: pl.DataFrame, read: pl.DataFrame):
    """Yield (line, what is wrong) of rows with a value that cannot be taken."""
    for text, value in zip(cells.iter_rows(named=True), read.iter_rows(named=True), strict=True):
        key = next(key for key, taken in value.items() if taken is None)
        yield text["line"], f"{key} is {text[key]!r}"
