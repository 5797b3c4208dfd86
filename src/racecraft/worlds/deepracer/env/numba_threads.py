"""How many threads are worth waking for a tick. Begin with `at_most`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from racecraft.kernels import set_threads, threads

PIXELS_A_THREAD = 5_000
"""Fewer than so many to draw, of all cars together, are drawn sooner than a thread more has joined in: the five frames
of 40 x 30 of an evaluation take a tenth of a millisecond."""


@contextmanager
def at_most(count: int) -> Iterator[None]:
    """Let kernels use no more than so many threads for the while, and one at least. The bits are the same."""
    before = threads()
    if before <= max(count, 1):
        yield
        return
    set_threads(count)
    try:
        yield
    finally:
        set_threads(before)
