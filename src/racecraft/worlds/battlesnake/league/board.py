"""An arena as plain values, for pages and programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from racecraft.worlds.battlesnake.league.ladder import TOGETHER, Ladder
from racecraft.worlds.battlesnake.league.store import ArenaStore
from racecraft.worlds.battlesnake.league.terms import ArenaGame, Entrant

GAMES_AT_A_TIME = 30


def board_facts(store: ArenaStore, ladder: Ladder) -> dict[str, Any]:
    """Return all that a board shows but the list of games; the ladder catches up with the store first."""
    ladder.count(store.games(ladder.last_game))
    entrants = store.entrants()
    return {
        "name": store.path.name,
        "terms": asdict(store.terms),
        "playing": store.is_playing,
        "last_game": ladder.last_game,
        "tables": [_table(ladder, entrants, size) for size in (TOGETHER, *ladder.sizes)],
    }


def game_facts(game: ArenaGame, names: Sequence[str]) -> dict[str, Any]:
    """Return a game's result."""
    return {
        "game": game.number, "meeting": game.meeting, "players": [names[one] for one in game.players],
        "places": list(game.places), "turns": game.turns, "timeouts": list(game.timeouts),
        "crashes": list(game.crashes), "ended": game.ended,
    }  # fmt: skip


def _table(ladder: Ladder, entrants: Sequence[Entrant], size: int) -> dict[str, Any]:
    """Return who stands where among games of a size, and who met whom: [won, drawn, lost], in the lines' order."""
    lines = ladder.rungs(entrants, size)
    met = [[ladder.score(entrants, a.number, b.number, size) for b in lines] for a in lines]
    return {
        "snakes": size,
        "games": ladder.games(size),
        "lines": [line.to_dict() for line in lines],
        "met": [[[one.won, one.drawn, one.lost] for one in row] for row in met],
    }
