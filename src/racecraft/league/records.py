"""Fastest laps and racers' careers, over all races of a league. Begin with `fastest_laps` and `career_of`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from racecraft.contract.errors import SettingError, nearest
from racecraft.league.board_row import BoardRow
from racecraft.league.race import Outcome
from racecraft.league.snapshot import Lap, Snapshot, snapshot_of
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
    entry: int
    """Its number in the race."""
    judged: float


def fastest_laps(league: League, track: str | None = None, each: int | None = None) -> list[Record]:
    """Return each racer's fastest lap on each track and in each type of race: by track, type and time.

    Args:
        league: Where they were driven.
        track: Only this one.
        each: So many of each track and type; None: all.
    """
    best: dict[tuple[str, str], dict[str, tuple[Lap, Snapshot]]] = {}
    for snapshot in (snapshot_of(league, race) for race in league.races()):
        rules = snapshot.race.rules
        kind = str(rules.get("type", "")) + (", reverse" if rules.get("reverse") else "")
        for name in snapshot.laps if track is None else snapshot.laps.keys() & {track}:
            of_type = best.setdefault((name, kind), {})
            for lap in snapshot.laps[name].order[:each]:
                racer = snapshot.entries[lap[2]].racer
                if racer not in of_type or lap < of_type[racer][0]:
                    of_type[racer] = lap, snapshot
    return [
        _record(*key, lap, snapshot)
        for key in sorted(best)
        for lap, snapshot in sorted(best[key].values(), key=lambda one: one[0])[:each]
    ]


def _record(track: str, type: str, lap: Lap, snapshot: Snapshot) -> Record:
    seconds, judged, number, heat = lap
    entry = snapshot.entries[number]
    return Record(
        track=track, type=type, seconds=seconds, racer=entry.racer, model=entry.model, race=snapshot.race.id, heat=heat,
        entry=number, judged=judged,
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
    snapshots = [snapshot_of(league, race) for race in league.races()]
    found = [_race_of(one, row) for one in snapshots if (row := one.board.row_of(racer))]
    if not found:
        names = {entry.racer for one in snapshots for entry in one.entries.values()}
        raise SettingError("no race has a racer {racer!r}. {hint}", racer=racer, hint=nearest(racer, sorted(names)))
    own = [outcome for one in snapshots for outcome in _outcomes(one, racer)]
    return Career(
        racer=racer,
        races=tuple(found),
        wins=sum(one.place == 1 for one in found),
        podiums=sum(one.place is not None and one.place <= 3 for one in found),
        laps=sum(lap is not None for outcome in own for lap in outcome.laps),
        resets=sum(outcome.resets for outcome in own),
        best_laps=tuple(record for record in fastest_laps(league) if record.racer == racer),
    )


def _race_of(snapshot: Snapshot, row: BoardRow) -> RaceOfRacer:
    race = snapshot.race
    return RaceOfRacer(
        race=race.id, title=race.title, place=row.place, racers=len(snapshot.board.rows), score=row.score, gap=row.gap,
        entries=row.submissions,
    )  # fmt: skip


def _outcomes(snapshot: Snapshot, racer: str) -> Iterator[Outcome]:
    own = {number for number, entry in snapshot.entries.items() if entry.racer == racer}
    for result in snapshot.results.values():
        for index, number in enumerate(result.entries):
            if number in own:
                yield from (drive.outcomes[index] for drive in result.drives)
