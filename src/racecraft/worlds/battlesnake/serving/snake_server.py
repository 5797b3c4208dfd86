"""A snake behind the official webhook API: `GET /`, `POST /start`, `/move`, `/end` (facts: A.10).

Every `/move` is answered within the game's timeout less a margin: the player thinks in a thread; what it has not said
when time runs out is not waited for, and a move that is at least safe, worked out in a blink, goes out instead. Many
games run at once and share the threads; a player of many boards is asked for all that wait together
(`batching_queue.py`), one that has its answer in a blink at once, without a thread. Where the machine is so busy that
requests wait before they are read, that wait is taken off the time (`loop_lag.py`); where answers would be late, a game
more is refused (503; `admission.py`), so that those under way are answered in time. What is kept of a game is dropped
at its end, or after a silence.
"""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Any, NamedTuple

from racecraft.players.thread_pool import ThreadPool
from racecraft.serving.batching_queue import BatchingQueue
from racecraft.serving.loop_lag import LoopLag
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, JsonApi, Reply
from racecraft.worlds.battlesnake.env.board import MOVES, BoardError, Point
from racecraft.worlds.battlesnake.players.living_snakes import LivingSnakes, move_anyway
from racecraft.worlds.battlesnake.players.messages import LOOKS, GameRequest, read_message
from racecraft.worlds.battlesnake.players.protocol import (
    BatchPlayer,
    InlinePlayer,
    JsonPlayer,
    Message,
    MoveRequest,
    PlayerError,
    SnakePlayer,
)
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move, find_snake, square_after
from racecraft.worlds.battlesnake.players.time_budget import NETWORK_MARGIN_MS, THINKING_SHARE, seconds_to_answer
from racecraft.worlds.battlesnake.serving.admission import MAX_LAG_SHARE, Admission

SILENCE_SECONDS = 600.0
ABANDONED_SECONDS = 30.0
"""A game silent for so long gives its place up to a new one where there is no other."""
LIVELY_SECONDS = 2.0
"""Games heard of within so long are thought to ask again at any moment."""
CROWDED_SHARE = 0.75
"""Share of its fair time that a move gets where there are more games than threads: the way in and out takes its own."""
OVERRUN_RATE = 0.1
"""How quickly it learns by how much players overrun their time, as they do where other programs want the cores."""
MAX_GAMES = 10_000
LATENCIES_KEPT = 100_000


@dataclass
class Count:
    """What a server has done so far."""

    games: int = 0
    moves: int = 0
    late: int = 0
    """Moves for which the player had not answered in time; a safe move went out instead."""
    failed: int = 0
    """Moves for which the player failed; a safe move went out instead."""
    missed: int = 0
    """Moves that the engine seems not to have had in time, by the latency that it tells or by where the snake went."""
    refused: int = 0
    """Requests answered with an error."""
    latencies_ms: deque[float] = field(default_factory=lambda: deque(maxlen=LATENCIES_KEPT))
    """Time from a move's request to its answer, the latest ones."""

    def within_ms(self, share: float) -> float:
        """Return the time within which a share (0 to 1) of the latest moves was answered; 0 before the first."""
        ordered = sorted(self.latencies_ms)
        return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0

    def p99_ms(self) -> float:
        """Return the time within which 99 of 100 moves were answered; 0 before the first."""
        return self.within_ms(0.99)


@dataclass
class OpenGame:
    """What is kept of a game, for one of its snakes, between its requests."""

    last_seen: float = 0.0
    """When it was heard of last, by the server's clock."""
    living: LivingSnakes = field(default_factory=LivingSnakes)
    answer: WebhookResponse | None = None
    """The last move sent."""


class WebhookResponse(NamedTuple):
    """A move that was sent."""

    turn: int
    head: Point
    """Where it leads."""
    seconds: float
    """From the request to the answer, by our clock."""


