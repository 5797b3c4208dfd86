"""A process that runs code of others, seen from its owner, who keeps the clock. Begin with `CodeProcess`.

The process is a Python of its own (nothing is forked), with an environment of a few harmless variables. It answers one
message at a time. A thread of its owner looks twenty times a second whether an answer is due, and ends a process that
is late; so a process that hangs, dies or talks nonsense is one error to whoever asked, `EndedError`.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.isolation.channel import Channel, ChannelError, from_head

HARMLESS = ("LANG", "LC_ALL", "LC_CTYPE", "LD_LIBRARY_PATH", "PYTHONHASHSEED", "SYSTEMROOT", "TZ")
"""Variables that a restricted process gets of its owner's environment."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Numeric libraries start no threads, which are denied."""
LOOK_SECONDS, DUMP_SECONDS = 0.05, 0.1
PAUSE_SECONDS = 1.0
"""Who wakes so much later than it wanted to was paused, as by Ctrl-Z."""
ALIVE_SHARE = 0.1
"""Of the time that an answer may take: so often at most the process says {"alive": k} before it."""
LAST_WORDS_BYTES, LAST_LINE = 1 << 14, 200
_START = "import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); from {module} import main; main()"
_PLACE = re.compile(r'^  File "(.*)", line (\d+) in ', re.MULTILINE)


@dataclass(eq=False)
class EndedError(Exception):
    """The process did not answer, and is no more.

    Attributes:
        found: What happened, as a clause: "ended (exit code 3)".
        was_late: Whether it was ended because it did not answer in time.
        places: Where it was, (file, line), innermost first, as far as it could say.
    """

    found: str
    was_late: bool = False
    locations: tuple[tuple[str, int], ...] = ()


@dataclass
class _Deadline:
    """Kept by a clock that stands still while this process is paused: an answer that lies there was not late."""

    at: float = math.inf
    """When the answer is due, by `now`."""
    paused: float = 0.0
    """How long this process has been paused so far, s; the watching thread alone counts it."""
    has_passed: bool = False

    def now(self) -> float:
        return time.monotonic() - self.paused


class CodeProcess:
    """A process that answers messages.

    Args:
        module: Its `main()` is called there; it talks by standard input and output (`channel.py`).
        has_environment: Whether it has the whole environment of this process.
    """

    def __init__(self, module: str, has_environment: bool = False) -> None:
        kept: Mapping[str, str] = os.environ if has_environment else harmless_environment()
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            python_command(module),
            stdin=pipe,
            stdout=pipe,
            stderr=pipe,
            env={**kept, **ONE_THREAD},
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._channel = Channel(self._process.stdout.fileno(), self._process.stdin.fileno())
        self._deadline, self._owes, self._lock = _Deadline(), False, threading.Lock()
        self._end = weakref.finalize(self, _end, self._process)
        if hasattr(os, "set_blocking"):  # whoever writes more than a pipe holds is not heard, and does not wait
            os.set_blocking(self._process.stderr.fileno(), False)
        watch = threading.Thread(target=_watch, args=(self._process, self._deadline), daemon=True)
        watch.start()

    def ask(
        self, head: bytes, body: bytes, seconds: float, told: Callable[[Any], None] = lambda value: None
    ) -> tuple[dict[str, Any], bytes]:
        """Send a message and return the answer's head and body.

        Args:
            head: JSON, as `channel.to_head` makes it.
            body: Bytes.
            seconds: How long the answer may take; an answer {"alive": k} begins the time anew, and the process may be
                late by ALIVE_SHARE.
            told: Is called with what the process says before its answer, {"told": value}, which gains it no time.

        Raises:
            EndedError: There is none; the process is ended.
        """
        with self._lock:
            if not self._end.alive:
                raise EndedError("has ended before")
            try:
                if self._owes:  # whoever asked before did not wait, as after Ctrl-C
                    self._answer(seconds, lambda value: None)
                self._due_in(seconds)
                self._owes = True
                self._channel.send(head, body)
                return self._answer(seconds, told)
            except (EOFError, OSError, ChannelError) as error:
                raise self._ended(error) from None
            finally:
                self._deadline.at = math.inf

    def close(self) -> None:
        """End the process."""
        self._end()

    def _answer(self, seconds: float, told: Callable[[Any], None]) -> tuple[dict[str, Any], bytes]:
        self._due_in(seconds)
        while True:
            head, body = self._channel.receive()
            header = from_head(head)
            if "told" in header:
                told(header["told"])
            elif "alive" in header:
                self._due_in(seconds)
            else:
                self._owes = False
                return header, body

    def _due_in(self, seconds: float) -> None:
        self._deadline.at = self._deadline.now() + (1.0 + ALIVE_SHARE) * seconds

    def _ended(self, error: Exception) -> EndedError:
        process, was_late = self._process, self._deadline.has_passed
        if isinstance(error, ChannelError):
            self.close()
            return EndedError(f"answered with {error}")
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(1.0)
        words = _last_words(process)
        self.close()
        code = process.returncode
        how = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        if code > 0 and (lines := words.strip().splitlines()):
            how += f": {lines[-1][:LAST_LINE]}"
        places = tuple((file, int(line)) for file, line in _PLACE.findall(words))
        return EndedError(f"ended ({how})", was_late, places)


def python_command(module: str, *arguments: str) -> list[str]:
    """Return the command of a Python that imports from where this one does, and calls a module's `main()`.

    Args:
        module: Its name.
        arguments: Its sys.argv[1:].
    """
    return [sys.executable, "-P", "-s", "-c", _START.format(module=module), json.dumps(_search_path()), *arguments]


def _search_path() -> list[str]:
    return [os.path.abspath(place) for place in sys.path if place]


def harmless_environment() -> dict[str, str]:
    """Return what a restricted process gets of its owner's environment."""
    return {name: os.environ[name] for name in HARMLESS if name in os.environ}


def _watch(process: subprocess.Popen[bytes], deadline: _Deadline) -> None:
    """End the process when it is late; before that, let it say where it is."""
    while process.poll() is None:
        slept = time.monotonic()
        time.sleep(LOOK_SECONDS)
        late = time.monotonic() - slept - LOOK_SECONDS
        if late > PAUSE_SECONDS:
            deadline.paused += late
        if deadline.now() > deadline.at:
            deadline.has_passed = True
            if hasattr(signal, "SIGUSR1"):
                process.send_signal(signal.SIGUSR1)
                time.sleep(DUMP_SECONDS)
            process.kill()
            return


def _last_words(process: subprocess.Popen[bytes]) -> str:
    assert process.stderr is not None
    with contextlib.suppress(OSError, ValueError):
        return os.read(process.stderr.fileno(), LAST_WORDS_BYTES).decode(errors="replace")
    return ""


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout, process.stderr):
        with contextlib.suppress(OSError):
            pipe.close()  # type: ignore[union-attr]
