"""Workers of a cluster; a lost one is replaced and its task repeated. Begin with `WorkerPool.gather`.

A worker's every answer says where it stands, so whoever takes its place goes on from there, with the same weights and
the same chance, and gives the very answer that was lost: a training loses no update by it, and its curve is the same.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from racecraft.cluster.deadlines import load_scaled
from racecraft.cluster.messages import RolloutResult, Task, WorkerConfig, WorkerError, WorkerInit, WorkerReady
from racecraft.cluster.transport import ClusterError, Handle, Ticket, Transport, WorkerLostError
from racecraft.cluster.worker import spec_of_all
from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.contract.world import WorldSpec
from racecraft.training.versions import versions

COME_SECONDS = 180.0
"""Where no further worker has come for so long, none does: a process begins in some ten seconds, on a machine at work
in sixty. Opening worlds, which may mean to compile them, is not limited."""
TELL_SECONDS = 20.0
"""How often it is said what is waited for."""
LOOK_SECONDS = 0.5
"""How often, while workers are at work, somebody may look at the clock."""
LOST_IN_A_ROW = 5
"""After so many workers lost in one place without an answer the fault is not theirs."""

MessageCallback = Callable[[str], None]


class WorkerPool:
    """Workers, each in its place.

    Args:
        transport: Reaches them.
        orders: What each of them opens.
        on_message: Called with a line for a person.
        come_seconds: Where none has come for so long, none does; longer on a machine with much else to do.
    """

    def __init__(
        self,
        transport: Transport,
        orders: Sequence[WorkerConfig],
        on_message: MessageCallback,
        come_seconds: float = COME_SECONDS,
    ) -> None:
        self._transport, self._on_message, self._come_seconds = transport, on_message, come_seconds
        self.orders = list(orders)
        """What the worker in each place opened."""
        self._workers: list[Handle] = []
        self._lost = [0] * len(self.orders)
        self.replaced = 0
        """Workers replaced so far."""
        self.opened: list[WorkerReady] = []

    def open(self) -> WorldSpec:
        """Start all workers; return what their worlds promise together.

        Raises:
            ClusterError: They do not come, are lost as they come, or have other versions of what results depend on.
            UserInputError: What they are to open cannot be opened.
        """
        self._workers = [self._transport.start() for _ in self.orders]
        coming = {self._transport.ask(worker, "come", None): place for place, worker in enumerate(self._workers)}
        self._wait_for_all(coming, "have come", load_scaled(self._come_seconds))
        tickets = {self._transport.ask(self._workers[place], "open", order): place for place, order in self._places()}
        self.opened = [answer for _, answer in sorted(self._wait_for_all(tickets, "have opened their worlds").items())]
        for place, opened in enumerate(self.opened):
            _require_same_versions(place, opened)
        return spec_of_all([opened.spec for opened in self.opened])

    def begin(self, starts: Sequence[WorkerInit]) -> None:
        """Have every worker begin."""
        for place, start in enumerate(starts):
            self._transport.ask(self._workers[place], "begin", start)

    def ask(self, task: Task) -> dict[Ticket, int]:
        """Ask every worker to collect; return the questions, each with its worker's place."""
        shared = self._transport.for_all(task)
        return {self._transport.ask(worker, "collect", shared): place for place, worker in enumerate(self._workers)}

    def gather(
        self,
        under_way: dict[Ticket, int],
        starts: Callable[[int], WorkerInit],
        task: Task,
        look: Callable[[], None] = lambda: None,
    ) -> list[RolloutResult]:
        """Wait for what every worker collected, in the order of their places.

        Args:
            under_way: The questions of `ask`.
            starts: From where a worker's successor in a place goes on.
            task: What the successor collects then.
            look: Called every now and then; what it raises breaks the waiting off.

        Raises:
            UserInputError: Something in a world that the user gave failed.
            ClusterError: In one place worker after worker is lost.
        """
        waiting, answers = dict(under_way), dict[int, Any]()
        while waiting:
            for ticket in self._transport.answered(list(waiting), LOOK_SECONDS):
                place = waiting.pop(ticket)
                try:
                    answers[place] = _answer(self._transport.answer(ticket))
                    self._lost[place] = 0
                except WorkerLostError as gone:
                    self._replace(place, str(gone), starts(place))
                    waiting[self._transport.ask(self._workers[place], "collect", task)] = place
            look()
        return [answers[place] for place in range(len(self._workers))]

    def close(self) -> None:
        """End all workers."""
        self._transport.close()

    def _places(self) -> list[tuple[int, WorkerConfig]]:
        return list(enumerate(self.orders))

    def _replace(self, place: int, why: str, start: WorkerInit) -> None:
        """Put a new worker into a place; it opens the same worlds and goes on where the one before it was."""
        self._lost[place] += 1
        if self._lost[place] >= LOST_IN_A_ROW:
            raise ClusterError(
                "cluster: {lost} workers one after the other were lost in place {place} ({why}); "
                "expected one that stays. Look at the memory of that machine, or give fewer worlds (--set "
                "rollout.num_worlds=…).",
                lost=self._lost[place],
                place=place,
                why=why,
            )
        self._on_message(f"cluster: worker {place} was lost ({why}); another takes its place and does its work again")
        self.replaced += 1
        self._transport.end(self._workers[place])
        self._workers[place] = self._transport.start()
        self._transport.ask(self._workers[place], "open", self.orders[place])
        self._transport.ask(self._workers[place], "begin", start)

    def _wait_for_all(self, tickets: Mapping[Ticket, int], what: str, seconds: float = math.inf) -> dict[int, Any]:
        """Wait until workers have answered that were just started, and say now and then how far they are."""
        waiting, answers = dict(tickets), dict[int, Any]()
        began = latest = reported = time.monotonic()
        while waiting:
            before = len(answers)
            for ticket in self._transport.answered(list(waiting), LOOK_SECONDS):
                place = waiting.pop(ticket)
                try:
                    answers[place] = _answer(self._transport.answer(ticket))
                except WorkerLostError as lost:
                    raise ClusterError(
                        "cluster: worker {place} was lost before it had begun ({lost}); expected a machine with the "
                        "same racecraft installed, and memory for its worlds.",
                        place=place,
                        lost=lost,
                    ) from lost
            now = time.monotonic()
            latest = now if len(answers) > before else latest
            if waiting and now - reported >= TELL_SECONDS:
                reported = now
                self._on_message(
                    f"- cluster: after {now - began:.0f} s {len(answers)} of {len(tickets)} workers {what}"
                )
            if waiting and now - latest > seconds:
                raise ClusterError(
                    "cluster: {count} of {count_2} workers came, and for {seconds:.0f} s no other; expected "
                    "all of them. Look with `ray status` which cores are taken, ask for fewer workers (N@…), or begin "
                    "more machines with `ray start --address=HOST:PORT`.",
                    count=len(answers),
                    count_2=len(tickets),
                    seconds=seconds,
                )
        return answers


def starts_of(
    start: WorkerInit, specs: Sequence[WorldSpec], states: Sequence[Mapping[str, Any] | None]
) -> list[WorkerInit]:
    """Return where each worker begins: alike but for its rows and its state."""
    starts, first = [], 0
    for spec, state in zip(specs, states, strict=True):
        starts.append(replace(start, first_row=first, state=state))
        first += spec.num_worlds * spec.num_agents
    return starts


def _answer(answer: Any) -> Any:
    """Return an answer that is none of trouble.

    Raises:
        RacecraftError: It is trouble.
    """
    if isinstance(answer, WorkerError):
        raise (UserInputError if answer.is_users else RacecraftError)(answer.message)
    return answer


def _require_same_versions(place: int, opened: WorkerReady) -> None:
    ours = versions()
    if dict(opened.versions) != ours:
        other = {name: found for name, found in opened.versions.items() if found != ours.get(name)}
        raise ClusterError(
            "cluster: worker {place} on {host} has {other}; expected "
            "{value} as here. Install the same versions on every "
            "machine.",
            place=place,
            host=opened.host,
            other=other,
            value={name: ours[name] for name in other if name in ours},
        )
