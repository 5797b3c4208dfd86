"""A limit on how long a call of a user's own code may last. Begin with `TimeLimit`.

A thread looks at the calls under way ten times a second, and into one that has lasted too long it raises an exception
(`PyThreadState_SetAsyncExc`), which the interpreter delivers at the next turn of a loop or the next call of a function.
No signals: it works in any thread, on any system that runs CPython.

A bare `except:` around the endless loop's body catches it, even where nobody meant to. So the thread strikes again and
again, until the call has been left; and it strikes with exceptions that ask for a further one as soon as they are made,
none to seven deep in turn. One is caught, and the next one strikes in what catches it or on the way back to the loop's
head, where nothing does.

What no exception can end is a call that sits in C (`time.sleep`, one enormous power of ten): the limit acts when it
returns; until then `stuck` is told, once.

The order of lines below is exact. CPython passes the interpreter to another thread between a call's end and what
follows it, at a loop's turn and at a function's beginning, and nowhere else; so "is this call still under way, then
strike" is one act, and so is "it is over". Nothing is locked, and a call costs some 0.2 µs more.
"""

from __future__ import annotations

import ctypes
import functools
import math
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

Argument = TypeVar("Argument")

LOOKS_PER_LIMIT, MOST_SECONDS_BETWEEN_LOOKS = 10, 0.1
IDLE_LOOKS = 50
"""After so many looks at nothing the thread ends; the next call begins another."""
SECONDS_BETWEEN_STRIKES = 0.01
DEEPEST_STRIKE = 8
"""As many exceptions at most in one strike: so many `except:`, one in another, are gone through at once."""

_strike = ctypes.PYFUNCTYPE(None, ctypes.c_ulong, ctypes.py_object)(("PyThreadState_SetAsyncExc", ctypes.pythonapi))
_take_back = ctypes.PYFUNCTYPE(None, ctypes.c_ulong, ctypes.c_void_p)(("PyThreadState_SetAsyncExc", ctypes.pythonapi))


class CallTooLongError(Exception):
    """A call lasted longer than it may; its cause is the exception that ended it, none where it caught them all."""


class TimeLimit:
    """Makes calls that end.

    Args:
        seconds: How long a call may last, s.
        stuck: Told a thread's number when its call sits where no exception reaches it; in a thread of its own.
    """

    def __init__(self, seconds: float, stuck: Callable[[int], None] = lambda thread: None) -> None:
        self.seconds = seconds
        self.stuck = stuck
        self._due: dict[int, float] = {}
        """Calls under way: when each must have ended, by thread."""
        self._struck: dict[int, float] = {}
        """Calls that the exception was raised in, likewise."""
        self._watcher: threading.Thread | None = None

    def call(self, function: Callable[[Argument], Any], argument: Argument, seconds: float = 0.0) -> Any:
        """Return function(argument); `seconds`, where given, stands in for the limit.

        Raises:
            CallTooLongError: It had not returned in time, or did so late, having caught what should have ended it.
        """
        me = threading.get_ident()
        self._due[me] = time.monotonic() + (seconds or self.seconds)
        try:
            if self._watcher is None:
                self._due[me] = math.inf  # a thread may take its time to begin; nobody is late meanwhile
                self._watch()
                self._due[me] = time.monotonic() + (seconds or self.seconds)
            value = function(argument)
            del self._due[me]
            if me not in self._struck:
                return value
        except BaseException as error:
            if me in self._due:
                del self._due[me]
            if me not in self._struck:
                raise
            _take_back(me, None)
            _lower_the_flag(me)
            del self._struck[me]
            raise CallTooLongError(f"no answer after {seconds or self.seconds:g} s") from error
        _take_back(me, None)  # it caught what was to end it, or answered in the very moment in which it was struck
        _lower_the_flag(me)
        del self._struck[me]
        raise CallTooLongError(f"an answer after more than {seconds or self.seconds:g} s")

    def _watch(self) -> None:
        self._watcher = threading.Thread(target=self._look_on, name="time limit of a user's code", daemon=True)
        self._watcher.start()

    def _look_on(self) -> None:
        pause = min(self.seconds / LOOKS_PER_LIMIT, MOST_SECONDS_BETWEEN_LOOKS)
        told: set[tuple[int, float]] = set()
        idle = strikes = 0
        while idle < IDLE_LOOKS:
            time.sleep(SECONDS_BETWEEN_STRIKES if self._struck else pause)
            idle = 0 if self._due else idle + 1
            for thread, due in list(self._due.items()):
                late = time.monotonic() - due
                if late > 0:
                    self._end(thread, due, 1 + strikes % DEEPEST_STRIKE)
                    strikes += 1
                if late > self.seconds and (thread, due) not in told:
                    told.add((thread, due))
                    self.stuck(thread)
        self._watcher = None
        if self._due:  # a call began while this thread was leaving, and thought itself watched
            self._watch()

    def _end(self, thread: int, due: float, depth: int) -> None:
        """Strike a call, if it is still under way."""
        error = _exceptions(thread, depth)
        try:
            if self._due[thread] == due:
                self._struck[thread] = due
                _strike(thread, error)
        except KeyError:
            pass  # it has just ended


def _lower_the_flag(thread: int) -> None:
    """Let the interpreter know that no exception waits in this thread, which must be the caller's own.

    CPython 3.11 raises a flag when an exception is asked for and lowers it only when one is delivered; one taken back
    leaves it up. Then each call and each turn of a loop looks for what is not there, and under a profiler or a debugger
    the next function that begins never gets past its first instruction. So one more is asked for, and caught.
    """
    try:
        _strike(thread, _Spared)
        while True:  # delivered here at the latest
            pass
    except _Spared:
        pass


class _Spared(BaseException):
    """Ends nothing."""


def _exceptions(thread: int, depth: int) -> type[BaseException]:
    """Return an exception that, when it is made, asks for the next of so many to be raised in the same thread."""

    class OutOfTime(BaseException):
        """Ends a call that lasts too long."""

    if depth > 1:
        ask = functools.partial(_strike, thread, _exceptions(thread, depth - 1))
        OutOfTime.__init__ = staticmethod(ask)  # type: ignore[method-assign]
    return OutOfTime
