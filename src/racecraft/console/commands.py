"""Run a command of racecraft's and read what it prints as JSON: the console does nothing that no command does."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.contract.loading import CONFINED, refuses_own_code

PATIENCE_SECONDS = 600.0


class CommandError(UserInputError):
    """A command could not do what was asked; the message is its own."""

    kind = ""
    """Name of the error's class in the command."""


def run_command(words: Sequence[str], folder: Path) -> dict[str, Any]:
    """Return what a command prints with --json.

    Args:
        words: Behind `racecraft`.
        folder: Where it is typed.

    Raises:
        CommandError: It ended with an error, or took too long.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-m", "racecraft", *words, "--json"],
            cwd=folder, env=_environment(), capture_output=True, text=True, timeout=PATIENCE_SECONDS,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise CommandError(
            "racecraft {words}: not done after {patience_seconds:g} s; expected less.",
            words=words[0],
            patience_seconds=PATIENCE_SECONDS,
        ) from None
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    result = json.loads(lines[-1]) if lines else {}
    if done.returncode != 0:
        error = result.get("error")
        told = error if isinstance(error, dict) else {}
        last = done.stderr.strip().splitlines()[-1:] or [f"ended with code {done.returncode}"]
        refused = CommandError(str(told.get("message") or last[0].removeprefix("racecraft: ")))
        refused.kind = str(told.get("kind", ""))
        raise refused
    return dict(result)


def _environment() -> dict[str, str]:
    return {**os.environ, **CONFINED} if refuses_own_code.get() else dict(os.environ)
