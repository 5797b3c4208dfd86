"""Two learnings that have nothing to do with each other, side by side in two threads. Begin with `run_in_parallel`.

PyTorch shares out every single operation of a layer among its threads, which wait for each other behind each one: the
networks of the preset aws, some 80 operations of a millisecond and less in a minibatch, were 1.2 times as fast with two
threads as with one. Where policy and critic share no weights, each can go its way through all minibatches by itself.
What either learns hangs on no clock.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

Told = TypeVar("Told")


def run_in_parallel(mine: Iterator[Told], theirs: Iterator[Told]) -> tuple[list[Told], list[Told]]:
    """Go through two iterators, the second in a thread of its own where there are threads; return what they gave.

    Each has half of PyTorch's threads. Where one fails, the other is left at its next step, and the error goes on.
    """
    threads = torch.get_num_threads()
    if threads == 1:
        return one_by_one(mine, theirs)
    failed = threading.Event()
    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="beside") as beside:
        other = beside.submit(_exhausted, theirs, threads // 2, failed)
        return _exhausted(mine, threads - threads // 2, failed), other.result()


def one_by_one(mine: Iterator[Told], theirs: Iterator[Told]) -> tuple[list[Told], list[Told]]:
    """Go through two iterators, one after the other, in the thread that calls; return what they gave."""
    return list(mine), list(theirs)


def _exhausted(steps: Iterator[Told], threads: int, failed: threading.Event) -> list[Told]:
    """Return what an iterator gives, worked out with so many threads; nothing more once the other has failed."""
    results, is_whole = [], False
    try:
        with of_threads(threads):
            for figure in steps:
                results.append(figure)
                if failed.is_set():
                    break
        is_whole = True
    finally:
        if not is_whole:
            failed.set()
    return results


@contextmanager
def of_threads(count: int) -> Iterator[None]:
    """Let PyTorch take so many threads for what the calling thread asks of it, for the while."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
