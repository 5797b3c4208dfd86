"""`racecraft snakes arena`: players come and go, games and ratings stay."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.arena_text import (
    against,
    facts_of,
    game_told,
    print_against,
    print_table,
    table,
    terms_told,
)
from racecraft.worlds.battlesnake.cli.options import (
    JSON,
    FileMemory,
    GameType,
    Height,
    MapName,
    Seed,
    Timeout,
    Width,
    aside,
    check_folder,
)

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import Entrant

PORT = 8200
LATEST = 10
INTERRUPTED = 130

Where = Annotated[Path, typer.Option("--arena", help="The arena: one file.")]
Port = Annotated[
    int | None,
    typer.Option(min=0, max=65535, help=f"By default {PORT} or, where it is taken, the next free; 0: any free one."),
]
Open = Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")]
HERE = Path("arena.sqlite")

app = typer.Typer(help="An arena that lasts: players come and go, games and ratings stay.", no_args_is_help=True)


@app.command()
def new(
    anchor: Annotated[
        list[str] | None,
        typer.Option("--anchor", help="A player that never changes; the mean of the anchors is 1500 points."),
    ] = None,
    snakes: Annotated[
        list[int] | None, typer.Option(help="Snakes at a board; may be said again. [default: 2 and 4]")
    ] = None,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 100,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    most_turns: Annotated[int, typer.Option("--most-turns", min=1, help="A longer game is a draw.")] = 1000,
    seed: Seed = 0,
    arena: Where = HERE,
    json: JSON = False,
) -> None:
    """Begin an arena: what is played there, and the anchors that keep its scale; neither ever changes.

    Example: racecraft snakes arena new

    Example: racecraft snakes arena new --arena duels.sqlite --snakes 2 --timeout 500 --anchor flood_fill
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.league.entry import entrant_of
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ANCHORS, ArenaTerms

    check_folder(arena)
    terms = ArenaTerms(
        width, height, gametype, map_name, tuple(snakes or (2, 4)), timeout, most_turns, seed or 0
    )  # fmt: skip
    _check(terms)
    anchors = [entrant_of(one, anchor=True) for one in dict.fromkeys(anchor or ANCHORS)]
    store = ArenaStore.begin(arena, terms)
    for one in anchors:
        store.add(one)
    names = [one.name for one in anchors]
    if json:
        print_json({"arena": str(arena), "anchors": names})
        return
    print(f"{arena}: {terms_told(store)}; anchors {', '.join(names)}.")
    print(f"Let players in: racecraft snakes arena add search{_here(arena)}")


@app.command()
def add(
    who: Annotated[list[str], typer.Argument(help="Players: names, addresses, FILE.py, RUN; search+ before one.")],
    name: Annotated[list[str] | None, typer.Option("--name", "-n", help="Its name there, in the same order.")] = None,
    arena: Where = HERE,
    json: JSON = False,
) -> None:
    """Let players in, also while the arena plays; who was removed comes back.

    A RUN is let in as the checkpoint that it has now; a FILE.py that changes later is left out until it is let in
    anew.

    Example: racecraft snakes arena add search runs/snakes-1 my_snake.py http://localhost:8000
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.league.entry import entrant_of
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.players.protocol import PlayerError

    if len(name or []) > len(who):
        players = "1 player" if len(who) == 1 else f"{len(who)} players"
        raise PlayerError(
            "{count} names for {players}; expected one player for every --name.", count=len(name or []), players=players
        )
    store, told = ArenaStore(arena), []
    names = [*(name or []), *who[len(name or []) :]]
    entrants = [entrant_of(what, called) for what, called in zip(who, names, strict=True)]
    for entrant in entrants:
        told.append(_let_in(store, entrant))
    if json:
        print_json({"players": [facts_of(one) for one in told]})
        return
    for one in told:
        print(f"{one.name} is in: {one.source}")


@app.command()
def remove(
    who: Annotated[list[str], typer.Argument(help="Names of players.")], arena: Where = HERE, json: JSON = False
) -> None:
    """Draw players no more, also while the arena plays; their games stay, and `add` brings them back.

    Example: racecraft snakes arena remove my_snake.py
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaError

    store = ArenaStore(arena)
    found = [store.find(one) for one in who]
    for one in found:
        if one.is_anchor:
            raise ArenaError("{name} is an anchor: the scale hangs on it; expected another player.", name=one.name)
    for one in found:
        store.set_rest(one, True)
    if json:
        print_json({"removed": [one.name for one in found]})
        return
    for one in found:
        print(f"{one.name} is drawn no more; its games stay.")


