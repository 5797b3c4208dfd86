"""`racecraft snakes serve`: a snake behind the official webhook API."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.battlesnake.options import JSON

if TYPE_CHECKING:
    from racecraft.serving.snake_server import SnakeServer


def serve(
    player: Annotated[str, typer.Argument(help="A built-in player, a FILE.py or a trained snake's RUN.")] = "search",
    port: Annotated[int, typer.Option(help="0: any free one.")] = 8000,
    host: Annotated[str, typer.Option(help="Who may ask; 0.0.0.0: other machines too.")] = "127.0.0.1",
    color: Annotated[str, typer.Option(help="#rrggbb")] = "",
    head: Annotated[str, typer.Option(help="Name of an official head.")] = "",
    tail: Annotated[str, typer.Option(help="Name of an official tail.")] = "",
    author: Annotated[str, typer.Option(help="Told on GET /.")] = "",
    margin: Annotated[int, typer.Option(min=0, help="Milliseconds of the timeout left for the way.")] = 100,
    json: JSON = False,
) -> None:
    """Serve a snake over the official webhook API until Ctrl-C.

    Example: racecraft snakes serve my_snake.py --port 8000

    Example: racecraft snakes serve runs/standard-1 --port 8000
    """
    from racecraft.cli.output import say
    from racecraft.players.battlesnake.find import find_player, warm_up
    from racecraft.players.battlesnake.from_file import FilePlayer
    from racecraft.serving.snake_server import SnakeServer, answer_before_thinking, settle

    answer_before_thinking()
    found = find_player(player)
    try:
        say(f"Getting {player} ready …", quiet_stdout=json)
        warm_up(found)
        settle()
        said = found.looks() if isinstance(found, FilePlayer) else {}
        given = {key: value for key, value in {"color": color, "head": head, "tail": tail}.items() if value}
        server = SnakeServer(found, said | given, author or said.get("author", ""), margin, complain=_complain)
        _answer_until_interrupted(server, host, port, player, json)
    finally:
        if isinstance(found, FilePlayer):
            found.close()
    count = server.count
    say(
        f"{count.games} games, {count.moves} moves, {count.late} late, {count.failed} failed, "
        f"{count.refused} refused, p99 {count.p99_ms():.0f} ms",
        quiet_stdout=json,
    )


def _answer_until_interrupted(server: SnakeServer, host: str, port: int, player: str, json: bool) -> None:
    import asyncio
    import contextlib

    from racecraft.cli.output import print_json, say
    from racecraft.serving.snake_server import serve_until_cancelled

    def ready(port: int) -> None:
        if json:
            print_json({"url": f"http://{host}:{port}", "player": player})
        else:
            say(f"{player} answers at http://{host}:{port} (Ctrl-C ends)", quiet_stdout=False)

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(serve_until_cancelled(server, host, port, ready))


def _complain(sentence: str) -> None:
    from racecraft.cli.output import say

    say(f"racecraft: {sentence}", quiet_stdout=True)
