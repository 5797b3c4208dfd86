"""Workers without Ray: in this process, every message pickled on its way; they are lost when the test says so."""

import itertools
import os
import sys
from dataclasses import dataclass, field

import cloudpickle  # as Ray does; it comes with gymnasium

from racecraft.cluster.cluster_options import ClusterOptions
from racecraft.cluster.distribute import spread_by
from racecraft.cluster.messages import WorkerEnv
from racecraft.cluster.transport import WorkerLostError
from racecraft.cluster.worker import Worker


@dataclass
class WorkersHere:
    """A transport whose workers answer at once."""

    capacity: int
    lost_at: tuple[int, ...] = ()
    """Which collectings, counted over all workers, are answered by nobody: their worker is lost with its answer."""
    never_come: bool = False
    slow_to: str = ""
    """A method whose answers are not there when they are first looked for."""
    asked: list = field(default_factory=list)
    ended: int = 0
    closed: bool = False

    def __post_init__(self):
        self._answers, self._numbers, self._collectings = {}, itertools.count(), itertools.count()
        self._lost, self._late = set(), set()

    def start(self):
        return Worker(WorkerEnv(tuple(sys.path), os.getcwd()))

    def ask(self, worker, what, message):
        ticket = next(self._numbers)
        self.asked.append(what)
        if self.never_come:
            return ticket
        if what == "collect" and next(self._collectings) in self.lost_at:
            self._lost.add(worker)
        answer = getattr(worker, what)(cloudpickle.loads(cloudpickle.dumps(message)))
        if what == self.slow_to:
            self._late.add(ticket)
        self._answers[ticket] = None if worker in self._lost else (cloudpickle.dumps(answer),)
        return ticket

    def for_all(self, message):
        return message

    def answered(self, tickets, seconds):
        there = [ticket for ticket in tickets if ticket in self._answers and ticket not in self._late]
        self._late.clear()
        return there

    def answer(self, ticket):
        answer = self._answers.pop(ticket)
        if answer is None:
            raise WorkerLostError("as the test has it")
        return cloudpickle.loads(answer[0])

    def end(self, worker):
        self.ended += 1
        worker.close()

    def close(self):
        self.closed = True


def spread_here(workers, come_seconds=60.0, **more):
    """Return what carries worlds to workers in this process, and their transport."""
    transport = WorkersHere(workers, **more)
    return spread_by(lambda: transport, ClusterOptions(workers, None), come_seconds), transport
