"""Jobs, homes and supervisors for tests: jobs are real processes, of scripts that take no time."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.job import new_job
from racecraft.jobs.job_paths import JobPaths

MARK = "racecraft-test-job"
"""Stands in the environment of every process a test job starts, so that what is left running is found."""


def home_in(folder):
    return JobPaths(Path(folder), f"sqlite:///{Path(folder) / 'jobs.sqlite'}")


def script_job(folder, name, text, *, mark="", **more):
    """A job that runs a script with this text."""
    script = Path(folder) / f"{name}.py"
    script.write_text(text)
    environment = {"PYTHONPATH": os.environ.get("PYTHONPATH", ""), MARK: mark or name}
    more = {"cores": 1, "memory_mib": 1, **more}
    return JobSpec(("run", script.name), name, folder=str(folder), environment=environment, **more)


def add(store, spec, created=None):
    store.add(new_job(spec, time.time() if created is None else created))
    return spec


def turn_until(supervisor, done, seconds=60.0):
    """Let a supervisor work until something holds."""
    until = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < until, "it took too long"
        supervisor.reconcile()
        time.sleep(0.02)


def state_of(store, name):
    return store.find(name).state


def running(mark):
    """Return the numbers of processes that a test job has left, by the mark in their environment."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if f"{MARK}={mark}".encode() in (folder / "environ").read_bytes().split(b"\0"):
                found.append(int(folder.name))
    return found


def wait_until(done, seconds=60.0):
    until = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < until, "it took too long"
        time.sleep(0.05)


def kill_hard(process):
    process.send_signal(signal.SIGKILL)
    process.wait()


def python(code, *arguments, **more):
    return subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)], **more)
