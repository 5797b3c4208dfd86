"""The other end of a `CodeProcess`: what every process does that runs code of others. Begin with `run_worker`."""

from __future__ import annotations

import faulthandler
import io
import os
import signal
import sys
import traceback
from collections.abc import Callable
from typing import NoReturn

from racecraft.isolation.channel import Channel

MAX_PRINTED = 1 << 16
"""Characters of a message; what is printed beyond is dropped."""


class Printed(io.TextIOBase):
    """What was printed since the last answer, up to a limit."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._room = MAX_PRINTED

    def write(self, text: str) -> int:
        """Keep a text, or as much of it as there is room for."""
        if self._room > 0:
            self._parts.append(text[: self._room])
            self._room -= len(text)
        return len(text)

    def pop(self) -> str:
        """Return what was printed, and forget it."""
        if not self._parts:
            return ""
        dropped = f"\n… {-self._room:,} more characters are dropped\n" if self._room < 0 else ""
        text = "".join(self._parts) + dropped
        self._parts.clear()
        self._room = MAX_PRINTED
        return text


def run_worker(answering: Callable[[Channel, Printed], Callable[[bytes, bytes], None]]) -> NoReturn:
    """Answer messages until the owner closes the pipe.

    Args:
        answering: Given the channel and what is printed, returns what answers a message's head and body.
    """
    faulthandler.enable()
    if hasattr(faulthandler, "register"):
        faulthandler.register(signal.SIGUSR1, all_threads=False)
    channel = Channel(0, os.dup(1))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)  # what is printed past Python is no message
    printed = Printed()
    sys.stdout = sys.stderr = printed
    answer = answering(channel, printed)
    try:
        while True:
            answer(*channel.receive())
    except EOFError:
        os._exit(0)
    except BaseException:
        traceback.print_exc(file=sys.__stderr__)
        os._exit(1)
