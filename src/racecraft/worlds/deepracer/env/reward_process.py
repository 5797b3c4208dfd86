"""A racer's reward function in a process of its own, seen from the training. Begin with `open_reward`.

One message a tick pays all cars: numbers go, numbers come (`reward_worker.py` has the other end). The process can read
Python's files and those beside the racer's, and do nothing else (`racecraft/isolation`); this side keeps the clock.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.isolation.channel import to_head
from racecraft.isolation.process import CodeProcess, EndedError
from racecraft.isolation.readable import files_beside, files_of_python
from racecraft.worlds.deepracer.env.reward_caller import CarRewards, PaidCourse
from racecraft.worlds.deepracer.env.reward_params import ObjectReports
from racecraft.worlds.deepracer.files.reward_examples import Params
from racecraft.worlds.deepracer.files.reward_file import MAX_REWARD
from racecraft.worlds.deepracer.files.reward_source import RewardSource, read_reward_source
from racecraft.worlds.deepracer.files.reward_trace import Term, Traced

CALL_SECONDS = 5.0
"""How long a call may last where nothing else is said; AWS's validator had the same limit."""
IMPORT_SECONDS = 120.0
"""How long loading may last: a first import of a large package takes its time."""
MEMORY_BYTES = 768 << 20
"""How much a restricted reward function may have for its data, all copies together."""
MAX_PRINTED = 100_000_000
"""Characters that a training's log takes of what a reward function prints."""


def open_reward(
    path: str | Path | RewardSource,
    output: TextIO | None = None,
    seconds: float = CALL_SECONDS,
    is_trusted: bool = False,
) -> RewardProcess:
    """Load a racer's reward function in a process of its own.

    Args:
        path: The racer's file, or what was read of it.
        output: Where its prints go; None is standard output. May be changed later.
        seconds: How long a call may last, s.
        is_trusted: Whether it keeps all rights of the user.

    Raises:
        RewardFileError: The file is missing or empty, does not compile, fails or ends its process while it is
            imported, or holds no reward function of one parameter.
    """
    source = path if isinstance(path, RewardSource) else read_reward_source(path)
    return RewardProcess(source, output, seconds, is_trusted)


class RewardProcess:
    """A reward function that answers from elsewhere.

    Attributes:
        source: What the file says, and the modules beside it; as they were when it was loaded.
        output: Where its prints go; None is standard output.
        is_trusted: Whether it keeps all rights of the user, as its owner wished.
        layers: Which restrictions hold, by name; none where it is trusted or the system has none.
    """

    def __init__(self, source: RewardSource, output: TextIO | None, seconds: float, is_trusted: bool) -> None:
        self.source, self.output = source, output
        self.is_trusted, self._seconds = is_trusted, seconds
        self._room = MAX_PRINTED
        self._line: int | None = None
        self._process = CodeProcess("racecraft.worlds.deepracer.env.reward_worker", has_environment=is_trusted)
        self._courses: dict[int, tuple[int, PaidCourse]] = {}
        self._groups = 0
        self.layers: tuple[str, ...] = ()
        self._load()

    @property
    def path(self) -> Path:
        """The file it came from."""
        return self.source.path

    def copies(self, count: int) -> RewardCopies:
        """Return one for each of so many cars: with state of its own where the file may keep any.

        Raises:
            RewardFileError: The file, which could be loaded once, cannot be loaded again.
        """
        self._ask_while_loading({"copies": count})
        self._groups += 1
        return RewardCopies(self, self._groups - 1, count)

    def variant(self, source: RewardSource) -> RewardCopies:
        """Load another source into the same process; return the one copy of it.

        Raises:
            RewardFileError: It cannot be loaded.
        """
        loaded = {"path": str(source.path), "text": source.text, "modules": dict(source.modules)}
        self._ask_while_loading({"variant": loaded})
        self._groups += 1
        return RewardCopies(self, self._groups - 1, 1)

    def call(self, params: Params) -> float:
        """Return the reward for one dictionary of parameters.

        Raises:
            RewardError: The function raised, hung, ended its process, or returned something that is no finite number
                within ±1e5.
        """
        points = params.get("waypoints", ())
        plain = {name: [] if name == "waypoints" else value for name, value in params.items()}
        (paid,) = self.compute_rewards({"call": plain}, np.array(points, float).tobytes(), 1)[0].tolist()
        return float(paid)

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def number_of(self, course: PaidCourse) -> int:
        """Return the number by which the process knows a course, which is sent when it is first met."""
        known = self._courses.get(id(course))
        if known is None:
            self._ask(to_head({"course": course.as_dictionary()}), course.waypoints.tobytes(), IMPORT_SECONDS)
            known = self._courses[id(course)] = (len(self._courses), course)
        return known[0]

    def compute_rewards(self, call: Mapping[str, Any] | bytes, body: bytes, rows: int) -> tuple[Array, dict[str, Any]]:
        """Return what so many rows earned, float64 (rows,), and what else was told.

        Raises:
            RewardError: The function failed; `paid` on it holds what went before.
        """
        head = call if isinstance(call, bytes) else to_head(call)
        try:
            reply, came = self._ask(head, body, self._seconds)
        except EndedError as error:
            raise RewardError(self._error_text(error)) from None
        paid: Array = np.frombuffer(came) if len(came) % 8 == 0 else np.zeros(0)
        if isinstance(failed := reply.get("error"), str):
            raise FailedRowError(_plain(failed), paid, reply)
        if len(paid) != rows or not (np.abs(paid) <= MAX_REWARD).all():
            raise RewardError(
                "{where}: reward_function's process answered {count} bytes; expected {rows} numbers from "
                "-1e5 to 1e5. Do not write to the process's own files.",
                where=self._where(),
                count=len(came),
                rows=rows,
            )
        return paid, reply

    def _load(self) -> None:
        source = self.source
        order = {
            "path": str(source.path),
            "text": source.text,
            "modules": dict(source.modules),
            "readable": None if self.is_trusted else [*files_of_python(), *files_beside(source.path)],
            "memory_bytes": MEMORY_BYTES,
            "seconds": self._seconds,
        }
        reply = self._ask_while_loading({"load": order})
        self.layers = tuple(str(layer) for layer in reply.get("layers", ()))
        self._line = reply.get("line")

    def _ask_while_loading(self, order: Mapping[str, Any]) -> dict[str, Any]:
        try:
            reply, _ = self._ask(to_head(order), b"", IMPORT_SECONDS)
        except EndedError as error:
            found = f"had not returned after {IMPORT_SECONDS:g} s" if error.was_late else f"its process {error.found}"
            raise RewardFileError(
                self.path, Message("{found} while it was imported", found=found), "a module that can be imported",
                line=self._line_of(error),
            ) from None  # fmt: skip
        if "file_error" in reply:
            if "load" in order:
                self.close()
            found, expected, hint, line, key = reply["file_error"]
            raise RewardFileError(self.path, _plain(str(found)), expected, hint, line=line, key=key)
        return reply

    def _ask(self, head: bytes, body: bytes, seconds: float) -> tuple[dict[str, Any], bytes]:
        reply, came = self._process.ask(head, body, seconds)
        if isinstance(printed := reply.get("printed"), str) and self._room > 0:
            self._room -= len(printed)
            if self._room <= 0:
                printed += f"\n{self.path}: printed {MAX_PRINTED:,} characters; what follows is dropped\n"
            (self.output or sys.stdout).write(_plain(printed))
        return reply, came

    def _error_text(self, error: EndedError) -> str:
        line = self._line_of(error) or self._line or 1
        lines = self.source.text.splitlines()
        text = lines[line - 1].strip() if 0 < line <= len(lines) else ""
        found = f"'s process {error.found}"
        hint = "Take out what ends it; an exception tells what is wrong."
        if error.was_late:
            found = f" had not returned after {self._seconds:g} s"
            hint = "Mend the loop that it was in, or allow a call more time with --set race.reward_seconds=60."
        return f"{self.path}:{line}: reward_function{found}; expected a number. {hint}\n    {text}"

    def _line_of(self, error: EndedError) -> int | None:
        """Return the line of the racer's file where the process was when it ended, as far as it could say."""
        mine = str(self.path).encode("ascii", "backslashreplace").decode()
        return next((line for file, line in error.locations if file == mine), None)

    def _where(self) -> str:
        return f"{self.path}:{self._line or 1}"


