"""`racecraft snakes play`: one game, with the flags of the official `battlesnake play`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.snakes_options import (
    JSON,
    Damage,
    FoodChance,
    GameType,
    Height,
    MapName,
    MinimumFood,
    Seed,
    Shrink,
    Timeout,
    Width,
    check_folder,
    take_seats,
)

if TYPE_CHECKING:
    from racecraft.envs.battlesnake.board import Board
    from racecraft.evaluation.arena.seats import Seat
    from racecraft.players.snakes.messages import GameCard


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
        check_folder(path)
    seats = take_seats(who, name or [], seed, quiet=json)
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


def _seat_facts(seats: list[Seat]) -> list[dict[str, object]]:
    return [
        {"name": seat.name, "timeouts": seat.failures.timeouts, "crashes": seat.failures.crashes,
         "last_letter": seat.failures.last_letter}
        for seat in seats
    ]  # fmt: skip
