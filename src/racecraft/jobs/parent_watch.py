"""End a job's process with its supervisor. Begin with `exit_with_parent`; `children.py` has the other end.

The supervisor holds one end of a pipe and writes nothing. When it is gone, however it went, the system closes that end;
the job's process reads the end of the file and ends itself and whatever it has started. A training then stands as after
any kill, at its last whole iteration, and whoever takes up the job goes on from there.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

VARIABLE = "RACECRAFT_LIFELINE"
"""Set to "1" where standard input is such a pipe."""


def exit_with_parent() -> None:
    """Take standard input as the lifeline, where a supervisor says that it is one; does nothing elsewhere."""
    if os.environ.pop(VARIABLE, "") != "1":
        return
    line = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)  # the job's own input is empty
    os.close(nothing)
    threading.Thread(target=_wait, args=(line,), name="lifeline", daemon=True).start()


def _wait(line: int) -> None:
    while os.read(line, 1):
        pass
    if sys.platform == "win32":
        os._exit(1)
    os.killpg(os.getpgid(0), signal.SIGKILL)
