"""Who sits at the board: a player, its name and looks, its last move, and how often it failed.

The official rule for a missing move (facts: A.10): the last one again, "up" before there was any.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError
from dataclasses import dataclass, field
from typing import Any

from racecraft.players.thread_pool import ThreadPool
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.players.find import find_player, warm_up
from racecraft.worlds.battlesnake.players.from_file import MEMORY_MB, FilePlayer
from racecraft.worlds.battlesnake.players.messages import LOOKS
from racecraft.worlds.battlesnake.players.protocol import JsonPlayer, Message, PlayerError, SnakePlayer
from racecraft.worlds.battlesnake.players.time_budget import THINKING_SHARE, seconds_to_answer

SETUP_SECONDS = 5.0
MOMENTS_KEPT = 1000


@dataclass
class Failures:
    """How often a seat gave no move, and when."""

    timeouts: int = 0
    crashes: int = 0
    last_error: str = ""
    """What was wrong last."""
    late_turns: list[int] = field(default_factory=list)
    """Turns of the timeouts, the first thousand."""
    failed_turns: list[int] = field(default_factory=list)
    """Turns of the crashes, the first thousand."""

    def note_late(self, turn: int, message: str) -> None:
        """Count a move that came late."""
        self.timeouts += 1
        self.last_error = f"turn {turn}: {message}"
        self.late_turns += [turn] * (len(self.late_turns) < MOMENTS_KEPT)

    def note_crash(self, turn: int, message: str) -> None:
        """Count a move that failed otherwise."""
        self.crashes += 1
        self.last_error = f"turn {turn}: {message}"
        self.failed_turns += [turn] * (len(self.failed_turns) < MOMENTS_KEPT)


@dataclass
class Seat:
    """One player at the board."""

    name: str
    player: SnakePlayer | JsonPlayer
    appearance: dict[str, str] = field(default_factory=lambda: dict(LOOKS))
    failures: Failures = field(default_factory=Failures)
    last_move: str = "up"
    latency_ms: int = 0
    """How long the last answer took."""
    _pool: ThreadPool = field(default_factory=ThreadPool)
    _under_way: Future[Any] | None = None
    _asked_at: float = 0.0

    def reset_seat(self) -> None:
        """Forget the game before."""
        self.last_move, self.latency_ms = "up", 0

    def prefetch(self, message: Message, seconds: float) -> None:
        """Send a JSON player its question; `answer` waits for it. Players that look at boards are asked there."""
        player = self.player
        if isinstance(player, SnakePlayer) or (self._under_way is not None and not self._under_way.done()):
            return
        self._asked_at = time.monotonic()
        limit = self._limit(seconds)
        self._under_way = self._pool.submit(lambda: self._timed(lambda: player.move(message, limit)))

    def answer(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return this turn's move, made good by the official rule where the player gave none.

        Who sits beside the board has no way to go, but keeps the time for it all the same (`time_budget.py`): a player
        is as strong here as behind a server of ours.
        """
        try:
            if isinstance(self.player, SnakePlayer):
                player, to_think = self.player, self._limit(seconds) * THINKING_SHARE
                word = self._timed(lambda: player.choose(board, settings, snake_id, to_think))
                if self.latency_ms > seconds * 1000:
                    raise TimeoutError
            else:
                word = self._wait(seconds)
            if word not in MOVES:
                raise PlayerError(
                    "{name}: move {word!r:.60}; expected one of {moves}.",
                    name=self.name,
                    word=word,
                    moves=", ".join(MOVES),
                )
            self.last_move = word
        except TimeoutError:
            self.failures.note_late(board.turn, f"{self.name}: no answer within {self._limit(seconds):g} s.")
            self.latency_ms = round(seconds * 1000)
        except Exception as error:  # a user's player may raise anything; the game goes on
            self.failures.note_crash(board.turn, str(error))
        return self.last_move

    def notify(self, what: str, message: Message, seconds: float) -> None:
        """Tell a JSON player of a start or an end; that it fails there is only noted."""
        if isinstance(self.player, SnakePlayer) or (self._under_way is not None and not self._under_way.done()):
            return
        act: Callable[[Message, float], None] = getattr(self.player, what)
        self._under_way = self._pool.submit(lambda: act(message, seconds))
        try:
            self._under_way.result(seconds)
        except TimeoutError:
            self._hang_up()
        except Exception as error:
            self.failures.last_error = str(error)

    def leave(self) -> None:
        """Let go of connection, process and thread."""
        self._hang_up()
        self._pool.close()
        if not isinstance(self.player, SnakePlayer):
            self.player.close()

    def _wait(self, seconds: float) -> str:
        assert self._under_way is not None, "prefetch comes first"
        try:
            word = self._under_way.result(max(0.0, self._asked_at + seconds - time.monotonic()))
        except TimeoutError:
            self._hang_up()
            raise
        if self.latency_ms > seconds * 1000:
            raise TimeoutError
        return str(word)

    def _limit(self, seconds: float) -> float:
        """Return the seconds the player has: a server the whole timeout, for it pays the way; others less that way."""
        return seconds if isinstance(self.player, Remote) else seconds_to_answer(seconds * 1000)

    def _timed(self, act: Callable[[], str]) -> str:
        begin = time.monotonic()
        try:
            return act()
        finally:
            self.latency_ms = round((time.monotonic() - begin) * 1000)

    def _hang_up(self) -> None:
        if isinstance(self.player, Remote):
            self.player.disconnect()


def take_seat(what: str, name: str = "", seed: int = 0, memory_mb: int = MEMORY_MB, is_isolated: bool = False) -> Seat:
    """Return a seat for an address, a built-in player or a FILE.py; servers are asked how they look.

    Args:
        what: What the user wrote.
        name: How the seat is called; what the user wrote, where empty.
        seed: Chance of a player that rolls dice.
        memory_mb: Memory that a FILE.py may use.
        is_isolated: A FILE.py can compute and nothing else.

    Raises:
        PlayerError: There is no such player, or the server does not answer `GET /`.
    """
    if "://" in what:
        remote = Remote(what)
        looks = remote.appearance(SETUP_SECONDS)
        return Seat(name or what, remote, _looks(looks))
    player = find_player(what, seed, memory_mb, is_isolated)
    warm_up(player)
    looks = player.appearance() if isinstance(player, FilePlayer) else {}
    return Seat(name or what, player, _looks(looks))


def _looks(card: dict[str, str]) -> dict[str, str]:
    return {key: card.get(key) or default for key, default in LOOKS.items()}
