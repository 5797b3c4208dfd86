"""`racecraft snakes serve`: a snake behind the official webhook API."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import JSON, FileMemory, aside

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.players.protocol import JsonPlayer, SnakePlayer
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer


def serve(
    player: Annotated[str, typer.Argument(help="A built-in player, a FILE.py or a trained snake's RUN.")] = "search",
    port: Annotated[int, typer.Option(help="0: any free one.")] = 8000,
    host: Annotated[str, typer.Option(help="Who may ask; 0.0.0.0: other machines too.")] = "127.0.0.1",
    color: Annotated[str, typer.Option(help="#rrggbb, or a basic colour's name.")] = "",
    head: Annotated[str, typer.Option(help="Name of an official head.")] = "",
    tail: Annotated[str, typer.Option(help="Name of an official tail.")] = "",
    author: Annotated[str, typer.Option(help="Told on GET /.")] = "",
    margin: Annotated[int, typer.Option(min=0, help="Milliseconds of the timeout left for the way.")] = 100,
    games: Annotated[int, typer.Option(min=1, help="Games at once; a new one beyond them is refused (503).")] = 200,
    ponder: Annotated[
        bool, typer.Option("--ponder/--no-ponder", help="Let search think on while others think.")
    ] = True,
    cores: Annotated[int, typer.Option(min=1, max=2, help="Cores that search may think about one move with.")] = 1,
    file_memory: FileMemory = 2048,
    json: JSON = False,
) -> None:
    """Serve a snake over the official webhook API until Ctrl-C or SIGTERM.

    Example: racecraft snakes serve my_snake.py --port 8000

    Example: racecraft snakes serve runs/standard-1 --port 8000
    """
    from racecraft.cli.output import say
    from racecraft.serving.quick_answers import answer_before_thinking, settle
    from racecraft.worlds.battlesnake.players.appearance import colour
    from racecraft.worlds.battlesnake.players.find import find_player, warm_up
    from racecraft.worlds.battlesnake.players.from_file import FilePlayer
    from racecraft.worlds.battlesnake.serving.snake_server import SnakeServer

    answer_before_thinking()
    asked = {"color": colour(color) if color else "", "head": head, "tail": tail}
    given = {key: value for key, value in asked.items() if value}
    found = find_player(player, memory_mb=file_memory)
    try:
        say(f"Getting {player} ready …", quiet_stdout=json)
        warm_up(found)
        _let_ponder(found, ponder)
        _let_use(found, cores, player)
        settle()
        said = found.looks() if isinstance(found, FilePlayer) else {}
        if said.get("color"):
            said["color"] = colour(said["color"], f"{player}: info()'s color")
        server = SnakeServer(
            found, said | given, author or said.get("author", ""), margin, most_games=games, complain=_complain
        )
        _answer_until_interrupted(server, host, port, player, json)
    finally:
        if isinstance(found, FilePlayer):
            found.close()
    count = server.count
    say(
        f"{count.games} games, {count.moves} moves, {count.late} late, {count.missed} seem missed, "
        f"{count.failed} failed, "
        f"{count.refused} refused, p99 {count.p99_ms():.0f} ms",
        quiet_stdout=json,
    )


def _answer_until_interrupted(server: SnakeServer, host: str, port: int, player: str, json: bool) -> None:
    from racecraft.cli.output import print_json, say
    from racecraft.web.server import serve as serve_application

    def ready(port: int) -> None:
        if json:
            print_json({"url": f"http://{host}:{port}", "player": player})
        else:
            say(f"{player} answers at http://{host}:{port} (Ctrl-C ends)", quiet_stdout=False)

    try:
        serve_application(server.application, host, port, ready)
    finally:
        server.close()


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


def _complain(sentence: str) -> None:
    aside(f"racecraft: {sentence}")
