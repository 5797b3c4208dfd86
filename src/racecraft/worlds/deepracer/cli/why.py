"""`racecraft why RUN`: where a car fails, what went before, and what would have saved it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from racecraft.actions.named_run import RUN_HELP

PAGE = "why.html"


def why(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    starts: Annotated[int, typer.Option(min=1, max=500, help="Starts it drives from, evenly round the lap.")] = 24,
    track: Annotated[str | None, typer.Option(help="Drive elsewhere: a name or a waypoint file.")] = None,
    checkpoints: Annotated[
        int, typer.Option(min=0, max=100, help="Compare so many of the run's checkpoints, place by place; 0: none.")
    ] = 8,
    page: Annotated[Path | None, typer.Option(help="The page (.html); by default why.html in the run.")] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Explain where a car fails and what would have saved it: other actions are driven from the moments before.

    Examples:

        racecraft why runs/reinvent_base-1

        racecraft why runs/reinvent_base-1:last --starts 48 --page why.html

        racecraft why runs/reinvent_base-1 --track Oval_track --json
    """
    from racecraft.cli.output import print_json, say
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.analysis.comparing import compare_checkpoints, compare_starts
    from racecraft.worlds.deepracer.analysis.explaining import explain_failures
    from racecraft.worlds.deepracer.analysis.failure_places import facts, sentences
    from racecraft.worlds.deepracer.analysis.forgetting import passages_facts, passages_words, starts_words
    from racecraft.worlds.deepracer.analysis.why_page import write_why_page
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    folder, which = split_source(run)
    car, elsewhere = load_trained_car(folder, which), load_track(track) if track else None
    say(f"Driving from {starts} starts, and again what failed …", quiet_stdout=json)
    found = explain_failures(car, elsewhere or car.trained_on, run, starts)
    begun = None if elsewhere else compare_starts(car, starts)
    kept = None
    if checkpoints:
        say("Driving earlier checkpoints from the same starts …", quiet_stdout=json)
        kept = compare_checkpoints(folder, folder, elsewhere, checkpoints, starts)
    title = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}"
    written = write_why_page(page or car.run.path / PAGE, found, title, kept, begun)
    if json:
        more = {"learned": passages_facts(kept) if kept else None, "start_places": asdict(begun) if begun else None}
        print_json({**facts(found), **more, "page": str(written)})
        return
    told = sentences(found) + (passages_words(kept) if kept else []) + ([starts_words(begun)] if begun else [])
    print("\n".join(told))
    print(f"page: {written}")
