"""What judging models on fresh starts came to, kept as files of the workspace. Begin with `begin_judging`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from racecraft.console.service import Console
from racecraft.formats.atomic import make_folder, write_atomic

FOLDER = "verdicts"
JUDGING = "Judging on fresh starts"


def begin_judging(console: Console, model: str, words: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Begin a command that judges models; its result is kept.

    Args:
        console: Whose.
        model: Whose pages tell of it.
        words: Behind `racecraft`.
        rows: The models' rows.
    """
    file = _file(console, words[0], rows)

    def keep(result: dict[str, Any]) -> None:
        make_folder(file.parent)
        write_atomic(file, json.dumps(result, indent=2) + "\n")

    console.tasks.begin(model, JUDGING, words, console.workspace.path, keep)


def kept_verdict(console: Console, command: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """Return what a command came to for these models as they are now; None where it did not judge them."""
    try:
        verdict = json.loads(_file(console, command, rows).read_text(encoding="utf-8"))
        return dict(verdict)
    except (OSError, ValueError):
        return None


def _file(console: Console, command: str, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Return where the verdict of these runs, at their iterations, is kept."""
    runs = json.dumps([command, sorted((row["run"], row["iterations"]) for row in rows)])
    return console.workspace.path / FOLDER / f"{hashlib.sha256(runs.encode()).hexdigest()[:16]}.json"
