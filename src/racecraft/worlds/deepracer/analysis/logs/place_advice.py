"""What a log suggests of places: where cars leave the road, how straights are driven, where laps lose time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from racecraft.analysis.advice import Advice
from racecraft.evaluation.rating import wilson
from racecraft.worlds.deepracer.analysis.logs.exits import exit_points, exits_by_segment
from racecraft.worlds.deepracer.analysis.logs.intervals import mean_interval
from racecraft.worlds.deepracer.analysis.logs.laps import sector_losses, sector_times
from racecraft.worlds.deepracer.analysis.logs.segments import Segment, find_segments, in_segments
from racecraft.worlds.deepracer.analysis.logs.straights import straights_and_curves
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

FEWEST_EXITS = 5
"""Exits at one place of which something is said."""
MORE_THAN_EVEN = 1.5
"""A place takes too many exits where it takes so many times its share of the lap's length."""
USED = 0.8
"""Share of the top speed below which a straight is driven slowly, at the high end of its interval."""
FEWEST_LAPS = 10
"""Full laps, or episodes on straights, of which something is said."""
TICK_S = 1.0 / 15.0
"""Times of a sector are no more exact; a smaller loss, at the low end of its interval, is none."""


def exits(ticks: pl.DataFrame, track: Track) -> Iterator[Advice]:
    """Say where more cars leave the road than chance explains."""
    table = exits_by_segment(ticks, track)
    worst, count = table.row(0, named=True), int(table["exits"].sum())
    place = next(one for one in find_segments(track).all if one.name == worst["segment"])
    even = place.length_m / track.length
    low, high = wilson(worst["exits"], count)
    if worst["exits"] < FEWEST_EXITS or low < even or worst["share"] < MORE_THAN_EVEN * even:
        return
    crashes = worst["crashes"] > worst["exits"] / 2
    of_them = f", {worst['crashes']} of them crashes," if crashes else ""
    end, hint = ("crash", "keeping clear of what stands in the way") if crashes else ("leave", "the right line")
    yield Advice(
        f"{worst['exits']} of {count} exits of the last two fifths{of_them} lie in {_place(track, place)} "
        f"({100 * worst['share']:.0f} %, 95 %: {100 * low:.0f} to {100 * high:.0f}; it is "
        f"{100 * even:.0f} % of the lap): {100 * worst['passed_share']:.0f} % get through it, at "
        f"{worst['speed_mps']:.2f} m/s where they {end}.",
        f"Pay for {hint} or less speed in {place.name}, and start more episodes before it.",
        lambda: exit_points(ticks, track),
        "racecraft why RUN",
    )


def speed(ticks: pl.DataFrame, track: Track) -> Iterator[Advice]:
    """Say that straights are driven slowly."""
    asked, top = _speeds_on_straights(ticks, track), float(ticks["speed_mps"].max() or 0.0)  # type: ignore[arg-type]
    if len(asked) < FEWEST_LAPS:
        return
    mean, low, high = mean_interval(asked)
    if high < USED * top:
        continuous = (ticks["action"] < 0).any()
        slow = "raise the lowest speed of the range" if continuous else "make the slow action that points ahead faster"
        yield Advice(
            f"On straights it asks for {mean:.2f} m/s on average (95 %: {low:.2f} to {high:.2f}), of {top:.2f} m/s it "
            "may.",
            f"Speed is not used: pay for it on straights, or {slow}.",
            lambda: straights_and_curves(ticks, track),
            "racecraft train my-car --from RUN:best",
        )


def _speeds_on_straights(ticks: pl.DataFrame, track: Track) -> np.ndarray:
    """Return the mean speed (E,) m/s that each episode asked for on straights."""
    import polars as pl

    segments = find_segments(track)
    straights = [k for k, one in enumerate(segments.all) if one.kind == "straight"]
    driven = in_segments(ticks, track, segments).filter(pl.col("segment").is_in(straights))
    return driven.group_by("unique_episode").agg(pl.col("speed_mps").mean())["speed_mps"].drop_nulls().to_numpy()


def sectors(ticks: pl.DataFrame, track: Track) -> Iterator[Advice]:
    """Say where full laps lose more than a tick to the best sector."""
    import polars as pl

    best = pl.col("seconds").min().over("sector")
    losses = sector_times(ticks, track).data.with_columns((pl.col("seconds") - best).alias("lost"))
    by_sector = losses.group_by("sector", maintain_order=True).agg("lost", pl.col("lost").mean().alias("mean"))
    name, lost, _ = by_sector.sort("mean", descending=True).row(0)
    place = next(one for one in find_segments(track).all if one.name == name)
    mean, low, high = mean_interval(np.array(lost))
    if len(lost) < FEWEST_LAPS or low < TICK_S:
        return
    yield Advice(
        f"{len(lost)} full laps lose {by_sector['mean'].sum():.2f} s on average to the best sectors put together, "
        f"{mean:.2f} s of it (95 %: {low:.2f} to {high:.2f}) in {_place(track, place)}.",
        f"Look at {name} first: it has the most time to win.",
        lambda: sector_losses(ticks, track),
        "racecraft evaluate RUN --laps 5 --video laps.mp4",
    )


def _place(track: Track, segment: Segment) -> str:
    """Return a segment's name with its waypoints, which a reward function knows it by."""
    ends = (np.abs(track.arc[:, None] - np.array([segment.begin, segment.end]) * track.length)).argmin(axis=0)
    return f"{segment.name}, waypoints {ends[0]} to {ends[1]}"
