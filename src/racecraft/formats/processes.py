"""Other processes of this machine: whether one lives, and how one ends with all that it started."""

from __future__ import annotations

import contextlib
import os
import signal
import sys


def is_alive(pid: int) -> bool:
    """Tell whether a process of that number lives."""
    import psutil

    return bool(psutil.pid_exists(pid))


def kill_tree(pid: int) -> None:
    """End at once a process that leads a group of its own, and all that it started; of one that is gone, the rest."""
    if sys.platform != "win32":
        signal_group(pid, signal.SIGKILL)
        return
    import psutil

    with contextlib.suppress(psutil.NoSuchProcess):
        leader = psutil.Process(pid)
        for one in (*leader.children(recursive=True), leader):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()


def signal_group(pid: int, number: int) -> bool:
    """Send a signal to the group that a process leads (POSIX); 0 only looks. Tell whether the group has a process."""
    try:
        os.killpg(pid, number)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
