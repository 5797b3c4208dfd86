"""A program of its own that starts at once: forked from a process that has imported what takes time. Begin with `ran`.

`python -m racecraft` imports PyTorch and more for two seconds before it does anything. What only that start shows, such
as what is imported, or how the interpreter ends, has tests that start an interpreter.
"""

from __future__ import annotations

import multiprocessing
import os
import runpy
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(
    ["racecraft.cli.app", "racecraft.actions.training", "racecraft.worlds.battlesnake.training.trainer",
     "racecraft.worlds.deepracer.training.trainer", "racecraft.worlds.gymnasium.training.trainer", "torch"]
)  # fmt: skip


def ran(words: Sequence[str | Path], folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a folder to its end; return what `subprocess.run` would.

    Args:
        words: Of `racecraft …`, or a script that ends in .py and its arguments.
        folder: Where it runs.
        variables: Of its environment, beside ours of this moment.
    """
    with tempfile.TemporaryDirectory() as told:
        out, errors = Path(told, "out"), Path(told, "errors")
        arguments = ([str(word) for word in words], str(folder), {**os.environ, **variables}, str(out), str(errors))
        process = PROCESSES.Process(target=_be, args=arguments)
        process.start()
        process.join(300.0)
        if process.is_alive():
            process.kill()
            process.join()
        return subprocess.CompletedProcess(words, process.exitcode, out.read_text(), errors.read_text())


def run(command: Sequence[str | Path], *, env: Mapping[str, str], **_: object) -> subprocess.CompletedProcess[str]:
    """Stand where `subprocess.run` is given `python -m racecraft …`, in the folder of this moment."""
    assert command[:3] == [sys.executable, "-m", "racecraft"]
    return ran(command[3:], Path.cwd(), **env)


class Begun:
    """A program that goes on beside the test; used as `subprocess.Popen` with pipes of text for what it says."""

    def __init__(self, words: Sequence[str | Path], folder: Path, **variables: str) -> None:
        with tempfile.TemporaryDirectory() as told:
            pipes = [str(Path(told, name)) for name in ("out", "errors")]
            for pipe in pipes:
                os.mkfifo(pipe)
            arguments = ([str(word) for word in words], str(folder), {**os.environ, **variables}, *pipes)
            self._process = PROCESSES.Process(target=_be, args=arguments)
            self._process.start()
            self.stdout, self.stderr = (open(pipe, encoding="utf-8") for pipe in pipes)  # noqa: SIM115 - as Popen's

    def __enter__(self) -> Begun:
        return self

    def __exit__(self, *error: object) -> None:
        self.kill()
        self._process.join()
        self.stdout.close()
        self.stderr.close()

    @property
    def returncode(self) -> int | None:
        """Its exit code, or minus the signal that ended it; None while it runs."""
        return self._process.exitcode

    poll = returncode.fget

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        if self._process.pid and self.returncode is None:
            os.kill(self._process.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def wait(self, seconds: float) -> int | None:
        """Return its exit code as soon as it has ended; None where it has not by then."""
        self._process.join(seconds)
        return self.returncode

    def communicate(self, timeout: float) -> tuple[str, str]:
        """Return what else it said until it ended: standard output and errors, each less than a pipe holds."""
        self.wait(timeout)
        assert self.returncode is not None, f"it goes on after {timeout} s"
        return self.stdout.read(), self.stderr.read()


def _be(words: list[str], folder: str, environment: Mapping[str, str], out: str, errors: str) -> None:
    """Be the program in this process."""
    for stream, path in ((1, out), (2, errors)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), stream)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.path[:0] = [one for one in environment.get("PYTHONPATH", "").split(os.pathsep) if one not in sys.path]
    warnings.simplefilter(environment.get("PYTHONWARNINGS", "default"))
    sys.argv = words if words[0].endswith(".py") else ["racecraft", *words]
    if words[0].endswith(".py"):
        sys.path.insert(0, str(Path(words[0]).parent))
        runpy.run_path(words[0], run_name="__main__")
    else:
        runpy.run_module("racecraft", run_name="__main__", alter_sys=True)
