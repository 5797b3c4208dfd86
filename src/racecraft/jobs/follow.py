"""A job's log: its last words, and all of it as it grows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

LAST_BYTES = 4096
ERROR_PREFIX = "racecraft: "
"""What a command of ours says before why it ends."""
LOOK_SECONDS = 0.1
MAX_WORDS = 1024
"""Letters of a failure's reason, as at SageMaker."""


def last_words(log: Path) -> str:
    """Return the last paragraph that was said, for the reason of a failure; "" where nothing was.

    Of a traceback it is the error and what was noted behind it.
    """
    try:
        with open(log, "rb") as file:
            file.seek(max(0, log.stat().st_size - LAST_BYTES))
            lines = file.read().decode("utf-8", "replace").strip().splitlines()
    except OSError:
        return ""
    letters = [at for at, line in enumerate(lines) if line.startswith((ERROR_PREFIX, "Traceback "))]
    if letters and lines[letters[-1]].startswith("Traceback "):
        trace = lines[letters[-1] + 1 :]
        error = next((at for at, line in enumerate(trace) if line and not line.startswith(" ")), len(trace) - 1)
        return " ".join(trace[error:])[:MAX_WORDS]
    return " ".join(lines[letters[-1] :] if letters else lines[-1:])[:MAX_WORDS]


def last_error(log: Path) -> str:
    """Return the error message that a job ended with; "" where it ended otherwise."""
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").rstrip().splitlines()
    except OSError:
        return ""
    begins = [at for at, line in enumerate(lines) if line.startswith((ERROR_PREFIX, "Traceback "))]
    if not begins or not lines[begins[-1]].startswith(ERROR_PREFIX):
        return ""
    return "\n".join(lines[begins[-1] :]).removeprefix(ERROR_PREFIX)


def follow(log: Path, ended: Callable[[], bool], look_seconds: float = LOOK_SECONDS) -> Iterator[str]:
    """Yield what is said, as it is said, until the job has ended and all was told.

    Args:
        log: Where it is written; it need not exist yet.
        ended: Tells whether nothing more will come.
        look_seconds: How often it is looked.
    """
    at, rest = 0, b""
    while True:
        over = ended()  # asked before reading: what was written until then is read
        if log.exists():
            with open(log, "rb") as file:
                file.seek(at)
                new = file.read()
            at += len(new)
            whole, line_end, rest = (rest + new).rpartition(b"\n")
            if line_end:
                yield (whole + line_end).decode("utf-8", "replace")
        if over:
            if rest:
                yield rest.decode("utf-8", "replace")
            return
        time.sleep(look_seconds)
