"""`racecraft evaluate`: judge a trained car by its laps, and whatever else was trained by its episodes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.option_groups import flags, takes_groups
from racecraft.worlds.deepracer.cli.film_options import FILM, FilmOptions
from racecraft.worlds.deepracer.cli.judged_race import RaceOptions, print_race, race_asked, race_car
from racecraft.worlds.deepracer.cli.robustness import DisturbedDrive

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.analysis.judged_drive import Drive
    from racecraft.worlds.deepracer.evaluation.laps import LapReport
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

MAX_LAPS = 1000
LAPS, STARTS, CHECKPOINT = 3, 5, "best"
"""Where neither the command nor the run's run.env says."""


@takes_groups
def evaluate(
    run: Annotated[
        Path,
        typer.Argument(
            help="RUN[:best|last|N|laptime …], such as runs/reinvent_base-1; s3://BUCKET/PREFIX, fetched first; or a "
            "model of AWS's, imported first."
        ),
    ],
    *,
    checkpoint: Annotated[
        str | None,
        typer.Option(
            help="best, last, the number of an iteration, or a merit such as laptime; by default what run.env "
            "asked for, else best."
        ),
    ] = None,
    track: Annotated[
        list[str] | None,
        typer.Option(
            help="A name or a waypoint file; by default the track it was trained on. Several: a table, a row a track."
        ),
    ] = None,
    tracks: Annotated[
        str | None,
        typer.Option(help="The same as a comma list; trained, held-out and all are understood too."),
    ] = None,
    laps: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MAX_LAPS,
            help=f"One from standstill, then flying, and no race; by default what run.env asked for, else {LAPS}. Of "
            f"several tracks: on each, from so many starts round it, by default {STARTS}.",
        ),
    ] = None,
    race: RaceOptions,
    disturbed: DisturbedDrive,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Of another run than a car's: how many count; of a snake: games.")
    ] = None,
    film: FilmOptions,
    picture: Annotated[
        Path | None,
        typer.Option(
            help="Draw the path into this PNG; by default into the run's evaluations folder.", rich_help_panel=FILM
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Let a trained car drive, greedily: one standing start, then flying laps. Other runs play whole episodes.

    Where an option of a race is given, or the run's run.env named one of its variables, a race is judged instead.

    Examples:

        racecraft evaluate runs/reinvent_base-1 --video lap.mp4

        racecraft evaluate runs/reinvent_base-1 --video race.mp4 --view pip --size 1080p --fps 60

        racecraft evaluate runs/reinvent_base-1 --checkpoint last --track Oval_track --laps 5 --json

        racecraft evaluate runs/20-tracks-1 --tracks trained,held-out,Oval_track

        racecraft evaluate runs/reinvent_base-1 --number-of-trials 3 --off-track-penalty 2

        racecraft evaluate runs/reinvent_base-1 --under strong --each

        racecraft evaluate runs/CartPole-v1-1 --episodes 100

        racecraft evaluate ~/Downloads/my-model.tar.gz --track Oval_track
    """
    from racecraft.actions.named_run import named_run
    from racecraft.cli.buckets.training import fetch_run
    from racecraft.cli.output import say
    from racecraft.cli.runs.judge import judge, refuse_words
    from racecraft.formats.run_folder import RunFolder
    from racecraft.worlds.deepracer.cli.many_tracks import judge_and_tell, tracks_asked
    from racecraft.worlds.deepracer.players.trained_car import KIND

    film.check()
    of_drives = {**flags(film), **flags(race)}
    disturbed.check({"--laps": laps, **of_drives})
    path, checkpoint = named_run(fetch_run(str(run), lambda text: say(text, quiet_stdout=json)), checkpoint)
    run = _imported(path, json)
    kind = RunFolder.open(run).read_job().get("kind")
    if kind == KIND:
        refuse_words(KIND, {"--episodes": episodes})
        if tracks is not None or len(track or ()) > 1:
            of_one = {"--picture": picture, **of_drives, **flags(disturbed)}
            return judge_and_tell(run, checkpoint, tracks_asked(track, tracks, of_one), laps, json)
        only_track = track[0] if track else None
        if disturbed.under is not None:
            disturbed.judge(run, checkpoint, only_track, picture, json)
        else:
            _judge_car(run, checkpoint, only_track, laps, race, film, picture, json)
        return
    of_cars = {"--track": track, "--tracks": tracks, "--laps": laps, "--picture": picture}
    of_cars |= {**of_drives, **flags(disturbed)}
    refuse_words(str(kind), of_cars)
    judge(run, checkpoint, episodes, json)


def _judge_car(
    run: Path,
    checkpoint: str | None,
    track: str | None,
    laps: int | None,
    race: RaceOptions,
    film: FilmOptions,
    picture: Path | None,
    json: bool,
) -> None:
    """Let a car drive laps or a race, show it, and say what came of it."""
    from racecraft.contract.errors import SettingError
    from racecraft.formats.run_folder import RunFolder
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    typed = race.typed()
    if typed and laps is not None:
        raise SettingError("--laps and a race's own options were given; expected one of them: --number-of-trials.")
    asked = RunFolder.open(run).read_job().get("evaluate", {})
    rules, reverse = race_asked(typed, asked) if laps is None else (None, None)
    car = load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT))
    style = film.style(car)
    circuit = load_track(track) if track else car.trained_on
    if rules is None:
        drive, stamp = _drive_laps(car, circuit, laps or asked.get("laps", LAPS))
    else:
        drive, stamp = race_car(car, circuit, rules, reverse)
    picture = picture or car.run.evaluations / f"{circuit.name}-{car.checkpoint.iteration}.png"
    files = _show(drive, film, style, picture, json)
    _tell(run, drive, stamp, files, json)


def _drive_laps(car: TrainedCar, circuit: Track, laps: int) -> tuple[Drive, str]:
    """Let a car drive laps; return the drive, and the digits under which its AWS files stand."""
    from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps
    from racecraft.worlds.deepracer.training.aws.evaluation import write_aws_evaluation

    drive = drive_laps(car, circuit, laps)
    return drive, write_aws_evaluation(car.run.path, drive.ticks, len(drive.report), drive.track.length)


def _show(drive: Drive, film: FilmOptions, style: FilmStyle | None, picture: Path, json: bool) -> dict[str, Path]:
    """Write the pictures and films that are asked for; return the files by kind."""
    from racecraft.cli.output import counting, say
    from racecraft.worlds.deepracer.analysis.judged_drive import film_as_aws, show_drive

    if film.video is not None or film.save_mp4:
        say(f"Filming {len(drive.ticks)} ticks …", quiet_stdout=json)
    outside = style if film.from_outside else None
    with counting("pictures", quiet_stdout=json) as count:
        files = show_drive(drive, video=film.video, picture=picture, style=outside, count=count)
        if film.save_mp4 and style is not None:
            files |= film_as_aws(drive, style, drive.car.checkpoint.iteration, count)
    return files


def _tell(run: Path, drive: Drive, stamp: str, files: Mapping[str, Path], json: bool) -> None:
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.driving.pace import pace_of
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs
    from racecraft.worlds.deepracer.evaluation.laps import LapReport

    checkpoint = drive.car.checkpoint.iteration
    report = drive.report
    pace = pace_of(drive.car, drive.track.name, report, drive.ticks) if isinstance(report, LapReport) else None
    if json:
        facts = {"run": str(run), "checkpoint": checkpoint, "track": drive.track.name, **drive.report.as_dictionary()}
        facts |= {} if pace is None else pace.as_dictionary()
        facts |= {"aws_files": f"evaluation-{stamp}", "video": None}
        print_json(facts | {kind: str(path) for kind, path in files.items()})
        return
    print(f"{run}, checkpoint {checkpoint}, on {drive.track.title or drive.track.name}:")
    if isinstance(report, LapReport):
        _print_table(report)
        print("\n".join(pace.lines() if pace else ()))
    else:
        print_race(report)
        if limits := beyond_logs(drive.car.settings.race.car, drive.car.actions.fastest):
            print(limits)
    for kind, path in files.items():
        print(f"{kind}: {path}")


def _imported(run: Path, json: bool) -> Path:
    """Return a run folder as it is, and a new one for a model of AWS's."""
    from racecraft.cli.output import say
    from racecraft.worlds.deepracer.players.aws_model import import_model
    from racecraft.worlds.deepracer.players.borrowed import is_foreign

    if not is_foreign(run):
        return run
    done = import_model(run)
    for note in done.notes:
        say(f"- {note}", quiet_stdout=json)
    say(f"{run} was imported as {done.run.path}", quiet_stdout=json)
    return done.run.path


def _print_table(report: LapReport) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("lap", "seconds", "progress", "ended"):
        table.add_column(title, justify="left" if title == "ended" else "right")
    for number, lap in enumerate(report.laps, 1):
        seconds = f"{lap.seconds:.2f}" if lap.seconds is not None else "-"
        table.add_row(str(number), seconds, f"{lap.progress_percent:.1f} %", lap.status.replace("_", " "))
    print_table(table)
