"""Workers that come by themselves, over a socket: two processes meet at a place that both name.

Begin with `MeetingTransport`, whoever learns, and `attend`, whoever carries worlds. The one that learns listens on this
machine and leaves address and key in a file that only this user can read; the other waits for the file, however early
or late it is, and serves until it is told that all is over. Both have deadlines, so that nobody waits for ever for one
that never comes. Between the two, messages are pickled, as Ray does; whoever has not the key is not heard.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener, wait
from pathlib import Path
from typing import Any

from racecraft.cluster.messages import Surroundings
from racecraft.cluster.transport import ClusterError, WorkerLostError
from racecraft.cluster.worker import Worker
from racecraft.formats.whole import make_folder, write_whole

MEETING = "meeting.json"
MEET_SECONDS = 600.0
"""As long as SageMaker's launcher waits for a machine (facts: battlesnake-and-sagemaker-rl.md C.5)."""
LOOK_SECONDS, GOODBYE_SECONDS = 0.2, 5.0
LOOPBACK = "127.0.0.1"


@dataclass(eq=False)
class Comer:
    """A worker that came."""

    door: Connection
    name: str
    """Of the party it came with."""
    of: int
    """How many the party has."""
    waiting: set[int] = field(default_factory=set)
    """Questions that it has not answered."""


class MeetingTransport:
    """Reaches workers that come to a place.

    Args:
        place: A folder that both sides name; it is made.
        seconds: A whole party is there by then, and a successor of one that was lost.

    Raises:
        ClusterError: No whole party came in time.
        OutputFileError: The place cannot be written.
    """

    def __init__(self, place: Path, seconds: float = MEET_SECONDS) -> None:
        self._place, self._seconds = place, seconds
        self._comers: deque[Comer] = deque()
        self._began: list[Comer] = []
        self._answers: dict[int, bytes | None] = {}
        self._tickets = 0
        self._came = threading.Condition()
        key = secrets.token_bytes(32)
        self._listener = Listener((LOOPBACK, 0), backlog=64, authkey=key)
        self._receiving = threading.Thread(target=self._receive, name="meeting", daemon=True)
        self._closed = False
        try:
            self._receiving.start()
            make_folder(place)
            place.chmod(0o700)
            write_whole(place / MEETING, json.dumps({"address": self._listener.address, "key": key.hex()}))
            self.room = self._whole_party()
        except BaseException:
            self.close()
            raise

    def start(self) -> Comer:
        """Return a worker that has nothing to do; wait for one where none is there."""
        with self._came:
            if not self._came.wait_for(lambda: bool(self._comers), self._seconds):
                raise ClusterError(
                    f"{self._place}: a worker was lost and no other came within {self._seconds:.0f} s; expected that "
                    "the secondary job goes on, or another one."
                )
            comer = self._comers.popleft()
        self._began.append(comer)
        return comer

    def ask(self, worker: Comer, what: str, message: Any) -> int:
        """Ask a worker."""
        self._tickets += 1
        ticket = self._tickets
        worker.waiting.add(ticket)
        try:
            worker.door.send_bytes(pickle.dumps((ticket, what, message)))
        except OSError:
            self._lose(worker)
        return ticket

    def for_all(self, message: Any) -> Any:
        """Return the message: every worker is sent its own copy."""
        return message

    def answered(self, tickets: Collection[int], seconds: float) -> list[int]:
        """Wait until one of the questions is answered or lost; return those that are."""
        if not any(ticket in self._answers for ticket in tickets):
            doors = {comer.door: comer for comer in self._began if comer.waiting}
            for door in wait(list(doors), seconds):
                self._hear(doors[door])  # type: ignore[index]
        return [ticket for ticket in tickets if ticket in self._answers]

    def answer(self, ticket: int) -> Any:
        """Return an answer that is there."""
        answer = self._answers.pop(ticket)
        if answer is None:
            raise WorkerLostError("its process ended")
        return pickle.loads(answer)

    def end(self, worker: Comer) -> None:
        """Send a worker away; its process waits for another meeting, or ends."""
        worker.door.close()
        self._began = [comer for comer in self._began if comer is not worker]

    def close(self) -> None:
        """Tell every worker that all is over."""
        if self._closed:
            return
        self._closed = True
        with contextlib.suppress(OSError):
            (self._place / MEETING).unlink()
        with contextlib.suppress(OSError):
            socket.create_connection(self._listener.address).close()  # so that nobody goes on listening
        self._receiving.join(GOODBYE_SECONDS)
        self._listener.close()
        for comer in [*self._began, *self._comers]:
            with contextlib.suppress(OSError):
                comer.door.send_bytes(pickle.dumps(None))
                comer.door.close()

    def _receive(self) -> None:
        """Let comers in, in a thread; one without the key is not heard."""
        while not self._closed:
            try:
                door = self._listener.accept()
                name, of = json.loads(door.recv_bytes())
            except Exception:  # a stranger, or the end
                continue
            with self._came:
                self._comers.append(Comer(door, name, of))
                self._came.notify_all()

    def _whole_party(self) -> int:
        """Wait until all of one party are there; return how many they are."""

        def whole() -> int:
            names = [comer.name for comer in self._comers]
            return next((comer.of for comer in self._comers if names.count(comer.name) >= comer.of), 0)

        with self._came:
            if count := self._came.wait_for(whole, self._seconds):
                return count
            raise ClusterError(
                f"{self._place}: {len(self._comers)} workers came within {self._seconds:.0f} s; expected a secondary "
                "job with the same s3_bucket and s3_prefix. Begin it beside the primary (fit(wait=False)), and leave "
                "it a core: `racecraft jobs list` shows whether it waits for one."
            )

    def _hear(self, comer: Comer) -> None:
        try:
            ticket, answer = pickle.loads(comer.door.recv_bytes())
        except (EOFError, OSError):
            self._lose(comer)
            return
        comer.waiting.discard(ticket)
        self._answers[ticket] = answer

    def _lose(self, comer: Comer) -> None:
        self._answers.update(dict.fromkeys(comer.waiting))
        comer.waiting.clear()


