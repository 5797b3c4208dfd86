"""Rows in the text of a simulation log, old or new, and what the log says beside them.

Begin with `read_log`. A row is what follows SIM_TRACE_LOG: on a line; newer logs write the names of nodes in front.
"""

from __future__ import annotations

import json
import re
from io import BytesIO
from typing import TYPE_CHECKING, Any

from racecraft.formats.aws.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.logs.careful import read_carefully
from racecraft.logs.errors import Damage
from racecraft.logs.sources import Source
from racecraft.logs.trace_rows import in_file, tidy, trace_schema, unsound_files

if TYPE_CHECKING:
    import polars as pl

MARK = "SIM_TRACE_LOG:"
_ENDED = re.compile(rb"Worker=(\d+), Episode=(\d+),[^\n]*?Training iteration=(\d+)")
_WORLD = re.compile(r"WORLD_NAME:?\s*=?\s*([A-Za-z0-9_\-]+)")
_NODE = re.compile(r"^\s*(?:\[[^\]]*\]\s+)+", re.MULTILINE)
_HYPERPARAMETERS = re.compile(r"Using the following hyper-parameters\s*(\{.*?\})", re.DOTALL)
_ACTIONS = re.compile(r"ction space from file: (.+)")
_FEWEST = sum(column.required for column in TRACE_COLUMNS)
HEAD_BYTES = 1 << 20
USUAL_EPISODES = 20
"""Episodes an iteration where a log does not say (the console's default)."""


def read_log(
    place: int, source: Source, before: dict[str, Any] | None = None
) -> tuple[pl.DataFrame, list[Damage], dict[str, Any]]:
    """Read one log.

    Args:
        place: Index of the file among the table's files.
        source: The log.
        before: What earlier pieces of a log that rolled over said.

    Returns:
        AWS's columns and `file`, `line`, `iteration`; what was damaged; and what the log says of world, hyperparameters
        and actions.
    """
    import polars as pl

    data = source.read()
    rows = _rows_in(data)
    if not rows.height:
        return pl.DataFrame(), [], {}
    says = (before or {}) | what_it_says(data)
    frame, damage = _rows(place, source, rows)
    if frame.height:
        frame = frame.with_columns(_iterations(frame["episode"], data, says, source.phase))
    return frame, damage, says


def _rows_in(data: bytes) -> pl.DataFrame:
    """Return the rows as text: `line`, counted from 1, and `row`, what follows the mark."""
    import polars as pl

    if MARK.encode() not in data:
        return pl.DataFrame({"line": [], "row": []}, schema={"line": pl.Int32, "row": pl.String})
    lines = pl.read_csv(
        BytesIO(data), has_header=False, separator="\x1f", quote_char=None, schema={"row": pl.String},
        row_index_name="line", row_index_offset=1, encoding="utf8-lossy", truncate_ragged_lines=True,
    )  # fmt: skip
    lines = lines.filter(pl.col("row").str.contains(MARK, literal=True))
    after = pl.col("row").str.slice(pl.col("row").str.find(MARK, literal=True) + len(MARK))
    return lines.select(
        pl.col("line").cast(pl.Int32), after.str.split_exact("\t", 0).struct.field("field_0").alias("row")
    )


def _rows(place: int, source: Source, rows: pl.DataFrame) -> tuple[pl.DataFrame, list[Damage]]:
    import polars as pl

    fields = _usual_count(rows["row"])
    if not _FEWEST <= fields <= len(NAMES):
        what = f"{fields} values in a row where {_FEWEST} to {len(NAMES)} are expected; left out"
        return pl.DataFrame(), [Damage(source.name, None, what)]
    header = list(NAMES[:fields])
    if fields == 18:  # between 2022 and 2026 the count of obstacles was left out
        header = [*NAMES[:17], NAMES[18]]
    text = BytesIO()
    rows.select("row").write_csv(text, include_header=False, quote_style="never")
    for continuous in (False, True):
        schema = trace_schema(header) | ({"action": pl.String()} if continuous else {})
        try:
            frame = pl.read_csv(text.getvalue(), schema=schema, has_header=False, quote_char=None)
        except pl.exceptions.PolarsError:
            continue
        if frame.height != rows.height:
            break
        frame = frame.with_columns(pl.lit(place, pl.UInt32).alias("file"), rows["line"])
        if not unsound_files(frame, tuple(header)):
            return tidy(frame, header), []
        break
    frame, damage = read_carefully(source.name, header, rows["line"].to_list(), rows["row"].to_list())
    return in_file(tidy(frame, header), place), damage


def _usual_count(rows: pl.Series) -> int:
    """Return how many values most rows have; a sample tells."""
    sample = rows.gather_every(max(1, len(rows) // 200))
    return 1 + int(sample.str.count_matches(",", literal=True).mode().max() or 0)  # type: ignore[arg-type]


def _iterations(episodes: pl.Series, data: bytes, says: dict[str, Any], phase: str | None) -> pl.Series:
    """Return the iteration of each row: as the log's own lines tell, else by the episodes an iteration takes."""
    import polars as pl

    told = {int(episode) - 1: int(iteration) for _, episode, iteration in _ENDED.findall(data)}
    per = says.get("hyperparameters", {}).get("num_episodes_between_training", USUAL_EPISODES)
    per = per if isinstance(per, int) and per > 0 else USUAL_EPISODES
    counted = pl.Series("iteration", episodes // per, dtype=pl.Int32)
    if phase in ("evaluation", "leaderboard"):
        return pl.Series("iteration", [0], dtype=pl.Int32).new_from_index(0, len(episodes))
    if not told:
        return counted
    known = pl.DataFrame({"episode": list(told), "told": list(told.values())}, schema_overrides={"episode": pl.Int32})
    joined = pl.DataFrame({"episode": episodes, "counted": counted}).join(known, on="episode", how="left")
    return joined.select(pl.coalesce("told", "counted").cast(pl.Int32).alias("iteration"))["iteration"]


def what_it_says(data: bytes) -> dict[str, Any]:
    """Return what the head of a log says of world, hyperparameters and action space."""
    head = _NODE.sub("", data[:HEAD_BYTES].decode("utf-8", errors="replace"))
    says: dict[str, Any] = {}
    if world := _WORLD.search(head):
        says["world"] = world[1]
    if match := _HYPERPARAMETERS.search(head):
        says |= _json("hyperparameters", match[1])
    if match := _ACTIONS.search(head):
        says |= _json("action_space", match[1].replace("'", '"'))
    return says


def _json(key: str, text: str) -> dict[str, Any]:
    try:
        return {key: json.loads(text)}
    except ValueError:
        return {}
