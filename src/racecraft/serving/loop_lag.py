"""How long what happens waits before an event loop looks at it: nothing on an idle machine, long on a busy one.

A server that counts its time from when it read a request does not see how long the request lay there before. So the
loop is asked to wake up at exact times; by how much it is late, so much later it reads, too.
"""

from __future__ import annotations

import asyncio

SECONDS_BETWEEN_LOOKS = 0.02
FADING = 0.9
"""What is left of a lateness at the next look, where that one is less late."""
LASTING = 0.02
"""How quickly the lasting lateness follows the momentary one: it takes a second to believe it."""


class LoopLag:
    """Watches the lateness of the loop it was asked to watch in."""

    def __init__(self) -> None:
        self.seconds = 0.0
        """The lateness to be expected now: the worst of the last moments, fading."""
        self.lasting_seconds = 0.0
        """The mean lateness of about the last second."""
        self._next: asyncio.TimerHandle | None = None

    def watch(self) -> None:
        """Begin, in the loop that runs."""
        loop = asyncio.get_running_loop()
        self._look_at(loop, loop.time() + SECONDS_BETWEEN_LOOKS)

    def close(self) -> None:
        """End."""
        if self._next is not None:
            self._next.cancel()

    def note(self, late_seconds: float) -> None:
        """Take one look's lateness."""
        self.seconds = max(late_seconds, FADING * self.seconds)
        self.lasting_seconds += LASTING * (late_seconds - self.lasting_seconds)

    def _look_at(self, loop: asyncio.AbstractEventLoop, due: float) -> None:
        self._next = loop.call_at(due, self._look, loop, due)

    def _look(self, loop: asyncio.AbstractEventLoop, due: float) -> None:
        now = loop.time()
        self.note(max(0.0, now - due))
        self._look_at(loop, now + SECONDS_BETWEEN_LOOKS)
