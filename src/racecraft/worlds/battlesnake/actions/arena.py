"""An arena: players come and go, games and ratings stay."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.battlesnake.actions.options import BoardOptions, check_folder

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.standings import Score
    from racecraft.worlds.battlesnake.league.ladder import Ladder, Rung
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaGame, ArenaTerms, Entrant

HERE = Path("arena.sqlite")
LATEST = 10


@dataclass(frozen=True, kw_only=True)
class NewArenaRequest(Request):
    """What is played in a new arena, and its anchors."""

    anchor: tuple[str, ...] = option((), "A player that never changes; the mean of the anchors is 1500 points.")
    snakes: tuple[int, ...] = option((), "Snakes at a board; may be said again. [default: 2 and 4]")
    board: BoardOptions = group(BoardOptions)
    timeout: int = option(100, "Milliseconds for an answer.", "--timeout", "-t", low=1)
    most_turns: int = option(1000, "A longer game is a draw.", low=1)
    seed: int | None = option(0, "Chance of the game; without it, another every time.", "--seed", "-r")
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True, kw_only=True)
class AddPlayersRequest(Request):
    """Which players are let in where."""

    who: tuple[str, ...] = argument("Players: names, addresses, FILE.py, RUN; search+ before one.")
    name: tuple[str, ...] = option((), "Its name there, in the same order.", "--name", "-n")
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True, kw_only=True)
class RemovePlayersRequest(Request):
    """Which players are drawn no more."""

    who: tuple[str, ...] = argument("Names of players.")
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True, kw_only=True)
class ArenaRequest(Request):
    """What is shown of an arena."""

    name: str | None = argument("One player: how it fared against each, and its games.", None)
    snakes: int = option(0, "Only games of so many snakes; 0: all.")
    latest: int = option(LATEST, "How many of the latest games are listed.", low=0)
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True, kw_only=True)
class ExportGamesRequest(Request):
    """Which games are written where."""

    out: Path = argument("The file to write.")
    game: int | None = option(None, "Number of one game, to watch, study or verify.", low=1)
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True)
class NewArena:
    """An arena that was begun."""

    arena: Path
    anchors: list[str]
    terms: ArenaTerms

    def as_dictionary(self) -> dict[str, Any]:
        """Return the file and the anchors."""
        return {"arena": self.arena, "anchors": self.anchors}


@dataclass(frozen=True)
class Players:
    """Players that were let in."""

    players: list[dict[str, Any]]


@dataclass(frozen=True)
class Removed:
    """Players that are drawn no more."""

    removed: list[str]


@dataclass(frozen=True)
class Standings:
    """The table of an arena, one player's meetings where it was asked for, and its latest games."""

    store: ArenaStore
    ladder: Ladder
    size: int = 0
    """Of games of so many snakes only; 0: of all."""
    player: Entrant | None = None
    latest: tuple[ArenaGame, ...] | None = None
    """None: not asked for."""
    names: tuple[str, ...] | list[str] = ()
    played: int | None = None
    """How many games were played just now; None: none was to be."""
    exit_code: int = 0

    @property
    def rungs(self) -> list[Rung]:
        """The rows of the table, the best first."""
        return list(self.ladder.rungs(self.store.entrants(), self.size))

    def scores(self) -> list[tuple[str, Score]]:
        """Return how the player fared against each that it met."""
        entrants, one = self.store.entrants(), self.player
        assert one is not None
        met = self.ladder.met(entrants, self.size)[one.number]
        return [
            (line.name, self.ladder.score(entrants, one.number, line.number, self.size))
            for line in self.rungs
            if met[line.number]
        ]

    def as_dictionary(self) -> dict[str, Any]:
        """Return player, table and games by name."""
        from dataclasses import asdict

        from racecraft.worlds.battlesnake.league.board import game_facts

        figures: dict[str, Any] = {} if self.played is None else {"played": self.played}
        if self.player is not None:
            against = {other: asdict(score) for other, score in self.scores()}
            figures |= {"player": facts_of(self.player), "against": against}
        figures |= {"games": self.ladder.games(self.size), "standings": [line.to_dict() for line in self.rungs]}
        if self.latest is not None:
            figures["latest"] = [game_facts(game, list(self.names)) for game in self.latest]
        return figures


@action
def new_arena(request: NewArenaRequest, progress: Progress = quiet) -> NewArena:
    """Begin an arena: what is played there, and the anchors that keep its scale; neither ever changes.

    Example: racecraft snakes arena new

    Example: racecraft snakes arena new --arena duels.sqlite --snakes 2 --timeout 500 --anchor flood_fill
    """
    from racecraft.worlds.battlesnake.league.entry import entrant_of
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ANCHORS, ArenaTerms

    check_folder(request.arena)
    board = request.board
    terms = ArenaTerms(
        board.width, board.height, board.gametype, board.map_name, request.snakes or (2, 4), request.timeout,
        request.most_turns, request.seed or 0,
    )  # fmt: skip
    _check(terms)
    anchors = [entrant_of(one, anchor=True) for one in dict.fromkeys(request.anchor or ANCHORS)]
    store = ArenaStore.begin(request.arena, terms)
    for one in anchors:
        store.add(one)
    return NewArena(request.arena, [one.name for one in anchors], store.terms)


