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
from racecraft.formats.atomic import make_folder
from racecraft.formats.run_lock import RunLock
from racecraft.jobs.children import apart
from racecraft.jobs.job_paths import JobPaths

SUPERVISOR_LOG = "supervisor.log"
WAKING_SECONDS = 2.0
"""A supervisor that was started so recently may not hold its lock yet."""
_started: list[tuple[Path, float, subprocess.Popen[bytes]]] = []
"""Supervisors that this process started, for which home and when; it does not wait for them."""


def is_supervised(home: JobPaths) -> bool:
    """Tell whether somebody works at the jobs of a home on this machine."""
    try:
        RunLock(home.path).release()
    except RunFolderError:
        return True
    return False


def ensure_supervisor(home: JobPaths) -> None:
    """Start a supervisor that outlives this process, where nobody works at the jobs of this home.

    Raises:
        JobError: The one that was started before could not work; its message is shown once.
    """
    make_folder(home.path)
    if _wakes(home) or is_supervised(home):
        return
    _raise_failed(home)
    environment = {**os.environ, "RACECRAFT_JOBS": str(home.path), "RACECRAFT_JOB_STORE": home.store_url}
    with open(home.path / SUPERVISOR_LOG, "ab") as log_file:
        command = [sys.executable, "-m", "racecraft.jobs"]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=log_file, stderr=log_file, env=environment, **apart()
        )
    if not _started:
        atexit.register(_leave_them)
    _started.append((home.path, time.monotonic(), process))


def _wakes(home: JobPaths) -> bool:
    """Tell whether this process has just started a supervisor there that lives."""
    now = time.monotonic()
    return any(
        path == home.path and now - began < WAKING_SECONDS and process.poll() is None
        for path, began, process in _started
    )


def _raise_failed(home: JobPaths) -> None:
    """Raise what a supervisor that was started here ended with, so that nobody waits for one that cannot work."""
    failed = [one for one in _started if one[0] == home.path and (one[2].poll() or 0) > 0]
    for one in failed:
        _started.remove(one)
    if failed:
        from racecraft.jobs.follow import last_error
        from racecraft.jobs.states import JobError

        log = home.path / SUPERVISOR_LOG
        message = last_error(log) or f"the supervisor ended with code {failed[-1][2].returncode}; see {log}."
        raise JobError(
            "nobody can work at the jobs of {path}: {letter} Jobs are kept, and go on afterwards.",
            path=home.path,
            letter=message,
        )


def _leave_them() -> None:
    """Have nobody complain that supervisors outlive us: that is what they are for."""
    for _, _, process in _started:
        process.poll()
        process.returncode = process.returncode or 0
