"""The board of a race: who is where, by how much. Begin with `board_of`."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from racecraft.league.board_row import BoardRow, figures_of
from racecraft.league.heats import bracket, latest_of_each, standing_of
from racecraft.league.ladder import rated
from racecraft.league.race import BRACKET, LADDER, LAPS, SOLO, Entry, Race, Result
from racecraft.league.solo_board import SoloRows


@dataclass(frozen=True)
class Board:
    """A race's board."""

    race: Race
    rows: Sequence[BoardRow]
    waiting: int
    """Entries that are still to be judged."""

    def row_of(self, racer: str) -> BoardRow | None:
        """Return a racer's row; None: nobody of that name has entered."""
        if isinstance(self.rows, SoloRows):
            return self.rows.of(racer)
        return next((row for row in self.rows if row.racer == racer), None)


def board_of(
    race: Race,
    entries: Mapping[int, Entry],
    results: Mapping[str, Result],
    before: Board | None = None,
    racers: Collection[str] = (),
) -> Board:
    """Return the board of a race; each racer's best result counts.

    Args:
        race: The race.
        entries: Its entries by number.
        results: Its results by heat.
        before: Its board a moment ago, where since then entries and results only came.
        racers: Whose they are.
    """
    if race.format == SOLO:
        ranked = before.rows if before is not None and isinstance(before.rows, SoloRows) else None
        alone = SoloRows(race, entries, results, ranked, racers)
        return Board(race, alone, alone.waiting)
    if race.format == LADDER:
        rows = _ladder_rows(entries, results)
        return Board(race, rows, sum(row.waiting for row in rows))
    return Board(race, _meeting_rows(race, entries, results), 0)


def _meeting_rows(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> tuple[BoardRow, ...]:
    """Return the rows of cars that meet each other: by wins; in a bracket first by the round that one reached."""
    latest = {entry.racer: entry for entry in entries.values()}
    wins, reached, last = dict.fromkeys(entries, 0), dict.fromkeys(entries, 0), dict[int, tuple[Result, int]]()
    seconds = dict.fromkeys(entries, 0.0)
    for result in results.values():
        if not all(number in entries for number in result.entries):
            continue
        wins[standing_of(result)[0]] += not result.failure
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
                failure=latest_result.failure if latest_result else "",
                **figures_of(latest_result, index),
            )
        )
    return tuple(rows)


def _ladder_rows(entries: Mapping[int, Entry], results: Mapping[str, Result]) -> tuple[BoardRow, ...]:
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
                **figures_of(latest, index),
            )
        )
    return tuple(rows)


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