@action
def add_players(request: AddPlayersRequest, progress: Progress = quiet) -> Players:
    """Let players in, also while the arena plays; who was removed comes back.

    A RUN is let in as the checkpoint that it has now; a FILE.py that changes later is left out until it is let in
    anew.

    Example: racecraft snakes arena add search runs/snakes-1 my_snake.py http://localhost:8000
    """
    from racecraft.worlds.battlesnake.league.entry import entrant_of
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.players.protocol import PlayerError

    if len(request.name) > len(request.who):
        players = "1 player" if len(request.who) == 1 else f"{len(request.who)} players"
        raise PlayerError(
            "{count} names for {players}; expected one player for every --name.",
            count=len(request.name),
            players=players,
        )
    store, added = ArenaStore(request.arena), []
    names = [*(request.name), *request.who[len(request.name) :]]
    entrants = [entrant_of(what, called) for what, called in zip(request.who, names, strict=True)]
    for entrant in entrants:
        added.append(_let_in(store, entrant))
    return Players([facts_of(one) for one in added])


@action
def remove_players(request: RemovePlayersRequest, progress: Progress = quiet) -> Removed:
    """Draw players no more, also while the arena plays; their games stay, and `add` brings them back.

    Example: racecraft snakes arena remove my_snake.py
    """
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaError

    store = ArenaStore(request.arena)
    found = [store.find(one) for one in request.who]
    for one in found:
        if one.is_anchor:
            raise ArenaError("{name} is an anchor: the scale hangs on it; expected another player.", name=one.name)
    for one in found:
        store.set_rest(one, True)
    return Removed([one.name for one in found])


@action
def show_arena(request: ArenaRequest, progress: Progress = quiet) -> Standings:
    """Show the table, or one player's meetings and games.

    Example: racecraft snakes arena show

    Example: racecraft snakes arena show my_snake.py --snakes 2
    """
    from racecraft.worlds.battlesnake.league.ladder import Ladder
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaError

    store = ArenaStore(request.arena)
    if request.snakes not in (0, *store.terms.snakes):
        there = ", ".join(map(str, store.terms.snakes))
        raise ArenaError(
            "--snakes {snakes}: nobody plays that here; expected {there}, or 0 for all.",
            snakes=request.snakes,
            there=there,
        )
    one = None if request.name is None else store.find(request.name)
    games, ladder = store.games(), Ladder(store.terms.snakes)
    ladder.count(games)
    mine = [
        game
        for game in games
        if (one is None or one.number in game.players) and request.snakes in (0, len(game.players))
    ]
    names = [entrant.name for entrant in store.entrants()]
    shown = mine[len(mine) - request.latest :] if request.latest else []
    return Standings(store, ladder, request.snakes, player=one, latest=tuple(shown), names=names)


@action
def export_games(request: ExportGamesRequest, progress: Progress = quiet) -> Figures:
    """Write one game as `snakes play --output` does, or the results of all games, a JSON object a line.

    Example: racecraft snakes arena export game.jsonl --game 17

    Example: racecraft snakes arena export results.jsonl
    """
    import json

    from racecraft.formats.atomic import write_atomic
    from racecraft.worlds.battlesnake.league.board import game_facts
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    store = ArenaStore(request.arena)
    check_folder(request.out)
    if request.game is not None:
        write_atomic(request.out, store.record(request.game))
        return Figures({"file": request.out, "game": request.game})
    names, games = [one.name for one in store.entrants()], store.games()
    write_atomic(request.out, "".join(json.dumps(game_facts(one, names)) + "\n" for one in games))
    return Figures({"file": request.out, "games": len(games)})


def facts_of(entrant: Entrant) -> dict[str, object]:
    """Return a player as JSON does."""
    return {"name": entrant.name, "source": entrant.source, "is_anchor": entrant.is_anchor, "rests": entrant.rests}


def _check(terms: ArenaTerms) -> None:
    """Refuse terms that cannot be played, before anything is written."""
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee

    for size in terms.snakes:
        Referee(terms.game(size), StreamDice(0))


def _let_in(store: ArenaStore, entrant: Entrant) -> Entrant:
    """Let a player in, or back in where it was removed."""
    known = {one.name: one for one in store.entrants()}.get(entrant.name)
    if known is not None and known.rests and (known.source, known.fingerprint) == (entrant.source, entrant.fingerprint):
        store.set_rest(known, False)
        return known
    return store.add(entrant)