@app.command()
def play(
    games: Annotated[int | None, typer.Option(min=1, help="Stop after so many; without it, play until Ctrl-C.")] = None,
    board: Annotated[bool, typer.Option("--board", help="Show the board in the browser meanwhile.")] = False,
    port: Port = None,
    open_it: Open = True,
    file_memory: FileMemory = 2048,
    arena: Where = HERE,
    json: JSON = False,
) -> None:
    """Let those meet of whose games most is learned, until Ctrl-C; every game is kept, and the next call goes on.

    Example: racecraft snakes arena play --board

    Example: racecraft snakes arena play --games 100 --arena duels.sqlite
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.league.arena import Arena
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    store = ArenaStore(arena)
    close = _serve_board(store, port, open_it, aside) if board else None
    held = Arena(store, file_memory, aside)
    played, broken_off = 0, False
    try:
        played, broken_off = _play_on(held, games)
    finally:
        if close is not None:
            close()
    if json:
        print_json({"played": played, **table(store, held.ladder)})
    else:
        print_table(store, held.ladder)
    if broken_off:
        raise typer.Exit(INTERRUPTED)


@app.command()
def board(port: Port = None, open_it: Open = True, arena: Where = HERE, json: JSON = False) -> None:
    """Show ratings, meetings and games in the browser, while the arena plays or rests; until Ctrl-C.

    Example: racecraft snakes arena board
    """
    from contextlib import suppress

    from racecraft.cli.output import print_json, say
    from racecraft.serving.interrupts import wait_for_interrupt
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    def told(address: str) -> None:
        if json:
            print_json({"url": address, "arena": str(arena)})
        else:
            tell(f"{arena}: {address}  (Ctrl-C ends)")

    close = _serve_board(ArenaStore(arena), port, open_it, tell, told)
    try:
        with suppress(KeyboardInterrupt):
            wait_for_interrupt()
    finally:
        close()


@app.command()
def show(
    name: Annotated[str | None, typer.Argument(help="One player: how it fared against each, and its games.")] = None,
    snakes: Annotated[int, typer.Option(help="Only games of so many snakes; 0: all.")] = 0,
    latest: Annotated[int, typer.Option(min=0, help="How many of the latest games are listed.")] = LATEST,
    arena: Where = HERE,
    json: JSON = False,
) -> None:
    """Show the table, or one player's meetings and games.

    Example: racecraft snakes arena show

    Example: racecraft snakes arena show my_snake.py --snakes 2
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.league.board import game_facts
    from racecraft.worlds.battlesnake.league.ladder import Ladder
    from racecraft.worlds.battlesnake.league.store import ArenaStore
    from racecraft.worlds.battlesnake.league.terms import ArenaError

    store = ArenaStore(arena)
    if snakes not in (0, *store.terms.snakes):
        there = ", ".join(map(str, store.terms.snakes))
        raise ArenaError(
            "--snakes {snakes}: nobody plays that here; expected {there}, or 0 for all.", snakes=snakes, there=there
        )
    one = None if name is None else store.find(name)
    games, ladder = store.games(), Ladder(store.terms.snakes)
    ladder.hear(games)
    mine = [game for game in games if (one is None or one.number in game.players) and snakes in (0, len(game.players))]
    names = [entrant.name for entrant in store.entrants()]
    shown = mine[len(mine) - latest :] if latest else []
    if json:
        told = [game_facts(game, names) for game in shown]
        faced = {} if one is None else {"player": facts_of(one), "against": against(store, ladder, one, snakes)}
        print_json({**faced, **table(store, ladder, snakes), "latest": told})
        return
    print_table(store, ladder, snakes)
    if one is not None:
        print_against(store, ladder, one, snakes)
    for game in shown:
        print(f"game {game.number:>5}: {game_told(game, names)}")