def attend(place: Path, party: str, of: int = 1, seconds: float = MEET_SECONDS) -> int:
    """Come to a meeting and carry worlds until all is over; return how many questions were answered.

    Where the one that learns is gone without a word, a new meeting is waited for: its job may have been interrupted.

    Args:
        place: A folder that both sides name.
        party: Whom this worker came with.
        of: How many they are.
        seconds: A meeting is there by then.

    Raises:
        ClusterError: There was none.
    """
    answered, until = 0, time.monotonic() + seconds
    for door in _meetings(place, until):
        with contextlib.closing(door):
            door.send_bytes(json.dumps([party, of]).encode())
            worker = Worker(Surroundings((), os.getcwd()))
            with contextlib.suppress(EOFError, OSError), contextlib.closing(worker):
                while (asked := pickle.loads(door.recv_bytes())) is not None:
                    ticket, what, message = asked
                    door.send_bytes(pickle.dumps((ticket, pickle.dumps(getattr(worker, what)(message)))))
                    answered += 1
                return answered
        until = time.monotonic() + seconds
    raise ClusterError(
        f"{place}: nobody to carry worlds for came within {seconds:.0f} s; expected a primary job with the same "
        "s3_bucket and s3_prefix."
    )


def _meetings(place: Path, until: float) -> Iterator[Connection]:
    """Yield a connection to each meeting that takes place, until the time is over."""
    while time.monotonic() < until:
        try:
            told = json.loads((place / MEETING).read_text(encoding="utf-8"))
            yield Client(tuple(told["address"]), authkey=bytes.fromhex(told["key"]))
        except (
            OSError,
            ValueError,
            EOFError,
            AuthenticationError,
        ):  # not yet; or its leader is gone, and the file is of yesterday
            pass
        time.sleep(LOOK_SECONDS)
