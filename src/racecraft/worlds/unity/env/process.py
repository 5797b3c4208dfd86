"""The player's process: started in a group of its own, watched, its log read, the whole group ended.

Begin at `PlayerProcess`. Unity players start helpers (crash handlers) and may ignore polite requests, so `close` asks,
insists, and then ends the whole group; it never leaves a process behind, and closing twice is closing once. A player
whose *owner* is killed outright notices by itself, because its pending call breaks.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.formats.processes import kill_tree, signal_group
from racecraft.worlds.unity.env.errors import BuildError, PlayerDiedError

LOG_TAIL_LINES = 20


class PlayerProcess:
    """One running player.

    Args:
        command: The program and its arguments.
        log_folder: Where the player's output and `Player.log` go; None for a folder that `close` takes away.
        unity_log: Whether to add `-logFile`, which Unity players understand, unless `command` has it already.
        environment: Variables added to this process's own.

    Raises:
        BuildError: The program cannot be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        log_folder: str | Path | None = None,
        unity_log: bool = True,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._own_folder = Path(tempfile.mkdtemp(prefix="racecraft-unity-")) if log_folder is None else None
        folder = self._own_folder or Path(str(log_folder)).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        self.command = list(command)
        self.log_files = _logfiles_of(self.command)
        if unity_log and "-logfile" not in map(str.lower, self.command):
            self.log_files = [_unused(folder, "Player", ".log")]
            self.command += ["-logFile", str(self.log_files[0])]
        self.output_file = _unused(folder, "output", ".txt")
        try:
            with open(self.output_file, "wb") as output:
                self._process = subprocess.Popen(
                    self.command,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    env={**os.environ, **(environment or {})},
                    **_IN_A_GROUP,
                )
        except OSError as cause:
            self._drop_folder()
            raise BuildError(
                "{command}: cannot be started ({cause}). {start_cure}",
                command=self.command[0],
                cause=cause,
                start_cure=_start_cure(cause),
            ) from cause
        self._closed = False

    @property
    def pid(self) -> int:
        """The player's process id."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """The exit code, negative for a signal; None while the player runs."""
        return self._process.poll()

    def wait_for_end(self, seconds: float) -> None:
        """Give a player that is probably dying so long to do so."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)

    def require_alive(self) -> None:
        """Raise `PlayerDiedError`, with the tail of its log, if the player has ended.

        A launcher that went well and left the player running is no death.
        """
        code = self.exit_code
        if code is not None and not (code == 0 and self._group_lives()):
            raise PlayerDiedError(
                "the player ended by itself with {describe_exit}: {command}\n{log_tail}",
                describe_exit=_describe_exit(code),
                command=self.command[0],
                log_tail=self.log_tail(),
            )

    def log_tail(self, lines: int = LOG_TAIL_LINES) -> str:
        """Return the last lines of what the player wrote, for an error message."""
        tail = []
        for path in [*self.log_files, self.output_file]:
            text = _last_lines(path, lines)
            if text:
                tail.append(f"--- the end of {path.name} ---\n{text}")
        return "\n".join(tail) or "It wrote nothing to its log."

    def close(self, patience_seconds: float = 5.0) -> None:
        """Wait for the player to leave, then make it: politely, then at once, with everything it started.

        Args:
            patience_seconds: How long a player that was told goodbye may take to leave.
        """
        if self._closed:
            return
        self._closed = True
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(patience_seconds)
        if self.exit_code is None and sys.platform != "win32":
            signal_group(self.pid, signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)
        kill_tree(self.pid)  # the player, and helpers that outlived it
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        self._drop_folder()

    def _group_lives(self) -> bool:
        return sys.platform != "win32" and signal_group(self.pid, 0)

    def _drop_folder(self) -> None:
        if self._own_folder is not None:
            shutil.rmtree(self._own_folder, ignore_errors=True)


_IN_A_GROUP: dict[str, Any] = (
    {"creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)}
    if sys.platform == "win32"
    else {"start_new_session": True}
)


def wait_until_gone(pid: int, timeout_seconds: float = 5.0) -> bool:
    """Tell whether a process group is gone, waiting for it a little (POSIX)."""
    end = time.monotonic() + timeout_seconds
    while time.monotonic() < end:
        if not signal_group(pid, 0):
            return True
        time.sleep(0.02)
    return False


def _logfiles_of(command: list[str]) -> list[Path]:
    """The log file that the user's own arguments name, if any; `-` is what the player prints."""
    pairs = zip(command, command[1:], strict=False)
    return [Path(value).absolute() for flag, value in pairs if flag.lower() == "-logfile" and value != "-"]


def _unused(folder: Path, stem: str, suffix: str) -> Path:
    """A file name in the folder that nothing has yet: players side by side share a log folder."""
    number = 0
    while True:
        path = folder / f"{stem}-{number}{suffix}"
        with contextlib.suppress(FileExistsError):
            path.touch(exist_ok=False)
            return path
        number += 1


def _last_lines(path: Path, lines: int) -> str:
    try:
        with open(path, "rb") as file:
            file.seek(0, os.SEEK_END)
            file.seek(max(0, file.tell() - 16_384))
            text = file.read().decode(errors="replace")
    except OSError:
        return ""
    return "\n".join(text.strip().splitlines()[-lines:])


def _describe_exit(code: int) -> str:
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"signal {signal.Signals(-code).name}"
    except ValueError:
        return f"signal {-code}"


def _start_cure(cause: OSError) -> str:
    if isinstance(cause, PermissionError):
        return "It is not executable: chmod 755 it, or give the folder or zip that holds the whole build."
    return "A build for this operating system and processor is needed."
