"""What a pupil did, kept in one JSON file of the account. Begin with `Progress`."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.user_folder import data_folder
from racecraft.lessons.checking import Verdict

VERSION = 1
DONE = ("passed", "seen")
_RANK = {"tried": 0, "run": 1, "seen": 2, "passed": 2}


class Progress:
    """Which exercises were tried, seen and passed.

    A file that is missing or cannot be read counts as an empty one: nobody loses a lesson for a damaged file.

    Args:
        path: Of the file; None: `lessons.json` in the account's data folder.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path or data_folder() / "lessons.json"
        self._lock = threading.Lock()

    def of(self, lesson: str) -> dict[str, dict[str, Any]]:
        """Return what was done in a lesson: by exercise its "state", "tries" and, of a prediction, "prediction"."""
        found = self._read().get(lesson, {})
        return found if isinstance(found, dict) else {}

    def done(self, lesson: str) -> int:
        """Return how many exercises of a lesson are passed or seen."""
        return sum(one.get("state") in DONE for one in self.of(lesson).values())

    def add(self, lesson: str, exercise: str, verdict: Verdict, prediction: Mapping[str, Any] | None = None) -> int:
        """Keep what a check said; return how often the exercise was tried.

        A passed exercise stays passed, and the first prediction stays the prediction.

        Raises:
            OutputFileError: The file cannot be written.
        """
        with self._lock:
            progress = self._read()
            row = progress.setdefault(lesson, {}).setdefault(exercise, {"state": "tried", "tries": 0})
            row["tries"] += 1
            if _RANK[verdict.state] >= _RANK.get(row["state"], 0):
                row["state"] = verdict.state
            if prediction is not None:
                row.setdefault("prediction", dict(prediction))
            self._write(progress)
            return int(row["tries"])

    def clear(self, lesson: str) -> None:
        """Begin a lesson anew."""
        with self._lock:
            progress = self._read()
            progress.pop(lesson, None)
            self._write(progress)

    def _write(self, progress: Mapping[str, Any]) -> None:
        make_folder(self.path.parent)
        write_atomic(self.path, json.dumps({"format": "racecraft lessons", "version": VERSION, "lessons": progress}))

    def _read(self) -> dict[str, Any]:
        with contextlib.suppress(OSError, ValueError):
            progress = json.loads(self.path.read_text("utf-8"))
            if isinstance(progress, dict) and isinstance(progress.get("lessons"), dict):
                return dict(progress["lessons"])
        return {}
