"""The checkpoints of a run, each with what its evaluation came to, in order of merit.

Begin with `ranked`; `find_checkpoint` hears every word that a checkpoint can be called by: best, last, an iteration, or
what it is the first in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import RunFolderError, SettingError, nearest
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.checkpoint import BEST, LAST, CheckpointEntry, Checkpoints
from racecraft.formats.json_text import parse_json
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.tensor_file import CheckpointError
from racecraft.formats.user_file import read_regular


@dataclass(frozen=True)
class RankedCheckpoint:
    """A checkpoint and its merits; None where its evaluation does not tell."""

    entry: CheckpointEntry
    score: float | None
    """What the evaluation gave it: mean progress in per cent for cars, mean return or rating elsewhere."""
    reward: float | None
    """Mean sum of rewards: of its evaluation where the reward function was asked there, else of the episodes driven
    just before it."""
    best_lap_seconds: float | None
    """Simulated seconds of its fastest full lap."""
    mean_lap_seconds: float | None
    """Mean of its full laps."""
    worst_progress_percent: float | None
    """Progress from the start it did worst from."""
    lap_spread_seconds: float | None
    """Slowest full lap less the fastest; None unless every start brought one."""


MERITS: dict[str, tuple[str, Callable[[RankedCheckpoint], tuple[float, ...]]]] = {
    "progress": (
        "mean progress, or score; of equals the faster",
        lambda one: (_high(one.score), _low(one.best_lap_seconds)),
    ),
    "reward": ("mean reward; of equals the faster", lambda one: (_high(one.reward), _low(one.best_lap_seconds))),
    "laptime": ("fastest full lap", lambda one: (_low(one.best_lap_seconds), _high(one.score))),
    "steadiness": (
        "progress from the worst start; where all lap, the spread between laps",
        lambda one: (_high(one.worst_progress_percent), _low(one.lap_spread_seconds), _low(one.best_lap_seconds)),
    ),
}
"""What checkpoints are ranked by: in words, and the numbers that are compared, bigger is better."""


def ranked(run: RunFolder, by: str = "progress") -> list[RankedCheckpoint]:
    """Return the checkpoints that were evaluated, the best first; those that were not stand behind, the newest first.

    Raises:
        SettingError: There is no such merit.
        CheckpointError: The index is damaged.
        RunFolderError: The metrics are damaged.
    """
    if by not in MERITS:
        raise SettingError("--by {by!r}: is nothing checkpoints are ranked by. {hint}", by=by, hint=nearest(by, MERITS))
    rewards = {row["iteration"]: row.get("mean_reward") for row in run.read_metrics()}
    found = [_with_merits(run, entry, rewards) for entry in Checkpoints(run.checkpoints).entries()]
    merit = MERITS[by][1]
    return sorted(found, key=lambda one: (one.score is not None, merit(one), one.entry.iteration), reverse=True)


def is_checkpoint_name(word: str) -> bool:
    """Tell whether a word behind a run's colon names a checkpoint.

    >>> [is_checkpoint_name(word) for word in ("best", "12", "laptime", "fast-car")]
    [True, True, True, False]
    """
    return word in (BEST, LAST, *MERITS) or word.isdigit()


def split_source(source: str) -> tuple[str, str]:
    """Return (run folder, checkpoint) of "RUN[:best|last|N|laptime …]".

    >>> split_source("runs/oval-1:last"), split_source("runs/oval-1"), split_source("oval-1:laptime")
    (('runs/oval-1', 'last'), ('runs/oval-1', 'best'), ('oval-1', 'laptime'))
    """
    path, colon, which = source.rpartition(":")
    if colon and is_checkpoint_name(which):
        return path, which
    return source, BEST


def find_checkpoint(run: RunFolder, which: str) -> CheckpointEntry:
    """Return the checkpoint that a word names: best, last, an iteration, or the first by one of `MERITS`.

    Raises:
        CheckpointError: There is no such checkpoint, none has that merit, or the index is damaged.
        RunFolderError: The metrics are damaged.
    """
    if which not in MERITS:
        return Checkpoints(run.checkpoints).find(which)
    first = ranked(run, which)[:1]
    if not first or MERITS[which][1](first[0])[0] == -math.inf:
        raise CheckpointError(
            run.checkpoints,
            Message("no checkpoint has what '{which}' asks for ({merits})", which=which, merits=MERITS[which][0]),
            "an evaluation that tells it",
            Message("racecraft checkpoints {path} shows what is known of each.", path=run.path),
        )
    return first[0].entry


def load_weights(run: RunFolder, which: str) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return weights and card of the checkpoint that a word names. Errors are those of `find_checkpoint`."""
    return Checkpoints(run.checkpoints).load_policy(str(find_checkpoint(run, which).iteration))


def _with_merits(run: RunFolder, entry: CheckpointEntry, rewards: Mapping[int, float | None]) -> RankedCheckpoint:
    laps = _laps_of(run, entry.iteration)
    full = [lap["seconds"] for lap in laps if lap.get("seconds") is not None]
    paid = [lap["reward"] for lap in laps if lap.get("reward") is not None]
    return RankedCheckpoint(
        entry,
        entry.score,
        sum(paid) / len(paid) if paid else rewards.get(entry.iteration),
        min(full, default=None),
        sum(full) / len(full) if full else None,
        min((lap["progress_percent"] for lap in laps), default=None),
        max(full) - min(full) if full and len(full) == len(laps) else None,
    )


def _laps_of(run: RunFolder, iteration: int) -> list[dict[str, Any]]:
    """Return the laps of an iteration's evaluation; none where it had none or is no car's."""
    path = run.evaluations / f"{iteration}.json"
    try:
        laps = parse_json(read_regular(path)).get("laps", [])
        return [dict(lap) for lap in laps if "progress_percent" in lap]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise RunFolderError(
            "{path}: damaged ({error}); expected what racecraft wrote. Take it away.", path=path, error=error
        ) from error


def _high(value: float | None) -> float:
    return -math.inf if value is None else value


def _low(value: float | None) -> float:
    return -math.inf if value is None else -value
