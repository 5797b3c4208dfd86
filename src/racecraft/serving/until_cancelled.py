"""A process that answers many short questions until it is told to end. Begin with `serve_until_cancelled`."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
import signal
import sys
from collections.abc import Callable
from typing import Protocol

from racecraft.web.ports import port_error


def answer_before_thinking() -> None:
    """Set this process up for many short answers; called once, before a player is loaded.

    A thread that thinks hands the interpreter back after half a millisecond instead of five, so that the one that
    answers is not kept waiting; and a policy uses one core for its small batches, because two wait for each other
    longer than they save, most of all beside another busy program. Who sets OMP_NUM_THREADS has the last word.
    """
    sys.setswitchinterval(0.0005)
    os.environ.setdefault("OMP_NUM_THREADS", "1")


def settle() -> None:
    """Take what was loaded so far out of the search for garbage; called once, when the player is ready.

    With torch loaded a full search goes through half a million objects that stay anyway, and holds every answer up for
    a fifth of a second.
    """
    gc.collect()
    gc.freeze()


class Listens(Protocol):
    """Whoever answers at an address."""

    async def listen(self, host: str, port: int) -> int:
        """Begin to listen; return the port."""
        ...

    async def close(self) -> None:
        """Stop."""
        ...


async def serve_until_cancelled(server: Listens, host: str, port: int, ready: Callable[[int], None]) -> None:
    """Listen until the task is cancelled or the process is told to end (SIGTERM); `ready` is told the port.

    Raises:
        PortError: The address cannot be listened on.
    """
    try:
        found = await server.listen(host, port)
    except (OSError, OverflowError) as error:
        raise port_error(host, port, error) from error
    ended = asyncio.Event()
    with contextlib.suppress(NotImplementedError):  # Windows has no such signal
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
    ready(found)
    try:
        await ended.wait()
    finally:
        await server.close()
