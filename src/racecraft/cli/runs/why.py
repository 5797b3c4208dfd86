"""`racecraft why RUN`: where a car fails, what went before, and what would have saved it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

PAGE = "why.html"


def why(
    run: Annotated[str, typer.Argument(help="RUN[:best|last|N], such as runs/reinvent_base-1; by default the best.")],
    starts: Annotated[int, typer.Option(min=1, max=500, help="Starts it drives from, evenly round the lap.")] = 24,
    track: Annotated[str | None, typer.Option(help="Drive elsewhere: a name or a waypoint file.")] = None,
    page: Annotated[Path | None, typer.Option(help="The page (.html); by default why.html in the run.")] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Explain where a car fails and what would have saved it: other actions are driven from the moments before.

    Examples:

        racecraft why runs/reinvent_base-1

        racecraft why runs/reinvent_base-1:last --starts 48 --page why.html

        racecraft why runs/reinvent_base-1 --track Oval_track --json
    """
    from racecraft.analysis.deepracer.failure_places import facts, sentences
    from racecraft.analysis.deepracer.why_page import write_why_page
    from racecraft.cli.output import print_json, say
    from racecraft.players.deepracer.trained_car import load_trained_car
    from racecraft.players.trained import split_source
    from racecraft.reporting.explaining import explain_failures
    from racecraft.tracks.catalogue import load_track

    folder, which = split_source(run)
    car = load_trained_car(folder, which)
    say(f"Driving from {starts} starts, and again what failed …", quiet_stdout=json)
    found = explain_failures(car, load_track(track) if track else car.trained_on, run, starts)
    title = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}"
    written = write_why_page(page or car.run.path / PAGE, found, title)
    if json:
        print_json({**facts(found), "page": str(written)})
        return
    print("\n".join(sentences(found)))
    print(f"page: {written}")
