"""A process that is ready for a training before it is asked for: `announce_job` for one, `keep_warm` for any.

Half of what a training takes to its first tick is imports, and they are the same for every car. So a command that is
about to put one into the store says so before anything else:

    the command       `announce_job` notes beside the store that a job comes, and wakes the supervisor
    the supervisor    `PreloadedProcess` imports and waits; it is ended where the command ends without a job
    that process      `await_words` is told its words, and goes on as the process of any job

Whoever lives long and will bring trainings, as the console does, asks for a warm worker instead (`keep_warm`): the
supervisor then always has a process that has imported, has trained once (`WorldKind.warm_up`) and waits. It takes
memory and no core.

Nothing depends on it: where no process waits, or one that would not be the same as a new one, a new one is started.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_lock import holder_of
from racecraft.jobs import parent_watch
from racecraft.jobs.children import Child, apart, current_args, variables
from racecraft.jobs.job_paths import JobPaths

VARIABLE = "RACECRAFT_SPARE"
"""Set for a process that is to wait for its words: "1", or WARM for one that trains once before."""
WARM = "warm"
READY = b"ready\n"
"""What a warm worker says when it waits."""
NOTE = "coming.json"
"""The file in the folder of jobs that tells who will bring one."""
WARM_NOTE = "warm.json"
"""The file there that tells who wants a worker kept warm."""
PATIENCE_SECONDS = 20.0
"""A command that has not brought its job by then brings it to an interpreter of its own."""
OWN_VARIABLES = "DR_"
"""Variables whose names begin so are read by the job itself; any other may have been read by what was imported."""


@contextlib.contextmanager
def announce_job(home: JobPaths) -> Iterator[None]:
    """Say that this process is about to put a car's training into the store; taken back at the end.

    Raises:
        OSError, OutputFileError: The folder of jobs cannot be written.
    """
    from racecraft.jobs.supervisor_start import ensure_supervisor

    note = home.path / NOTE
    home.path.mkdir(parents=True, exist_ok=True)
    note.write_text(json.dumps({"pid": os.getpid()}), encoding="utf-8")
    try:
        ensure_supervisor(home)
        yield
    finally:
        withdraw(home)


def withdraw(home: JobPaths) -> None:
    """Take back what this process has announced: its job is in the store, or there will be none."""
    note = home.path / NOTE
    if holder_of(note) == os.getpid():
        note.unlink(missing_ok=True)


def is_awaited(home: JobPaths) -> bool:
    """Tell whether somebody who lives has announced a job, and has not brought it yet."""
    note = home.path / NOTE
    try:
        fresh = time.time() - note.stat().st_mtime < PATIENCE_SECONDS
    except OSError:
        return False
    return fresh and holder_of(note) is not None


@contextlib.contextmanager
def keep_warm(home: JobPaths) -> Iterator[None]:
    """Have a worker wait for trainings as long as this lasts, and as long as this process lives.

    Raises:
        OSError, OutputFileError: The folder of jobs cannot be written.
    """
    from racecraft.jobs.supervisor_start import ensure_supervisor

    home.path.mkdir(parents=True, exist_ok=True)
    note = home.path / WARM_NOTE
    note.write_text(json.dumps({"pid": os.getpid()}), encoding="utf-8")
    try:
        ensure_supervisor(home)
        yield
    finally:
        if holder_of(note) == os.getpid():
            note.unlink(missing_ok=True)


def is_kept_warm(home: JobPaths) -> bool:
    """Tell whether a living process wants a worker kept warm; never on Windows, whose pipes cannot be polled."""
    return sys.platform != "win32" and holder_of(home.path / WARM_NOTE) is not None


class PreloadedProcess:
    """A process that imports ahead and waits for its job's words.

    Args:
        home: Where the jobs are.
        warm: Whether it also trains once while it waits.

    Raises:
        OSError: It cannot be started.
    """

    def __init__(self, home: JobPaths, warm: bool = False) -> None:
        self.warm, self._said_ready = warm, False
        spare = WARM if warm else "1"
        self._born_with = {**os.environ, parent_watch.VARIABLE: "1", "PYTHONUNBUFFERED": "1", VARIABLE: spare}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "racecraft"],
            cwd=home.path,
            env=self._born_with,
            stdin=subprocess.PIPE,
            bufsize=0,  # nothing is left to be said to one that has ended
            stdout=subprocess.PIPE if warm else subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            **apart(),
        )

    @classmethod
    def if_awaited(cls, home: JobPaths) -> PreloadedProcess | None:
        """Return one where a job was announced; None where none was, or no process can be had."""
        with contextlib.suppress(OSError):
            return cls(home) if is_awaited(home) else None
        return None

    @property
    def is_ready(self) -> bool:
        """Whether it has done what it does before it waits; one that was announced is taken at once."""
        if self.warm and not self._said_ready:
            assert self._process.stdout is not None
            self._said_ready = bool(select.select([self._process.stdout], [], [], 0.0)[0])
        return not self.warm or self._said_ready

    @property
    def has_ended(self) -> bool:
        """Whether the process is gone, by itself or because somebody ended it."""
        return self._process.poll() is not None

    def assign(self, spec: JobSpec, log: Path) -> Child | None:
        """Have it be a job's process; None where a new one would be another, and a new one is needed.

        Args:
            spec: What is to be done.
            log: Where it says what it says.
        """
        message = {
            "words": current_args(spec),
            "folder": str(Path(spec.folder).absolute()),
            "environment": variables(spec),
            "log": str(log.absolute()),
        }
        if not (self.is_ready and self._would_be_the_same(spec, variables(spec))):
            return None
        assert self._process.stdin is not None
        try:
            log.open("ab").close()
            self._process.stdin.write(json.dumps(message).encode() + b"\n")
        except OSError:
            return None  # it has ended, or a new one would fail alike and say why
        self._close_output()
        return Child(self._process)

    def dismiss(self) -> None:
        """End it; whoever announced its job has none."""
        Child(self._process).end()
        self._close_output()

    def _close_output(self) -> None:
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _would_be_the_same(self, spec: JobSpec, wanted: Mapping[str, str]) -> bool:
        """Tell whether a job's own interpreter would have imported the same, and found its folder."""
        return (
            spec.python in ("", sys.executable)
            and Path(spec.folder).is_dir()
            and _read_by_libraries(wanted) == _read_by_libraries(self._born_with)
        )


