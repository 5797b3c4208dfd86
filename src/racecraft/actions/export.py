"""Hand a trained policy over to another program, or to a car."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kind import load
from racecraft.contract.kinds import find_kind, kinds
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.export.exported import Exported

TARGETS = tuple(name for kind in kinds() for name in kind.exporters)
"""What the exporters of all installed worlds write for."""


@dataclass(frozen=True, kw_only=True)
class ExportRequest(Request):
    """Which checkpoint is exported for whom."""

    run: str = argument(RUN_HELP, metavar="RUN[:which]")
    to: str = option(MISSING, f"Whom it is for: {', '.join(TARGETS)}.")
    checkpoint: str | None = option(
        None, "best, last, an iteration's number, or a merit such as laptime; by default the best."
    )
    output: Path | None = option(None, "A file, or a folder; by default in RUN/export.")
    check: bool = option(True, "Ask checkpoint and exported file side by side before writing.")


@dataclass(frozen=True)
class ExportedRun:
    """What was written."""

    run: Path
    to: str
    exported: Exported

    def as_dictionary(self) -> dict[str, Any]:
        """Return run, target and what the exporter tells."""
        return {"run": self.run, "to": self.to, **self.exported.figures}


@action
def export_run(request: ExportRequest, progress: Progress = quiet) -> ExportedRun:
    """Write a trained policy as a file that another program loads, and check that it acts alike.

    Examples:

        racecraft export runs/Basic-1 --to unity

        racecraft export runs/reinvent_base-1 --to car

        racecraft export runs/aws-1 --to drfc --output bucket/rl-deepracer-mine

        racecraft export runs/reinvent_base-1:laptime --to onnx --output policy.onnx
    """
    if request.to not in TARGETS:
        raise SettingError("--to {to!r} is not known. {hint}", to=request.to, hint=nearest(request.to, TARGETS))
    run, which = named_run(request.run, request.checkpoint)
    exported = load(_exporter(run, request.to))(run, request.to, which, request.output, request.check)
    return ExportedRun(run, request.to, exported)


def _exporter(run: Path, to: str) -> str:
    """Return the exporter of that name which the run's own world has; another program's model is read by the first.

    Raises:
        SettingError: The run's world has none of that name.
    """
    from racecraft.formats.run_folder import JOB, RunFolder

    found = {kind.name: kind.exporters[to] for kind in kinds() if to in kind.exporters}
    if not (run / JOB).is_file():
        return next(iter(found.values()))
    kind = find_kind(str(RunFolder.open(run).read_job().get("kind")))
    if kind.name not in found:
        own = f"Export it with --to {' or '.join(kind.exporters)}." if kind.exporters else kind.export_instead
        raise SettingError(
            "--to {to}: the run is one of `{command}`; expected one of {titles}. {own}",
            to=to, command=kind.train_command, titles=" or ".join(find_kind(name).title for name in found), own=own,
        )  # fmt: skip
    return found[kind.name]
