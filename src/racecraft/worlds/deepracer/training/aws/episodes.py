"""Cut the ticks of cars that drive side by side into whole episodes, one after the other, as one car would drive them.

An episode often spans several of our iterations. `EpisodeCutter` keeps its ticks until it ends, and hands episodes
over in the order in which they ended; of two that ended in the same tick, the car with the lower number comes first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from racecraft.contract.world import Array

STATUSES = ("in_progress", "prepare", "lap_complete", "off_track", "crashed", "immobilized", "reversed", "time_up")
"""Words for how a tick stands; the code is the index."""
TIME_UP = STATUSES.index("time_up")

TICK = np.dtype(
    [
        ("tick", "i4"),
        ("x_m", "f8"), ("y_m", "f8"), ("yaw_rad", "f8"),
        ("steering_rad", "f8"), ("speed_mps", "f8"), ("action", "i4"),
        ("reward", "f8"), ("done", "?"), ("status", "u1"), ("all_wheels_on_track", "?"),
        ("progress_share", "f8"), ("closest_waypoint", "i4"), ("track_length_m", "f8"),
    ]
)  # fmt: skip
"""One tick of one car, in the words and units of `formats/episodes.py`; the status as a code."""


class EpisodeCutter:
    """Holds the ticks of episodes that have not ended yet."""

    def __init__(self) -> None:
        self._ticks = np.empty(0, TICK)
        """Of unfinished episodes, ordered by car, then by time."""
        self._cars = np.empty(0, np.int32)

    def cut(self, columns: Mapping[str, Array]) -> list[Array]:
        """Return the episodes that end within these ticks, each TICK (T,), in the order in which they end.

        Args:
            columns: Ticks of N cars, ordered by car, then by time: what `EpisodeRecorder.take` gives. The cars have
                set out in the same tick; one may have fewer ticks than another because it was parked.

        Episodes that were broken off (their car begins anew without an end) are left out.
        """
        fresh = as_ticks(columns)
        worlds = _cars_of(columns)
        moment = np.arange(len(fresh)) - np.searchsorted(worlds, worlds)
        order = np.argsort(np.concatenate([self._cars, worlds.astype(np.int32)]), kind="stable")
        old = len(self._ticks)
        ticks = np.concatenate([self._ticks, fresh])[order]
        cars = np.concatenate([self._cars, worlds.astype(np.int32)])[order]
        moment = np.concatenate([np.full(old, -1), moment])[order]
        if not len(ticks):
            return []
        change = np.append(True, cars[1:] != cars[:-1])
        begins = np.flatnonzero(change | (ticks["tick"] == 1))
        lasts = np.append(begins[1:], len(ticks)) - 1
        whole = ticks["tick"][begins] == 1
        ended = ticks["done"][lasts]
        latest = np.append(change[begins[1:]], True)
        self._keep(ticks, cars, begins, lasts, whole & ~ended & latest)
        chosen = np.flatnonzero(whole & ended)
        chosen = chosen[np.lexsort((cars[lasts[chosen]], moment[lasts[chosen]]))]
        return [ticks[begins[place] : lasts[place] + 1] for place in chosen.tolist()]

    def state(self) -> dict[str, Any]:
        """Return the unfinished episodes, as named arrays."""
        return {"cars": self._cars, "ticks": apart(self._ticks)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self._cars = np.asarray(state["cars"])
        self._ticks = together(state["ticks"])

    def _keep(self, ticks: Array, cars: Array, begins: Array, lasts: Array, chosen: Array) -> None:
        steps = np.zeros(len(ticks) + 1, np.int64)
        np.add.at(steps, begins[chosen], 1)
        np.add.at(steps, lasts[chosen] + 1, -1)
        kept = np.cumsum(steps[:-1]) > 0
        self._ticks, self._cars = ticks[kept], cars[kept]


def _cars_of(columns: Mapping[str, Array]) -> Array:
    """Return a number for the car of each tick, rising as the ticks are ordered: its world, then itself."""
    worlds = np.asarray(columns["world"])
    if "agent" not in columns:
        return worlds
    agents = np.asarray(columns["agent"])
    return worlds * (agents.max(initial=0) + 1) + agents


def as_ticks(columns: Mapping[str, Array]) -> Array:
    """Return a table of ticks as TICK (T,). A last tick that is still in progress ran out of time."""
    ticks = np.empty(len(columns["tick"]), TICK)
    for name in TICK.names or ():
        if name != "status":
            ticks[name] = columns[name]
    words = np.asarray(columns["status"])
    ticks["status"] = 0
    for code, word in enumerate(STATUSES):
        if code:
            ticks["status"][words == word] = code
    ticks["status"][ticks["done"] & (ticks["status"] == 0)] = TIME_UP
    return ticks


def apart(ticks: Array) -> dict[str, Array]:
    """Return TICK (T,) as one array a column."""
    return {name: np.ascontiguousarray(ticks[name]) for name in TICK.names or ()}


def together(columns: Mapping[str, Array]) -> Array:
    """Return what `apart` took apart."""
    ticks = np.zeros(len(columns["tick"]), TICK)
    for name in TICK.names or ():
        if name in columns:  # what was taken apart before courses could differ tells no length
            ticks[name] = columns[name]
    return ticks
