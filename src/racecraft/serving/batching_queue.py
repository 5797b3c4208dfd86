"""Many questions, one answer sheet: the boards that wait at a moment are thought about together.

While a thread works on one batch, the next one gathers; so a lone question goes at once, and two hundred share a few
forward passes. Nothing is waited for on purpose.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future

from racecraft.players.battlesnake.protocol import ManyPlayer, PlayerError, Question
from racecraft.players.battlesnake.worker_pool import WorkerPool

MOST_AT_ONCE = 256
"""Boards in one batch."""
HANGING_SECONDS = 2.0
"""A batch that takes longer is given up, and the next begins without it."""


class BatchingQueue:
    """Asks a player of many boards for everyone who waits. Lives in one event loop.

    Args:
        player: Who decides; asked by one thread at a time, unless a call hangs.
        most: Boards in one batch.
    """

    def __init__(self, player: ManyPlayer, most: int = MOST_AT_ONCE) -> None:
        self._player, self._most = player, most
        self._pool = WorkerPool(1)
        self._waiting: list[tuple[Question, asyncio.Future[str]]] = []
        self._under_way: Future[list[str]] | None = None
        self.batches = 0

    async def choose(self, question: Question, deadline: float) -> str:
        """Return the player's move.

        Args:
            question: A board, who is asked, and the settings.
            deadline: `time.monotonic()` at which nobody waits any more.

        Raises:
            TimeoutError: There was no answer in time.
            PlayerError: The player has no moves, or not as many as it was asked for. Whatever else it raises comes too.
        """
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[str] = loop.create_future()
        self._waiting.append((question, answer))
        if len(self._waiting) == 1:
            loop.call_soon(self._begin)  # whatever else arrived with it comes along
        return await asyncio.wait_for(answer, max(0.0, deadline - time.monotonic()))

    def close(self) -> None:
        """Let the thread go home."""
        self._pool.close()

    def _begin(self) -> None:
        if self._under_way is not None:
            return
        waiting = [one for one in self._waiting if not one[1].done()]
        batch, self._waiting = waiting[: self._most], waiting[self._most :]
        if not batch:
            return
        loop = asyncio.get_running_loop()
        questions = [question for question, _ in batch]
        task: Future[list[str]] = self._pool.submit(lambda: self._player.choose_many(questions))
        self._under_way = task
        self.batches += 1
        given_up = loop.call_later(HANGING_SECONDS, self._give_up, task)

        def done(task: Future[list[str]]) -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(self._hand_out, task, batch, given_up)

        task.add_done_callback(done)

    def _give_up(self, task: Future[list[str]]) -> None:
        self._pool.leave_behind(task)
        self._under_way = None
        self._begin()

    def _hand_out(
        self, task: Future[list[str]], batch: Sequence[tuple[Question, asyncio.Future[str]]], given_up: asyncio.Handle
    ) -> None:
        given_up.cancel()
        if self._under_way is task:
            self._under_way = None
        try:
            moves = task.result()
            if len(moves) != len(batch):
                raise PlayerError(f"the player gave {len(moves)} moves for {len(batch)} boards.")
        except (Exception, CancelledError) as error:
            for _, answer in batch:
                if not answer.done():
                    answer.set_exception(error)
        else:
            for (_, answer), move in zip(batch, moves, strict=True):
                if not answer.done():
                    answer.set_result(move)
        self._begin()
