"""Play one game, with the options of the official `battlesnake play`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.battlesnake.actions.options import BoardOptions, check_folder, new_seed, take_seats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.live import StepObserver
    from racecraft.worlds.battlesnake.evaluation.match import Played
    from racecraft.worlds.battlesnake.evaluation.seats import Seat


@dataclass(frozen=True, kw_only=True)
class PlayRequest(Request):
    """Who plays what, and what is written."""

    who: tuple[str, ...] = argument("Players: names, addresses, FILE.py, RUN; by default search and area_control.", ())
    url: tuple[str, ...] = option((), "A server's address, a built-in player, or a FILE.py.", "--url", "-u")
    name: tuple[str, ...] = option((), "Its name, in the same order.", "--name", "-n")
    board: BoardOptions = group(BoardOptions)
    timeout: int = option(500, "Milliseconds for an answer.", "--timeout", "-t", low=1)
    sequential: bool = option(False, "Ask one after another.", "--sequential", "-s")
    seed: int | None = option(None, "Chance of the game; without it, another every time.", "--seed", "-r")
    delay: int = option(0, "Milliseconds to wait after each turn.", "--delay", "-d", low=0)
    duration: int = option(0, "Milliseconds a turn lasts at least.", "--duration", "-D", low=0)
    output: Path | None = option(None, "Write the game here, as JSON Lines.", "--output", "-o")
    film: Path | None = option(None, "Film the game here: .mp4 or .gif.", "--film", "--gif")
    food_spawn_chance: int = option(15, "Percent, each turn.", "--foodSpawnChance")
    minimum_food: int = option(1, "Food below this is filled up at once.", "--minimumFood")
    hazard_damage: int = option(14, "Health a hazard takes.", "--hazardDamagePerTurn")
    shrink_every: int = option(25, "Turns between two changes of the hazards.", "--shrinkEveryNTurns")
    most_turns: int | None = option(None, "Stop after so many turns.", low=1)
    file_memory: int = option(2048, "MB of memory a FILE.py may use; 0: no limit. (Linux)", low=0)
    verbose: bool = option(False, "Say every turn, on standard error.")

    @property
    def players(self) -> tuple[str, ...]:
        """Who plays, in the order of their seats."""
        return (*self.who, *self.url) or ("search", "area_control")

    def settings(self) -> GameSettings:
        """Return the game.

        Raises:
            SettingError: There is none like it.
        """
        from racecraft.worlds.battlesnake.env.settings import GameSettings

        board, snakes = self.board, len(self.players)
        return GameSettings(
            board.width, board.height, snakes, board.gametype, board.map_name, self.food_spawn_chance,
            self.minimum_food, self.hazard_damage, self.shrink_every, solo=True if snakes < 2 else None,
        )  # fmt: skip


@dataclass(frozen=True)
class PlayedGame:
    """A game, and what was late or failed at each seat."""

    played: Played
    seats: list[Seat]
    seed: int

    @property
    def verdict(self) -> dict[str, Any]:
        """Who won."""
        from racecraft.worlds.battlesnake.evaluation.record import verdict

        return verdict(self.played)

    def as_dictionary(self) -> dict[str, Any]:
        """Return verdict, turns and seats by name."""
        about = {"turns": self.played.turns, "seed": self.seed, "over": self.played.over}
        return {**self.verdict, **about, "seats": _seat_facts(self.seats)}


@action
def play(request: PlayRequest, progress: Progress = quiet) -> PlayedGame:
    """Play one game between servers, built-in players, files and trained snakes.

    Example: racecraft snakes play search flood_fill --browser --output game.jsonl

    Example: racecraft snakes play --url http://localhost:8000 --name mine --url runs/snakes-1
    """
    return play_before(request, progress)


def play_before(
    request: PlayRequest, progress: Progress, observers: Sequence[StepObserver] = (), min_turn_ms: int = 0
) -> PlayedGame:
    """Play one game before observers.

    Args:
        request: Who plays what.
        progress: Receives messages.
        observers: See every position.
        min_turn_ms: What a turn lasts at least, beside what is asked.
    """
    from racecraft.worlds.battlesnake.evaluation.live import TurnLog, play_live

    settings = request.settings()
    _check_files(request.output, request.film)
    seed = new_seed() if request.seed is None else request.seed
    seats = take_seats(request.players, request.name, seed, progress, request.file_memory)
    watching = [*([TurnLog(progress)] if request.verbose else []), *observers]
    delay, least = request.delay / 1000, max(request.duration, min_turn_ms) / 1000
    played = play_live(
        settings, seats, seed, request.timeout, request.sequential, request.most_turns, watching, delay, least
    )
    _write(played, request.output, request.film)
    return PlayedGame(played, seats, seed)


def _check_files(output: Path | None, film: Path | None) -> None:
    from racecraft.worlds.battlesnake.analysis.board_film import check_film

    for path in (output, film):
        check_folder(path)
    if film is not None:
        check_film(film)


def _write(played: Played, output: Path | None, film: Path | None) -> None:
    from racecraft.worlds.battlesnake.analysis.board_film import film_game
    from racecraft.worlds.battlesnake.evaluation.record import write_record

    if output is not None:
        write_record(played, output)
    if film is not None:
        film_game(played.boards, played.card, film)


def _seat_facts(seats: list[Seat]) -> list[dict[str, object]]:
    return [
        {"name": seat.name, "timeouts": seat.failures.timeouts, "crashes": seat.failures.crashes,
         "late_turns": seat.failures.late_turns, "failed_turns": seat.failures.failed_turns,
         "last_error": seat.failures.last_error}
        for seat in seats
    ]  # fmt: skip
