"""Push to pages by Server-Sent Events. Begin with `Topic`.

    laps = Topic("laps")                     laps.publish({...}) from any thread
    load = Topic("load", read_load, 1.0)     read_load() is asked once a second, in a thread, while somebody listens

    events_answer(request, [laps, load])     the answer to GET /events

Each client has a queue of the newest two messages of each topic: a slow one loses the older, and nobody waits for it.
A message is encoded once for all. Without news a comment goes out every 15 s, so that a page knows its server lives;
a page that comes back names the last message it had (Last-Event-ID) and gets the newest if it missed any.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import StreamingResponse

from racecraft.pages.plain_json import plain_json

KEPT = 2
"""Messages that wait for a slow client."""
SIGN_OF_LIFE_S = 15.0


class Closing:
    """Tells all streams of an application that its server ends."""

    def __init__(self) -> None:
        self.now = False
        self.waiting: set[asyncio.Event] = set()

    def close(self) -> None:
        """End every stream; called in the server's loop."""
        self.now = True
        for event in self.waiting:
            event.set()


class Topic:
    """Messages to all pages that listen.

    Args:
        name: The event's name in the page.
        produce: Returns how things stand; called in a thread, only while somebody listens. A value that is None or
            equal to the one before is no news.
        every_s: Seconds between two calls of it.
    """

    def __init__(self, name: str, produce: Callable[[], Any] | None = None, every_s: float = 1.0) -> None:
        self.name = name
        self._produce, self._every_s = produce, every_s
        self._clients: dict[asyncio.Event, deque[bytes]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self._count, self._told, self._newest = 0, "", b""

    def publish(self, value: Any) -> None:
        """Send a value to all that listen, as JSON; from any thread."""
        text = plain_json(value)
        if self._loop is None:
            self._put(text)
        else:
            with contextlib.suppress(RuntimeError):  # the server has ended
                self._loop.call_soon_threadsafe(self._put, text)

    def _put(self, text: str) -> None:
        self._count, self._told = self._count + 1, text
        self._newest = f"event: {self.name}\nid: {self.name} {self._count}\ndata: {text}\n\n".encode()
        for event, waiting in self._clients.items():
            waiting.append(self._newest)
            event.set()

    def join(self, event: asyncio.Event, last_seen: str) -> deque[bytes]:
        """Begin to fill a queue and set an event with each message; in the server's loop."""
        self._loop = asyncio.get_running_loop()
        waiting: deque[bytes] = deque(maxlen=KEPT)
        if self._newest and last_seen != f"{self.name} {self._count}":
            waiting.append(self._newest)
            event.set()
        self._clients[event] = waiting
        if self._produce is not None and self._task is None:
            self._task = self._loop.create_task(self._go_on())
        return waiting

    def leave(self, event: asyncio.Event) -> None:
        """End what `join` began."""
        self._clients.pop(event, None)

    async def _go_on(self) -> None:
        """Ask for news as long as somebody listens."""
        assert self._produce is not None
        try:
            while self._clients:
                value = await run_in_threadpool(self._produce)
                text = plain_json(value)
                if value is not None and text != self._told:
                    self._put(text)
                await asyncio.sleep(self._every_s)
        finally:
            self._task = None


def events_answer(request: Request, topics: Sequence[Topic]) -> StreamingResponse:
    """Return the stream of some topics; it ends when the page or the server goes."""
    stream = _stream(request, topics)
    return StreamingResponse(stream, media_type="text/event-stream", headers={"Cache-Control": "no-store"})


async def _stream(request: Request, topics: Sequence[Topic]) -> AsyncIterator[bytes]:
    closing: Closing = request.app.state.closing
    event = asyncio.Event()
    closing.waiting.add(event)
    queues = [topic.join(event, request.headers.get("last-event-id", "")) for topic in topics]
    try:
        yield b"retry: 2000\n\n"
        while not closing.now:
            try:
                async with asyncio.timeout(SIGN_OF_LIFE_S):
                    await event.wait()
            except TimeoutError:
                yield b":\n\n"
                continue
            event.clear()
            while any(queues):
                yield b"".join(queue.popleft() for queue in queues if queue)
    finally:
        closing.waiting.discard(event)
        for topic in topics:
            topic.leave(event)
