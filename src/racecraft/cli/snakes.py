"""`racecraft snakes`: play, judge and serve Battlesnakes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecraft.envs.battlesnake.board import Board
    from racecraft.evaluation.arena.seats import Seat
    from racecraft.players.snakes.messages import GameCard

app = typer.Typer(help="Battlesnake: play games, hold tournaments, serve a snake.", no_args_is_help=True)

JSON = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]
Width = Annotated[int, typer.Option("--width", "-W", help="Squares from left to right.")]
Height = Annotated[int, typer.Option("--height", "-H", help="Squares from bottom to top.")]
Timeout = Annotated[int, typer.Option("--timeout", "-t", min=1, help="Milliseconds for an answer.")]
GameType = Annotated[str, typer.Option("--gametype", "-g", help="Ruleset: standard, solo, royale, constrictor, …")]
MapName = Annotated[str, typer.Option("--map", "-m", help="Map: standard, empty, royale, arcade_maze, …")]
Seed = Annotated[int | None, typer.Option("--seed", "-r", help="Chance of the game; without it, another every time.")]
FoodChance = Annotated[int, typer.Option("--foodSpawnChance", help="Percent, each turn.")]
MinimumFood = Annotated[int, typer.Option("--minimumFood", help="Food below this is filled up at once.")]
Damage = Annotated[int, typer.Option("--hazardDamagePerTurn", help="Health a hazard takes.")]
Shrink = Annotated[int, typer.Option("--shrinkEveryNTurns", help="Turns between two changes of the hazards.")]


@app.command()
def players(json: JSON = False) -> None:
    """List the built-in players, weakest first."""
    from racecraft.cli.output import print_json
    from racecraft.players.snakes.protocol import PLAYERS

    if json:
        print_json({"players": PLAYERS})
        return
    for name, what in PLAYERS.items():
        print(f"{name:14} {what}")
    print("\nsearch+NAME    search, guided by another player\nFILE.py        your own: def move(data): …")


@app.command()
def play(
    url: Annotated[
        list[str] | None, typer.Option("--url", "-u", help="A server's address, a built-in player, or a FILE.py.")
    ] = None,
    name: Annotated[list[str] | None, typer.Option("--name", "-n", help="Its name, in the same order.")] = None,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 500,
    sequential: Annotated[bool, typer.Option("--sequential", "-s", help="Ask one after another.")] = False,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    view: Annotated[bool, typer.Option("--view", "--viewmap", "-v", help="Watch in the terminal.")] = False,
    seed: Seed = None,
    delay: Annotated[int, typer.Option("--delay", "-d", min=0, help="Milliseconds to wait after each turn.")] = 0,
    duration: Annotated[int, typer.Option("--duration", "-D", min=0, help="Milliseconds a turn lasts at least.")] = 0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the game here, as JSON Lines.")] = None,
    gif: Annotated[Path | None, typer.Option("--gif", help="Write the game here, as a GIF.")] = None,
    food_spawn_chance: FoodChance = 15,
    minimum_food: MinimumFood = 1,
    hazard_damage: Damage = 14,
    shrink_every: Shrink = 25,
    most_turns: Annotated[int | None, typer.Option("--most-turns", min=1, help="Stop after so many turns.")] = None,
    json: JSON = False,
) -> None:
    """Play one game between servers, built-in players and files.

    Example: racecraft snakes play --url search --url flood_fill --view --output game.jsonl
    """
    import secrets

    from racecraft.cli.output import print_json, say
    from racecraft.contract.random_streams import stream_keys
    from racecraft.envs.battlesnake.dice import StreamDice
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.evaluation.arena.match import play as play_game
    from racecraft.evaluation.arena.record import verdict, write_record
    from racecraft.evaluation.arena.view import write_gif

    seed = secrets.randbits(31) if seed is None else seed
    who = url or ["search", "area_control"]
    settings = GameSettings(
        width, height, len(who), gametype, map_name, food_spawn_chance, minimum_food, hazard_damage, shrink_every,
        solo=True if len(who) < 2 else None,
    )  # fmt: skip
    for path in (output, gif):
        _check_folder(path)
    seats = _take_seats(who, name or [], seed, quiet=json)
    watcher = _Watcher(view and not json, delay / 1000, max(duration, 100 if view else 0) / 1000)
    key = int(stream_keys(seed, "snake game", 1)[0])
    try:
        with watcher:
            played = play_game(
                settings, seats, StreamDice(key), f"racecraft-{seed}", timeout, sequential, most_turns, watcher.show
            )  # fmt: skip
    finally:
        for seat in seats:
            seat.leave()
    if output is not None:
        write_record(played, output)
    if gif is not None:
        write_gif(played, gif)
    won = verdict(played)
    if json:
        print_json(won | {"turns": played.turns, "seed": seed, "over": played.over, "seats": _seat_facts(seats)})
        return
    end = f"{won['winnerName']} wins" if won["winnerId"] else "a draw" if won["isDraw"] else "nobody wins"
    say(f"Turn {played.turns}: {end}. Seed {seed}.", quiet_stdout=False)
    for snake, seat in zip(played.boards[-1].snakes, seats, strict=True):
        failures = seat.failures
        fate = "alive" if snake.alive else f"{snake.cause} on turn {snake.on}"
        missed = f", {failures.timeouts} timeouts, {failures.crashes} crashes" * (failures.last_letter != "")
        print(f"  {seat.name:20} {fate}, length {len(snake.body)}{missed}")
        if failures.last_letter:
            print(f"  {'':20} {failures.last_letter}")


@app.command()
def tournament(
    who: Annotated[list[str] | None, typer.Argument(help="Players: names, addresses, FILE.py; default: all.")] = None,
    snakes: Annotated[int, typer.Option(help="Snakes at a board.")] = 2,
    rounds: Annotated[int, typer.Option(min=1, help="Dice each group meets with, at every rotation of seats.")] = 3,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 100,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    seed: Seed = 0,
    most_turns: Annotated[int, typer.Option("--most-turns", min=1, help="A longer game is a draw.")] = 1000,
    json: JSON = False,
) -> None:
    """Play everyone against everyone, seats swapped; rate them (Elo points, 95 % intervals).

    Example: racecraft snakes tournament flood_fill area_control my_snake.py --rounds 10
    """
    from racecraft.cli.output import print_json, say
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.evaluation.arena.tournament import tournament as hold
    from racecraft.players.snakes.protocol import PLAYERS

    settings = GameSettings(width, height, snakes, gametype, map_name)
    seats = _take_seats(who or list(PLAYERS), [], seed or 0, quiet=json)

    def told(played: object, number: int, games: int) -> None:
        if number % max(1, games // 10) == 0:
            say(f"{number} of {games} games", quiet_stdout=True)

    try:
        table = hold(seats, settings, rounds, timeout, seed or 0, most_turns, told)
    finally:
        for seat in seats:
            seat.leave()
    if json:
        print_json(table.to_dict())
        return
    print(f"{'player':20} {'rating':>6} {'95 %':>13} {'games':>6} {'won':>5} {'late':>5} {'failed':>6}")
    for line in table.standings:
        points = line.rating
        spread = f"{points.low:.0f} … {points.high:.0f}"
        print(
            f"{line.name:20.20} {points.points:>6.0f} {spread:>13} {line.games:>6} {line.wins / line.games:>5.0%} "
            f"{line.timeouts:>5} {line.crashes:>6}"
        )


@app.command()
def serve(
    player: Annotated[str, typer.Argument(help="A built-in player or a FILE.py.")] = "search",
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
    """
    import asyncio
    import contextlib
    import sys

    from racecraft.cli.output import print_json, say
    from racecraft.players.snakes.from_file import FilePlayer
    from racecraft.players.snakes.protocol import find_player, warm_up
    from racecraft.serving.snake_server import SnakeServer, serve_until_cancelled

    found = find_player(player)
    say(f"Getting {player} ready …", quiet_stdout=json)
    warm_up(found)
    said = found.looks() if isinstance(found, FilePlayer) else {}
    given = {key: value for key, value in {"color": color, "head": head, "tail": tail}.items() if value}
    complain = lambda sentence: print(f"racecraft: {sentence}", file=sys.stderr, flush=True)  # noqa: E731
    server = SnakeServer(found, said | given, author or said.get("author", ""), margin, complain=complain)

    def ready(port: int) -> None:
        if json:
            print_json({"url": f"http://{host}:{port}", "player": player})
        else:
            say(f"{player} answers at http://{host}:{port} (Ctrl-C ends)", quiet_stdout=False)

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(serve_until_cancelled(server, host, port, ready))
    count = server.count
    say(
        f"{count.games} games, {count.moves} moves, {count.late} late, {count.failed} failed, "
        f"{count.refused} refused, p99 {count.p99_ms():.0f} ms",
        quiet_stdout=json,
    )


