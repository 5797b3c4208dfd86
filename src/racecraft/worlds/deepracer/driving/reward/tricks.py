"""What pays more than lapping: drives that nobody wants, against the best paid lap. Begin with `try_tricks`.

Standing, creeping and circling could go on for ever, so their pay a second is compared with that of laps. Leaving the
road ends the episode, so its sum is compared with the sum of a lap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.poses import place_on_road, reports_of
from racecraft.worlds.deepracer.driving.reward.stock import Drive
from racecraft.worlds.deepracer.env.vehicle import MIN_SPEED_MPS, TICK_SECONDS
from racecraft.worlds.deepracer.tracks.track import Track

TICKS = 300
"""Of standing, creeping and circling: 20 s."""
CREEP_MPS, CIRCLE_MPS, CALM_MPS = 0.2, 1.0, 1.0
CIRCLE_M = 0.5
"""Radius of the tightest circle that car v6 drives."""
LEAVING_TICKS = 8
MARGIN = 0.02
"""A trick pays more when it pays so much more, as a share of what the lap pays."""
STANDING, CREEPING, CIRCLING = "standing still", "creeping", "circling"
LEAVING_AT_ONCE, LEAVING_AT_THE_END = "leaving the road at once", "leaving the road at the end"


@dataclass(frozen=True)
class Trick:
    """A trick and the lap it is compared with."""

    name: str
    pays: float
    """A second, or in sum where `is_sum`."""
    lap_pays: float
    """Likewise, of the best paid lap."""
    is_sum: bool

    @property
    def pays_more(self) -> bool:
        """Whether the trick pays clearly more than every lap."""
        return self.pays > self.lap_pays + MARGIN * abs(self.lap_pays) + 1e-9

    @property
    def pays_the_same(self) -> bool:
        """Whether the trick pays as much as the best paid lap, or nearly."""
        return not self.pays_more and self.pays >= self.lap_pays - MARGIN * abs(self.lap_pays) - 1e-9

    @property
    def unit(self) -> str:
        """Of both pays."""
        return "in sum" if self.is_sum else "a second"

    @property
    def answer(self) -> str:
        """Whether the trick pays "more", "as much" or "less"."""
        return "more" if self.pays_more else "as much" if self.pays_the_same else "less"


def try_tricks(payer: Payer, stock: tuple[Drive, ...], sums: list[float]) -> list[Trick]:
    """Return every trick and what it pays.

    Args:
        payer: The reward function.
        stock: The drives.
        sums: What each of them earned, in their order; NaN where it failed.
    """
    narrow, wide = stock[0].track, max({drive.track for drive in stock}, key=lambda track: track.width_mean)
    tricks = []
    for name, track, drive in ((STANDING, narrow, _stand(narrow)), (CREEPING, narrow, _creep(narrow)),
                               (CIRCLING, wide, _circle(wide))):  # fmt: skip
        rates = [
            total / one.seconds for one, total in zip(stock, sums, strict=True) if one.is_lap and one.track is track
        ]
        calm = _calm_lap(track)
        best = max([*rates, _sum(payer, track, calm) / (len(calm) * TICK_SECONDS)])
        tricks.append(Trick(name, _sum(payer, track, drive) / (TICKS * TICK_SECONDS), best, is_sum=False))
    laps = [(total, one) for one, total in zip(stock, sums, strict=True) if one.is_lap and one.track is narrow]
    failed = [total for one, total in zip(stock, sums, strict=True) if not one.is_lap and one.track is narrow]
    best_sum, _ = max(laps, key=lambda pair: pair[0])
    tricks.append(Trick(LEAVING_AT_ONCE, max(failed), best_sum, is_sum=True))
    fast_sum, fastest = min(laps, key=lambda pair: pair[1].seconds)
    tricks.append(Trick(LEAVING_AT_THE_END, _sum(payer, narrow, _leave(fastest)), fast_sum, is_sum=True))
    return tricks


def _sum(payer: Payer, track: Track, drive: Array) -> float:
    return float(np.nansum(payer.compute_rewards(track, reports_of(track, drive)).rewards))


def _stand(track: Track) -> Array:
    """Return a car that stays at the start."""
    return place_on_road(track, np.zeros(TICKS), np.zeros(TICKS), np.zeros(TICKS), 0.0, MIN_SPEED_MPS)


def _creep(track: Track) -> Array:
    """Return a car that creeps along the centre line."""
    arcs = np.arange(TICKS) * CREEP_MPS * TICK_SECONDS
    return place_on_road(track, arcs, np.zeros(TICKS), np.zeros(TICKS), 0.0, CREEP_MPS)


def _circle(track: Track) -> Array:
    """Return a car that drives in a circle round a place of the centre line, where the road is widest."""
    middle = track.pose_at(track.arc[int(np.argmax(track.widths))])
    turned = np.arange(TICKS) * CIRCLE_MPS * TICK_SECONDS / CIRCLE_M
    x, y = middle.x + CIRCLE_M * np.cos(turned), middle.y + CIRCLE_M * np.sin(turned)
    yaw = (turned + 0.5 * np.pi + np.pi) % (2.0 * np.pi) - np.pi
    return np.column_stack([x, y, yaw, np.full(TICKS, np.radians(30.0)), np.full(TICKS, CIRCLE_MPS)])


def _calm_lap(track: Track) -> Array:
    """Return one lap along the centre line, exactly."""
    arcs = np.arange(0.0, track.length, CALM_MPS * TICK_SECONDS)
    return place_on_road(track, arcs, np.zeros(len(arcs)), np.zeros(len(arcs)), 0.0, CALM_MPS)


def _leave(lap: Drive) -> Array:
    """Return a lap that leaves the road to the right just before the finish."""
    rows = lap.rows[:-LEAVING_TICKS].copy()
    reports = lap.reports[-LEAVING_TICKS:]
    offsets = -np.linspace(0.1, 1.0, LEAVING_TICKS) * lap.track.width_mean
    away = place_on_road(lap.track, reports["arc"], offsets, np.full(LEAVING_TICKS, -0.4), np.radians(-30.0), 1.0)
    return np.concatenate([rows, away])
