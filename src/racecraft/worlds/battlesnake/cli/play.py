"""`racecraft snakes play`: one game, with the flags of the official `battlesnake play`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import (
    JSON,
    Damage,
    FileMemory,
    FoodChance,
    GameType,
    Height,
    MapName,
    MinimumFood,
    Names,
    Seed,
    Shrink,
    Timeout,
    Urls,
    Width,
    check_folder,
    page_told,
    take_seats,
)

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.board import Snake
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.live import StepObserver
    from racecraft.worlds.battlesnake.evaluation.match import Played
    from racecraft.worlds.battlesnake.evaluation.seats import Seat
    from racecraft.worlds.battlesnake.players.messages import GameCard

Who = Annotated[
    list[str] | None,
    typer.Argument(help="Players: names, addresses, FILE.py, RUN; by default search and area_control."),
]
Sequential = Annotated[bool, typer.Option("--sequential", "-s", help="Ask one after another.")]
View = Annotated[bool, typer.Option("--view", "--viewmap", "-v", help="Watch in the terminal.")]
Colour = Annotated[
    bool | None,
    typer.Option("--color/--no-color", "-c", help="Colours in the terminal, or letters; by default where it can."),
]
InBrowser = Annotated[bool, typer.Option("--browser", help="Watch in a browser: a page of ours on this machine.")]
BoardUrl = Annotated[
    str, typer.Option("--board-url", help="With --browser: another board page, such as the official one.")
]
Delay = Annotated[int, typer.Option("--delay", "-d", min=0, help="Milliseconds to wait after each turn.")]
Duration = Annotated[int, typer.Option("--duration", "-D", min=0, help="Milliseconds a turn lasts at least.")]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Write the game here, as JSON Lines.")]
Film = Annotated[Path | None, typer.Option("--film", "--gif", help="Film the game here: .mp4 or .gif.")]
MostTurns = Annotated[int | None, typer.Option("--most-turns", min=1, help="Stop after so many turns.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="Say every turn, on standard error.")]

TURNS_SHOWN = 8
SHOWN_MS = 100
"""What a turn lasts at least in the terminal, where nothing is said of it."""


def play(
    who: Who = None,
    url: Urls = None,
    name: Names = None,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 500,
    sequential: Sequential = False,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    view: View = False,
    color: Colour = None,
    seed: Seed = None,
    delay: Delay = 0,
    duration: Duration = 0,
    output: Output = None,
    browser: InBrowser = False,
    board_url: BoardUrl = "",
    film: Film = None,
    food_spawn_chance: FoodChance = 15,
    minimum_food: MinimumFood = 1,
    hazard_damage: Damage = 14,
    shrink_every: Shrink = 25,
    most_turns: MostTurns = None,
    file_memory: FileMemory = 2048,
    verbose: Verbose = False,
    json: JSON = False,
) -> None:
    """Play one game between servers, built-in players, files and trained snakes.

    Example: racecraft snakes play search flood_fill --browser --output game.jsonl

    Example: racecraft snakes play --url http://localhost:8000 --name mine --url runs/snakes-1
    """
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.live import play_live

    who = [*(who or []), *(url or [])] or ["search", "area_control"]
    settings = GameSettings(
        width, height, len(who), gametype, map_name, food_spawn_chance, minimum_food, hazard_damage, shrink_every,
        solo=True if len(who) < 2 else None,
    )  # fmt: skip
    _check_files(output, film)
    seed = new_seed() if seed is None else seed
    seats = take_seats(who, name or [], seed, json, file_memory)
    view = view and not json
    observers = _observers(settings, view, color, browser, board_url, verbose, json)
    least = max(duration, SHOWN_MS if view else 0)
    played = play_live(settings, seats, seed, timeout, sequential, most_turns, observers, delay / 1000, least / 1000)
    _write(played, output, film)
    _tell(played, seats, seed, json)


def new_seed() -> int:
    """Return a seed that nobody chose."""
    import secrets

    return secrets.randbits(31)


def _check_files(output: Path | None, film: Path | None) -> None:
    from racecraft.worlds.battlesnake.analysis.board_film import check_film

    for path in (output, film):
        check_folder(path)
    if film is not None:
        check_film(film)


def _observers(
    settings: GameSettings,
    view: bool,
    color: bool | None,
    browser: bool,
    board_url: str,
    verbose: bool,
    quiet: bool,
) -> list[StepObserver]:
    from racecraft.worlds.battlesnake.cli.options import aside
    from racecraft.worlds.battlesnake.evaluation.live import TurnLog

    observers: list[StepObserver] = [TurnLog(aside)] if verbose else []
    if browser or board_url:
        from racecraft.worlds.battlesnake.serving.game_audience import Browser, Showing

        observers.append(Browser(settings, Showing(board_url, announce=page_told(quiet), say=aside)))
    if view:
        from racecraft.worlds.battlesnake.serving.game_audience import Terminal

        observers.append(Terminal(color))
    return observers


def _write(played: Played, output: Path | None, film: Path | None) -> None:
    from racecraft.worlds.battlesnake.analysis.board_film import film_game
    from racecraft.worlds.battlesnake.evaluation.record import write_record

    if output is not None:
        write_record(played, output)
    if film is not None:
        film_game(played.boards, played.card, film)


def _tell(played: Played, seats: list[Seat], seed: int, json: bool) -> None:
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.battlesnake.evaluation.record import verdict

    won = verdict(played)
    if json:
        print_json(won | {"turns": played.turns, "seed": seed, "over": played.over, "seats": _seat_facts(seats)})
        return
    end = f"{won['winnerName']} wins" if won["winnerId"] else "a draw" if won["isDraw"] else "nobody wins"
    say(f"Turn {played.turns}: {end}. Seed {seed}.", quiet_stdout=False)
    for snake, seat in zip(played.boards[-1].snakes, seats, strict=True):
        print(f"  {seat.name:20} {fate(snake, played.card)}, length {len(snake.body)}{_missed(seat)}")
        if seat.failures.last_letter:
            print(f"  {'':20} {seat.failures.last_letter}")


def fate(snake: Snake, card: GameCard) -> str:
    """Return how a snake ended: what killed it, whose it was, and on which turn."""
    if snake.alive:
        return "alive"
    by = f" by {card.names.get(snake.by, snake.by)}" if snake.by not in ("", snake.id) else ""
    return f"{snake.cause}{by} on turn {snake.on}"


def _missed(seat: Seat) -> str:
    """Return how many moves were late or failed, and on which turns; empty where none was."""
    told = ""
    failures = seat.failures
    for what, count, turns in (
        ("late", failures.timeouts, failures.late_turns),
        ("failed", failures.crashes, failures.failed_turns),
    ):
        if count:
            shown = ", ".join(map(str, turns[:TURNS_SHOWN])) + ", …" * (count > TURNS_SHOWN)
            told += f", {count} {what} (turn{'s' * (count > 1)} {shown})"
    return told


def _seat_facts(seats: list[Seat]) -> list[dict[str, object]]:
    return [
        {"name": seat.name, "timeouts": seat.failures.timeouts, "crashes": seat.failures.crashes,
         "late_turns": seat.failures.late_turns, "failed_turns": seat.failures.failed_turns,
         "last_letter": seat.failures.last_letter}
        for seat in seats
    ]  # fmt: skip
