"""See to it that somebody works at the jobs of this account. Begin with `ensure_supervisor`.

It imports little: a command that begins a training calls it before it has imported anything else.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import time
from pathlib import Path

from racecraft.contract.errors import RunFolderError
from racecraft.formats.run_lock import RunLock
from racecraft.formats.whole import make_folder
from racecraft.jobs.children import apart
from racecraft.jobs.home import JobHome

WAKING_SECONDS = 2.0
"""A supervisor that was started so recently may not hold its lock yet."""
_started: list[tuple[Path, float, subprocess.Popen[bytes]]] = []
"""Supervisors that this process started, for which home and when; it does not wait for them."""


def is_supervised(home: JobHome) -> bool:
    """Tell whether somebody works at the jobs of a home on this machine."""
    try:
        RunLock(home.path).release()
    except RunFolderError:
        return True
    return False


def ensure_supervisor(home: JobHome) -> None:
    """Start a supervisor that outlives this process, where nobody works at the jobs of this home."""
    make_folder(home.path)
    if _wakes(home) or is_supervised(home):
        return
    environment = {**os.environ, "RACECRAFT_JOBS": str(home.path), "RACECRAFT_JOB_STORE": home.store_url}
    with open(home.path / "supervisor.log", "ab") as said:
        command = [sys.executable, "-m", "racecraft.jobs"]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, env=environment, **apart()
        )
    if not _started:
        atexit.register(_leave_them)
    _started.append((home.path, time.monotonic(), process))


def _wakes(home: JobHome) -> bool:
    """Tell whether this process has just started a supervisor there that lives."""
    now = time.monotonic()
    return any(
        path == home.path and now - began < WAKING_SECONDS and process.poll() is None
        for path, began, process in _started
    )


def _leave_them() -> None:
    """Have nobody complain that supervisors outlive us: that is what they are for."""
    for _, _, process in _started:
        process.poll()
        process.returncode = process.returncode or 0
