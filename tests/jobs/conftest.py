"""A home of jobs of its own for a test, whose supervisor is ended afterwards."""

import contextlib
import os
import signal
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests import forked
from tests.jobs.makers import wait_until

from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.tuning import dry_run


@pytest.fixture(autouse=True)
def _tried_by_a_fork(monkeypatch):
    """Have a command that is tried before it becomes a job begin at once, in a process of its own as ever."""
    monkeypatch.setattr(dry_run, "subprocess", SimpleNamespace(run=forked.run, DEVNULL=subprocess.DEVNULL))


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The home of jobs that every command of this test finds."""
    monkeypatch.delenv("RACECRAFT_JOB_STORE", raising=False)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    made = JobPaths.of_user()
    yield made
    end_supervisor(made)


def supervisor_of(home):
    """Return the numbers of the processes that supervise a home."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words, told = ((folder / name).read_bytes().split(b"\0") for name in ("cmdline", "environ"))
            if b"racecraft.jobs" in words and f"RACECRAFT_JOBS={home.path}".encode() in told:
                found.append(int(folder.name))
    return found


def end_supervisor(home):
    for number in supervisor_of(home):
        os.kill(number, signal.SIGTERM)
    wait_until(lambda: not supervisor_of(home))  # one that has ended has no words any more
