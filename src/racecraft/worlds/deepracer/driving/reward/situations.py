"""Two hundred moments on which every reward is called: driven ones of the stock, and made-up ones at the edges.

Begin with `situations`. Most moments are rows; those with objects, which rows cannot hold, are dictionaries
(`made_up`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.poses import place_on_road, reports_of
from racecraft.worlds.deepracer.driving.reward.stock import Drive
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE
from racecraft.worlds.deepracer.files.reward_examples import example_situations
from racecraft.worlds.deepracer.tracks.track import Track

COUNT = 200
DRIVEN = 130
"""Of the stock's drives; the rest is made up."""


@dataclass(frozen=True, eq=False)
class Situations:
    """Moments on one track."""

    track: Track
    titles: tuple[str, ...]
    reports: Array
    """TICK_REPORT (T,)."""
    is_reversed: bool = False


def situations(stock: tuple[Drive, ...]) -> list[Situations]:
    """Return the moments that rows hold, by track; with `made_up` they are COUNT."""
    tracks = list(dict.fromkeys(drive.track for drive in stock))
    driven = [_driven(track, [drive for drive in stock if drive.track is track]) for track in tracks]
    edge = _edges(tracks[0])
    against = _reverse_race(tracks[1])
    missing = COUNT - len(_made_up()) - sum(len(part.titles) for part in (edge, against))
    share = np.diff(np.linspace(0, missing, len(driven) + 1).round().astype(int))
    return [*(_evenly(part, count) for part, count in zip(driven, share, strict=True)), edge, against]


def made_up() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the moments that are dictionaries: title and parameters."""
    yield from _made_up()


def _driven(track: Track, drives: list[Drive]) -> Situations:
    titles: list[str] = []
    rows = []
    for drive in drives:
        reports = drive.reports
        picked = np.unique(np.linspace(0, len(reports) - 1, 12).round().astype(int))
        rows.append(reports[picked])
        titles += [f"{drive.title}, {seconds:.1f} s after the start" for seconds in reports["time"][picked]]
    return Situations(track, tuple(titles), np.concatenate(rows))


def _evenly(part: Situations, count: int) -> Situations:
    """Return so many of the moments, first and last among them, in their order."""
    picked = np.linspace(0, len(part.titles) - 1, count).round().astype(int)
    return Situations(part.track, tuple(part.titles[k] for k in picked), part.reports[picked], part.is_reversed)


def _edges(track: Track) -> Situations:
    """Return moments at the edges of what can happen: borders, start line, wrong way, finish, extreme commands."""
    half = 0.5 * track.width_mean
    arcs = {
        "at the start line": 0.0,
        "just before the finish": track.length - 0.02,
        "half way round": 0.5 * track.length,
    }
    across = {"on the centre line": 0.0, "on the left border": half, "right of the road": -1.3 * half}
    ways = {"along the road": 0.0, "across it": 0.5 * np.pi, "the wrong way": np.pi}
    commands = {"at 0.1 m/s, hard left": (np.radians(30), 0.1), "at 4 m/s, hard right": (np.radians(-30), 4.0)}
    made = list(itertools.product(arcs.items(), across.items(), ways.items(), commands.items()))
    drive = np.concatenate([
        place_on_road(track, [arc], [offset], [way], *command)
        for (_, arc), (_, offset), (_, way), (_, command) in made
    ])  # fmt: skip
    reports = np.concatenate([reports_of(track, one[None]) for one in drive])
    reports["steps"] = 2.0 + np.arange(len(reports))
    finish = reports[:2].copy()
    finish["progress"], finish["status"], finish["steps"] = 100.0, LAP_COMPLETE, (150.0, 5000.0)
    titles = [", ".join(name for name, _ in parts) for parts in made]
    return Situations(track, (*titles, "a lap complete", "a slow lap complete"), np.concatenate([reports, finish]))


def _reverse_race(track: Track) -> Situations:
    """Return moments of a race that runs against the track's direction."""
    back = track.reversed()
    drive = place_on_road(back, np.linspace(0.0, back.length, 6, endpoint=False), np.zeros(6), np.zeros(6), 0.0, 1.0)
    titles = tuple(f"a reversed race, {100 * k / 6:.0f} % round" for k in range(6))
    return Situations(back, titles, reports_of(back, drive), is_reversed=True)


def _made_up() -> list[tuple[str, dict[str, Any]]]:
    examples = example_situations()
    first = examples["at the start"]
    ahead = examples["an object ahead"]
    beside = {**ahead, "objects_distance": [0.1], "objects_location": [[0.1, -4.0]], "objects_left_of_center": [False]}
    two = {
        **ahead, "closest_objects": [1, 0], "objects_location": [[0.0, 4.0], [-4.0, 0.0]],
        "objects_left_of_center": [True, False], "objects_distance": [12.6, 18.8],
        "objects_distance_from_center": [0.2, 0.2], "objects_heading": [0.0, 1.5], "objects_speed": [0.0, 1.0],
    }  # fmt: skip
    return [
        *((f"a round track, {name}", params) for name, params in examples.items()),
        ("an object beside the car", beside),
        ("two objects, one behind and one ahead", two),
        ("a crash", {**beside, "is_crashed": True}),
        ("progress slightly negative", {**first, "progress": -0.3}),
        ("exactly on a waypoint", {**first, "distance_from_center": 0.0, "y": -4.0}),
        ("at the closing waypoint", {**first, "closest_waypoints": [39, 40]}),
    ]
