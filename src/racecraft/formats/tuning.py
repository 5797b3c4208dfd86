"""What a search for settings tried, as a JSON file: `tuning.json`, version 1. Begin with `TuningRecord`.

{
"format": "racecraft tuning", "version": 1,
"command": ["gym", "train", "CartPole-v1", "--stop=minutes=1"],
"objective": "evaluation_score", "maximise": true, "take_last": false,
"importances": {"ppo.epochs": 0.7, …},
"trials": [{"number": 0, "values": {…}, "state": "complete", "score": 67.0, "seconds": 31.9, "note": "",
 "taken_from": ""}, …]
}
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular

FILE = "tuning.json"
FORMAT, VERSION = "racecraft tuning", 1
COMPLETE, PRUNED, FAILED, RUNNING = "complete", "pruned", "failed", "running"
"""States of a trial."""


@dataclass(frozen=True)
class TrialRecord:
    """One trial as it stands."""

    number: int
    """Counted from 0."""
    values: Mapping[str, Any]
    """What was tried, by parameter."""
    state: str
    """COMPLETE, PRUNED, FAILED or RUNNING."""
    score: float | None
    """What came of it; of a pruned one, what was last seen; None: nothing yet."""
    seconds: float | None
    """From its beginning to its end; None while it runs."""
    note: str = ""
    """Why it failed."""
    taken_from: str = ""
    """SEARCH/NUMBER of the earlier trial that it is; "": this search tried it."""

    @property
    def is_done(self) -> bool:
        """Whether it came to its end with a score."""
        return self.state == COMPLETE and self.score is not None


@dataclass(frozen=True)
class TuningRecord:
    """A search as it stands."""

    command: Sequence[str]
    """What each trial trains, behind `racecraft`."""
    objective: str
    """A column of metrics.jsonl, or a regular expression over the log."""
    maximise: bool
    take_last: bool
    """Whether the last figure of a trial counts; else its best."""
    trials: Sequence[TrialRecord]
    importances: Mapping[str, float]
    """How much each parameter decides, shares of 1; {}: too little was tried."""

    @property
    def best(self) -> TrialRecord | None:
        """The best trial that is done; None without one."""
        return best_of(self.trials, self.maximise)

    @property
    def done(self) -> list[TrialRecord]:
        """The trials that came to their end with a score."""
        return [one for one in self.trials if one.is_done]

    @property
    def best_so_far(self) -> tuple[list[int], list[float], list[float]]:
        """Of each trial that is done its number, its score, and the best score up to it."""
        scores = [float(one.score or 0.0) for one in self.done]
        better = max if self.maximise else min
        return [one.number for one in self.done], scores, list(accumulate(scores, better))

    @property
    def shares(self) -> list[tuple[str, str, float]]:
        """What each parameter decides, the largest first: its name, the share in words, the share."""
        found = sorted(self.importances.items(), key=lambda pair: -pair[1])
        return [(name, f"{100 * share:.0f} %", share) for name, share in found]


def best_of(trials: Sequence[TrialRecord], maximise: bool) -> TrialRecord | None:
    """Return the best trial that is done; of equals the first; None without one."""
    sign = 1.0 if maximise else -1.0
    done = [one for one in trials if one.is_done]
    return max(done, key=lambda one: (sign * float(one.score or 0.0), -one.number), default=None)


def write_tuning(path: str | Path, record: TuningRecord) -> None:
    """Write the file.

    Raises:
        OutputFileError: It cannot be written.
    """
    document = {"format": FORMAT, "version": VERSION, **vars(record), "command": list(record.command)}
    document["trials"] = [{**vars(one), "values": dict(one.values)} for one in record.trials]
    write_atomic(path, json.dumps(document, indent=2) + "\n")


def read_tuning(folder: Path) -> TuningRecord | None:
    """Return the record in a search's folder; None where no trial has ended yet.

    Raises:
        InputFileError: The file is no such record.
    """
    path = folder / FILE
    if not path.is_file():
        return None
    try:
        told = parse_json(read_regular(path))
        if (told.pop("format"), told.pop("version")) != (FORMAT, VERSION):
            raise ValueError("another format or version")
        told["trials"] = [TrialRecord(**one) for one in told["trials"]]
        return TuningRecord(**told)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputFileError(path, str(error), f"what `racecraft tune` writes, version {VERSION}") from error
