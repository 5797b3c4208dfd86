"""Show what a policy looks at, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.named_run import RUN_HELP
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.analysis.attribution import ExplainTarget
    from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries
    from racecraft.worlds.deepracer.analysis.saliency_page import LapSaliency


PAGE, FILM = "look.html", "look.mp4"


@dataclass(frozen=True, kw_only=True)
class LookRequest(Request):
    """Which policy, what it looks at, and what is written."""

    run: str = argument(RUN_HELP, metavar="RUN[:which]")
    source: Path | None = argument(
        "Pictures to look at; by default a lap is driven for it.", None, metavar="[PICTURE|FOLDER|FILM]"
    )
    film: Path | None = option(None, "The heat-map film (.mp4); by default look.mp4 in the run.")
    page: Path | None = option(None, "The page of a lap (.html); by default look.html in the run.")
    track: str | None = option(None, "Drive the lap elsewhere: a name or a waypoint file.")
    part: int = option(0, "Which part of the action: of a car with two numbers 0 steering, 1 speed.", low=0)
    option_: int | None = option(None, "Explain this action, by its number, instead of the one chosen.", low=0)


@action
def look(request: LookRequest, progress: Progress = quiet) -> Figures:
    """Show what a policy looks at: heat maps beside the camera, how sure it is, what each surface means to it.

    Examples:

        racecraft look runs/reinvent_base-1

        racecraft look runs/reinvent_base-1:last frames/ --film frames.mp4

        racecraft look runs/reinvent_base-1 --track Oval_track --page oval.html --json
    """
    from racecraft.analysis.attribution import ExplainTarget

    question = ExplainTarget(request.part, request.option_)
    if request.source is None:
        return _lap(request, question, progress)
    if request.track is not None or request.page is not None:
        raise SettingError("--track and --page belong to a lap, and pictures were given. Leave one of them away.")
    return _pictures(request, request.source, question)


def _lap(request: LookRequest, question: ExplainTarget, progress: Progress) -> Figures:
    """Drive a lap, explain it, write film and page; return what was found."""
    from racecraft.analysis.video import film_path, small_film
    from racecraft.formats.checkpoint import IMPORTED
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.analysis.run_saliency import look_at_lap
    from racecraft.worlds.deepracer.analysis.saliency_film import write_saliency_film
    from racecraft.worlds.deepracer.analysis.saliency_page import findings, write_saliency_page
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    folder, which = split_source(request.run)
    car = load_trained_car(folder, which)
    film, page = film_path(request.film or car.run.path / FILM), request.page or car.run.path / PAGE
    progress("Driving a lap and looking into every tick …")
    lap = look_at_lap(car, load_track(request.track) if request.track else car.trained_on, question)
    title = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}"
    write_saliency_film(film, lap.series, title, lap.positions)
    imported = IMPORTED in car.run.read_job()
    write_saliency_page(page, lap, title, small_film(film), folder, imported)
    figures = {
        "run": folder,
        "checkpoint": car.checkpoint.iteration,
        "track": lap.positions.track.name,
        "ticks": len(lap.series),
        "ended": lap.outcome,
        **_sureness(lap.series),
        "findings": findings(lap.surfaces, lap.series, folder, imported),
        "surfaces": _surfaces(lap),
    }
    return Figures(figures, {"film": film, "page": page})


def _surfaces(lap: LapSaliency) -> list[dict[str, Any]]:
    return [
        {
            "surface": row.surface, "area_share": row.area, "attention_share": row.attention,
            "times_its_area": row.times_its_area, "decisions_changed_share": row.changed,
        }
        for row in lap.surfaces
    ]  # fmt: skip


def _pictures(request: LookRequest, source: Path, question: ExplainTarget) -> Figures:
    """Explain pictures, write the film; return what was found."""
    from racecraft.analysis.video import film_path
    from racecraft.players.trained import load_policy
    from racecraft.worlds.deepracer.analysis.run_saliency import FILMS, look_at_pictures
    from racecraft.worlds.deepracer.analysis.saliency_film import write_saliency_film

    policy = load_policy(request.run)
    film = film_path(request.film or policy.run.path / FILM)
    seen = look_at_pictures(policy, source, question)
    title = f"{policy.run.path.name}, checkpoint {policy.checkpoint.iteration}, {source.name}"
    write_saliency_film(film, seen, title, still=source.suffix.lower() not in FILMS)
    figures = {
        "run": policy.run.path,
        "checkpoint": policy.checkpoint.iteration,
        "pictures": [seen.facts(row) for row in range(len(seen))],
        **_sureness(seen),
    }
    return Figures(figures, {"film": film})


def _sureness(look: SaliencySeries) -> dict[str, Any]:
    values, words = look.confidence_values
    return {"sureness": words, "mean_sureness": float(values.mean()), "least_sureness": float(values.min())}
