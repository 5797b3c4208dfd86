"""One thread for what is done in no time. Begin with `single_threaded`.

PyTorch shares out every single operation among its threads, which wait for each other behind each one, turning over and
over, and are in the way of the threads that move the worlds. A look at a few small frames is some twenty operations of
some microseconds: beside other work on the machine, three products of such a look took 22 us of one thread and 1,100 us
of two.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

LIGHT = 10_000_000
"""Rows times weights up to which a look is light: 32 frames of the default car are a fifth of it, 5 frames of the AWS
networks three times as much."""


@contextmanager
def single_threaded(rows: int, weights: int) -> Iterator[None]:
    """Let PyTorch work in this thread alone for the while, where so many rows pass so few weights.

    With gradients it is left as it is: a minibatch passes three times, and through more.
    """
    before = torch.get_num_threads()
    if before == 1 or rows * weights > LIGHT or torch.is_grad_enabled():
        yield
        return
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
