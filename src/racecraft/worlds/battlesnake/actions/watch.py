"""Watch a game in the browser, or film one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.battlesnake.actions.options import BoardOptions, check_folder, new_seed, take_seats

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.serving.spectators import BoardPage

GAME = "A game from `snakes play --output`, or any file that `snakes import` reads."


@dataclass(frozen=True, kw_only=True)
class WatchGameRequest(Request):
    """Which game is watched, recorded or played now, and where."""

    game: Path | None = argument(GAME, None)
    live: bool = option(False, "Play a game and watch it as it comes.")
    url: tuple[str, ...] = option((), "A server's address, a built-in player, or a FILE.py.", "--url", "-u")
    name: tuple[str, ...] = option((), "Its name, in the same order.", "--name", "-n")
    board: BoardOptions = group(BoardOptions)
    timeout: int = option(500, "Milliseconds for an answer.", "--timeout", "-t", low=1)
    seed: int | None = option(None, "Chance of the game; without it, another every time.", "--seed", "-r")
    html: Path | None = option(None, "Write the page here, to open or e-mail, and stop.")
    board_url: str = option("", "Another board page, such as the official one.")
    port: int = option(0, "Where the page is served; 0: any free one.", low=0, high=65535)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")
    speed: float = option(8.0, "Turns a second.", low=0.5, high=50)


@dataclass(frozen=True)
class WatchedGame(Served):
    """A page with a game: a file, or an address that answers while `serve` runs."""

    html: Path | None = None
    play: Callable[[BoardPage], None] | None = None
    """Serves the game on a page until Ctrl-C."""
    page: BoardPage | None = None
    address: list[str] = field(default_factory=list)
    """Its only item comes when the page is served: a live game has its first position then."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the file or the address."""
        return {"html": str(self.html)} if self.html is not None else {"url": "".join(self.address)}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Serve the game until Ctrl-C; of a page that was written, nothing is to be served."""
        if self.play is None or self.page is None:
            ready()
            return

        def announce(address: str) -> None:
            self.address.append(address)
            ready()

        self.play(replace(self.page, announce=announce))


@dataclass(frozen=True, kw_only=True)
class FilmGameRequest(Request):
    """Which game is filmed, and how."""

    game: Path = argument(GAME)
    out: Path = option(Path("game.mp4"), "The film to write: .mp4 or .gif.", "--out", "-o")
    speed: float = option(8.0, "Turns a second.", low=0.5, high=50)


@dataclass(frozen=True, kw_only=True)
class GifRequest(Request):
    """Which game is drawn as a GIF."""

    game: Path = argument(GAME)
    picture: Path = argument("The GIF to write.")
    fps: float = option(8.0, "Turns a second.", low=0.1, high=50)


@dataclass(frozen=True)
class FilmedGame:
    """A film of a game."""

    film: Path


@action
def watch(request: WatchGameRequest, progress: Progress = quiet) -> WatchedGame:
    """Watch a game in the browser: step, play, scrub; until Ctrl-C.

    Example: racecraft snakes watch game.jsonl

    Example: racecraft snakes watch game.jsonl --html game.html

    Example: racecraft snakes watch --live --url search --url my_snake.py

    Raises:
        PlayerError: There is no such player, or both a game and `live` were given, or neither.
    """
    from racecraft.worlds.battlesnake.players.protocol import PlayerError
    from racecraft.worlds.battlesnake.serving.spectators import BoardPage

    if request.live == (request.game is not None):
        raise PlayerError("expected either a recorded game or --live.")
    page = BoardPage(request.board_url, request.port, request.open_it, request.speed, stays=True, on_message=progress)
    if request.game is not None:
        return _watch_recorded(request.game, request.html, page)
    if request.html is not None:
        raise PlayerError("--html writes a recorded game. Play one first: `racecraft snakes play --output game.jsonl`.")
    return _watch_live(request, page, progress)


@action
def film(request: FilmGameRequest, progress: Progress = quiet) -> FilmedGame:
    """Film a recorded game, as MP4 that browsers play or as GIF.

    Example: racecraft snakes film game.jsonl --out game.mp4
    """
    return _film(request.game, request.out, request.speed)


@action
def gif(request: GifRequest, progress: Progress = quiet) -> FilmedGame:
    """Draw a recorded game as a GIF: `film` by its older name.

    Example: racecraft snakes gif game.jsonl game.gif
    """
    return _film(request.game, request.picture, request.fps)


def _film(game: Path, out: Path, speed: float) -> FilmedGame:
    from racecraft.worlds.battlesnake.analysis.board_film import check_film, film_game
    from racecraft.worlds.battlesnake.evaluation.imported import read_game

    check_folder(out)
    check_film(out)
    played = read_game(game)
    return FilmedGame(film_game(played.boards, played.card, out, speed))


def _watch_live(request: WatchGameRequest, page: BoardPage, progress: Progress) -> WatchedGame:
    from racecraft.worlds.battlesnake.evaluation.live import play_live
    from racecraft.worlds.battlesnake.serving.spectators import Browser

    who = request.url or ("search", "area_control")
    seed = new_seed() if request.seed is None else request.seed
    settings = request.board.settings(len(who))
    seats = take_seats(who, request.name, seed, progress)

    def play(shown: BoardPage) -> None:
        observers = [Browser(settings, shown)]
        play_live(settings, seats, seed, request.timeout, observers=observers, least_seconds=1 / request.speed)

    return WatchedGame(play=play, page=page)


def _watch_recorded(game: Path, html: Path | None, page: BoardPage) -> WatchedGame:
    from racecraft.formats.atomic import write_atomic
    from racecraft.worlds.battlesnake.analysis.board_page import board_page, read_board
    from racecraft.worlds.battlesnake.serving.board_server import BoardServer

    check_folder(html)
    title, facts, events = read_board(game)
    if html is not None:
        write_atomic(html, board_page(title, facts, events, speed=page.speed))
        return WatchedGame(html)
    return WatchedGame(
        play=lambda shown: shown.show_until_interrupt(BoardServer(title, facts, events, shown.speed), facts["ID"]),
        page=page,
    )
