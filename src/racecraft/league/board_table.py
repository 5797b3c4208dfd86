"""A board as a table of texts: what it is worth to say depends on the race. Begin with `table_of`."""

from __future__ import annotations

from racecraft.league.board import Board, score_text, titles_of
from racecraft.league.board_row import BoardRow
from racecraft.league.race import LADDER, Race

TEXTS = ("racer", "model", "note")
"""Columns that are no numbers."""


def table_of(board: Board) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return a board's headings and its rows."""
    race = board.race
    own = ("95 %", "games", "won", "faults") if race.format == LADDER else ("best lap", "resets")
    heads = ("place", "racer", "model", *titles_of(race), *own, "entries", "note")
    return heads, [_cells(race, row) for row in board.rows]


def _cells(race: Race, row: BoardRow) -> tuple[str, ...]:
    place = "–" if row.place is None else str(row.place)
    behind = "" if row.gap is None or row.place == 1 else f"+{score_text(race, row.gap)}"
    own = _of_ladder(row) if race.format == LADDER else _of_laps(row)
    note = row.failure or ("waits" if row.waiting else "")
    return place, row.racer, row.model, score_text(race, row.score), behind, *own, str(row.submissions), note


def _of_ladder(row: BoardRow) -> tuple[str, ...]:
    interval = "–" if row.score_range is None else f"{row.score_range[0]:.0f} to {row.score_range[1]:.0f}"
    return interval, str(row.games), str(row.wins), str(row.faults)


def _of_laps(row: BoardRow) -> tuple[str, ...]:
    return "–" if row.best_lap_seconds is None else f"{row.best_lap_seconds:.3f}", str(row.resets)
