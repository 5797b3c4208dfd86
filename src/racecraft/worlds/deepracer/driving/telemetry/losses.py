"""Where a lap loses time to another, and which corner to work on. Begin with `compare_lap`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming

NOTICEABLE_SECONDS = 1.0 / 15.0
"""One tick: a lap is timed no finer, so nothing below it is worth a sentence."""


@dataclass(frozen=True)
class ZoneLoss:
    """What a lap does in the zone of one corner, beside the reference. Times in s, speeds in m/s, distances in m."""

    name: str
    begin: float
    """Share of the lap at which the corner itself begins, and where it ends."""
    end: float
    seconds: float
    reference_seconds: float
    lost_seconds: float
    """Less than 0 where the lap is faster; without what a standing start costs."""
    slowest_mps: float
    """Driven, anywhere in the corner."""
    reference_slowest_mps: float
    apex_share: float
    """Where the car is nearest to the inside of the corner, a share of the lap."""
    apex_metres: float
    """How far inside the centre line it is there; negative: outside."""
    reference_apex_metres: float
    best_seconds: float
    """The fastest of all laps here."""
    spread_seconds: float
    """Half of all laps lie within so much; nan of too few."""
    correlation: float
    """Of the time here with the time of the lap, -1 to 1; nan of too few."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name; what is unknown is None."""
        return {name: _plain(value) for name, value in vars(self).items()}


@dataclass(frozen=True, eq=False)
class LapComparison:
    """One lap beside a reference."""

    timing: LapTiming
    row: int
    """The lap, a row of `timing.laps`."""
    reference: Reference
    delta_seconds: Array
    """(N,) how much time the lap has lost since the start line at the end of each piece."""
    start_seconds: float
    """What the lap's standing start costs beside the reference; 0 of a flying lap."""
    zones: tuple[ZoneLoss, ...]

    @property
    def lap(self) -> Reference:
        """The lap's own traces."""
        return of_lap(self.timing.laps, self.row, "this lap")

    @property
    def lost_seconds(self) -> float:
        """How much slower the lap is than the reference; less than 0 where it is faster."""
        return float(self.timing.laps.lap_seconds[self.row] - self.reference.lap_seconds)

    @property
    def worst(self) -> ZoneLoss | None:
        """The corner in which most time is lost; None where none costs a tick."""
        worst = max(self.zones, key=lambda zone: zone.lost_seconds)
        return worst if worst.lost_seconds >= NOTICEABLE_SECONDS else None

    def advice(self) -> str:
        """Return which corner to work on and what it is worth, a sentence or two."""
        worst, against = self.worst, self.reference.name
        if len(self.timing.laps) == 1 and abs(self.lost_seconds) < 1e-6:
            return "There is one lap and nothing to compare it with; give more laps, or name a lap with --against."
        start = (
            f" The standing start costs {self.start_seconds:.2f} s, which no corner gives back."
            if self.start_seconds >= NOTICEABLE_SECONDS
            else ""
        )
        if worst is None:
            most = max(zone.lost_seconds for zone in self.zones)
            if most <= 0.0:
                return f"No corner costs time beside {against}.{start}"
            return f"No corner costs a tick: at most {most:.2f} s each beside {against}.{start}"
        if self.lost_seconds <= NOTICEABLE_SECONDS:
            worth = f"it costs {worst.lost_seconds:.2f} s, which other places make good."
        else:
            worth = f"it is worth {worst.lost_seconds:.2f} s of the {self.lost_seconds:.2f} s to {against}."
        return f"Work on {worst.name}: {worth}{_how(worst)}{start}"


def compare_lap(timing: LapTiming, row: int, reference: Reference) -> LapComparison:
    """Return where a lap loses time to a reference.

    Args:
        timing: The laps of a log.
        row: Which of them.
        reference: On the same track, in as many pieces.
    """
    lap = of_lap(timing.laps, row, "this lap")
    lost = lap.seconds - reference.seconds
    starts = lap.gathering & ~reference.gathering
    zones = tuple(_zone(timing, zone, lap, reference, starts) for zone in range(timing.zone_seconds.shape[1]))
    return LapComparison(timing, row, reference, np.cumsum(lost), float(lost[starts].sum()), zones)


def _zone(timing: LapTiming, zone: int, lap: Reference, reference: Reference, starts: Array) -> ZoneLoss:
    inside = timing.zone_of == zone
    corner = timing.corners[zone] if timing.corners else None
    shares = timing.laps.shares
    begin, end, side = (corner.begin, corner.end, np.sign(corner.turn_rad)) if corner else (0.0, 1.0, 1.0)
    bend = (shares >= begin) & (shares < end) if begin < end else (shares >= begin) | (shares < end)
    rolling = inside & ~starts
    at = int(np.argmax(np.where(bend, side * lap.offset_m, -np.inf)))
    rows = timing.best_zone_rows
    return ZoneLoss(
        timing.zone_name(zone),
        float(begin),
        float(end),
        float(lap.seconds[inside].sum()),
        float(reference.seconds[inside].sum()),
        float((lap.seconds - reference.seconds)[rolling].sum()),
        _least(lap.speed_mps[bend & ~lap.gathering]),
        _least(reference.speed_mps[bend & ~reference.gathering]),
        float(shares[at]),
        float(side * lap.offset_m[at]),
        float((side * reference.offset_m)[bend].max()),
        float(timing.zone_seconds[rows[zone], zone]),
        float(timing.spread_seconds[zone]),
        float(timing.correlations[zone]),
    )


def _how(zone: ZoneLoss) -> str:
    """Return how the lap drives a corner otherwise than the reference, as far as that is clear."""
    reasons = []
    if zone.slowest_mps < 0.97 * zone.reference_slowest_mps:
        reasons.append(f"slows to {zone.slowest_mps:.2f} m/s there where {zone.reference_slowest_mps:.2f} is possible")
    if zone.apex_metres < zone.reference_apex_metres - 0.1:
        wider = zone.reference_apex_metres - zone.apex_metres
        reasons.append(f"passes the apex {100 * wider:.0f} cm further outside")
    return f" The car {' and '.join(reasons)}." if reasons else ""


def _least(speeds: Array) -> float:
    known = speeds[np.isfinite(speeds)]
    return float(known.min()) if len(known) else float("nan")


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4) if np.isfinite(value) else None
    return value
