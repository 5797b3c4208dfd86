"""Setting a process up for many short answers."""

from __future__ import annotations

import gc
import os
import sys


def answer_before_thinking() -> None:
    """Set this process up for many short answers; called once, before a player is loaded.

    A thread that thinks hands the interpreter back after half a millisecond instead of five, so that the one that
    answers is not kept waiting; and a policy uses one core for its small batches, because two wait for each other
    longer than they save, most of all beside another busy program. Who sets OMP_NUM_THREADS has the last word.
    """
    sys.setswitchinterval(0.0005)
    os.environ.setdefault("OMP_NUM_THREADS", "1")


def freeze_loaded() -> None:
    """Take what was loaded so far out of the search for garbage; called once, when the player is ready.

    With torch loaded a full search goes through half a million objects that stay anyway, and holds every answer up for
    a fifth of a second.
    """
    gc.collect()
    gc.freeze()
