"""Where a policy fails, what went before, what would have saved it: what the page and the report show. Plain values.

Begin with `Why`. `sentences` says in words what it comes to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.drive import WORDS
from racecraft.worlds.deepracer.tracks.track import Track

TICKS_A_SECOND = 15
MOST = 0.5
"""A change that saves at least this share of the failures is called a cure."""


@dataclass(frozen=True)
class Alternative:
    """One change of what was done before the failures of a place."""

    seconds_before: float
    """How long before the failure, s."""
    waypoint: int
    """Where that was, the commonest."""
    action: str
    """What it was told instead, in a racer's words."""
    instead_of: str
    """What was commonly done there."""
    held_seconds: float
    saved: int
    """Of `tried` failures."""
    tried: int

    @property
    def share(self) -> float:
        """Share of the failures it saves, 0 to 1."""
        return self.saved / self.tried if self.tried else 0.0

    @property
    def description(self) -> str:
        """The change and what came of it."""
        held = f", held for {self.held_seconds:.1f} s," if self.held_seconds > 1.5 / TICKS_A_SECOND else ""
        return (
            f"at waypoint {self.waypoint}, {self.seconds_before:.1f} s before: {self.action}{held} instead of "
            f"{self.instead_of} saves {self.saved} of {self.tried}"
        )


@dataclass(frozen=True, eq=False)
class RewardLine:
    """A line of the reward function, over the ticks that are shown."""

    line: int
    name: str
    text: str
    values: Array
    """(T,), NaN where the line was not run."""


@dataclass(frozen=True, eq=False)
class Before:
    """The last second before one failure, the most typical of its place; T ticks, the last of which ends it."""

    seconds: Array
    """(T,) before the failure, falling to 0."""
    frames: Array
    """(T, H, W, 3) uint8: what its camera saw."""
    actions: Sequence[str]
    """(T,) what it chose, in a racer's words; the last was never obeyed."""
    driven_mps: Array
    """(T,)"""
    centre_share: Array
    """(T,) distance from the centre line over half the road's width."""
    rewards: Array | None = None
    """(T,) what it was paid; None where the run has no reward function."""
    lines: Sequence[RewardLine] = ()
    """How those came about."""


@dataclass(frozen=True, eq=False)
class FailurePlace:
    """A place of the track at which cars fail."""

    number: int
    """From 1, the place with most failures first."""
    segment: str
    """Of the track, such as "turn 2 (left)"."""
    arc_m: float
    """Of the middle failure, m along the centre line."""
    waypoints: tuple[int, int]
    """First and last, in driving order."""
    failures: int
    reached: int
    """Cars that came so far."""
    how: Mapping[str, int]
    """How they failed, by the word of `STATUSES`."""
    speed_mps: float
    """Driven, in the mean, at the failure."""
    xy: Array
    """(F, 2) m: where."""
    before: Before
    cures: Sequence[Alternative]
    """The best, of different actions; empty where nothing that was tried saves any."""
    moments: Array
    """(D,) s before the failure at which changes were tried."""
    saveable: Array
    """(D, H) share of the failures that some action saves at each moment, each failure its own."""
    held_seconds: Array
    """(H,)"""
    in_training: int | None = None
    """How often cars left the road here late in the training; None: not known."""

    @property
    def where(self) -> str:
        """The place in words."""
        first, last = self.waypoints
        return f"{self.segment}, " + (f"waypoint {first}" if first == last else f"waypoints {first} to {last}")

    @property
    def how_words(self) -> str:
        """How they failed, in words."""
        return ", ".join(f"{count} {WORDS.get(word, word)}" for word, count in self.how.items())

    @property
    def last_chance(self) -> float | None:
        """The latest moment, s before the failure, at which some action saves at least MOST; None: there is none."""
        enough = self.moments[(self.saveable >= MOST).any(axis=1)] if self.saveable.size else self.moments[:0]
        return float(enough.min()) if len(enough) else None


@dataclass(frozen=True, eq=False)
class Why:
    """Why a policy fails."""

    run: str
    """What a command calls the run and the checkpoint."""
    checkpoint: int
    track: Track
    starts: int
    """From which it drove, evenly round the lap."""
    full: int
    """Of them that drove the whole lap."""
    out_of_time: int
    """And that ran out of time without failing."""
    places: Sequence[FailurePlace]
    changes: int
    """Other actions that were driven to find the cures."""
    seconds: float
    """That took, s of this machine."""
    not_explained: int = 0
    """Failures at further places, which were counted only."""
    reward_note: str = ""
    """Why nothing is told of the reward, where it could not be asked."""
    paths: Sequence[Array] = field(default=(), repr=False)
    """(T, 2) m: how the failed cars drove."""

    @property
    def failures(self) -> int:
        """Cars that failed."""
        return self.starts - self.full - self.out_of_time


def sentences(why: Why) -> list[str]:
    """Return what it comes to, the weightiest first."""
    if not why.failures:
        late = f" {why.out_of_time} ran out of time." if why.out_of_time else ""
        return [f"From {why.starts} starts round the lap {why.full} were driven to the end: nothing failed.{late}"]
    lines = [f"From {why.starts} starts round the lap {why.full} were driven to the end, {why.failures} failed."]
    return lines + [place_words(place, why.failures) for place in why.places]


def place_words(place: FailurePlace, failures: int) -> str:
    """Return a place and its cure in words."""
    text = (
        f"{place.failures} of {failures} failures lie in {place.where}: of {place.reached} cars that came there "
        f"{place.reached - place.failures} got through ({place.how_words}, at {place.speed_mps:.1f} m/s)."
    )
    if not place.cures:
        return f"{text} No other action, at any of the moments tried, saves one of them: the mistake lies earlier."
    best = place.cures[0]
    return f"{text} {best.description[0].upper()}{best.description[1:]}."


def facts(why: Why) -> dict[str, Any]:
    """Return everything but the pictures as plain values."""
    return {
        "run": why.run, "checkpoint": why.checkpoint, "track": why.track.name, "starts": why.starts,
        "full_laps": why.full, "failures": why.failures, "out_of_time": why.out_of_time,
        "changes_tried": why.changes, "findings": sentences(why),
        "places": [_place_facts(place, why.failures) for place in why.places],
    }  # fmt: skip


def _place_facts(place: FailurePlace, failures: int) -> dict[str, Any]:
    return {
        "segment": place.segment, "arc_m": place.arc_m, "waypoints": list(place.waypoints),
        "failures": place.failures, "share": place.failures / failures, "reached": place.reached,
        "how": dict(place.how), "speed_mps": place.speed_mps, "in_training": place.in_training,
        "last_chance_seconds": place.last_chance,
        "cures": [
            {
                "seconds_before": cure.seconds_before, "waypoint": cure.waypoint, "action": cure.action,
                "instead_of": cure.instead_of, "held_seconds": cure.held_seconds, "saved": cure.saved,
                "tried": cure.tried,
            }
            for cure in place.cures
        ],
        "actions_before": list(place.before.actions),
    }  # fmt: skip
