"""Laps and other drives on which every reward is tried, from the fastest known to the clumsiest.

`stock.npz` beside this page is made by `scripts/make_reward_stock.py`: 15 laps and 4 drives that leave the road on each
of three tracks, driven with car v6 in the simulator. Begin with `read_stock`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.poses import reports_of
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

STOCK_FILE = Path(__file__).with_name("stock.npz")
TRACKS = ("reinvent_base", "reInvent2019_track_cw", "caecer_loop")
"""A short one, one driven clockwise, and the widest; the first is the one most racers begin on."""


@dataclass(frozen=True, eq=False)
class Drive:
    """One lap from rest, or a drive that left the road."""

    track: Track
    title: str
    """Who drove: "centre line up to 2 m/s, weaving"."""
    is_lap: bool
    rows: Array
    """(T, 5) as `poses.reports_of` takes it."""

    @property
    def seconds(self) -> float:
        """How long it took from the start, s; of a lap the lap time."""
        return (len(self.rows) + 1) * TICK_SECONDS

    @cached_property
    def reports(self) -> Array:
        """TICK_REPORT (T,)."""
        return reports_of(self.track, self.rows)


@cache
def read_stock() -> tuple[Drive, ...]:
    """Return every drive, by track and from fast to slow, the failed ones last."""
    drives = []
    with np.load(STOCK_FILE, allow_pickle=False) as stock:
        for key in stock.files:
            track, _, kind, title = key.split("/", 3)
            drives.append(Drive(_track(track), title, kind == "lap", stock[key].astype(np.float64)))
    return tuple(drives)


@cache
def _track(name: str) -> Track:
    return load_track(name)
