"""Fastest laps and racers' careers, over all races of a league. Begin with `fastest_laps` and `career_of`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from racecraft.contract.errors import SettingError, nearest
from racecraft.league.board import board_of
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.store import League


@dataclass(frozen=True, kw_only=True)
class Record:
    """A racer's fastest lap on a track."""

    track: str
    type: str
    """Of the race, as its rules say: laps among boxes are no laps on an empty road."""
    seconds: float
    racer: str
    model: str
    race: str
    heat: str
    judged: float


def fastest_laps(league: League, track: str | None = None, count: int | None = None) -> list[Record]:
    """Return each racer's fastest lap on each track and in each type of race: by track, type and time.

    Args:
        league: Where they were driven.
        track: Only this one.
        count: So many, the first of that order; None: all.
    """
    best: dict[tuple[str, str, str], tuple[float, float, Race, Entry, Result]] = {}
    for race, entry, result, drive, outcome in _outcomes(league):
        laps = [lap for lap in outcome.laps if lap is not None]
        if not laps or track not in (None, drive.track):
            continue
        kind = str(race.rules.get("type", "")) + (", reverse" if race.rules.get("reverse") else "")
        key, lap = (drive.track, kind, entry.racer), (min(laps), result.judged)
        if key not in best or lap < best[key][:2]:
            best[key] = (*lap, race, entry, result)
    order = sorted(best, key=lambda key: (*key[:2], *best[key][:2]))
    return [_record(track, type, *best[track, type, racer]) for track, type, racer in order[:count]]


def _record(track: str, type: str, seconds: float, judged: float, race: Race, entry: Entry, result: Result) -> Record:
    return Record(
        track=track, type=type, seconds=seconds, racer=entry.racer, model=entry.model, race=race.id, heat=result.heat,
        judged=judged,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class RaceOfRacer:
    """How a racer did in one race."""

    race: str
    title: str
    place: int | None
    racers: int
    score: float | None
    gap: float | None
    entries: int


@dataclass(frozen=True, kw_only=True)
class Career:
    """A racer over all races of a league."""

    racer: str
    races: tuple[RaceOfRacer, ...]
    wins: int
    podiums: int
    laps: int
    """Full laps driven in all entries."""
    resets: int
    best_laps: tuple[Record, ...]


def career_of(league: League, racer: str) -> Career:
    """Return a racer's races, personal bests and counts.

    Raises:
        SettingError: Nobody of that name has entered a race.
    """
    found, names = [], set()
    for race in league.races():
        board = board_of(race, league.entries(race.id), league.results(race.id))
        names |= {row.racer for row in board.rows}
        found += [
            RaceOfRacer(race=race.id, title=race.title, place=row.place, racers=len(board.rows), score=row.score,
                        gap=row.gap, entries=row.submissions)
            for row in board.rows if row.racer == racer
        ]  # fmt: skip
    if not found:
        raise SettingError("no race has a racer {racer!r}. {hint}", racer=racer, hint=nearest(racer, sorted(names)))
    own = [outcome for _, entry, _, _, outcome in _outcomes(league) if entry.racer == racer]
    return Career(
        racer=racer,
        races=tuple(found),
        wins=sum(one.place == 1 for one in found),
        podiums=sum(one.place is not None and one.place <= 3 for one in found),
        laps=sum(lap is not None for outcome in own for lap in outcome.laps),
        resets=sum(outcome.resets for outcome in own),
        best_laps=tuple(record for record in fastest_laps(league) if record.racer == racer),
    )


def _outcomes(league: League) -> Iterator[tuple[Race, Entry, Result, Drive, Outcome]]:
    for race in league.races():
        entries = league.entries(race.id)
        for result in league.results(race.id).values():
            for drive in result.drives:
                for number, outcome in zip(result.entries, drive.outcomes, strict=True):
                    if number in entries:
                        yield race, entries[number], result, drive, outcome
