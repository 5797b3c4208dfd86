"""What `racecraft snakes arena` prints of an arena: its terms, its table, a player, a game."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.actions.arena import Standings
    from racecraft.worlds.battlesnake.league.ladder import Rung
    from racecraft.worlds.battlesnake.league.terms import ArenaGame, ArenaTerms


def print_standings(found: Standings) -> None:
    """Print the table, one player's meetings where there is one, and the latest games."""
    size, games = found.size, found.ladder.games(found.size)
    print(f"{found.store.path}: {terms_text(found.store.terms)}; {games} games" + f" of {size} snakes" * bool(size))
    print(f"{'player':24} {'rating':>6} {'95 %':>13} {'games':>6} {'won':>5} {'late':>5} {'failed':>6}")
    for line in found.rungs:
        print(_line(line))
    if found.player is not None:
        print(f"\n{found.player.name} ({found.player.source}), won-drawn-lost")
        for other, score in found.scores():
            print(f"  against {other:24.24} {score}")
    for game in found.latest or ():
        print(f"game {game.number:>5}: {game_text(game, found.names)}")


def game_text(game: ArenaGame, names: Sequence[str]) -> str:
    """Return a game in a line: its players from the first place to the last.

    >>> from racecraft.worlds.battlesnake.league.terms import ArenaGame
    >>> game_text(ArenaGame(1, (0, 1, 2), (1, 0, 1), 87, (0, 0, 0), (0, 0, 0)), ["Flo", "Sam", "Kim"])
    'Sam before Flo and Kim, 87 turns'
    """
    places = [
        " and ".join(names[one] for one, at in zip(game.players, game.places, strict=True) if at == place)
        for place in sorted(set(game.places))
    ]
    if len(places) == 1:
        return f"a draw of {places[0]}, {game.turns} turns"
    return f"{' before '.join(places)}, {game.turns} turns"


def _line(line: Rung) -> str:
    spread = f"{line.rating.low:.0f} … {line.rating.high:.0f}"
    won = f"{line.wins / line.games:.0%}" if line.games else "-"
    note = "  anchor" * line.is_anchor + "  removed" * line.rests
    return (
        f"{line.name:24.24} {line.rating.points:>6.0f} {spread:>13} {line.games:>6} {won:>5} "
        f"{line.timeouts:>5} {line.crashes:>6}{note}"
    )


def terms_text(terms: ArenaTerms) -> str:
    """Return what is played in an arena, in words."""
    boards = " and ".join(map(str, terms.snakes))
    map_told = f", map {terms.map}" if terms.map != "standard" else ""
    return (
        f"{terms.width}×{terms.height}, {terms.ruleset}{map_told}, {boards} snakes at a board, "
        f"{terms.timeout_ms} ms a move"
    )
