"""The board of a race: who is where, by how much. Begin with `board_of`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.league.heats import bracket, latest_of_each, standing_of
from racecraft.league.ladder import rated
from racecraft.league.race import BRACKET, LADDER, LAPS, SOLO, Entry, Race, Result
from racecraft.league.scoring import Score, best_lap_of, score_of

NO_FIGURES: Mapping[str, Any] = {
    "best_lap_seconds": None, "laps": (), "resets": 0, "penalty_seconds": 0.0, "heat": "", "judged": None,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class BoardRow:
    """A racer's line."""

    place: int | None
    """Counted from 1; equal scores share it. None: no result that counts."""
    racer: str
    model: str
    """The model behind the best result."""
    entry: int
    """Its number."""
    score: float | None
    """Seconds, full laps, wins or rating points, as the race's format and ranking say."""
    gap: float | None
    """To the first, in the score's unit, 0 or more."""
    interval: float | None
    """To the racer in front."""
    best_lap_seconds: float | None
    laps: tuple[float | None, ...]
    """Of the best result; over a cup those of all tracks."""
    resets: int
    penalty_seconds: float
    submissions: int
    heat: str
    """Name of the best result: its replay and logs."""
    judged: float | None
    failure: str = ""
    """Why the newest entry could not be driven."""
    waiting: int = 0
    """Entries that are still to be judged."""
    score_range: tuple[float, float] | None = None
    """95 % interval of a rating."""
    games: int = 0
    """Of a ladder's entry."""
    wins: int = 0
    """Games in which it alone was first, likewise."""
    faults: int = 0
    """Moves that came late or were none, likewise."""


@dataclass(frozen=True)
class Board:
    """A race's board."""

    race: Race
    rows: tuple[BoardRow, ...]
    waiting: int
    """Entries that are still to be judged."""
    version: str
    """Changes whenever the rows may have changed."""