def await_words(modules: Sequence[str], warm_ups: Iterable[Callable[[], Any]] = ()) -> None:
    """Import ahead, wait for a job's words, and become its process: its variables, its folder, its log, its words.

    Where standard input ends instead, there is no job, and this process ends.

    Args:
        modules: What the job will import.
        warm_ups: What a warm worker does while it waits.
    """
    is_warm = os.environ.pop(VARIABLE) == WARM
    for name in modules:
        with contextlib.suppress(Exception):  # the job meets it again, and its own log says what is missing
            importlib.import_module(name)
    for warm_up in warm_ups if is_warm else ():
        with contextlib.suppress(Exception):
            warm_up()
    if is_warm:
        os.write(1, READY)
    line = b""
    while not line.endswith(b"\n"):
        more = os.read(0, 1 << 16)
        if not more:
            os._exit(0)
        line += more
    message = json.loads(line)
    os.environ.clear()
    os.environ.update(message["environment"])
    if sys.path[:1] == [os.getcwd()]:  # where `python -m` looks first
        sys.path[0] = message["folder"]
    os.chdir(message["folder"])
    log = os.open(message["log"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    for output in (1, 2):
        os.dup2(log, output)
    os.close(log)
    sys.argv[1:] = message["words"]


def _read_by_libraries(variables: Mapping[str, str]) -> dict[str, str]:
    return {name: text for name, text in variables.items() if not name.startswith(OWN_VARIABLES) and name != VARIABLE}
