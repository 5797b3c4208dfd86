"""The latest ticks of a training that is watched: one small file in the run folder, written whole, for any reader.

Whoever watches says so by touching `watched` (`say_watched`); a training that sees it fresh leaves its latest ticks in
`live.safetensors` about once a second, and one that nobody watches writes nothing. Nobody needs the file tomorrow, so
it is moved into place without waiting for the disk. Columns are those of `formats/episodes.py`, as arrays (T, C): T
ticks of C cars, `status` as an index of `STATUSES` there. Where boxes or bots are on the road, `objects.4` says where
they were in the N worlds from number 4 on: (T, N, K, 3), x and y in m, yaw in rad.
"""

from __future__ import annotations

import json
import os
import struct
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import safetensors
import safetensors.numpy

from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder

KIND = "racecraft live ticks"
OBJECTS = "objects."
"""What the name of an array of boxes and bots begins with; the number of its first world follows."""
WATCHED_SECONDS = 5.0
"""Who watches says so more often than this."""


@dataclass(frozen=True)
class LiveTicks:
    """T consecutive ticks of C cars."""

    last: int
    """Number of the last tick, counted from the training's begin in this process."""
    written: float
    """Seconds since 1970 at which it was left."""
    columns: Mapping[str, Array]
    """(T, C) by name; objects (T, N, K, 3)."""


def say_watched(run: RunFolder) -> None:
    """Tell a training that somebody watches; in a folder that cannot be written to, it is not told."""
    with suppress(OSError):
        run.watched.touch()


def is_watched(run: RunFolder) -> bool:
    """Tell whether somebody has said so lately."""
    try:
        return time.time() - run.watched.stat().st_mtime < WATCHED_SECONDS
    except OSError:
        return False


def write_live_ticks(run: RunFolder, last: int, columns: Mapping[str, Array]) -> None:
    """Leave the latest ticks, in one move; a disk that does not take them costs the training nothing.

    Args:
        run: Where.
        last: Number of the last tick.
        columns: (T, C) by name, contiguous; objects (T, N, K, 3).
    """
    metadata = {"format": KIND, "last": str(last), "written": repr(time.time())}
    part = run.live.with_name(run.live.name + ".part")
    with suppress(OSError):
        part.write_bytes(safetensors.numpy.save(dict(columns), metadata))
        os.replace(part, run.live)


def read_live_ticks(run: RunFolder) -> LiveTicks | None:
    """Return the latest ticks; None where there are none that can be read."""
    try:
        data = run.live.read_bytes()
        columns = safetensors.numpy.load(data)
        (length,) = struct.unpack_from("<Q", data)
        metadata = json.loads(data[8 : 8 + length])["__metadata__"]
        if metadata["format"] != KIND:
            return None
        return LiveTicks(int(metadata["last"]), float(metadata["written"]), columns)
    except (OSError, ValueError, KeyError, struct.error, safetensors.SafetensorError):
        return None


def forget_live_ticks(run: RunFolder) -> None:
    """Take the file away: what it shows is over."""
    with suppress(OSError):
        run.live.unlink(missing_ok=True)