def board_of(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> Board:
    """Return the board of a race; each racer's best result counts.

    Args:
        race: The race.
        entries: Its entries by number.
        results: Its results by heat.
    """
    if race.format == SOLO:
        rows, judged = _solo_rows(race, entries, results), {one.entries[0] for one in results.values()}
        waiting = sum(number not in judged for number in entries)
    elif race.format == LADDER:
        rows = _ladder_rows(entries, results)
        waiting = sum(row.waiting for row in rows)
    else:
        rows, waiting = _meeting_rows(race, entries, results), 0
    newest = max((one.judged for one in results.values()), default=0.0)
    return Board(race, tuple(rows), waiting, f"{len(entries)}-{len(results)}-{newest:.3f}")


def _solo_rows(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> list[BoardRow]:
    by_entry = {result.entries[0]: result for result in results.values()}
    by_racer: dict[str, list[Entry]] = {}
    for entry in entries.values():
        by_racer.setdefault(entry.racer, []).append(entry)
    found = []
    for racer, own in by_racer.items():
        judged = [(score_of(race, by_entry[one.number]), one) for one in own if one.number in by_entry]
        scored = [(score, one) for score, one in judged if score is not None]
        score, entry = min(scored, key=lambda pair: (pair[0].key, pair[1].number)) if scored else (None, own[-1])
        found.append((score, racer, entry, own, by_entry.get(entry.number)))
    found.sort(key=lambda row: (row[0] is None, row[0].key if row[0] else (), row[2].number))
    rows: list[BoardRow] = []
    first = found[0][0] if found else None
    for score, racer, entry, own, result in found:
        before = rows[-1] if rows else None
        place = None if score is None else len(rows) + 1
        if before is not None and score is not None and found[len(rows) - 1][0] == score:
            place = before.place
        newest = by_entry.get(own[-1].number)
        rows.append(
            BoardRow(
                place=place,
                racer=racer,
                model=entry.model,
                entry=entry.number,
                score=None if score is None else score.value,
                gap=_difference(score, first),
                interval=_difference(score, found[len(rows) - 1][0] if rows else score),
                submissions=len(own),
                failure="" if newest is None else newest.failure,
                waiting=sum(one.number not in by_entry for one in own),
                **_figures(result, 0),
            )
        )
    return rows


def _meeting_rows(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> list[BoardRow]:
    """Return the rows of cars that meet each other: by wins; in a bracket first by the round that one reached."""
    latest = {entry.racer: entry for entry in entries.values()}
    wins, reached, last = dict.fromkeys(entries, 0), dict.fromkeys(entries, 0), dict[int, tuple[Result, int]]()
    seconds = dict.fromkeys(entries, 0.0)
    for result in results.values():
        if not all(number in entries for number in result.entries):
            continue
        wins[standing_of(result)[0]] += 1
        for index, number in enumerate(result.entries):
            reached[number] = max(reached[number], result.round)
            last[number] = result, index
            seconds[number] += sum(drive.outcomes[index].total_seconds for drive in result.drives)
    field = sorted(entry.number for entry in latest.values())
    if race.format == BRACKET:
        rounds = bracket(field, results)
        for number, meetings in enumerate(rounds, start=1):
            for number_of_entry in (one for meeting in meetings for one in meeting):
                reached[number_of_entry] = max(reached[number_of_entry], number)
    order = sorted(field, key=lambda one: (-reached[one] if race.format == BRACKET else 0, -wins[one], seconds[one]))
    rows = []
    for place, number in enumerate(order, start=1):
        entry, (latest_result, index) = entries[number], last.get(number, (None, 0))
        rows.append(
            BoardRow(
                place=place if number in last else None,
                racer=entry.racer,
                model=entry.model,
                entry=number,
                score=float(wins[number]),
                gap=float(wins[order[0]] - wins[number]),
                interval=float(wins[order[max(0, place - 2)]] - wins[number]),
                submissions=sum(one.racer == entry.racer for one in entries.values()),
                **_figures(latest_result, index),
            )
        )
    return rows


def _ladder_rows(entries: Mapping[int, Entry], results: Mapping[str, Result]) -> list[BoardRow]:
    """Return the newest entry of each racer by its rating; those who have not played come last."""
    found, last = rated(entries, results), dict[int, tuple[Result, int]]()
    for result in results.values():
        last |= {number: (result, index) for index, number in enumerate(result.entries)}
    points = {number: found.of(number).points for number in entries}
    order = sorted(latest_of_each(entries), key=lambda one: (found.games[one] == 0, -points[one]))
    rows: list[BoardRow] = []
    for number in order:
        (latest, index), rating = last.get(number, (None, 0)), found.of(number)
        has_played, before = found.games[number] > 0, order[max(0, len(rows) - 1)]
        rows.append(
            BoardRow(
                place=len(rows) + 1 if has_played else None,
                racer=entries[number].racer,
                model=entries[number].model,
                entry=number,
                score=rating.points if has_played else None,
                gap=points[order[0]] - points[number] if has_played else None,
                interval=points[before] - points[number] if has_played else None,
                submissions=sum(one.racer == entries[number].racer for one in entries.values()),
                waiting=int(latest is None),
                failure="" if latest is None else latest.failure,
                score_range=(rating.low, rating.high) if has_played else None,
                games=found.games[number],
                wins=found.wins[number],
                faults=found.faults[number],
                **_figures(latest, index),
            )
        )
    return rows


def _figures(result: Result | None, index: int) -> dict[str, Any]:
    """Return what a row says of a result."""
    if result is None:
        return dict(NO_FIGURES)
    if index not in result.figures:
        outcomes = [drive.outcomes[index] for drive in result.drives]
        result.figures[index] = {
            "best_lap_seconds": best_lap_of(result, index),
            "laps": tuple(lap for outcome in outcomes for lap in outcome.laps),
            "resets": sum(outcome.resets for outcome in outcomes),
            "penalty_seconds": round(sum(outcome.penalty_seconds for outcome in outcomes), 3),
            "heat": result.heat,
            "judged": result.judged,
        }
    return result.figures[index]


def _difference(score: Score | None, other: Score | None) -> float | None:
    return None if score is None or other is None else round(abs(score.value - other.value), 6)


def score_text(race: Race, score: float | None) -> str:
    """Return a score as boards print it.

    >>> score_text(Race(id="a", title="A", kind="k", tracks=("t",), rules={}), 10.25)
    '10.250'
    """
    if score is None:
        return "–"
    return f"{score:.0f}" if race.format != SOLO or race.ranking == LAPS else f"{score:.3f}"


def titles_of(race: Race) -> Sequence[str]:
    """Return the heading of the score's column and that of the gap's."""
    if race.format != SOLO:
        return ("rating" if race.format == LADDER else "wins"), "behind"
    return ("laps", "behind") if race.ranking == LAPS else ("seconds", "gap")
