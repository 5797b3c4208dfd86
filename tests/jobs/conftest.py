"""A home of jobs of its own for a test, whose supervisor is ended afterwards."""

import os
import signal

import pytest
from tests.jobs.makers import wait_until

from racecraft.jobs.home import JobHome


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The home of jobs that every command of this test finds."""
    monkeypatch.delenv("RACECRAFT_JOB_STORE", raising=False)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    made = JobHome.of_user()
    yield made
    end_supervisor(made)


def supervisor_of(home):
    """Return the numbers of the processes that supervise a home."""
    found = []
    for folder in os.listdir("/proc"):
        try:
            words = open(f"/proc/{folder}/cmdline", "rb").read().split(b"\0")
            told = open(f"/proc/{folder}/environ", "rb").read().split(b"\0")
        except OSError:
            continue
        if b"supervise" in words and f"RACECRAFT_JOBS={home.path}".encode() in told:
            found.append(int(folder))
    return found


def end_supervisor(home):
    for number in supervisor_of(home):
        os.kill(number, signal.SIGTERM)
    wait_until(lambda: not [one for one in supervisor_of(home) if not _is_zombie(one)], 20.0)


def _is_zombie(number):
    try:
        return open(f"/proc/{number}/stat").read().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True
