"""An HTTP service in a thread of its own: whoever starts it goes on with something else."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import Any

from racecraft.serving.http_service import HttpService
from racecraft.web.ports import port_error


class ServiceThread:
    """Serves until it is closed.

    Args:
        service: What answers; it is called in the thread alone.
        name: Of the thread.
    """

    def __init__(self, service: HttpService, name: str) -> None:
        self._service = service
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)

    def start(self, host: str, port: int) -> int:
        """Begin to listen; return the port.

        Raises:
            PortError: The port cannot be listened on.
        """
        self._thread.start()
        listening = asyncio.run_coroutine_threadsafe(self._service.listen(host, port), self._loop)
        try:
            return listening.result()
        except (OSError, OverflowError) as error:
            self._end()
            raise port_error(host, port, error) from error

    def call(self, function: Callable[..., Any], *values: Any) -> None:
        """Have something called in the thread, soon; from any thread."""
        self._loop.call_soon_threadsafe(function, *values)

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        if self._loop.is_closed():
            return
        asyncio.run_coroutine_threadsafe(self._service.close(), self._loop).result()
        self._end()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
