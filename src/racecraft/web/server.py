"""Serving an application: until it is told to end, or in a thread beside other work. Begin with `serve`."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import uvicorn
from starlette.types import ASGIApp

from racecraft.contract.errors import UserInputError
from racecraft.web.access import Access
from racecraft.web.limits import LimitedProtocol
from racecraft.web.ports import listen_on

IDLE_SECONDS = 75
MAX_MESSAGE_BYTES = 64 * 1024
"""Of a WebSocket."""
SECONDS_TO_END = 3
"""What is under way when a server is told to end may take so long."""


@dataclass(frozen=True)
class Tls:
    """A certificate and its private key, as PEM files; the certificate may be followed by those that signed it."""

    certificate: Path
    key: Path


def serve(application: ASGIApp, host: str, port: int, ready: Callable[[int], None], tls: Tls | None = None) -> None:
    """Serve until Ctrl-C or SIGTERM, then end what is under way and return.

    Args:
        application: From `make_application`, or a `JsonApi`.
        host: Address to listen on.
        port: Port; 0: any free one.
        ready: Told the port when it is listened on.
        tls: Answer by https alone; None: by http.

    Raises:
        PortError: The address cannot be listened on.
        TlsError: Certificate or key cannot be read, or do not belong together.
    """
    server = ListeningServer(application, host, port, tls)
    ready(server.port)
    server.run()


class ListeningServer:
    """Listens from the moment it is made; `run` answers.

    Args:
        application: From `make_application`, or a `JsonApi`.
        host: Address to listen on.
        port: Port; 0: any free one.
        tls: Certificate and key; None: plain HTTP.

    Raises:
        PortError: The address cannot be listened on.
        TlsError: Certificate or key cannot be read, or do not belong together.
    """

    def __init__(self, application: ASGIApp, host: str, port: int, tls: Tls | None = None) -> None:
        self._server = _Server(application, tls)
        self._socket = listen_on(host, port)
        self.port = int(self._socket.getsockname()[1])

    def run(self) -> None:
        """Serve until Ctrl-C or SIGTERM, end what is under way, and listen no more."""
        with contextlib.closing(self._socket):
            self._server.run(sockets=[self._socket])


class ServerThread:
    """Serves in a thread of its own until it is closed.

    Args:
        application: From `make_application`, or a `JsonApi`; its routes run in the thread and its workers alone.
        name: Of the thread.
        tls: As `serve` takes it.
        niceness: Of the thread and its workers beyond that of whoever starts it; on Linux those alone are slowed.
    """

    def __init__(self, application: ASGIApp, name: str, tls: Tls | None = None, niceness: int = 0) -> None:
        self._server = _Server(application, tls)
        self._name, self._niceness = name, niceness
        self._thread: threading.Thread | None = None

    def start(self, host: str, port: int) -> int:
        """Begin to listen; return the port.

        Raises:
            PortError: The address cannot be listened on.
        """
        listening = listen_on(host, port)
        self._thread = threading.Thread(target=self._run, args=(listening,), name=self._name, daemon=True)
        self._thread.start()
        return int(listening.getsockname()[1])

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join()

    def _run(self, listening: socket.socket) -> None:
        if self._niceness and hasattr(os, "nice"):
            os.nice(self._niceness)
        self._server.run(sockets=[listening])


def address_of(host: str, port: int, access: Access, path: str = "/", scheme: str = "http") -> str:
    """Return what a person opens: by this machine's name for all interfaces, with the token where there is one.

    >>> address_of("127.0.0.1", 8100, Access())
    'http://127.0.0.1:8100/'
    """
    name = socket.gethostname() if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"{scheme}://{name}:{port}{path}" + (f"?token={access.token}" if access.token else "")


class TlsError(UserInputError):
    """A certificate or its key cannot be used."""


def _loaded(config: uvicorn.Config, tls: Tls | None) -> uvicorn.Config:
    """Return a configuration whose certificate was read: what is wrong with it is said before anything is served."""
    try:
        config.load()
    except (OSError, ssl.SSLError) as error:
        if tls is None:
            raise
        raise TlsError(
            "{certificate}, {key}: {error}; expected a certificate and its private key, both PEM.",
            certificate=tls.certificate, key=tls.key, error=error.strerror or error,
        ) from error  # fmt: skip
    return config


class _Server(uvicorn.Server):
    """uvicorn's, ending its streams first and without raising the signal that ended it once more."""

    def __init__(self, application: ASGIApp, tls: Tls | None = None) -> None:
        super().__init__(
            _loaded(uvicorn.Config(
                application, loop="asyncio", http=LimitedProtocol, ws_max_size=MAX_MESSAGE_BYTES, lifespan="auto",
                log_config=None, log_level="critical", access_log=False, proxy_headers=False, server_header=False,
                timeout_keep_alive=IDLE_SECONDS,
                timeout_graceful_shutdown=SECONDS_TO_END,
                ssl_certfile=tls.certificate if tls else None, ssl_keyfile=tls.key if tls else None,
            ), tls)
        )  # fmt: skip
        state = getattr(application, "state", None)  # a `JsonApi` has none, and no streams
        self._closing = state.closing if state else None

    async def shutdown(self, sockets: Any = None) -> None:
        """End."""
        if self._closing is not None:
            self._closing.close()
        await super().shutdown(sockets)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take Ctrl-C and SIGTERM as the wish to end; only the main thread can."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {one: signal.signal(one, self._is_ending) for one in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)

    def _is_ending(self, number: int, frame: FrameType | None) -> None:
        self.handle_exit(number, frame)
