"""Waiting for Ctrl-C, in a process whose other threads do the work."""

from __future__ import annotations

import time
from typing import NoReturn

LOOK_S = 0.5
"""Seconds between two looks at what arrived.

A signal that comes while the main thread hands over the interpreter, on its way into a long sleep, is only noted: the
sleep does not end, and whoever pressed Ctrl-C waits for it. A short one is over soon.
"""


def wait_for_interrupt() -> NoReturn:
    """Wait, in the main thread, until `KeyboardInterrupt` is raised."""
    while True:
        time.sleep(LOOK_S)
