"""Show from recorded races whether this is the same car."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.replay_report import ReplayReport


@dataclass(frozen=True, kw_only=True)
class ReplayRequest(Request):
    """Which recordings are compared with which car, and what is written."""

    traces: tuple[Path, ...] = argument(
        "Simulation traces (.csv) or logs, archives (.tar.gz) or folders of them.", metavar="LOG…"
    )
    track: str | None = option(None, "The track they were driven on, or its waypoint file; by default it is found.")
    car: str | None = option(
        None, "v4, v5-classic, v6, v6-unlimited or kinematic; by default whichever of the first three was recorded."
    )
    picture: Path | None = option(None, "Draw the longest recorded episode and our car's attempts into this PNG.")
    page: Path | None = option(None, "Write everything on one self-contained page (.html).", "--report")


@dataclass(frozen=True)
class Replayed:
    """How far the recorded races and ours agree, and what was written."""

    report: ReplayReport
    figures: Figures

    @property
    def answer(self) -> str:
        """The answer in a sentence."""
        from racecraft.worlds.deepracer.analysis.replay_page import answer

        return answer(dict(self.figures))

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name."""
        return self.figures.as_dictionary()


@action
def replay(request: ReplayRequest, progress: Progress = quiet) -> Replayed:
    """Tell and drive recorded races again: what does our track say of their poses, where does our car stray?

    Examples:

        racecraft replay my-old-logs --track reinvent_base --report same-car.html

        racecraft replay model.tar.gz

        racecraft replay my-model/training-simtrace --track reinvent_base.npy --car v4 --picture replay.png
    """
    from racecraft.worlds.deepracer.analysis.replay_page import write_replay_page
    from racecraft.worlds.deepracer.evaluation.replay_picture import draw_replay, replay_figure
    from racecraft.worlds.deepracer.evaluation.replay_report import replay as replay_traces

    report = replay_traces(request.traces, request.track or _found_track(request.traces), request.car)
    facts = report.as_dictionary()
    for clause in facts["damaged_rows"]:
        progress(clause)
    files: dict[str, Path] = {}
    if request.picture is not None:
        draw_replay(report, request.picture)
        files["picture"] = request.picture
    if request.page is not None:
        write_replay_page(request.page, facts, replay_figure(report), report.errors_m())
        files["report"] = request.page
    return Replayed(report, Figures(facts, files))


def _found_track(paths: tuple[Path, ...]) -> str:
    """Return the name of the track that logs were driven on."""
    from racecraft.worlds.deepracer.analysis.logs import circuit_of
    from racecraft.worlds.deepracer.logs import read

    return circuit_of(read(paths)).name
