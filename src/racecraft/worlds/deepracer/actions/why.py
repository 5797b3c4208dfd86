"""Explain where a car fails, what went before, and what would have saved it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.named_run import RUN_HELP
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

PAGE = "why.html"


@dataclass(frozen=True, kw_only=True)
class WhyRequest(Request):
    """Which car drives from where, and the page that is written."""

    run: str = argument(RUN_HELP, metavar="RUN[:which]")
    starts: int = option(24, "Starts it drives from, evenly round the lap.", low=1, high=500)
    track: str | None = option(None, "Drive elsewhere: a name or a waypoint file.")
    checkpoints: int = option(8, "Compare so many of the run's checkpoints, place by place; 0: none.", low=0, high=100)
    page: Path | None = option(None, "The page (.html), facts beside it (.json); by default why.html in the run.")


class Explanation(Figures):
    """Where a car fails: figures, the page that was written, and what they say in sentences."""

    def __init__(self, figures: dict[str, Any], page: Path, sentences: list[str]) -> None:
        super().__init__(figures, {"page": page})
        self.sentences = tuple(sentences)


@action
def why(request: WhyRequest, progress: Progress = quiet) -> Explanation:
    """Explain where a car fails and what would have saved it: other actions are driven from the moments before.

    Examples:

        racecraft why runs/reinvent_base-1

        racecraft why runs/reinvent_base-1:last --starts 48 --page why.html

        racecraft why runs/reinvent_base-1 --track Oval_track --json
    """
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.analysis.comparing import compare_checkpoints, compare_starts
    from racecraft.worlds.deepracer.analysis.explaining import explain_failures
    from racecraft.worlds.deepracer.analysis.failure_places import facts, sentences
    from racecraft.worlds.deepracer.analysis.forgetting import passages_facts, passages_words, starts_words
    from racecraft.worlds.deepracer.analysis.why_page import write_why_facts, write_why_page
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    folder, which = split_source(request.run)
    car, elsewhere = load_trained_car(folder, which), load_track(request.track) if request.track else None
    progress(f"Driving from {request.starts} starts, and again what failed …")
    found = explain_failures(car, elsewhere or car.trained_on, request.run, request.starts)
    starts = None if elsewhere else compare_starts(car, request.starts)
    kept = None
    if request.checkpoints:
        progress("Driving earlier checkpoints from the same starts …")
        kept = compare_checkpoints(folder, folder, elsewhere, request.checkpoints, request.starts)
    title = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}"
    written = write_why_page(request.page or car.run.path / PAGE, found, title, kept, starts)
    write_why_facts(written.with_suffix(".json"), found)
    more = {"learned": passages_facts(kept) if kept else None, "start_places": asdict(starts) if starts else None}
    lines = sentences(found) + (passages_words(kept) if kept else []) + ([starts_words(starts)] if starts else [])
    return Explanation({**facts(found), **more}, written, lines)
