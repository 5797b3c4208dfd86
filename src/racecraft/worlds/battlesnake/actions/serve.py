"""Serve a snake over the official webhook API."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option
from racecraft.worlds.battlesnake.actions.options import FILE_MEMORY_HELP

if TYPE_CHECKING:
    from racecraft.web.server import ListeningServer
    from racecraft.worlds.battlesnake.players.protocol import JsonPlayer, SnakePlayer
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer


@dataclass(frozen=True, kw_only=True)
class ServeSnakeRequest(Request):
    """Who is served, where, how it looks, and what it may use."""

    player: str = argument("A built-in player, a FILE.py or a trained snake's RUN.", "search")
    port: int = option(8000, "0: any free one.", low=0, high=65535)
    host: str = option("127.0.0.1", "Listen address; 0.0.0.0: all interfaces.")
    color: str = option("", "#rrggbb, or a basic colour's name.")
    head: str = option("", "Name of an official head.")
    tail: str = option("", "Name of an official tail.")
    author: str = option("", "Told on GET /.")
    margin: int = option(100, "Milliseconds of the timeout left for the way.", low=0)
    games: int = option(200, "Games at once; a new one beyond them is refused (503).", low=1)
    ponder: bool = option(True, "Let search think on while others think.")
    cores: int = option(1, "Cores that search may think about one move with.", low=1, high=2)
    file_memory: int = option(2048, FILE_MEMORY_HELP, low=0)


@dataclass(frozen=True)
class ServedSnake(Served):
    """A snake that answers games."""

    url: str
    player: str
    server: SnakeServer
    listening: ListeningServer
    close_player: Callable[[], None]

    def as_dictionary(self) -> dict[str, Any]:
        """Return address and player."""
        return {"url": self.url, "player": self.player}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Answer until Ctrl-C or SIGTERM; then tell how the games went."""
        try:
            ready()
            self.listening.run()
        finally:
            self.server.close()
            self.close_player()
        count = self.server.count
        progress(
            f"{count.games} games, {count.moves} moves, {count.late} late, {count.missed} seem missed, "
            f"{count.failed} failed, {count.refused} refused, p99 {count.p99_ms():.0f} ms"
        )


@action
def serve(request: ServeSnakeRequest, progress: Progress = quiet) -> ServedSnake:
    """Serve a snake over the official webhook API until Ctrl-C or SIGTERM.

    Example: racecraft snakes serve my_snake.py --port 8000

    Example: racecraft snakes serve runs/standard-1 --port 8000

    Raises:
        PlayerError: There is no such player, or it cannot be used so.
        PortError: The address cannot be listened on.
    """
    from racecraft.serving.quick_answers import answer_before_thinking
    from racecraft.worlds.battlesnake.players.find import find_player
    from racecraft.worlds.battlesnake.players.from_file import FilePlayer

    answer_before_thinking()
    looks = _looks(request)
    player = find_player(request.player, memory_mb=request.file_memory)
    close = player.close if isinstance(player, FilePlayer) else lambda: None
    try:
        return _served(request, player, looks, close, progress)
    except BaseException:
        close()
        raise


def _served(
    request: ServeSnakeRequest,
    player: SnakePlayer | JsonPlayer,
    looks: dict[str, str],
    close: Callable[[], None],
    progress: Progress,
) -> ServedSnake:
    """Return a player that is warm, behind a socket that listens."""
    from racecraft.serving.quick_answers import freeze_loaded
    from racecraft.web.server import ListeningServer
    from racecraft.worlds.battlesnake.players.appearance import colour
    from racecraft.worlds.battlesnake.players.find import warm_up
    from racecraft.worlds.battlesnake.players.from_file import FilePlayer
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

    progress(f"Getting {request.player} ready …")
    warm_up(player)
    _let_ponder(player, request.ponder)
    _let_use(player, request.cores, request.player)
    freeze_loaded()
    info = player.appearance() if isinstance(player, FilePlayer) else {}
    if info.get("color"):
        info["color"] = colour(info["color"], f"{request.player}: info()'s color")
    server = SnakeServer(
        player,
        info | looks,
        request.author or info.get("author", ""),
        request.margin,
        most_games=request.games,
        complain=lambda sentence: progress(f"racecraft: {sentence}"),
    )
    listening = ListeningServer(server.application, request.host, request.port)
    url = f"http://{request.host}:{listening.port}"
    return ServedSnake(url, request.player, server, listening, close)


def _looks(request: ServeSnakeRequest) -> dict[str, str]:
    from racecraft.worlds.battlesnake.players.appearance import colour

    looks = {"color": colour(request.color) if request.color else "", "head": request.head, "tail": request.tail}
    return {key: value for key, value in looks.items() if value}


def _let_ponder(player: SnakePlayer | JsonPlayer, ponder: bool) -> None:
    """Tell a player that can think on while nobody asks whether it may: here, unlike in an arena, it may."""
    minds = getattr(player, "minds", None)
    if minds is not None:
        minds.ponders = ponder


def _let_use(player: SnakePlayer | JsonPlayer, cores: int, name: str) -> None:
    """Tell search how many cores it may think with.

    Raises:
        PlayerError: More than one are given to a player that thinks with one.
    """
    from racecraft.worlds.battlesnake.players.protocol import PlayerError
    from racecraft.worlds.battlesnake.players.search import Search

    if isinstance(player, Search):
        player.cores = cores
    elif cores > 1:
        raise PlayerError(
            "--cores is {cores}, and {name} thinks with one; expected search, search:RUN or search+ one.",
            cores=cores,
            name=name,
        )
