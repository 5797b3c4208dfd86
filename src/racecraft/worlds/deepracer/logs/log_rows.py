"""Rows in the text of a simulation log, old or new, and what the log says beside them.

Begin with `read_log`. A row is what follows SIM_TRACE_LOG: on a line; newer logs write the names of nodes in front.
"""

from __future__ import annotations

import contextlib
import itertools
import re
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.formats.json_text import parse_json
from racecraft.worlds.deepracer.files.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.worlds.deepracer.files.simulation_log import PREFIX
from racecraft.worlds.deepracer.logs.csv_rows import CHUNK_BYTES, Text, read_rows
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source
from racecraft.worlds.deepracer.logs.spreadsheets import as_plain_text

if TYPE_CHECKING:
    import polars as pl

_MARK = PREFIX.encode()
_ENDED = re.compile(rb"Worker=(\d+), Episode=(\d+),[^\n]*?Training iteration=(\d+)")
_WORLD = re.compile(r"WORLD_NAME['\"]?:?\s*=?\s*['\"]?([A-Za-z0-9_\-]+)(?![\w\-]|\.\.\.)")
"""The track's name; not where roslaunch cuts it off in its list of parameters (`/WORLD_NAME: 2022_reinvent_cha...`)."""
_NODE = re.compile(r"^\s*(?:\[[^\]]*\]\s+)+", re.MULTILINE)
_HYPERPARAMETERS = re.compile(r"Using the following hyper-parameters\s*(\{.*?\})", re.DOTALL)
_ROS_1 = re.compile(r"/rosdistro: |started roslaunch server|ROS_DISTRO=(?:kinetic|melodic|noetic)")
_ROS_2 = re.compile(r"\bros2 launch\b|\[INFO\] \[launch\]|ros_gz_bridge")
_PAIR = re.compile(rb"\[([^\[\],]*),([^\[\],]*)\]")
"""A continuous action with a comma between angle and speed, as the console's logs of 2023 have it."""
_METADATA_VERSION = re.compile(r"simapp_version (\d+)")
_JOB_TYPE = re.compile(r"JOB_TYPE'?: '?(TRAINING|EVALUATION)")
_ACTIONS = re.compile(r"ction space from file: (.+)")
_FEWEST = sum(column.required for column in TRACE_COLUMNS)
_VERSIONS = {fields: NAMES[:fields] for fields in range(_FEWEST, len(NAMES) + 1)}
_VERSIONS[18] = (*NAMES[:17], NAMES[18])  # between 2022 and 2026 the count of obstacles was left out
"""How many values a row has → their names; a log that was written by several simulators has several."""
HEAD_BYTES = 1 << 20
SAMPLED_ROWS = 200
MIN_WALL_CLOCK = 1e9
"""s since 1970; a smaller number is no time of day."""
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
        AWS's columns in AWS's units and `file`, `line`, `iteration`; what was damaged; and what the log says of world,
        hyperparameters and actions.
    """
    import polars as pl

    try:
        with source.open() as file:
            source, notes = as_plain_text(source, file.read(2))
        header = _header(source)
    except OSError as error:
        return pl.DataFrame(), [Damage(source.name, None, f"cannot be read ({error.strerror}); left out")], {}
    if not header:
        return pl.DataFrame(), [], {}
    wide = [Damage(source.name, None, notes)] if notes else []
    if not _FEWEST <= len(header) <= len(NAMES):
        what = f"{len(header)} values in a row where {_FEWEST} to {len(NAMES)} are expected; left out"
        return pl.DataFrame(), [Damage(source.name, None, what)], {}
    others: list[bytes] = []
    frame, damage = read_rows(_texts(place, source, header, others), _VERSIONS)
    between = b"".join(others)
    says = (before or {}) | what_it_says(between)
    if frame.height:
        frame = _with_obstacles(frame).with_columns(_iterations(frame["episode"], between, says, source.phase))
    return frame, wide + damage, says


def rows_behind(source: Source, text: str) -> Iterator[tuple[str, ...]]:
    """Yield episode, tick, X and Y of each row of a log before which a line holds a text, as they are written.

    What stands before the first row is the log's head. A file that cannot be read holds nothing.
    """
    wanted, is_there, has_begun = text.encode(), False, False
    with contextlib.suppress(OSError):
        with source.open() as file:
            source, _ = as_plain_text(source, file.read(2))
        with source.open() as file:
            for line in file:
                before, mark, row = line.partition(_MARK)
                fields = row.decode("utf-8", errors="replace").split(",", 4)[:4]
                if mark and is_there and len(fields) == 4:
                    yield tuple(fields)
                has_begun |= bool(mark)
                is_there = not mark and has_begun and (is_there or wanted in before)


def _texts(place: int, source: Source, header: tuple[str, ...], others: list[bytes]) -> Iterator[Text]:
    """Cut the rows out of a log, CHUNK_BYTES at a time; the other lines are put into `others`."""
    rows: list[bytes] = []
    lines: list[int] = []
    size = 0
    with source.open() as file:
        for number, line in enumerate(file, 1):
            before, mark, row = line.partition(_MARK)
            if not mark:
                others.append(before)
                continue
            rows.append(_fields(row).rstrip(b"\n") + b"\n")
            lines.append(number)
            size += len(row)
            if size >= CHUNK_BYTES:
                yield Text(place, source.name, header, b"".join(rows), np.array(lines, np.int32))
                rows, lines, size = [], [], 0
    if lines:
        yield Text(place, source.name, header, b"".join(rows), np.array(lines, np.int32))


def _fields(row: bytes) -> bytes:
    """Return the values of a row with commas between values alone."""
    fields = row.split(b"\t", 1)[0]
    return _PAIR.sub(rb"[\1\2]", fields) if b"[" in fields else fields


def _header(source: Source) -> tuple[str, ...]:
    """Return AWS's names of a log's columns, by how many values most of its first rows have; () where it has no row."""
    counts: Counter[int] = Counter()
    for line in itertools.islice(_lines_with_rows(source), SAMPLED_ROWS):
        counts[_fields(line.split(_MARK, 1)[1]).count(b",") + 1] += 1
    fields = counts.most_common(1)[0][0] if counts else 0
    return _VERSIONS.get(fields, ("",) * fields)


def _with_obstacles(frame: pl.DataFrame) -> pl.DataFrame:
    """Return rows of 18 values with the last under its name: seconds since 1970, or in 2022 the count of obstacles."""
    import polars as pl

    if "wall_clock" not in frame.columns or "obstacle_crash_counter" in frame.columns:
        return frame
    if (frame["wall_clock"].max() or 0.0) > MIN_WALL_CLOCK:  # type: ignore[operator]
        return frame
    counted = pl.col("wall_clock").cast(pl.Int32, strict=False).alias("obstacle_crash_counter")
    return frame.with_columns(counted).drop("wall_clock")


def _lines_with_rows(source: Source) -> Iterator[bytes]:
    with source.open() as file:
        yield from (line for line in file if _MARK in line)


def _iterations(episodes: pl.Series, data: bytes, says: dict[str, Any], phase: str | None) -> pl.Series:
    """Return the iteration of each row: as the log's own lines tell, else by the episodes an iteration takes."""
    import polars as pl

    iteration_of = {int(episode) - 1: int(iteration) for _, episode, iteration in _ENDED.findall(data)}
    per = says.get("hyperparameters", {}).get("num_episodes_between_training", USUAL_EPISODES)
    per = per if isinstance(per, int) and per > 0 else USUAL_EPISODES
    counted = pl.Series("iteration", episodes // per, dtype=pl.Int32)
    if phase in ("evaluation", "leaderboard"):
        return pl.Series("iteration", [0], dtype=pl.Int32).new_from_index(0, len(episodes))
    if len(set(iteration_of.values())) < 2:  # some simulators say iteration 0 of every episode
        return counted
    known = pl.DataFrame(
        {"episode": list(iteration_of), "told": list(iteration_of.values())}, schema_overrides={"episode": pl.Int32}
    )
    joined = pl.DataFrame({"episode": episodes, "counted": counted}).join(known, on="episode", how="left")
    return joined.select(pl.coalesce("told", "counted").cast(pl.Int32).alias("iteration"))["iteration"]


def what_it_says(data: bytes) -> dict[str, Any]:
    """Return what the head of a log says of world, build, phase, metadata version, hyperparameters and actions."""
    raw = data[:HEAD_BYTES].decode("utf-8", errors="replace")
    head = _NODE.sub("", raw)
    says: dict[str, Any] = {}
    if world := _WORLD.search(head):
        says["world"] = world[1]
    if _ROS_1.search(raw) or _ROS_2.search(raw):
        says["build"] = "ROS 1" if _ROS_1.search(raw) else "ROS 2"
    if match := _JOB_TYPE.search(raw):
        says["phase"] = match[1].lower()
    if match := _METADATA_VERSION.search(head):
        says["version"] = match[1]
    if match := _HYPERPARAMETERS.search(head):
        says |= _json("hyperparameters", match[1])
    if match := _ACTIONS.search(head):
        says |= _json("action_space", match[1].replace("'", '"'))
    return says


def _json(key: str, text: str) -> dict[str, Any]:
    try:
        return {key: parse_json(text)}
    except ValueError:
        return {}