def _plain(text: str) -> str:
    """Return a text that any file takes: no half characters."""
    return text.encode("utf-8", "replace").decode()


class RewardCopies(CarRewards):
    """The reward functions of a world's cars, a copy each.

    Attributes:
        is_traced: Whether `terms` are kept: which line gave which variable which number in the last row paid.
        terms: See there.
    """

    def __init__(self, process: RewardProcess, group: int, count: int) -> None:
        self._process, self._group, self._count = process, group, count
        self.is_traced = False
        self.terms: dict[Term, float] = {}

    def __len__(self) -> int:
        return self._count

    def compute_rewards(
        self, course: PaidCourse, cars: Array, reports: Array, objects: ObjectReports | None, rewards: Any
    ) -> None:
        """Write what cars earned in a tick; see `CarRewards.compute_rewards`."""
        if not len(cars):
            return
        try:
            rewards[cars], reply = self.ask(course, cars, reports, objects)
        except FailedRowError as error:
            rewards[cars[: len(error.paid)]] = error.paid[: len(cars)]
            raise RewardError(str(error)) from None
        if self.is_traced:
            traces = reply.get("traces")
            self.terms = dict(sorted(Traced.of(traces[-1]).terms.items())) if traces else {}

    def ask(
        self, course: PaidCourse, cars: Array, reports: Array, objects: ObjectReports | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Return the rewards of the rows, float64 (R,), and notes; arguments as in `CarRewards.compute_rewards`.

        Traced, "traces" holds how each row's reward came about, for `Traced.of`, and "lines" which lines ran.

        Raises:
            FailedRowError: A row failed.
        """
        rows = len(cars)
        head = b'{"tick":[%d,%d,%d]%s}' % (
            self._process.number_of(course), self._group, rows, b',"trace":1' if self.is_traced else b"",
        )  # fmt: skip
        parts: Sequence[Array] = (cars.astype(np.int64), reports)
        if objects is not None:
            counts = () if objects.counts is None else (objects.counts.astype(np.int64),)
            parts = (*parts, objects.boxes.astype(float), objects.states, *counts)
        return self._process.compute_rewards(head, b"".join(part.tobytes() for part in parts), rows)


class FailedRowError(RewardError):
    """A row failed after others were paid.

    Attributes:
        paid: What the rows before it earned, float64.
        told: What else was told.
    """

    def __init__(self, text: str, paid: Array, reply: Mapping[str, Any]) -> None:
        super().__init__(text)
        self.paid, self.told = paid, reply
