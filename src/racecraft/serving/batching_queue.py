"""Many questions, one answer sheet: whatever waits at a moment is thought about together.

While a thread works on one batch, the next one gathers; so a lone question goes at once, and two hundred share a few
forward passes. Nothing is waited for on purpose.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from typing import Generic, TypeVar

from racecraft.contract.errors import ContractError
from racecraft.players.thread_pool import ThreadPool

Question = TypeVar("Question")
Answer = TypeVar("Answer")

MAX_AT_ONCE = 256
"""Questions in one batch."""
HANGING_SECONDS = 2.0
"""A batch that takes longer is given up, and the next begins without it."""


class BatchingQueue(Generic[Question, Answer]):
    """Asks somebody who answers many at once, for everyone who waits. Lives in one event loop.

    Args:
        answer_many: Gives one answer for each question; called by one thread at a time, unless a call hangs.
        most: Questions in one batch.
    """

    def __init__(self, answer_many: Callable[[list[Question]], Sequence[Answer]], most: int = MAX_AT_ONCE) -> None:
        self._answer_many, self._most = answer_many, most
        self._pool = ThreadPool(1)
        self._waiting: list[tuple[Question, asyncio.Future[Answer]]] = []
        self._under_way: Future[Sequence[Answer]] | None = None
        self.batches = 0

    async def ask(self, question: Question, deadline: float) -> Answer:
        """Return the answer to a question.

        Args:
            question: What is asked.
            deadline: `time.monotonic()` at which nobody waits any more.

        Raises:
            TimeoutError: There was no answer in time.
            ContractError: There were not as many answers as questions. Whatever answering raises comes too.
        """
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[Answer] = loop.create_future()
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
        task: Future[Sequence[Answer]] = self._pool.submit(lambda: self._answer_many(questions))
        self._under_way = task
        self.batches += 1
        given_up = loop.call_later(HANGING_SECONDS, self._give_up, task)

        def done(task: Future[Sequence[Answer]]) -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(self._hand_out, task, batch, given_up)

        task.add_done_callback(done)

    def _give_up(self, task: Future[Sequence[Answer]]) -> None:
        self._pool.leave_behind(task)
        self._under_way = None
        self._begin()

    def _hand_out(
        self,
        task: Future[Sequence[Answer]],
        batch: Sequence[tuple[Question, asyncio.Future[Answer]]],
        given_up: asyncio.Handle,
    ) -> None:
        given_up.cancel()
        if self._under_way is task:
            self._under_way = None
        try:
            answers = task.result()
            if len(answers) != len(batch):
                raise ContractError(
                    "{count} answers were given to {count_2} questions.", count=len(answers), count_2=len(batch)
                )
        except (Exception, CancelledError) as error:
            for _, answer in batch:
                if not answer.done():
                    answer.set_exception(error)
        else:
            for (_, answer), given in zip(batch, answers, strict=True):
                if not answer.done():
                    answer.set_result(given)
        self._begin()
