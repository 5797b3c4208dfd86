"""What `racecraft snakes arena` shows of an arena: its terms, its table, a player, a game."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.standings import Score
    from racecraft.worlds.battlesnake.league.ladder import Ladder, Rung
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaGame, Entrant


def game_told(game: ArenaGame, names: list[str]) -> str:
    """Return a game in a line: its players from the first place to the last.

    >>> from racecraft.worlds.battlesnake.league.terms import ArenaGame
    >>> game_told(ArenaGame(1, (0, 1, 2), (1, 0, 1), 87, (0, 0, 0), (0, 0, 0)), ["Flo", "Sam", "Kim"])
    'Sam before Flo and Kim, 87 turns'
    """
    places = [
        " and ".join(names[one] for one, at in zip(game.players, game.places, strict=True) if at == place)
        for place in sorted(set(game.places))
    ]
    if len(places) == 1:
        return f"a draw of {places[0]}, {game.turns} turns"
    return f"{' before '.join(places)}, {game.turns} turns"


def table(store: ArenaStore, ladder: Ladder, size: int = 0) -> dict[str, object]:
    """Return the table as JSON does."""
    entrants = store.entrants()
    return {"games": ladder.games(size), "standings": [line.to_dict() for line in ladder.rungs(entrants, size)]}


def facts_of(entrant: Entrant) -> dict[str, object]:
    """Return a player as JSON does."""
    return {"name": entrant.name, "source": entrant.source, "is_anchor": entrant.is_anchor, "rests": entrant.rests}


def against(store: ArenaStore, ladder: Ladder, one: Entrant, size: int) -> dict[str, dict[str, int]]:
    """Return how a player fared against each that it met, by name."""
    from dataclasses import asdict

    return {other: asdict(score) for other, score in _scores(store, ladder, one, size)}


def _scores(store: ArenaStore, ladder: Ladder, one: Entrant, size: int) -> list[tuple[str, Score]]:
    entrants = store.entrants()
    met = ladder.met(entrants, size)[one.number]
    return [
        (line.name, ladder.score(entrants, one.number, line.number, size))
        for line in ladder.rungs(entrants, size)
        if met[line.number]
    ]


def print_table(store: ArenaStore, ladder: Ladder, size: int = 0) -> None:
    """Print the table; `size`: of games of so many snakes only, 0: of all."""
    print(f"{store.path}: {terms_told(store)}; {ladder.games(size)} games" + f" of {size} snakes" * bool(size))
    print(f"{'player':24} {'rating':>6} {'95 %':>13} {'games':>6} {'won':>5} {'late':>5} {'failed':>6}")
    for line in ladder.rungs(store.entrants(), size):
        print(_line(line))


def _line(line: Rung) -> str:
    spread = f"{line.rating.low:.0f} … {line.rating.high:.0f}"
    won = f"{line.wins / line.games:.0%}" if line.games else "-"
    note = "  anchor" * line.is_anchor + "  removed" * line.rests
    return (
        f"{line.name:24.24} {line.rating.points:>6.0f} {spread:>13} {line.games:>6} {won:>5} "
        f"{line.timeouts:>5} {line.crashes:>6}{note}"
    )


def print_against(store: ArenaStore, ladder: Ladder, one: Entrant, size: int) -> None:
    """Print how a player fared against each that it met."""
    print(f"\n{one.name} ({one.source}), won-drawn-lost")
    for other, score in _scores(store, ladder, one, size):
        print(f"  against {other:24.24} {score}")


def terms_told(store: ArenaStore) -> str:
    """Return what is played in an arena, in words."""
    terms = store.terms
    boards = " and ".join(map(str, terms.snakes))
    map_told = f", map {terms.map}" if terms.map != "standard" else ""
    return (
        f"{terms.width}×{terms.height}, {terms.ruleset}{map_told}, {boards} snakes at a board, "
        f"{terms.timeout_ms} ms a move"
    )
