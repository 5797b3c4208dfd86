"""Cores of the machine for a thread of its own. Begin with `split_cores`; the system must be Linux."""

from __future__ import annotations

import os
import threading
import weakref

from racecraft.contract.errors import SettingError


def split_cores(wanted: int, setting: str) -> tuple[set[int], set[int]]:
    """Return the last `wanted` cores that this thread may use, and those that are left.

    Raises:
        SettingError: None would be left, or the system gives threads no cores.
    """
    if not hasattr(os, "sched_setaffinity"):
        raise SettingError(f"{setting}={wanted}: this system gives threads no cores of their own; leave it at 0.")
    free = sorted(os.sched_getaffinity(0))
    if wanted >= len(free):
        raise SettingError(
            f"{setting}={wanted}: {len(free)} core{'s' * (len(free) > 1)} may be used here, and actors need one; "
            f"expected 0 to {len(free) - 1}."
        )
    return set(free[-wanted:]), set(free[:-wanted])


def keep_to(cores: set[int]) -> None:
    """Keep the calling thread, and those that it begins, to some cores."""
    os.sched_setaffinity(0, cores)


def keep_to_while(owner: object, cores: set[int]) -> None:
    """Keep the calling thread to some cores for as long as an object lives; then it has those that it had."""
    weakref.finalize(owner, _give_back, threading.get_native_id(), os.sched_getaffinity(0))
    keep_to(cores)


def _give_back(thread: int, cores: set[int]) -> None:
    """Let a thread have its cores again, where it still lives."""
    try:
        os.sched_setaffinity(thread, cores)
    except OSError:
        return
