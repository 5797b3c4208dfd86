"""`racecraft evaluate`: judge a trained car by its laps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.evaluation.laps import LapReport

MAX_LAPS = 1000


def evaluate(
    run: Annotated[Path, typer.Argument(help="A run folder, such as runs/reinvent_base-1.")],
    checkpoint: Annotated[str, typer.Option(help="best, last, or the number of an iteration.")] = "best",
    track: Annotated[
        str | None, typer.Option(help="A name or a waypoint file; by default the track it was trained on.")
    ] = None,
    laps: Annotated[int, typer.Option(min=1, max=MAX_LAPS, help="One from standstill, then flying.")] = 3,
    video: Annotated[Path | None, typer.Option(help="Film the drive into this MP4 file.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the path into this PNG; by default into the run's evaluations folder.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Let a trained car drive, greedily: one standing start, then flying laps.

    Examples:
        racecraft evaluate runs/reinvent_base-1 --video lap.mp4

        racecraft evaluate runs/reinvent_base-1 --checkpoint last --track Oval_track --laps 5 --json
    """
    from racecraft.analysis.figures import draw_path
    from racecraft.cli.output import print_json, say
    from racecraft.evaluation.drive import DriveKeeper
    from racecraft.evaluation.laps import judge_laps
    from racecraft.players.trained_car import load_trained_car
    from racecraft.tracks.catalogue import load_track

    car = load_trained_car(run, checkpoint)
    circuit = load_track(track or car.trained_on)
    keeper = DriveKeeper()
    world = car.world(circuit, num_cars=1, laps=laps)
    report = judge_laps(car.policy, world, laps, [keeper])

    picture = picture or car.run.evaluations / f"{circuit.name}-{car.checkpoint.iteration}.png"
    draw_path(picture, world.track, keeper.drive)
    files = {"picture": str(picture)}
    if video is not None:
        from racecraft.analysis.video import write_video

        say(f"Filming {len(keeper.drive)} ticks …", quiet_stdout=json)
        write_video(video, keeper.drive, world.track, world.camera.mount)
        files["video"] = str(video)
    facts: dict[str, Any] = {
        "run": str(run),
        "checkpoint": car.checkpoint.iteration,
        "track": circuit.name,
        **report.as_dictionary(),
        **files,
    }
    if json:
        print_json(facts)
        return
    print(f"{run}, checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}:")
    _print_table(report)
    for kind, path in files.items():
        print(f"{kind}: {path}")


def _print_table(report: LapReport) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("lap", "seconds", "progress", "ended"):
        table.add_column(title, justify="left" if title == "ended" else "right")
    for number, lap in enumerate(report.laps, 1):
        seconds = f"{lap.seconds:.2f}" if lap.seconds is not None else "-"
        table.add_row(str(number), seconds, f"{lap.progress_percent:.1f} %", lap.status.replace("_", " "))
    Console().print(table)
