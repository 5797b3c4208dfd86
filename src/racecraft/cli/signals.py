"""What the signals of a terminal or an operating system do to a command.

Ctrl-C and SIGTERM end a training, which saves what it learned; a second one ends the process at once, without a
traceback.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

SIGTERM = "SIGTERM"
TERMINATED = 128 + signal.SIGTERM
"""Exit code of a process that SIGTERM ended, as shells report it."""


class TerminatedError(KeyboardInterrupt):
    """SIGTERM was received; its text is `SIGTERM`, where that of Ctrl-C is empty."""


@contextlib.contextmanager
def sigterm_interrupts() -> Iterator[None]:
    """Raise `TerminatedError` in the main thread on SIGTERM, as Ctrl-C raises KeyboardInterrupt."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _raise_terminated)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def end_at_once_on_interrupt() -> None:
    """Let the next Ctrl-C end the process as the operating system does; the command has said its last word."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _raise_terminated(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends the process
    raise TerminatedError(SIGTERM)
