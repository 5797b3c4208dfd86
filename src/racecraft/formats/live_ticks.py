"""Some ticks of a training for whoever asks for them: one small file in the run folder, written whole, for any reader.

Who wants ticks that `live.safetensors` does not hold yet touches `watched`: a wish (`request_ticks`). A training that
sees a new one keeps its next ticks, leaves them in `live.safetensors`, and goes on as if nobody watched until the next
wish; who plays them asks again in time. So a training nobody wishes anything of writes nothing, and one that is watched
writes as often as somebody has played what there was. Nobody needs the file tomorrow, so it is moved into place without
waiting for the disk. Columns are those of `formats/episodes.py`, as arrays (T, C): T ticks of C cars, `status` as an
index of `STATUSES` there. Where boxes or bots are on the road, `objects.4` says where they were in the N worlds from
number 4 on: (T, N, K, 3), x and y in m, yaw in rad.
"""

from __future__ import annotations

import os
import struct
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import safetensors
import safetensors.numpy

from racecraft.contract.world import Array
from racecraft.formats.json_text import parse_json
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.user_file import read_regular

KIND = "racecraft live ticks"
OBJECTS = "objects."
"""What the name of an array of boxes and bots begins with; the number of its first world follows."""
WISH_SECONDS = 3.0
"""So long a wish holds: who wished may be gone. Who still waits wishes again sooner than this."""
LIVE_SECONDS = 5.0
"""Ticks that were left longer ago are not live."""


@dataclass(frozen=True)
class LiveTicks:
    """T consecutive ticks of C cars."""

    last: int
    """Number of the last tick, counted from the training's begin in this process."""
    written: float
    """Seconds since 1970 at which it was left."""
    columns: Mapping[str, Array]
    """(T, C) by name; objects (T, N, K, 3)."""

    @property
    def are_live(self) -> bool:
        """Whether they were left just now."""
        return time.time() - self.written < LIVE_SECONDS


def request_ticks(run: RunFolder) -> None:
    """Ask a training for its next ticks; in a folder that cannot be written to, it is not told."""
    with suppress(OSError):
        run.watched.touch()


def latest_request(run: RunFolder) -> int | None:
    """Return when somebody last wished for ticks, ns since 1970, to be told from another wish; None: not lately."""
    try:
        wish = run.watched.stat().st_mtime_ns
    except OSError:
        return None
    return wish if time.time() - wish / 1e9 < WISH_SECONDS else None


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
        data = read_regular(run.live)
        columns = safetensors.numpy.load(data)
        (length,) = struct.unpack_from("<Q", data)
        metadata = parse_json(data[8 : 8 + length])["__metadata__"]
        if metadata["format"] != KIND:
            return None
        return LiveTicks(int(metadata["last"]), float(metadata["written"]), columns)
    except (OSError, ValueError, KeyError, struct.error, safetensors.SafetensorError):
        return None


def forget_live_ticks(run: RunFolder) -> None:
    """Take the file away: what it shows is over."""
    with suppress(OSError):
        run.live.unlink(missing_ok=True)
