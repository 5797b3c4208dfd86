"""Let an arena play, and show its board."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.actions.watch import port_help, serve_page
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, option
from racecraft.worlds.battlesnake.actions.arena import HERE, Standings
from racecraft.worlds.battlesnake.actions.options import FILE_MEMORY_HELP

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.arena import Arena
    from racecraft.worlds.battlesnake.league.store import ArenaStore

PORT = 8200
INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True)
class PlayArenaRequest(Request):
    """How long an arena plays, and whether its board is shown."""

    games: int | None = option(None, "Stop after so many; without it, play until Ctrl-C.", low=1)
    board: bool = option(False, "Show the board in the browser meanwhile.")
    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")
    file_memory: int = option(2048, FILE_MEMORY_HELP, low=0)
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True, kw_only=True)
class BoardRequest(Request):
    """Which arena is shown, and where."""

    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")
    arena: Path = option(HERE, "The arena: one file.")


@dataclass(frozen=True)
class ServedBoard(Served):
    """The board of an arena, on a page."""

    arena: Path
    url: str
    close: Callable[[], None]
    opens_page: bool

    def as_dictionary(self) -> dict[str, Any]:
        """Return the address and the arena."""
        return {"url": self.url, "arena": str(self.arena)}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Show the board until Ctrl-C."""
        serve_page(self.url, self.close, ready, self.opens_page)


@action
def play_arena(request: PlayArenaRequest, progress: Progress = quiet) -> Standings:
    """Let those meet of whose games most is learned, until Ctrl-C; every game is kept, and the next call goes on.

    Example: racecraft snakes arena play --board

    Example: racecraft snakes arena play --games 100 --arena duels.sqlite

    Raises:
        ArenaError: There is no arena, another process plays in it, or too few players can play.
    """
    from racecraft.web.browser import open_page
    from racecraft.worlds.battlesnake.league.arena import Arena
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    store = ArenaStore(request.arena)
    board = _serve_board(store, request.port, request.open_it, progress) if request.board else None
    held = Arena(store, request.file_memory, progress)
    try:
        if board is not None:
            progress(f"The board: {board.url}")
            if board.opens_page:
                open_page(board.url)
        played, interrupted = _play_on(held, request.games, progress)
    finally:
        if board is not None:
            board.close()
    return Standings(store, held.ladder, played=played, exit_code=INTERRUPTED if interrupted else 0)


@action
def show_board(request: BoardRequest, progress: Progress = quiet) -> ServedBoard:
    """Show ratings, meetings and games in the browser, while the arena plays or rests; until Ctrl-C.

    Example: racecraft snakes arena board

    Raises:
        ArenaError: There is no arena.
        PortError: The port cannot be listened on.
    """
    from racecraft.worlds.battlesnake.league.store import ArenaStore

    return _serve_board(ArenaStore(request.arena), request.port, request.open_it, progress)


def _serve_board(store: ArenaStore, port: int | None, opens_page: bool, progress: Progress) -> ServedBoard:
    """Begin to serve the board."""
    from racecraft.web.ports import choose_port
    from racecraft.worlds.battlesnake.serving.arena_server import ArenaServer

    chosen, note = choose_port(port, PORT)
    if note:
        progress(note)
    server = ArenaServer(store)
    return ServedBoard(store.path, server.start(chosen), server.close, opens_page)


def _play_on(held: Arena, max_games: int | None, progress: Progress) -> tuple[int, bool]:
    """Play and report every game; return how many it was, and whether Ctrl-C ended it."""
    from racecraft.worlds.battlesnake.actions.tournament import outcome

    played = 0
    try:
        with closing(held.play()) as games:
            for game, shown in games:
                played += 1
                progress(f"game {game.number}: {outcome(shown)}")
                if max_games is not None and played >= max_games:
                    break
    except KeyboardInterrupt:
        progress(f"Broken off after {played} game{'s' * (played != 1)}. The same command goes on from here.")
        return played, True
    return played, False
