"""Run pytest again and again without paying for its start: in forks of a process that imported the large guests once.

The process that forks must not have started any thread: Numba's OpenMP layer, among others, does not live on in a fork.
So nothing of the package runs in it, and BLAS is told to start none.
"""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

GUESTS = ("torch", "numba", "pytest", "gymnasium", "matplotlib.pyplot", "safetensors.torch", "av")
"""Polars is not among them, since it starts threads."""
MEMORY_BYTES = 8 << 30
TOOK_TOO_LONG = (-signal.SIGXCPU, -signal.SIGKILL, -signal.SIGVTALRM)
SLACK = 20
"""On a busy machine a fork may take so many times its processor seconds by the clock."""


def warm_up() -> None:
    """Import the large guests, once; call it before anything else has imported NumPy."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    os.environ["MPLBACKEND"] = "agg"
    for guest in GUESTS:
        with contextlib.suppress(ImportError):
            __import__(guest)


def in_fork(act: Callable[[], int], folder: Path, log: Path, cpu_seconds: float) -> int | None:
    """Do something in a fork, in a folder, with what it says kept in a log; return its exit status, None where late.

    Late is what took more processor time than it may, or waited `SLACK` times as long.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if not child:
        _child(act, folder, log, cpu_seconds)
    ends = time.monotonic() + SLACK * cpu_seconds
    try:
        while True:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                code = os.waitstatus_to_exitcode(status)
                return None if code in TOOK_TOO_LONG else code
            if time.monotonic() > ends:
                return None
            time.sleep(0.02)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # and what it started
        with contextlib.suppress(ChildProcessError):
            os.waitpid(child, 0)


def _child(act: Callable[[], int], folder: Path, log: Path, cpu_seconds: float) -> None:
    code = 3
    try:
        os.setsid()
        os.chdir(folder)
        said = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(said, 1)
        os.dup2(said, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (int(cpu_seconds) + 1, int(cpu_seconds) + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
        code = int(act())
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
