"""The wire: a gRPC server on loopback that one player talks to.

ML-Agents turns the roles around: Python is the *server*, and Unity is the client that always has one call of
`/communicator_objects.UnityToExternalProto/Exchange` pending. We "send" by answering it. So a conversation is

    hear() -> bytes of the player's call        (waits)
    answer(bytes)                               (lets the player go on until its next call)

Begin at `Wire`; `call_as_player` is the other side, for stand-ins. Bytes go through unparsed, so that a message that
cannot be parsed is our error to name, not gRPC's. Lessons that stand behind the choices here (facts: unity-ml-agents):

* the port is chosen by gRPC, so parallel players never quarrel; port reuse is off, so a taken port is an error;
* the server listens on loopback only; the official one listens on every interface, without a password;
* gRPC's limit of 4 MB a message is raised: big observations are ordinary;
* the thread that holds the pending call blocks until we answer, and an interpreter that waits for it never exits. Our
  threads are daemons, and `close` answers the pending call.
"""

from __future__ import annotations

import logging
import queue
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent import futures
from typing import Any

from racecraft.worlds.unity.env.errors import (
    PlayerDiedError,
    PortTakenError,
    SessionClosedError,
    WireError,
    missing_extra,
)

METHOD = "/communicator_objects.UnityToExternalProto/Exchange"
MAX_MESSAGE_BYTES = 512 * 2**20
"""The largest message taken in. A player that claims more is refused; gRPC's own limit would be 4 MB."""
EDITOR_PORT = 5004

_log = logging.getLogger("racecraft.unity")
_WATCH_SECONDS = 0.1  # how often a waiting `receive` looks after the player; a death is noticed well within a second


