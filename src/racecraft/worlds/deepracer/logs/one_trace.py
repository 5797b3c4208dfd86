"""One recorded drive in AWS's columns and units, for replay. Begin with `read_sim_trace`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.sim_trace import TRACE_COLUMNS, SimTrace
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.log_rows import read_log
from racecraft.worlds.deepracer.logs.sources import LOG, TRACE, find_sources
from racecraft.worlds.deepracer.logs.trace_rows import read_traces

EXPECTED = "a simulation trace (.csv) or log with a valid row"


def read_sim_trace(path: str | Path) -> SimTrace:
    """Read a simulation trace, or the rows of a simulation log.

    Raises:
        LogError: The file is missing or of another kind, lacks a column, or none of its rows is valid.
    """
    path = Path(path)
    if path.is_dir():
        raise LogError(path, "a folder", EXPECTED)
    source = find_sources(path)[0]
    if source.kind == LOG:
        frame, damage, _ = read_log(0, source)
    elif source.kind == TRACE:
        frame, damage = read_traces([(0, source)])
    else:
        raise LogError(path, Message("a file of {kind}", kind=source.kind), EXPECTED)
    if not frame.height:
        found = damage[0].what if damage else "the file holds no rows"
        raise LogError(path, found, EXPECTED, line=damage[0].line if damage else None)
    columns = {column.name: column.dtype for column in TRACE_COLUMNS if column.name in frame.columns}
    arrays = {name: _array(frame[name].to_numpy(), dtype) for name, dtype in columns.items()}
    return SimTrace(arrays, tuple(map(str, damage)))


def _array(values: Array, dtype: str) -> Array:
    return values.astype(str) if dtype == "str" else values.astype(np.dtype(dtype), copy=False)