@app.command()
def export(
    out: Annotated[Path, typer.Argument(help="The file to write.")],
    game: Annotated[int | None, typer.Option(min=1, help="Number of one game, to watch, study or verify.")] = None,
    arena: Where = HERE,
    json: JSON = False,
) -> None:
    """Write one game as `snakes play --output` does, or the results of all games, a JSON object a line.

    Example: racecraft snakes arena export game.jsonl --game 17

    Example: racecraft snakes arena export results.jsonl
    """
    import json as as_json

    from racecraft.cli.output import print_json
    from racecraft.formats.atomic import write_atomic
    from racecraft.worlds.battlesnake.league.board import game_facts
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    store = ArenaStore(arena)
    check_folder(out)
    if game is not None:
        write_atomic(out, store.record(game))
        told: dict[str, object] = {"game": game}
    else:
        names, games = [one.name for one in store.entrants()], store.games()
        write_atomic(out, "".join(as_json.dumps(game_facts(one, names)) + "\n" for one in games))
        told = {"games": len(games)}
    if json:
        print_json({"file": str(out), **told})
    else:
        print(out)


def _serve_board(
    store: ArenaStore,
    port: int | None,
    open_it: bool,
    say: Callable[[str], None],
    told: Callable[[str], None] | None = None,
) -> Callable[[], None]:
    """Begin to serve the board and tell where; return what ends it."""
    from racecraft.cli.runs.watch import open_page
    from racecraft.web.ports import choose_port
    from racecraft.worlds.battlesnake.serving.arena_server import ArenaServer

    chosen, note = choose_port(port, PORT)
    if note:
        say(note)
    server = ArenaServer(store)
    address = server.start(chosen)
    (told or (lambda address: say(f"The board: {address}")))(address)
    if open_it:
        open_page(address)
    return server.close


def _check(terms: object) -> None:
    """Refuse terms that cannot be played, before anything is written."""
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee
    from racecraft.worlds.battlesnake.league.terms import ArenaTerms

    assert isinstance(terms, ArenaTerms)
    for size in terms.snakes:
        Referee(terms.game(size), StreamDice(0))


def _let_in(store: ArenaStore, entrant: Entrant) -> Entrant:
    """Let a player in, or back in where it was removed."""
    known = {one.name: one for one in store.entrants()}.get(entrant.name)
    if known is not None and known.rests and (known.source, known.fingerprint) == (entrant.source, entrant.fingerprint):
        store.set_rest(known, False)
        return known
    return store.add(entrant)


def _play_on(held: object, most: int | None) -> tuple[int, bool]:
    """Play and say every game; return how many it was, and whether Ctrl-C ended it."""
    from contextlib import closing

    from racecraft.worlds.battlesnake.cli.tournament import told
    from racecraft.worlds.battlesnake.league.arena import Arena

    assert isinstance(held, Arena)
    played = 0
    try:
        with closing(held.play()) as games:
            for game, shown in games:
                played += 1
                aside(f"game {game.number}: {told(shown)}")
                if most is not None and played >= most:
                    break
    except KeyboardInterrupt:
        aside(f"Broken off after {played} game{'s' * (played != 1)}. The same command goes on from here.")
        return played, True
    return played, False


def _here(arena: Path) -> str:
    return f" --arena {shlex.quote(str(arena))}" if arena != HERE else ""
