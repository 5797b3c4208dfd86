"""`racecraft snakes watch` and `film`: games to look at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.from_request import TerminalProgress
from racecraft.worlds.battlesnake.actions.options import check_folder, new_seed, take_seats
from racecraft.worlds.battlesnake.cli.options import (
    JSON,
    GameType,
    Height,
    MapName,
    Names,
    Seed,
    Timeout,
    Urls,
    Width,
    page_told,
)

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.serving.game_audience import BoardPage

Recorded = Annotated[
    Path, typer.Argument(help="A game from `snakes play --output`, or any file that `snakes import` reads.")
]
MaybeRecorded = Annotated[
    Path | None, typer.Argument(help="A game from `snakes play --output`, or any file that `snakes import` reads.")
]
Live = Annotated[bool, typer.Option("--live", help="Play a game and watch it as it comes.")]
Html = Annotated[Path | None, typer.Option("--html", help="Write the page here, to open or e-mail, and stop.")]
BoardUrl = Annotated[str, typer.Option("--board-url", help="Another board page, such as the official one.")]
Port = Annotated[int, typer.Option(help="Where the page is served; 0: any free one.")]
Open = Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")]
Speed = Annotated[float, typer.Option(min=0.5, max=50, help="Turns a second.")]


def watch(
    game: MaybeRecorded = None,
    live: Live = False,
    url: Urls = None,
    name: Names = None,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 500,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    seed: Seed = None,
    html: Html = None,
    board_url: BoardUrl = "",
    port: Port = 0,
    open_it: Open = True,
    speed: Speed = 8,
    json: JSON = False,
) -> None:
    """Watch a game in the browser: step, play, scrub; until Ctrl-C.

    Example: racecraft snakes watch game.jsonl

    Example: racecraft snakes watch game.jsonl --html game.html

    Example: racecraft snakes watch --live --url search --url my_snake.py
    """
    from racecraft.worlds.battlesnake.cli.options import aside
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.live import play_live
    from racecraft.worlds.battlesnake.players.protocol import PlayerError
    from racecraft.worlds.battlesnake.serving.game_audience import BoardPage, Browser

    if live == (game is not None):
        raise PlayerError("expected either a recorded game or --live.")
    showing = BoardPage(board_url, port, open_it, speed, stays=True, announce=page_told(json, stays=True), say=aside)
    if game is not None:
        _show_recorded(game, html, showing, json)
        return
    if html is not None:
        raise PlayerError("--html writes a recorded game. Play one first: `racecraft snakes play --output game.jsonl`.")
    who, seed = url or ["search", "area_control"], new_seed() if seed is None else seed
    settings = GameSettings(width, height, len(who), gametype, map_name, solo=True if len(who) < 2 else None)
    seats = take_seats(who, name or [], seed, TerminalProgress(quiet_stdout=json))
    play_live(settings, seats, seed, timeout, observers=[Browser(settings, showing)], least_seconds=1 / speed)


def film(
    game: Recorded,
    out: Annotated[Path, typer.Option("--out", "-o", help="The film to write: .mp4 or .gif.")] = Path("game.mp4"),
    speed: Speed = 8,
) -> None:
    """Film a recorded game, as MP4 that browsers play or as GIF.

    Example: racecraft snakes film game.jsonl --out game.mp4
    """
    from racecraft.worlds.battlesnake.analysis.board_film import check_film, film_game
    from racecraft.worlds.battlesnake.evaluation.imported import read_game

    check_folder(out)
    check_film(out)
    played = read_game(game)
    print(film_game(played.boards, played.card, out, speed))


def gif(
    game: Recorded,
    picture: Annotated[Path, typer.Argument(help="The GIF to write.")],
    fps: Annotated[float, typer.Option(min=0.1, max=50, help="Turns a second.")] = 8,
) -> None:
    """Draw a recorded game as a GIF: `film` by its older name.

    Example: racecraft snakes gif game.jsonl game.gif
    """
    film(game, picture, fps)


def _show_recorded(game: Path, html: Path | None, showing: BoardPage, json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.formats.atomic import write_atomic
    from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts, title_of
    from racecraft.worlds.battlesnake.analysis.board_page import board_page
    from racecraft.worlds.battlesnake.evaluation.imported import read_game
    from racecraft.worlds.battlesnake.serving.board_server import BoardServer

    check_folder(html)
    played = read_game(game)
    card = played.card
    events = [*(frame(board, card) for board in played.boards), game_end(played.settings, card)]
    title, facts = title_of(card), game_facts(played.settings, card, "complete")
    if html is None:
        showing.hold(BoardServer(title, facts, events, showing.speed), card.id)
        return
    write_atomic(html, board_page(title, facts, events, speed=showing.speed))
    if json:
        print_json({"html": str(html)})
    else:
        print(html)
