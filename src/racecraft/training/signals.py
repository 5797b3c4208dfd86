"""What the signals of a terminal or an operating system do to a command.

Ctrl-C and SIGTERM end a training, which saves what it learned; a second one ends the process at once, without a
traceback. Python forgets an exception that leaves a finaliser, the callback of a weak reference or one of LLVM's; a
signal that arrived there is sent again, unless what it broke ends the command before.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from types import FrameType

SIGTERM = "SIGTERM"
INTERRUPTED, TERMINATED = 128 + signal.SIGINT, 128 + signal.SIGTERM
"""Exit codes of a process that Ctrl-C or SIGTERM ended, as shells report it."""
SECONDS_TO_RESEND = 0.01
"""After which a forgotten signal is sent again: by then Python has left the callback that forgot it."""
_forgotten: list[KeyboardInterrupt] = []
"""What Python forgot, until it is sent again or ends the command."""


class TerminatedError(KeyboardInterrupt):
    """SIGTERM was received; its text is `SIGTERM`, where that of Ctrl-C is empty."""


class StoppedError(Exception):
    """A command was ended by a signal; unlike KeyboardInterrupt, Typer hands it on.

    Args:
        interrupt: What the signal raised.
    """

    def __init__(self, interrupt: KeyboardInterrupt) -> None:
        super().__init__("stopped.")
        self.exit_code = TERMINATED if isinstance(interrupt, TerminatedError) else INTERRUPTED


@contextlib.contextmanager
def interrupts_stop() -> Iterator[None]:
    """Raise `StoppedError` where a signal interrupts, or something fails because Python forgot that one did."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise StoppedError(interrupt) from interrupt
    except Exception as error:  # LLVM's callback kept no machine code, and Numba misses it
        if not _forgotten:
            raise
        raise StoppedError(_forgotten.pop()) from error


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


@contextlib.contextmanager
def forgotten_interrupts_return() -> Iterator[None]:
    """Send Ctrl-C and SIGTERM to the main thread again where Python forgot the exception that they raised."""
    before = sys.unraisablehook

    def resend(unraisable: sys.UnraisableHookArgs) -> None:
        if not isinstance(unraisable.exc_value, KeyboardInterrupt):
            before(unraisable)
            return
        number = signal.SIGINT
        if isinstance(unraisable.exc_value, TerminatedError):
            number = signal.SIGTERM
            signal.signal(number, _raise_terminated)
        _forgotten[:] = [unraisable.exc_value]
        timer = threading.Timer(SECONDS_TO_RESEND, _send_again, [number])
        timer.daemon = True
        timer.start()

    sys.unraisablehook = resend
    try:
        yield
    finally:
        sys.unraisablehook = before


def end_at_once_on_interrupt() -> None:
    """Let the next Ctrl-C end the process as the operating system does; the command has said its last word."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _raise_terminated(number: int, frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # a second one ends the process
    raise TerminatedError(SIGTERM)


def _send_again(number: signal.Signals) -> None:
    if _forgotten:
        _forgotten.clear()
        _signal_main_thread(number)


def _signal_main_thread(number: signal.Signals) -> None:
    main = threading.main_thread().ident
    if main is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, number)  # ends a system call that waits, too
    else:
        interrupt_main(number)
