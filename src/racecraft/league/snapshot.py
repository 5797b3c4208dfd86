"""A race with all that stands in it at one moment, kept as long as nothing changes. Begin with `snapshot_of`.

A folder of thousands of results is read, ranked and searched for fast laps once; a result that comes changes what it
concerns.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from operator import is_
from typing import TypeVar
from weakref import WeakKeyDictionary

from racecraft.league.board import Board, board_of
from racecraft.league.race import Entry, Race, Result
from racecraft.league.ranking import Ranking
from racecraft.league.store import League

Key = TypeVar("Key")
Value = TypeVar("Value")
Lap = tuple[float, float, int, str]
"""Seconds, when it was judged, the number of its entry, and the heat."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A race at one moment."""

    race: Race
    entries: Mapping[int, Entry]
    results: Mapping[str, Result]
    board: Board
    laps: Mapping[str, Ranking[Lap]]
    """Each racer's fastest lap, by track."""


_KEPT: WeakKeyDictionary[League, dict[str, Snapshot]] = WeakKeyDictionary()


def snapshot_of(league: League, race: Race) -> Snapshot:
    """Return a race as it stands now; the same object as long as nothing in it changes."""
    results = league.results(race.id)  # before the entries: none of these lacks its entry
    entries = league.entries(race.id)
    kept = _KEPT.setdefault(league, {})
    before = kept.get(race.id)
    if before is not None and before.race is race and before.entries is entries and before.results is results:
        return before
    kept[race.id] = made = _made(race, entries, results, before)
    return made


def _made(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result], before: Snapshot | None) -> Snapshot:
    new_entries = None if before is None or before.race is not race else _added(before.entries, entries)
    new_results = None if before is None else _added(before.results, results)
    if before is None or new_entries is None or new_results is None:
        return Snapshot(race, entries, results, board_of(race, entries, results), _laps({}, entries, results.values()))
    numbers = {*new_entries, *(number for result in new_results.values() for number in result.entries)}
    racers = {entries[number].racer for number in numbers if number in entries}
    board = board_of(race, entries, results, before.board, racers)
    return Snapshot(race, entries, results, board, _laps(before.laps, entries, new_results.values()))


def _added(before: Mapping[Key, Value], now: Mapping[Key, Value]) -> dict[Key, Value] | None:
    """Return what is new; None where what stood under a key before is gone or another."""
    if not all(map(is_, map(now.get, before), before.values())):
        return None
    return {key: now[key] for key in now.keys() - before.keys()}


def _laps(
    before: Mapping[str, Ranking[Lap]], entries: Mapping[int, Entry], results: Collection[Result]
) -> Mapping[str, Ranking[Lap]]:
    """Return each racer's fastest lap on each track, with what some results add."""
    better: dict[str, dict[str, Lap]] = {}
    for result in results:
        for drive in result.drives:
            best, kept = better.setdefault(drive.track, {}), before.get(drive.track)
            for number, outcome in zip(result.entries, drive.outcomes, strict=True):
                seconds = min((lap for lap in outcome.laps if lap is not None), default=None)
                if seconds is None or number not in entries:
                    continue
                racer, lap = entries[number].racer, (seconds, result.judged, number, result.heat)
                fastest = best.get(racer) or (kept and kept.best.get(racer))
                if not fastest or lap < fastest:
                    best[racer] = lap
    rankings = {track: before.get(track) or Ranking[Lap]({}) for track in before.keys() | better.keys()}
    return {track: one.changed(better[track]) if better.get(track) else one for track, one in rankings.items()}
