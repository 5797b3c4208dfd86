"""A job's process: started apart from every terminal, ended with all it has started. Begin with `start`."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.formats.job_spec import JobSpec
from racecraft.formats.processes import kill_tree
from racecraft.formats.run_folder import JOB
from racecraft.jobs import parent_watch

THREADS = "OMP_NUM_THREADS"
"""Tells most libraries how many cores are theirs."""


@dataclass
class Child:
    """A job's process."""

    process: subprocess.Popen[bytes]

    @property
    def pid(self) -> int:
        """Its number."""
        return self.process.pid

    def ended(self) -> int | None:
        """Return what it ended with, negative for a signal; None while it lives. What it left running is ended, too."""
        code = self.process.poll()
        if code is not None:
            self.kill()
            if self.process.stdin:
                self.process.stdin.close()
        return code

    def end(self) -> None:
        """End it at once, and wait until it has."""
        self.kill()
        self.process.wait()
        self.ended()

    def ask_to_end(self) -> None:
        """Ask it to end (SIGTERM)."""
        with contextlib.suppress(OSError):
            self.process.terminate()

    def kill(self) -> None:
        """End it at once, and all it has started."""
        kill_tree(self.pid)


def start(spec: JobSpec, log: Path) -> Child:
    """Start a job's process; where its run folder holds a run, it goes on with it.

    Raises:
        OSError: The interpreter or the folder is gone, or the log cannot be written.
    """
    with open(log, "ab") as log_file:
        process = subprocess.Popen(
            [spec.python or sys.executable, "-m", "racecraft", *current_args(spec)],
            cwd=spec.folder,
            env=variables(spec),
            stdin=subprocess.PIPE,
            stdout=log_file,
            stderr=subprocess.STDOUT,
            **apart(),
        )
    return Child(process)


def variables(spec: JobSpec) -> dict[str, str]:
    """Return the variables that a job's process sees."""
    threads = {THREADS: str(spec.cores)} if spec.cores else {}
    return {**os.environ, **spec.environment, parent_watch.VARIABLE: "1", "PYTHONUNBUFFERED": "1", **threads}


def current_args(spec: JobSpec) -> Sequence[str]:
    """Return the words behind `racecraft` with which a job is begun, or gone on with."""
    return spec.resume if spec.resume and has_begun(spec) else spec.command


def has_begun(spec: JobSpec) -> bool:
    """Tell whether a job's run folder holds a run of its: by then all that it was given was read, and can be used."""
    run = spec.run_folder()
    return run is not None and run_mark(run) not in ("", spec.older_run)


def run_mark(run: Path) -> str:
    """Return what tells a run from another one that stood in its place before; "" where none stands."""
    try:
        status = (run / JOB).stat()
    except OSError:
        return ""
    return f"{status.st_mtime_ns}-{status.st_ino}-{status.st_size}"


def apart() -> dict[str, Any]:
    """Return how a process is started that no terminal takes with it."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
    return {"start_new_session": True}


def signal_name(code: int) -> str:
    """Return the name of the signal that a process ended with.

    >>> signal_name(-9)
    'SIGKILL'
    """
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"
