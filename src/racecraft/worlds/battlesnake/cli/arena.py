"""`racecraft snakes arena`."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.arena import (
    HERE,
    NewArena,
    Players,
    Removed,
    Standings,
    add_players,
    export_games,
    new_arena,
    remove_players,
    show_arena,
)
from racecraft.worlds.battlesnake.cli.arena_text import print_standings, terms_text
from racecraft.worlds.battlesnake.cli.options import JSON, FileMemory, aside

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.arena import Arena
    from racecraft.worlds.battlesnake.league.store import ArenaStore

PORT = 8200
INTERRUPTED = 130

Where = Annotated[Path, typer.Option("--arena", help="The arena: one file.")]
Port = Annotated[
    int | None,
    typer.Option(min=0, max=65535, help=f"By default {PORT} or, where it is taken, the next free; 0: any free one."),
]
Open = Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")]

app = typer.Typer(help="An arena that lasts: players come and go, games and ratings stay.", no_args_is_help=True)


def _show_new(made: NewArena) -> None:
    print(f"{made.arena}: {terms_text(made.terms)}; anchors {', '.join(made.anchors)}.")
    here = f" --arena {shlex.quote(str(made.arena))}" if made.arena != HERE else ""
    print(f"Let players in: racecraft snakes arena add search{here}")


def _show_added(added: Players) -> None:
    for one in added.players:
        print(f"{one['name']} is in: {one['source']}")


def _show_removed(done: Removed) -> None:
    for name in done.removed:
        print(f"{name} is drawn no more; its games stay.")


def _show_export(done: Figures) -> None:
    print(done["file"])


app.command("new")(command(new_arena, _show_new))
app.command("add")(command(add_players, _show_added))
app.command("remove")(command(remove_players, _show_removed))


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
        print_json(Standings(store, held.ladder, played=played))
    else:
        print_standings(Standings(store, held.ladder))
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


app.command("show")(command(show_arena, print_standings))
app.command("export")(command(export_games, _show_export))


def _serve_board(
    store: ArenaStore,
    port: int | None,
    open_it: bool,
    say: Callable[[str], None],
    told: Callable[[str], None] | None = None,
) -> Callable[[], None]:
    """Begin to serve the board and tell where; return what ends it."""
    from racecraft.web.browser import open_page
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


def _play_on(held: Arena, most: int | None) -> tuple[int, bool]:
    """Play and say every game; return how many it was, and whether Ctrl-C ended it."""
    from racecraft.worlds.battlesnake.actions.tournament import outcome

    played = 0
    try:
        with closing(held.play()) as games:
            for game, shown in games:
                played += 1
                aside(f"game {game.number}: {outcome(shown)}")
                if most is not None and played >= most:
                    break
    except KeyboardInterrupt:
        aside(f"Broken off after {played} game{'s' * (played != 1)}. The same command goes on from here.")
        return played, True
    return played, False
