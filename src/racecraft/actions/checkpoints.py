"""List the checkpoints of a run in order of merit, and take away those that are not worth their room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.contract.progress import Progress, quiet
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.formats.checkpoint_ranking import RankedCheckpoint


@dataclass(frozen=True, kw_only=True)
class CheckpointsRequest(Request):
    """Which checkpoints are listed, by what, and which stay."""

    run: str = argument(f"{RUN_HELP} With a checkpoint, that one alone.", metavar="RUN[:which]")
    by: str = option("progress", "progress, reward, laptime or steadiness.")
    most: int | None = option(None, "Show so many of the best.", low=1)
    keep: str | None = option(
        None, "Take all others away for good: best,last or best,last,N (N more, spread out).", metavar="KEPT"
    )


@dataclass(frozen=True)
class CheckpointRow:
    """A checkpoint, and what its evaluation came to; None where it has no such figure."""

    iteration: int
    steps: int
    called: list[str]
    """Names that a user may type for it: "best", "last"."""
    score: float | None
    reward: float | None
    best_lap_seconds: float | None
    mean_lap_seconds: float | None
    worst_progress_percent: float | None
    lap_spread_seconds: float | None


@dataclass(frozen=True)
class CheckpointList:
    """Checkpoints of a run, the best first."""

    run: str
    by: str
    checkpoints: list[CheckpointRow]
    freed_bytes: int | None = None
    """What taking others away freed; None: nothing was to be taken away."""

    @property
    def merit(self) -> str:
        """What they are ordered by, in words."""
        from racecraft.formats.checkpoint_ranking import MERITS

        return MERITS[self.by][0]


@action
def checkpoints(request: CheckpointsRequest, progress: Progress = quiet) -> CheckpointList:
    """List every checkpoint that is kept, the best first, with what its evaluation came to.

    Any of them can be begun with, judged or handed on: --from RUN:N, --checkpoint N; a merit in place of N names the
    first by it: --from RUN:laptime. How many a training keeps says its own --keep; here it says how many stay.

    Examples:

        racecraft checkpoints runs/reinvent_base-1 --by laptime

        racecraft checkpoints runs/reinvent_base-1 --keep best,last,10

        racecraft train --from runs/reinvent_base-1:laptime --track Oval_track

    Raises:
        UserInputError: There is no such run, checkpoint or merit, or it trains while checkpoints are to be taken away.
    """
    from racecraft.formats.checkpoint_ranking import find_checkpoint, ranked

    path, which = named_run(request.run)
    folder = RunFolder.open(path)
    freed = None if request.keep is None else _prune(folder, request.keep)
    found = ranked(folder, request.by)
    if which is not None:
        iteration = find_checkpoint(folder, which).iteration
        found = [one for one in found if one.entry.iteration == iteration]
    names = _names(folder)
    rows = [_row(one, names.get(one.entry.iteration, [])) for one in found[: request.most]]
    return CheckpointList(request.run, request.by, rows, freed)


def _prune(folder: RunFolder, keep: str) -> int:
    """Take checkpoints away; return the bytes that are free now."""
    from racecraft.formats.checkpoint import Checkpoints
    from racecraft.training.settings import kept_count

    count = kept_count(keep)
    with folder.lock():
        return Checkpoints(folder.checkpoints, keep_count=count).prune()


def _names(folder: RunFolder) -> dict[int, list[str]]:
    """Return by iteration which checkpoint is called the best, and which the last."""
    from racecraft.formats.checkpoint import Checkpoints
    from racecraft.formats.tensor_file import CheckpointError

    kept, names = Checkpoints(folder.checkpoints), dict[int, list[str]]()
    for name in ("best", "last"):
        try:
            names.setdefault(kept.find(name).iteration, []).append(name)
        except CheckpointError:
            continue  # there is none yet
    return names


def _row(one: RankedCheckpoint, called: list[str]) -> CheckpointRow:
    return CheckpointRow(
        one.entry.iteration, one.entry.steps, called, one.score, one.reward, one.best_lap_seconds,
        one.mean_lap_seconds, one.worst_progress_percent, one.lap_spread_seconds,
    )  # fmt: skip
