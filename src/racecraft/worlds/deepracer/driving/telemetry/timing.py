"""What laps came to, sector by sector and corner by corner. Begin with `time_laps`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.telemetry.corners import THE_STRAIGHT, Corner, find_corners
from racecraft.worlds.deepracer.driving.telemetry.laps import Laps

SECTORS = 3
MIN_LAPS = 3
"""Of fewer laps neither a spread nor a correlation is told."""


@dataclass(frozen=True, eq=False)
class LapTiming:
    """The times of L laps in S sectors and in the zones of C corners. A track without corners has one zone."""

    laps: Laps
    corners: tuple[Corner, ...]
    sector_edges: Array
    """(S + 1,) pieces at which sectors begin and end."""
    sector_seconds: Array
    """(L, S)."""
    zone_of: Array
    """(N,) the zone of each piece, counted from 0."""
    zone_seconds: Array
    """(L, Z)."""
    rolling_zone_seconds: Array
    """(L, Z) without zones in which the car gathered speed from a standing start: nan there."""

    @property
    def fastest(self) -> int:
        """The row of the fastest lap; of equals the first."""
        return int(np.argmin(self.laps.lap_seconds))

    @property
    def best_sector_seconds(self) -> Array:
        """(S,) the best time of any lap in each sector."""
        return np.asarray(self.sector_seconds.min(axis=0))

    @property
    def theoretical_best_seconds(self) -> float:
        """The best sectors together, s."""
        return float(self.best_sector_seconds.sum())

    @property
    def best_zone_rows(self) -> Array:
        """(Z,) the lap that was fastest in each zone."""
        return np.asarray(np.argmin(self.zone_seconds, axis=0))

    @property
    def spread_seconds(self) -> Array:
        """(Z,) half of the laps lie within so much of each other (interquartile range); nan of fewer than MIN_LAPS."""
        return np.array([_spread(times) for times in self.rolling_zone_seconds.T])

    @property
    def correlations(self) -> Array:
        """(Z,) Pearson's correlation of the time in a zone with the time of the lap, -1 to 1; nan where unknown."""
        rolling, lap = self.rolling_zone_seconds, self.laps.lap_seconds
        return np.array([correlation(times, lap) for times in rolling.T])

    def zone_name(self, zone: int) -> str:
        """Return "turn 3 (left)"; of a track without corners "the straight"."""
        return self.corners[zone].name if self.corners else THE_STRAIGHT


def time_laps(laps: Laps, sectors: int = SECTORS) -> LapTiming:
    """Return the times of laps in sectors of equal length and in the zones of the track's corners.

    Args:
        laps: One lap at least.
        sectors: How many, 1 or more.
    """
    pieces = laps.pieces
    edges = np.round(np.arange(sectors + 1) * pieces / sectors).astype(int)
    corners = find_corners(laps.track)
    zone_of = _zones(corners, laps.shares)
    count = max(1, len(corners))
    in_zone = zone_of[:, None] == np.arange(count)
    zones = laps.seconds @ in_zone
    gathers = (laps.gathering @ in_zone) > 0
    return LapTiming(
        laps,
        corners,
        edges,
        np.add.reduceat(laps.seconds, edges[:-1], axis=1),
        zone_of,
        zones,
        np.where(gathers, np.nan, zones),
    )


def correlation(a: Array, b: Array) -> float:
    """Return Pearson's correlation of the pairs that are numbers; nan of fewer than MIN_LAPS or where one is constant.

    >>> round(correlation(np.array([1.0, 2.0, 3.0, np.nan]), np.array([2.0, 4.0, 6.5, 1.0])), 3)
    0.998
    """
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    if len(a) < MIN_LAPS or a.std() < 1e-9 or b.std() < 1e-9:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


def _zones(corners: tuple[Corner, ...], shares: Array) -> Array:
    """Return the zone of each share of the lap; before the first zone of the lap is the last one."""
    if not corners:
        return np.zeros(len(shares), int)
    begins = np.array([corner.zone_begin for corner in corners])
    order = np.argsort(begins)
    found = np.searchsorted(begins[order], shares, side="right") - 1
    return np.asarray(order[found])


def _spread(times: Array) -> float:
    times = times[np.isfinite(times)]
    if len(times) < MIN_LAPS:
        return float("nan")
    low, high = np.percentile(times, (25, 75))
    return float(high - low)
