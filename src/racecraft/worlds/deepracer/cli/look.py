"""`racecraft look RUN`: what a policy looks at, and how sure it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.actions.named_run import RUN_HELP

if TYPE_CHECKING:
    from racecraft.analysis.attribution import Question
    from racecraft.worlds.deepracer.analysis.look import Look
    from racecraft.worlds.deepracer.analysis.look_page import LapLook

PAGE, FILM = "look.html", "look.mp4"
MOST_ROWS = 20


def look(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    source: Annotated[
        Path | None,
        typer.Argument(metavar="[PICTURE|FOLDER|FILM]", help="Pictures to look at; by default a lap is driven for it."),
    ] = None,
    film: Annotated[Path | None, typer.Option(help="The heat-map film (.mp4); by default look.mp4 in the run.")] = None,
    page: Annotated[
        Path | None, typer.Option(help="The page of a lap (.html); by default look.html in the run.")
    ] = None,
    track: Annotated[str | None, typer.Option(help="Drive the lap elsewhere: a name or a waypoint file.")] = None,
    part: Annotated[
        int, typer.Option(min=0, help="Which part of the action: of a car with two numbers 0 steering, 1 speed.")
    ] = 0,
    option: Annotated[
        int | None, typer.Option(min=0, help="Explain this action, by its number, instead of the one chosen.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Show what a policy looks at: heat maps beside the camera, how sure it is, what each surface means to it.

    Examples:

        racecraft look runs/reinvent_base-1

        racecraft look runs/reinvent_base-1:last frames/ --film frames.mp4

        racecraft look runs/reinvent_base-1 --track Oval_track --page oval.html --json
    """
    from racecraft.analysis.attribution import Question
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError

    question = Question(part, option)
    if source is None:
        facts = _lap(run, track, question, film, page, json)
    else:
        if track is not None or page is not None:
            raise SettingError("--track and --page belong to a lap, and pictures were given. Leave one of them away.")
        facts = _pictures(run, source, question, film)
    if json:
        print_json(facts)
        return
    _print(facts)


def _lap(
    run: str, track: str | None, question: Question, film: Path | None, page: Path | None, json: bool
) -> dict[str, Any]:
    """Drive a lap, explain it, write film and page; return what was found."""
    from racecraft.analysis.video import film_path, small_film
    from racecraft.cli.output import say
    from racecraft.formats.checkpoint import IMPORTED
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.analysis.look_film import write_look_film
    from racecraft.worlds.deepracer.analysis.look_page import findings, write_look_page
    from racecraft.worlds.deepracer.analysis.looking import look_at_lap
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    folder, which = split_source(run)
    car = load_trained_car(folder, which)
    film, page = film_path(film or car.run.path / FILM), page or car.run.path / PAGE
    say("Driving a lap and looking into every tick …", quiet_stdout=json)
    lap = look_at_lap(car, load_track(track) if track else car.trained_on, question)
    title = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}"
    write_look_film(film, lap.look, title, lap.place)
    imported = IMPORTED in car.run.read_job()
    write_look_page(page, lap, title, small_film(film), folder, imported)
    return {
        "run": folder,
        "checkpoint": car.checkpoint.iteration,
        "track": lap.place.track.name,
        "ticks": len(lap.look),
        "ended": lap.outcome,
        **_sureness(lap.look),
        "findings": findings(lap.surfaces, lap.look, folder, imported),
        "surfaces": _surfaces(lap),
        "film": str(film),
        "page": str(page),
    }


def _surfaces(lap: LapLook) -> list[dict[str, Any]]:
    return [
        {
            "surface": row.surface, "area_share": row.area, "attention_share": row.attention,
            "times_its_area": row.times_its_area, "decisions_changed_share": row.changed,
        }
        for row in lap.surfaces
    ]  # fmt: skip


def _pictures(run: str, source: Path, question: Question, film: Path | None) -> dict[str, Any]:
    """Explain pictures, write the film; return what was found."""
    from racecraft.analysis.video import film_path
    from racecraft.players.trained import load_policy
    from racecraft.worlds.deepracer.analysis.look_film import write_look_film
    from racecraft.worlds.deepracer.analysis.looking import FILMS, look_at_pictures

    policy = load_policy(run)
    film = film_path(film or policy.run.path / FILM)
    seen = look_at_pictures(policy, source, question)
    title = f"{policy.run.path.name}, checkpoint {policy.checkpoint.iteration}, {source.name}"
    write_look_film(film, seen, title, still=source.suffix.lower() not in FILMS)
    return {
        "run": str(policy.run.path),
        "checkpoint": policy.checkpoint.iteration,
        "pictures": [seen.facts(row) for row in range(len(seen))],
        **_sureness(seen),
        "film": str(film),
    }


def _sureness(look: Look) -> dict[str, Any]:
    values, words = look.sureness
    return {"sureness": words, "mean_sureness": float(values.mean()), "least_sureness": float(values.min())}


def _print(facts: dict[str, Any]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    if "surfaces" in facts:
        print(f"{facts['ticks']} ticks on {facts['track']}: {facts['ended']}.")
        for title in ("surface", "attention", "of the picture", "times its area", "other decisions"):
            table.add_column(title, justify="left" if title == "surface" else "right")
        for row in facts["surfaces"]:
            changed = row["decisions_changed_share"]
            table.add_row(
                row["surface"], f"{100 * row['attention_share']:.1f} %", f"{100 * row['area_share']:.1f} %",
                f"{row['times_its_area']:.1f}", "-" if changed is None else f"{100 * changed:.0f} %",
            )  # fmt: skip
    else:
        for title in ("picture", *facts["pictures"][0]):
            table.add_column(title.replace("_", " "), justify="left" if title in ("chosen", "second") else "right")
        for number, row in enumerate(facts["pictures"][:MOST_ROWS], 1):
            table.add_row(str(number), *(one if isinstance(one, str) else f"{one:.3f}" for one in row.values()))
    print_table(table)
    print(f"{facts['sureness']}: {facts['mean_sureness']:.3g} on average, {facts['least_sureness']:.3g} at least")
    for sentence in facts.get("findings", ()):
        print(sentence)
    for kind in ("film", "page"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")
