"""`racecraft evaluate`: judge a trained car by its laps, and whatever else was trained by its episodes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.evaluation.deepracer.laps import LapReport

MAX_LAPS = 1000
LAPS, CHECKPOINT = 3, "best"
"""Where neither the command nor the run's run.env says."""


def evaluate(
    run: Annotated[
        Path,
        typer.Argument(
            help="A run folder, such as runs/reinvent_base-1, or a model of AWS's, which is imported first."
        ),
    ],
    checkpoint: Annotated[
        str | None,
        typer.Option(help="best, last, or the number of an iteration; by default what run.env asked for, else best."),
    ] = None,
    track: Annotated[
        str | None, typer.Option(help="A name or a waypoint file; by default the track it was trained on.")
    ] = None,
    laps: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MAX_LAPS,
            help=f"One from standstill, then flying; by default what run.env asked for, else {LAPS}.",
        ),
    ] = None,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Of another run than a car's: how many count; of a snake: games.")
    ] = None,
    video: Annotated[Path | None, typer.Option(help="Film the drive into this MP4 file.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the path into this PNG; by default into the run's evaluations folder.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Let a trained car drive, greedily: one standing start, then flying laps. Other runs play whole episodes.

    Examples:

        racecraft evaluate runs/reinvent_base-1 --video lap.mp4

        racecraft evaluate runs/reinvent_base-1 --checkpoint last --track Oval_track --laps 5 --json

        racecraft evaluate runs/CartPole-v1-1 --episodes 100

        racecraft evaluate ~/Downloads/my-model.tar.gz --track Oval_track
    """
    from racecraft.analysis.video import film_path
    from racecraft.cli.output import print_json, say
    from racecraft.cli.runs.judge import judge, refuse_words
    from racecraft.formats.run_folder import RunFolder
    from racecraft.players.deepracer.trained_car import KIND, load_trained_car
    from racecraft.reporting.gallery import drive_laps, show_drive
    from racecraft.tracks.catalogue import load_track
    from racecraft.training.deepracer.aws.evaluation import write_aws_evaluation

    if video is not None:
        film_path(video)  # refused before the drive, not after it
    run = _imported(run, json)
    job = RunFolder.open(run).read_job()
    if job.get("kind") != KIND:
        refuse_words(job["kind"], {"--track": track, "--laps": laps, "--video": video, "--picture": picture})
        judge(run, checkpoint, episodes, json)
        return
    refuse_words(KIND, {"--episodes": episodes})
    asked = job.get("evaluate", {})
    car = load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT))
    circuit = load_track(track) if track else car.trained_on
    drive = drive_laps(car, circuit, laps or asked.get("laps", LAPS))
    picture = picture or car.run.evaluations / f"{circuit.name}-{car.checkpoint.iteration}.png"
    if video is not None:
        say(f"Filming {len(drive.ticks)} ticks …", quiet_stdout=json)
    show_drive(drive, video=video, picture=picture)
    stamp = write_aws_evaluation(car.run.path, drive.ticks, len(drive.report.laps), drive.track.length)
    facts: dict[str, Any] = {
        "run": str(run),
        "checkpoint": car.checkpoint.iteration,
        "track": circuit.name,
        **drive.report.as_dictionary(),
        "aws_files": f"evaluation-{stamp}",
        "picture": str(picture),
        "video": None if video is None else str(video),
    }
    if json:
        print_json(facts)
        return
    print(f"{run}, checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}:")
    _print_table(drive.report)
    for kind in ("picture", "video"):
        if facts[kind]:
            print(f"{kind}: {facts[kind]}")


def _imported(run: Path, json: bool) -> Path:
    """Return a run folder as it is, and a new one for a model of AWS's."""
    from racecraft.cli.output import say
    from racecraft.players.deepracer.foreign_model import import_model, is_foreign

    if not is_foreign(run):
        return run
    done = import_model(run)
    for note in done.notes:
        say(f"- {note}", quiet_stdout=json)
    say(f"{run} was imported as {done.run.path}", quiet_stdout=json)
    return done.run.path


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
