"""Recorded drives in AWS's columns and units, for replay. Begin with `read_recordings`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.sim_trace import TRACE_COLUMNS, SimTrace
from racecraft.worlds.deepracer.logs.about import Facts, facts_of
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.log_rows import read_log
from racecraft.worlds.deepracer.logs.sources import ABOUT, LOG, TRACE, Source, find_sources
from racecraft.worlds.deepracer.logs.trace_rows import read_traces

EXPECTED = "a simulation trace (.csv) or log with a valid row"


@dataclass(frozen=True)
class Recordings:
    """Files with recorded drives, and what stands beside them."""

    traces: tuple[tuple[str, SimTrace], ...]
    """Name and trace of each file, in the order in which they were written."""
    about: Facts
    """What logs and other files say beside the rows, as `about.facts_of` names it."""

    @property
    def build(self) -> str | None:
        """Build of the simulator, "ROS 1" or "ROS 2"; or None. Only the second writes `wall_clock`."""
        if any("wall_clock" in trace.columns for _, trace in self.traces):
            return "ROS 2"
        return self.about.get("build")


def read_recordings(paths: Iterable[str | Path]) -> Recordings:
    """Read whatever traces and logs lie at paths: files, archives, folders.

    Raises:
        LogError: There is nothing at a path, or no trace or log in it; a file holds no valid row.
    """
    traces: list[tuple[str, SimTrace]] = []
    about: Facts = {}
    for path in paths:
        sources = find_sources(path, traces_first=True)
        found = [(source.name, *_read(source)) for source in sources if source.kind in (TRACE, LOG)]
        if not found:
            raise LogError(path, "no simulation trace and no simulation log", EXPECTED)
        for name, trace, says in found:
            traces.append((name, trace))
            about = says | about
        for source in sources:
            if source.kind == ABOUT:
                about = facts_of(source) | about
    return Recordings(tuple(traces), about)


def read_sim_trace(path: str | Path) -> SimTrace:
    """Read a simulation trace, or the rows of a simulation log.

    Raises:
        LogError: The file is missing or of another kind, lacks a column, or none of its rows is valid.
    """
    path = Path(path)
    if path.is_dir():
        raise LogError(path, "a folder", EXPECTED)
    return _read(find_sources(path)[0])[0]


def _read(source: Source) -> tuple[SimTrace, Facts]:
    """Return the rows of a file, and what it says beside them."""
    says: Facts = {}
    if source.kind == LOG:
        frame, damage, says = read_log(0, source)
    elif source.kind == TRACE:
        frame, damage = read_traces([(0, source)])
    else:
        raise LogError(source.name, Message("a file of {kind}", kind=source.kind), EXPECTED)
    if not frame.height:
        found = damage[0].what if damage else "the file holds no rows"
        raise LogError(source.name, found, EXPECTED, line=damage[0].line if damage else None)
    columns = {column.name: column.dtype for column in TRACE_COLUMNS if column.name in frame.columns}
    arrays = {name: _array(frame[name].to_numpy(), dtype) for name, dtype in columns.items()}
    return SimTrace(arrays, tuple(map(str, damage))), says


def _array(values: Array, dtype: str) -> Array:
    return values.astype(str) if dtype == "str" else values.astype(np.dtype(dtype), copy=False)
