"""A ladder: racers meet those of whose games most is learned, and ratings decide. Begin with `next_meeting`.

Ratings are Bradley and Terry's (`evaluation/rating.py`), over every game of every entry that still stands: an older
entry of a racer plays no more, but what it told of others counts.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.evaluation import rating
from racecraft.league.pairing import next_group
from racecraft.league.race import Race, Result


def next_meeting(
    race: Race, field: Sequence[int], entries: Collection[int], results: Mapping[str, Result]
) -> list[int] | None:
    """Return the entries that meet next; None where all have met often enough, or too few are there.

    Args:
        race: The race.
        field: Numbers of the entries that play: the newest of each racer.
        entries: Numbers of all entries.
        results: What was judged, by heat.
    """
    if meetings_left(race, field, results) == 0:
        return None
    index = {number: place for place, number in enumerate(field)}
    met = np.zeros((len(field), len(field)), np.int64)
    for pair in (pair for result in results.values() for pair in _pairs(result.entries)):
        if pair[0] in index and pair[1] in index:
            met[index[pair[0]], index[pair[1]]] += 1
    found = rated(entries, results)
    places = [found.index[number] for number in field]
    strengths = [found.strengths[place] for place in places]
    covariance = found.covariance[np.ix_(places, places)]
    return [field[place] for place in next_group(strengths, covariance, met, range(len(field)), race.grid)]


def meetings_left(race: Race, field: Collection[int], results: Mapping[str, Result]) -> int:
    """Return how many meetings are still to be judged; those in which an older entry played do not count."""
    if len(field) < race.grid:
        return 0
    judged = sum(set(result.entries) <= set(field) for result in results.values())
    return max(0, math.ceil(race.meetings * len(field) / race.grid) - judged)


@dataclass(frozen=True, eq=False)
class Rated:
    """Ratings of a race's entries."""

    index: Mapping[int, int]
    """Where an entry stands in what follows, by its number."""
    strengths: Sequence[rating.Strength]
    covariance: Array
    """How sure they are, (P, P), in nats."""
    games: Mapping[int, int]
    wins: Mapping[int, int]
    """Games in which an entry alone was first."""
    faults: Mapping[int, int]

    def of(self, entry: int) -> rating.Rating:
        """Return the rating of an entry."""
        return self.strengths[self.index[entry]].rating


def rated(entries: Collection[int], results: Mapping[str, Result]) -> Rated:
    """Return what games say of entries.

    Args:
        entries: Their numbers; games of others do not count.
        results: What was judged, by heat.
    """
    index = {number: place for place, number in enumerate(sorted(entries))}
    games, wins, faults = dict.fromkeys(index, 0), dict.fromkeys(index, 0), dict.fromkeys(index, 0)
    found = []
    for result in (one for one in results.values() if set(one.entries) <= index.keys()):
        for drive in result.drives:
            for places in zip(*(outcome.places for outcome in drive.outcomes), strict=True):
                found.append(rating.Result(tuple(index[number] for number in result.entries), places))
                for number, place in zip(result.entries, places, strict=True):
                    games[number] += 1
                    wins[number] += place == 1 and places.count(1) == 1
            for number, outcome in zip(result.entries, drive.outcomes, strict=True):
                faults[number] += outcome.faults
    strengths, covariance = rating.strengths(rating.wins_of(len(index), found))
    return Rated(index, strengths, covariance, games, wins, faults)


def _pairs(entries: Sequence[int]) -> list[tuple[int, int]]:
    return [(a, b) for a in entries for b in entries if a != b]
