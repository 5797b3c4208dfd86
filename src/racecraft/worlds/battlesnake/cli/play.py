"""`racecraft snakes play`: one game, watched in the terminal or a browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.cli.from_request import TerminalProgress, command
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option
from racecraft.worlds.battlesnake.actions.play import PlayedGame, PlayRequest, play_before
from racecraft.worlds.battlesnake.actions.play import play as play_game
from racecraft.worlds.battlesnake.actions.tournament import fate

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.live import StepObserver
    from racecraft.worlds.battlesnake.evaluation.seats import Seat

TURNS_SHOWN = 8
SHOWN_MS = 100
"""What a turn lasts at least in the terminal, where nothing is said of it."""


@dataclass(frozen=True, kw_only=True)
class WatchedPlayRequest(PlayRequest):
    """A game, and where it is watched."""

    view: bool = option(False, "Watch in the terminal.", "--view", "--viewmap", "-v")
    color: bool | None = option(
        None, "Colours in the terminal, or letters; by default where it can.", "--color/--no-color", "-c"
    )
    browser: bool = option(False, "Watch in a browser: a page of ours on this machine.")
    board_url: str = option("", "With --browser: another board page, such as the official one.")


@action
def watched(request: WatchedPlayRequest, progress: Progress = quiet) -> PlayedGame:
    """Play one game before those who watch."""
    json = isinstance(progress, TerminalProgress) and progress.json
    in_terminal = request.view and not json
    observers = _observers(request, in_terminal, progress)
    return play_before(request, progress, observers, SHOWN_MS if in_terminal else 0)


def _observers(request: WatchedPlayRequest, in_terminal: bool, progress: Progress) -> list[StepObserver]:
    from racecraft.worlds.battlesnake.serving.spectators import BoardPage, Browser, Terminal

    observers: list[StepObserver] = []
    if request.browser or request.board_url:
        showing = BoardPage(
            request.board_url, announce=lambda address: progress(f"Watch it at {address}"), on_message=progress
        )
        observers.append(Browser(request.settings(), showing))
    if in_terminal:
        observers.append(Terminal(request.color))
    return observers


def _show(done: PlayedGame) -> None:
    verdict, played = done.verdict, done.played
    end = f"{verdict['winnerName']} wins" if verdict["winnerId"] else "a draw" if verdict["isDraw"] else "nobody wins"
    print(f"Turn {played.turns}: {end}. Seed {done.seed}.", flush=True)
    for snake, seat in zip(played.boards[-1].snakes, done.seats, strict=True):
        print(f"  {seat.name:20} {fate(snake, played.card)}, length {len(snake.body)}{_missed(seat)}")
        if seat.failures.last_error:
            print(f"  {'':20} {seat.failures.last_error}")


def _missed(seat: Seat) -> str:
    """Return how many moves were late or failed, and on which turns; empty where none was."""
    text = ""
    failures = seat.failures
    for what, count, turns in (
        ("late", failures.timeouts, failures.late_turns),
        ("failed", failures.crashes, failures.failed_turns),
    ):
        if count:
            shown = ", ".join(map(str, turns[:TURNS_SHOWN])) + ", …" * (count > TURNS_SHOWN)
            text += f", {count} {what} (turn{'s' * (count > 1)} {shown})"
    return text


play = command(watched, _show, messages_aside=True, help=str(play_game.__doc__))