class Wire:
    """A server for one player.

    Args:
        port: 0 lets the system choose a free port; the Editor listens for 5004 only.
        host: `localhost`, or another name of this machine where the player sits in a container.
        max_message_bytes: The largest message taken in.

    Raises:
        PortTakenError: The wished port is in use.
        MissingExtraError: grpcio is not installed.
    """

    def __init__(self, port: int = 0, host: str = "localhost", max_message_bytes: int = MAX_MESSAGE_BYTES) -> None:
        grpc = _grpc()
        self._max_message_bytes = max_message_bytes
        self._calls: queue.SimpleQueue[bytes | Exception] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._pending: object | None = None
        self._player: str | None = None
        """The connection of the player, from its first whole message on; strangers are turned away."""
        self._heard = False
        self._closed = False
        self._threads = _DaemonThreads(2)
        if port:
            _require_free(port)
        # A unary call and a stream of one message look alike on the wire, but a stream tells us when the message
        # never came whole.
        handler = grpc.method_handlers_generic_handler(
            METHOD.split("/")[1], {"Exchange": grpc.stream_unary_rpc_method_handler(self._exchange)}
        )
        options = [
            ("grpc.so_reuseport", 0),
            ("grpc.max_receive_message_length", max_message_bytes),
            ("grpc.max_send_message_length", -1),
        ]
        self._server = grpc.server(self._threads, handlers=[handler], options=options)
        try:
            self.port: int = self._server.add_insecure_port(f"{host}:{port}")
        except RuntimeError as cause:
            self._threads.shutdown()
            raise PortTakenError(
                "cannot listen on {host}:{port} ({cause}). {port_cure}",
                host=host,
                port=port,
                cause=cause,
                port_cure=_PORT_CURE,
            ) from cause
        self._server.start()

    def receive(self, timeout_seconds: float, look_after: Callable[[], None] = lambda: None) -> bytes | None:
        """Wait for the player's next call and return its bytes, or None when `timeout_seconds` have passed.

        Args:
            timeout_seconds: How long to wait.
            look_after: Called ten times a second while waiting; raises when there is nobody left to wait for.

        Raises:
            WireError: Two calls at once, or a message that did not arrive whole.
            PlayerDiedError: The player hung up.
            SessionClosedError: The wire is closed.
        """
        end = time.monotonic() + timeout_seconds
        while not self._closed:
            left = end - time.monotonic()
            try:
                news = self._calls.get(timeout=max(0.0, min(_WATCH_SECONDS, left)))
            except queue.Empty:
                look_after()
                if left <= 0:
                    return None
                continue
            if isinstance(news, Exception):
                look_after()  # a process that ended explains more than a broken connection
                raise news
            self._heard = True
            return news
        raise SessionClosedError("the wire is closed")

    def answer(self, message: bytes) -> None:
        """Answer the call last heard."""
        if self._closed:
            raise SessionClosedError("the wire is closed")
        if not self._heard:
            raise WireError("nothing was asked, so nothing can be answered; hear() comes first")
        self._heard = False
        self._answers.put(message)

    def close(self, goodbye: bytes = b"", patience_seconds: float = 2.0) -> None:
        """Answer the pending call with `goodbye` and end the server and its threads; twice is once.

        Args:
            goodbye: The bytes of a last answer.
            patience_seconds: How long calls may take to leave before they are cut.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
        for _ in range(2):  # one for the pending call, one for a call that slipped in beside it
            self._answers.put(goodbye or None)
        self._server.stop(grace=patience_seconds).wait(patience_seconds + 1.0)
        self._threads.shutdown()
        self._threads.join(1.0)

    def _exchange(self, requests: Iterator[bytes], context: Any) -> bytes | None:
        """One call of the player, in a thread of the server: pass it on and wait for the answer."""
        grpc = _grpc()
        caller = context.peer()
        if self._player not in (None, caller):
            _log.warning("Another program (%s) called a Unity player's port %d and was turned away.", caller, self.port)
            context.abort(grpc.StatusCode.FAILED_PRECONDITION, "this conversation belongs to another player")
        try:
            request = next(requests)
        except Exception:  # noqa: BLE001 (StopIteration or gRPC's own: either way no whole message came)
            self._calls.put(WireError(
                "a message of the player did not arrive whole: it is larger than "
                "{max_message_bytes:,} bytes, or the player ended while sending. "
                "Raise max_message_bytes, or make its observations smaller.", max_message_bytes=self._max_message_bytes
            ))  # fmt: skip
            context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, "the message did not arrive whole")
        this_call = object()
        with self._lock:
            second, closed = self._pending is not None, self._closed
            stranger = self._player not in (None, caller)
            if not second and not closed and not stranger:
                self._pending, self._player = this_call, caller
        if closed:
            context.abort(grpc.StatusCode.UNAVAILABLE, "the conversation is over")
        if stranger:
            context.abort(grpc.StatusCode.FAILED_PRECONDITION, "this conversation belongs to another player")
        if second:
            self._calls.put(WireError("the player called twice without waiting for an answer; expected one call."))
            context.abort(grpc.StatusCode.FAILED_PRECONDITION, "one call at a time")
        if not context.add_callback(lambda: self._call_ended(this_call)):
            self._call_ended(this_call)
        self._calls.put(request)
        answer = self._answers.get()
        with self._lock:
            self._pending = None
        if answer is None:
            context.abort(grpc.StatusCode.UNAVAILABLE, "the conversation is over")
        return answer

    def _call_ended(self, call: object) -> None:
        """Notice a call that ended although it was not answered: the player is gone."""
        with self._lock:
            gone = self._pending is call and not self._closed
        if gone:
            self._calls.put(PlayerDiedError("the player hung up in the middle of the conversation."))
            self._answers.put(None)


def call_as_player(port: int, timeout_seconds: float = 60.0) -> tuple[Callable[[bytes], bytes], Callable[[], None]]:
    """Connect to a server as a player does.

    Returns:
        `exchange`, which sends one message and returns the answer, and `disconnect`.

    Raises:
        ConnectionError: Nobody listens; from `exchange`, the server hung up.
    """
    grpc = _grpc()
    channel = grpc.insecure_channel(
        f"localhost:{port}",
        options=[
            ("grpc.max_receive_message_length", -1),
            ("grpc.max_send_message_length", -1),
            ("grpc.enable_http_proxy", 0),
            ("grpc.use_local_subchannel_pool", 1),  # a connection of its own, as a program of its own has
            ("grpc.initial_reconnect_backoff_ms", 50),
            ("grpc.min_reconnect_backoff_ms", 50),
        ],
    )
    call = channel.unary_unary(METHOD)

    def exchange(message: bytes) -> bytes:
        try:
            return bytes(call(message))
        except grpc.RpcError as cause:
            raise ConnectionError(f"the server hung up: {cause.code()}, {cause.details()}") from cause

    try:
        grpc.channel_ready_future(channel).result(timeout_seconds)
    except grpc.FutureTimeoutError as cause:
        channel.close()
        raise ConnectionError(f"nobody listens on port {port}") from cause
    return exchange, channel.close


_PORT_CURE = (
    "Another program holds it, perhaps a training of yours or another Unity session. End that one, or leave the port "
    "open: without a wish, a free one is chosen. The Editor alone insists on 5004."
)


def _require_free(port: int) -> None:
    """Refuse a port somebody listens on; gRPC alone would be content with the other address family."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        if sys.platform != "win32":
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as cause:
            raise PortTakenError(
                "port {port} is in use ({cause}). {port_cure}", port=port, cause=cause, port_cure=_PORT_CURE
            ) from cause


def _grpc() -> Any:
    """Return the gRPC module: nothing else imports it."""
    try:
        import grpc
    except ImportError as cause:
        raise missing_extra("grpcio") from cause
    return grpc


class _DaemonThreads(futures.ThreadPoolExecutor):
    """A few threads that never keep an interpreter from ending."""

    def __init__(self, count: int) -> None:
        self._work: queue.SimpleQueue[tuple[futures.Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._all = [threading.Thread(target=self._serve, daemon=True, name="unity-wire") for _ in range(count)]
        for thread in self._all:
            thread.start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> futures.Future[Any]:
        future: futures.Future[Any] = futures.Future()
        self._work.put((future, lambda: fn(*args, **kwargs)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        for _ in self._all:
            self._work.put(None)

    def join(self, timeout_seconds: float) -> None:
        for thread in self._all:
            thread.join(timeout_seconds)

    def _serve(self) -> None:
        while (task := self._work.get()) is not None:
            future, work = task
            try:
                future.set_result(work())
            except BaseException as error:  # noqa: BLE001 (a future carries whatever happened)
                future.set_exception(error)
