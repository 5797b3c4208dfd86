"""A player from a user's own FILE.py, in the spirit of the official starter packs.

The file has a function `move(data)` that is given the official JSON as a dictionary and returns `{"move": "up"}` or
just `"up"`. It may also have `info()` (colour, head, tail), `start(data)` and `end(data)`.

It lives in a process of its own (`file_worker.py`): one that hangs is ended and begun anew, one that dies or wants more
memory than it may have is begun anew, and none can hurt the game. Its global names live as long as that process.
Loading a file runs it, with the rights of whoever started us unless it is isolated: load only what its owner asked to
run.
"""

from __future__ import annotations

import json
import queue
import subprocess
import threading
import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from racecraft.formats.processes import kill_tree
from racecraft.isolation.process import harmless_environment, python_command
from racecraft.worlds.battlesnake.players.protocol import Message, PlayerError

LOAD_SECONDS = 30.0
"""Time a file may take to load: its imports may be heavy."""
HANGING_SECONDS = 2.0
"""A single answer that takes longer hangs: the process is ended. Nobody waits for it so long."""
MAX_ANSWER_BYTES = 64 * 1024
MEMORY_MB = 2048
"""Memory a file may use unless told otherwise: much for a snake, little for a machine. Held to on Linux only."""

MIN_MEMORY_MB = 64
"""Python and what runs the file take about half of it."""


class DiedError(PlayerError):
    """The process of a user's file is gone."""


class FilePlayer:
    """A user's functions in their own process, ready to be called from any thread; one question at a time.

    Args:
        path: The file.
        memory_mb: Memory it may use, in MB of 2^20 bytes: data, not code; 0: as much as there is. Held to on Linux.
        is_isolated: It can compute and nothing else (`isolation/`): a stranger's file.

    Raises:
        PlayerError: It cannot be read, does not compile, fails or hangs while it is run, or has no `move`; or the
            memory asked for is none.
    """

    def __init__(self, path: str | Path, memory_mb: int = MEMORY_MB, is_isolated: bool = False) -> None:
        if memory_mb and memory_mb < MIN_MEMORY_MB:
            raise PlayerError(
                "{memory_mb} MB for {path}; expected at least {least_memory_mb}, or 0 for no limit.",
                memory_mb=memory_mb,
                path=path,
                least_memory_mb=MIN_MEMORY_MB,
            )
        self.path, self._memory_mb, self._is_isolated = Path(path), memory_mb, is_isolated
        self._lock = threading.Lock()
        self._worker = _Worker(self.path, self._memory_mb, self._is_isolated)
        try:
            self._worker.receive(LOAD_SECONDS)
        except TimeoutError:
            self.close()
            raise PlayerError(
                "{path}: still loading after {load_seconds:g} s; expected a file that loads.",
                path=path,
                load_seconds=LOAD_SECONDS,
            ) from None
        except PlayerError:
            self.close()
            raise

    def appearance(self) -> dict[str, str]:
        """Return what the file's `info()` says, texts only; empty where there is none."""
        try:
            card: dict[str, str] = self._ask("info", {}, HANGING_SECONDS)
        except TimeoutError:
            raise PlayerError(
                "{path}: info() gave no answer within {hanging_seconds:g} s.",
                path=self.path,
                hanging_seconds=HANGING_SECONDS,
            ) from None
        return card

    def start(self, message: Message, seconds: float) -> None:
        """Tell the file that a game begins, if it wants to know."""
        self._ask("start", message, seconds)

    def end(self, message: Message, seconds: float) -> None:
        """Tell the file that a game is over, if it wants to know."""
        self._ask("end", message, seconds)

    def move(self, message: Message, seconds: float) -> str:
        """Return the file's move.

        Raises:
            PlayerError: It raised, died, or returned no move; names file and line.
            TimeoutError: It has not answered within `seconds`.
        """
        return str(self._ask("move", message, seconds))

    def close(self) -> None:
        """End the process."""
        self._worker.end()

    def _ask(self, what: str, message: Message, seconds: float) -> Any:
        deadline = time.monotonic() + seconds
        if not self._lock.acquire(timeout=max(0.0, seconds)):
            raise TimeoutError(f"{self.path}: busy with other games.")
        try:
            self._await_late_answers(deadline)
            self._worker.put({"ask": what, "data": message})
            return self._worker.receive(deadline - time.monotonic())
        except DiedError:
            self._restart()
            raise
        finally:
            self._lock.release()

    def _await_late_answers(self, deadline: float) -> None:
        """Wait until the process has answered what nobody waited for, or loaded; end it where it hangs."""
        while self._worker.owes:
            until = min(deadline, self._worker.patience_ends)
            try:
                self._worker.receive(until - time.monotonic())
            except TimeoutError:
                if time.monotonic() < self._worker.patience_ends:
                    raise
                self._restart()
            except DiedError:
                raise
            except PlayerError:
                if self._worker.loading:
                    raise  # the file was changed meanwhile, and cannot be used any more
        self._worker.loading = False

    def _restart(self) -> None:
        self._worker.end()
        self._worker = _Worker(self.path, self._memory_mb, self._is_isolated)