@app.command()
def gif(
    game: Annotated[Path, typer.Argument(help="A game from `snakes play --output`.")],
    picture: Annotated[Path, typer.Argument(help="The GIF to write.")],
    fps: Annotated[float, typer.Option(min=0.1, max=50, help="Turns a second.")] = 8,
) -> None:
    """Draw a recorded game as a GIF.

    Example: racecraft snakes gif game.jsonl game.gif
    """
    from racecraft.evaluation.arena.record import read_record
    from racecraft.evaluation.arena.view import write_gif

    write_gif(read_record(game), picture, fps)
    print(picture)


@app.command()
def verify(
    record: Annotated[Path, typer.Argument(help="Recorded games: JSON Lines, gzipped where the name ends in .gz.")],
    json: JSON = False,
) -> None:
    """Replay recorded games by our rules and count what differs; exit code 1 where something does.

    Example: racecraft snakes verify games.jsonl.gz --json
    """
    from racecraft.cli.output import print_json, say
    from racecraft.envs.battlesnake.verify import verify_records

    report = verify_records(record)
    if json:
        print_json(report.to_dict())
    else:
        for example in report.examples:
            print(example + "\n")
        say(f"{report.games} games, {report.steps} steps, {report.mismatches} mismatches", quiet_stdout=False)
    if not report.agrees:
        raise typer.Exit(1)