class SnakeServer:
    """Answers for one player, in any number of games.

    Args:
        player: Who decides.
        looks: Colour, head and tail; what is missing has the official default.
        author: Told on `GET /`.
        margin_ms: Time of the timeout that is left unused.
        silence_seconds: A game not heard of for so long is forgotten.
        most_games: Games at once; a new one beyond them is refused (503), so that those under way are answered in time.
        threads: How many moves are thought about at the same time; None: one a core.
        complain: Called with a sentence when the player failed.
        clock: Seconds that only grow; decides how long a game has been silent.
    """

    def __init__(
        self,
        player: SnakePlayer | JsonPlayer,
        looks: dict[str, str] | None = None,
        author: str = "",
        margin_ms: int = NETWORK_MARGIN_MS,
        silence_seconds: float = SILENCE_SECONDS,
        most_games: int = MAX_GAMES,
        threads: int | None = None,
        complain: Callable[[str], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.count, self._clock = Count(), clock
        self._player, self._author = player, author
        self._looks = {key: (looks or {}).get(key) or default for key, default in LOOKS.items()}
        self._margin_ms, self._silence_seconds = margin_ms, silence_seconds
        self._most_games = most_games
        self._complain = complain or (lambda sentence: None)
        self._pool = ThreadPool(threads or os.cpu_count() or 1)
        self._queue = BatchingQueue(player.choose_many) if isinstance(player, BatchPlayer) else None
        self._lag = LoopLag()
        self._admission = Admission(self._lag)
        self._thinking = 0
        self._overrun = 0.0
        self._open_games: OrderedDict[tuple[str, str], OpenGame] = OrderedDict()
        self.application = JsonApi(self._answer, begin=self._lag.watch, end=self._lag.close)
        """To be served. Tournaments ask from anywhere, by any name of this machine, and show no token."""

    @property
    def games_open(self) -> int:
        """Games (a snake's own, each) that began and have neither ended nor fallen silent."""
        self._forget_silent()
        return len(self._open_games)

    def close(self) -> None:
        """Let go of the threads, when the application is served no more; players that still think are left behind."""
        self._pool.close()
        if self._queue is not None:
            self._queue.close()

    async def _answer(self, request: ApiRequest) -> Message | Reply:
        try:
            return await self._route(request)
        except WebError as error:
            self.count.refused += 1
            if request.path.rstrip("/") != "/move":
                raise
            return _refusal_with_move(error, request)

    async def _route(self, request: ApiRequest) -> Message:
        ways = {"/": "GET", "/start": "POST", "/move": "POST", "/end": "POST"}
        path = request.path.rstrip("/") or "/"
        if path not in ways:
            raise WebError(404, "no_such_page", f"there is no {path[:80]}; there are {', '.join(ways)}.")
        if request.method != ways[path]:
            raise WebError(405, "wrong_method", f"{path} wants {ways[path]}.")
        if path == "/":
            return {"apiversion": "1", "author": self._author, **self._looks, "version": "racecraft"}
        message, game = self._only_living(request.json(), path)
        try:
            letter = read_message(message)
        except BoardError as error:
            raise WebError(422, "bad_board", str(error)) from error
        if path == "/move":
            return {"move": await self._move(letter, message, request.arrived, game)}
        self._note(letter, game, request.arrived, ended=path == "/end")
        await self._notify_player(path[1:], letter, message)
        return {}

    def _only_living(self, message: Any, path: str) -> tuple[Any, OpenGame]:
        """Return the message without the dead, and what is kept of its game; `/start` begins a known game anew."""
        try:
            game = self._open_games.get((message["game"]["id"], message["you"]["id"])) or OpenGame()
        except (TypeError, KeyError):
            game = OpenGame()
        if path == "/start":
            game.living.restart()
            game.answer = None
        return game.living.only(message, asks=path == "/move"), game

    async def _move(self, request: GameRequest, message: Message, arrived: float, game: OpenGame) -> str:
        try:
            head = find_snake(request.board, request.you).head
        except PlayerError as error:
            raise WebError(422, "bad_board", f"you: {error}") from error
        self._note(request, game, arrived)
        self.count.missed += _seems_missed(request, message, game.answer)
        seconds = self._seconds(request)
        unread = min(self._lag.seconds, MAX_LAG_SHARE * seconds)
        word = await self._think(request, message, arrived + seconds - unread)
        if word is None:
            word = best_safe_move(request.board, request.settings, request.you)
        taken = time.monotonic() - arrived
        self._admission.note_move(taken, seconds)
        self.count.moves += 1
        self.count.latencies_ms.append(taken * 1000)
        game.answer = WebhookResponse(
            request.board.turn, square_after(head, word, request.board, request.settings), taken
        )
        return word

    async def _think(self, request: GameRequest, message: Message, deadline: float) -> str | None:
        """Return the player's move, or None where it failed or was not in time."""
        self._thinking += 1
        try:
            if self._queue is not None:
                question = MoveRequest(request.board, request.you, request.settings)
                word = await self._queue.ask(question, deadline)
            elif isinstance(self._player, InlinePlayer):
                if time.monotonic() >= deadline:
                    raise TimeoutError
                word = self._ask(request, message, deadline)
            else:
                word = await self._wait(lambda: self._ask(request, message, deadline), deadline - time.monotonic())
            if word not in MOVES:
                raise PlayerError(
                    "the player answered {word!r:.60}; expected one of {moves}.", word=word, moves=", ".join(MOVES)
                )
        except TimeoutError:
            self.count.late += 1
            return None
        except Exception as error:  # a player's own failure is no reason to lose the game
            self._note_failure(error)
            return None
        finally:
            self._thinking -= 1
        return word

    async def _wait(self, act: Callable[[], str], seconds: float) -> str:
        """Return what `act` gives in a thread, or leave it behind and raise TimeoutError."""
        task = self._pool.submit(act)
        try:
            return str(await asyncio.wait_for(asyncio.wrap_future(task), max(0.0, seconds)))
        except TimeoutError:
            self._pool.leave_behind(task)
            raise

    def _note_failure(self, error: Exception) -> None:
        self.count.failed += 1
        self._complain(str(error) or type(error).__name__)

    def _ask(self, request: GameRequest, message: Message, deadline: float) -> str:
        """Ask the player, in a thread: one that looks at boards thinks for its fair share of the time that is left."""
        left = max(0.0, deadline - time.monotonic())
        if not isinstance(self._player, SnakePlayer):
            return self._player.move(message, left)
        asking = max(self._thinking, self._lively())
        share = 1.0 if asking <= self._pool.size else CROWDED_SHARE * self._pool.size / asking
        seconds = max(0.0, THINKING_SHARE * left * share - (self._overrun if share < 1.0 else 0.0))
        started = time.monotonic()
        word = self._player.choose(request.board, request.settings, request.you, seconds)
        over = time.monotonic() - started - seconds
        self._overrun += OVERRUN_RATE * (max(0.0, over) - self._overrun)
        return word

    def _lively(self) -> int:
        """Return how many games may ask at any moment, so that the first of them leaves time for the others."""
        since = self._clock() - LIVELY_SECONDS
        return sum(1 for _ in takewhile(lambda game: game.last_seen > since, reversed(list(self._open_games.values()))))

    async def _notify_player(self, what: str, request: GameRequest, message: Message) -> None:
        """Pass a start or an end on to a player that wants to know."""
        if isinstance(self._player, SnakePlayer):
            return
        act, seconds = getattr(self._player, what), self._seconds(request)
        try:
            await self._wait(lambda: act(message, seconds), seconds)
        except TimeoutError:
            pass  # it has no answer to give
        except Exception as error:
            self._note_failure(error)

    def _seconds(self, request: GameRequest) -> float:
        return seconds_to_answer(request.timeout_ms, self._margin_ms)

    def _note(self, request: GameRequest, game: OpenGame, arrived: float, ended: bool = False) -> None:
        """Remember when a game was heard of last; forget the ended and the silent, refuse a new one beyond the cap.

        A health probe of an arena is no game: it is answered always, and neither counted nor kept.
        """
        self._forget_silent()
        key = (request.game_id, request.you)
        known = self._open_games.pop(key, None) is not None
        if ended or (not known and _is_probe(request)):
            return
        if not known:
            self._refuse_where_late(request, arrived)
        if not known and len(self._open_games) >= self._most_games:
            self._evict_abandoned()
        self.count.games += not known
        game.last_seen = self._clock()
        self._open_games[key] = game

    def _refuse_where_late(self, request: GameRequest, arrived: float) -> None:
        """Refuse a game more (503) where it or those under way would be answered late."""
        waited = time.monotonic() - arrived
        if self._open_games and self._admission.is_too_busy(waited, self._seconds(request)):
            self._complain("a game was refused: the machine is so busy that answers to one more would be late.")
            raise WebError(
                503, "too_busy", "this machine is too busy to answer one game more in time; try again later."
            )

    def _evict_abandoned(self) -> None:
        """Give the place of a game that seems abandoned to a new one; without one, refuse (503)."""
        if self._clock() - next(iter(self._open_games.values())).last_seen < ABANDONED_SECONDS:
            self._complain(f"a game beyond {self._most_games} at once was refused; see --games.")
            raise WebError(503, "too_many_games", f"{self._most_games} games are under way; try again later.")
        self._open_games.popitem(last=False)

    def _forget_silent(self) -> None:
        now = self._clock()
        while self._open_games and now - next(iter(self._open_games.values())).last_seen >= self._silence_seconds:
            self._open_games.popitem(last=False)


def _is_probe(request: GameRequest) -> bool:
    """Tell whether this is no game: one snake alone on the first turn of a game among several."""
    alone = len(request.board.snakes) == 1 and request.board.turn == 0
    return alone and request.settings.ruleset != "solo" and request.settings.map != "solo_maze"


def _seems_missed(request: GameRequest, message: Message, answer: WebhookResponse | None) -> bool:
    """Tell whether the answer to the turn before seems not to have arrived in time.

    The snake went elsewhere; or the engine tells a latency of its timeout or more, or of 0 ms for an answer that took
    longer than that here: engines differ in how they tell a miss.
    """
    if answer is None or request.board.turn != answer.turn + 1:
        return False
    latency = str(message["you"].get("latency", ""))
    milliseconds = int(latency) if latency.isascii() and latency.isdigit() else -1
    is_missed = milliseconds >= request.timeout_ms or (milliseconds == 0 and answer.seconds >= 0.001)
    return is_missed or find_snake(request.board, request.you).head != answer.head


def _refusal_with_move(error: WebError, request: ApiRequest) -> Reply:
    """Return a refusal that holds a safe move: engines that do not look at the status play it."""
    try:
        move = move_anyway(request.json())
    except WebError:
        move = "up"
    body = {"error": error.name, "message": error.sentence, "move": move}
    return Reply(json.dumps(body, separators=(",", ":")).encode(), status=error.status)