class _Worker:
    """A process, the answers that came out of it, and whether one is still owed."""

    def __init__(self, path: Path, memory_mb: int, is_isolated: bool) -> None:
        self._path = path
        worker = "racecraft.worlds.battlesnake.players.file_worker"
        command = python_command(worker, str(path), str(memory_mb), *["isolated"] * is_isolated)
        self._process: subprocess.Popen[str] = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8", start_new_session=True,
            env=harmless_environment() if is_isolated else None,
        )  # fmt: skip
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=_gather, args=(self._process.stdout, self._answers), daemon=True).start()
        self.end = weakref.finalize(self, _end, self._process)
        self.owes, self.loading = True, True
        self.patience_ends = time.monotonic() + LOAD_SECONDS

    def put(self, question: dict[str, Any]) -> None:
        """Ask; an answer is owed from now on."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        except (OSError, ValueError) as error:
            raise self._died() from error
        self.owes, self.patience_ends = True, time.monotonic() + HANGING_SECONDS

    def receive(self, seconds: float) -> Any:
        """Return the answer that is owed; raises TimeoutError, and it stays owed."""
        try:
            line = self._answers.get(timeout=max(0.0, seconds))
        except queue.Empty:
            raise TimeoutError(f"{self._path}: no answer yet.") from None
        if not line.endswith("\n"):
            raise self._died()
        self.owes = False
        reply = json.loads(line)
        if "last_words" in reply:
            raise DiedError(reply["last_words"])
        if "error" in reply:
            raise PlayerError(reply["error"])
        return reply["answer"]

    def _died(self) -> DiedError:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        return DiedError(
            "{path}: its process ended (exit code {poll}); it is begun anew.",
            path=self._path,
            poll=self._process.poll(),
        )


def load_file_player(path: str | Path, memory_mb: int = MEMORY_MB, is_isolated: bool = False) -> FilePlayer:
    """Load a user's file. Arguments and errors are those of `FilePlayer`."""
    return FilePlayer(path, memory_mb, is_isolated)


def _gather(pipe: IO[str], answers: queue.SimpleQueue[str]) -> None:
    """Pass lines on; what is no whole line is the end."""
    line = "\n"
    with pipe:
        while line.endswith("\n"):
            try:
                line = pipe.readline(MAX_ANSWER_BYTES)
            except (OSError, ValueError):
                line = ""
            answers.put(line)


def _end(process: subprocess.Popen[str]) -> None:
    """End a process and whatever it started."""
    kill_tree(process.pid)
    process.wait()
    with suppress(OSError):
        process.stdin.close()  # type: ignore[union-attr]