class _Watcher:
    """Shows turns as they come, and keeps the pace."""

    def __init__(self, visible: bool, delay: float, at_least: float) -> None:
        self._visible, self._delay, self._at_least = visible, delay, at_least
        self._shown_at = 0.0

    def __enter__(self) -> _Watcher:
        if self._visible:
            from rich.live import Live

            self._live = Live(auto_refresh=False, transient=False)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._visible:
            self._live.stop()

    def show(self, board: Board, card: GameCard) -> None:
        """Show a position."""
        import time

        from racecraft.evaluation.arena.view import as_text

        if self._visible:
            self._live.update(as_text(board, card), refresh=True)
        rest = self._shown_at + self._at_least - time.monotonic()
        if board.turn > 0 and max(rest, self._delay) > 0:
            time.sleep(max(rest, self._delay))
        self._shown_at = time.monotonic()


def _take_seats(who: list[str], names: list[str], seed: int, quiet: bool) -> list[Seat]:
    from racecraft.cli.output import say
    from racecraft.evaluation.arena.seats import take_seat
    from racecraft.players.snakes.protocol import PlayerError

    if len(names) > len(who):
        raise PlayerError(f"{len(names)} names for {len(who)} players; expected one --url for every --name.")
    if any(one in ("area_control", "search") or one.startswith("search+") for one in who):
        say("Getting the players ready …", quiet_stdout=quiet)
    given = names + who[len(names) :]
    taken: list[Seat] = []
    for number, one in enumerate(who):
        twin = given[:number].count(given[number])
        taken.append(take_seat(one, f"{given[number]}#{twin + 1}" if twin else given[number], seed + number))
    return taken


def _seat_facts(seats: list[Seat]) -> list[dict[str, object]]:
    return [
        {"name": seat.name, "timeouts": seat.failures.timeouts, "crashes": seat.failures.crashes,
         "last_letter": seat.failures.last_letter}
        for seat in seats
    ]  # fmt: skip


def _check_folder(path: Path | None) -> None:
    from racecraft.formats.whole import OutputFileError

    if path is not None and not path.parent.is_dir():
        raise OutputFileError(f"{path}: its folder does not exist. Create {path.parent} first.")
