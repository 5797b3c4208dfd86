"""Judge a trained car by its laps, and whatever else was trained by its episodes. Begin with `evaluate`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.judging import evaluate_episodes, refuse_options
from racecraft.actions.mirroring import fetch_run
from racecraft.actions.named_run import named_run
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.deepracer.actions.film_options import FILM, FilmOptions
from racecraft.worlds.deepracer.actions.judged_race import RaceOptions, race_car, requested_race
from racecraft.worlds.deepracer.actions.robustness import DisturbedDrive, drive_disturbed

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.analysis.judged_drive import Drive
    from racecraft.worlds.deepracer.driving.pace import Pace
    from racecraft.worlds.deepracer.files.generalisation import TrackResult
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

MAX_LAPS = 1000
LAPS, STARTS, CHECKPOINT = 3, 5, "best"
"""Defaults, where the run's run.env does not say otherwise."""


@dataclass(frozen=True, kw_only=True)
class EvaluateRequest(Request):
    """Which run is judged, how, and what is written."""

    run: str = argument(
        "RUN[:best|last|N|laptime …], such as runs/reinvent_base-1; s3://BUCKET/PREFIX, fetched first; or a "
        "model of AWS's, imported first."
    )
    checkpoint: str | None = option(
        None,
        "best, last, the number of an iteration, or a merit such as laptime; by default what run.env "
        "asked for, else best.",
    )
    track: tuple[str, ...] = option(
        (), "A name or a waypoint file; by default the track it was trained on. Several: a table, a row a track."
    )
    tracks: str | None = option(None, "The same as a comma list; trained, held-out and all are understood too.")
    laps: int | None = option(
        None,
        f"One from standstill, then flying, and no race; by default what run.env asked for, else {LAPS}. Of "
        f"several tracks: on each, from so many starts round it, by default {STARTS}.",
        low=1,
        high=MAX_LAPS,
    )
    race: RaceOptions = group(RaceOptions)
    disturbed: DisturbedDrive = group(DisturbedDrive)
    episodes: int | None = option(None, "Of another run than a car's: how many count; of a snake: games.", low=1)
    film: FilmOptions = group(FilmOptions)
    picture: Path | None = option(
        None, "Draw the path into this PNG; by default into the run's evaluations folder.", panel=FILM
    )


@dataclass(frozen=True)
class EvaluatedDrive:
    """Laps or a judged race on one track, and the files that show them."""

    run: str
    drive: Drive
    pace: Pace | None
    """How the laps compare with the best known; None: a race."""
    stamp: str
    """The digits in the names of its AWS files."""
    files: dict[str, Path]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name."""
        drive = self.drive
        figures = {"run": self.run, "checkpoint": drive.car.checkpoint.iteration, "track": drive.track.name}
        figures |= drive.report.as_dictionary() | ({} if self.pace is None else self.pace.as_dictionary())
        return figures | {"aws_files": f"evaluation-{self.stamp}", "video": None} | self.files


class EvaluatedTracks(Figures):
    """How a car generalises: figures, and a row a track."""

    def __init__(
        self, figures: Mapping[str, Any], car: TrainedCar, starts: int, results: Sequence[TrackResult]
    ) -> None:
        super().__init__(figures)
        self.car, self.starts, self.results = car, starts, tuple(results)


@action
def evaluate(request: EvaluateRequest, progress: Progress = quiet) -> EvaluatedDrive | Figures:
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

    Raises:
        UserInputError: The run, a track or an option cannot be used.
    """
    from racecraft.worlds.deepracer.players.trained_car import KIND, load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    request.film.check()
    of_drives = {**request.film.given(), **request.race.given()}
    request.disturbed.check(_given({"--laps": request.laps}) | of_drives)
    path, checkpoint = named_run(fetch_run(request.run, progress), request.checkpoint)
    run = _imported(path, progress)
    kind = str(RunFolder.open(run).read_job().get("kind"))
    if kind != KIND:
        of_cars = _given({"--track": request.track, "--tracks": request.tracks, "--laps": request.laps})
        of_cars |= _given({"--picture": request.picture}) | of_drives | request.disturbed.given()
        refuse_options(kind, of_cars)
        return evaluate_episodes(run=str(run), checkpoint=checkpoint, episodes=request.episodes)
    refuse_options(KIND, _given({"--episodes": request.episodes}))
    asked = RunFolder.open(run).read_job().get("evaluate", {})
    if request.tracks is not None or len(request.track) > 1:
        of_one = _given({"--picture": request.picture}) | of_drives | request.disturbed.given()
        names = requested_tracks(request.track, request.tracks, of_one)
        return _drive_tracks(load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT)), names, request)
    if request.disturbed.under is None and request.race.given() and request.laps is not None:
        raise SettingError("--laps and a race's own options were given; expected one of them: --number-of-trials.")
    car = load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT))
    circuit = load_track(request.track[0]) if request.track else car.trained_on
    if request.disturbed.under is not None:
        return drive_disturbed(request.disturbed, run, car, circuit, request.picture, progress)
    return _drive(request, str(run), car, circuit, asked, progress)


def _given(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value not in (None, ())}


def _drive(
    request: EvaluateRequest, run: str, car: TrainedCar, circuit: Track, recorded: Mapping[str, Any], progress: Progress
) -> EvaluatedDrive:
    """Let a car drive laps or a race, and show it.

    Args:
        request: What is asked.
        run: The run, as the user named it.
        car: Who drives.
        circuit: Where.
        recorded: What the run keeps of its run.env.
        progress: Receives messages, and how many pictures are done.
    """
    from racecraft.worlds.deepracer.driving.pace import pace_of
    from racecraft.worlds.deepracer.evaluation.laps import LapReport

    rules, reverse = requested_race(request.race.typed(), recorded) if request.laps is None else (None, None)
    style = request.film.style(car)
    if rules is None:
        drive, stamp = _drive_laps(car, circuit, request.laps or recorded.get("laps", LAPS))
    else:
        drive, stamp = race_car(car, circuit, rules, reverse)
    picture = request.picture or car.run.evaluations / f"{circuit.name}-{car.checkpoint.iteration}.png"
    files = _show(drive, request.film, style, picture, progress)
    report = drive.report
    pace = pace_of(car, drive.track.name, report, drive.ticks) if isinstance(report, LapReport) else None
    return EvaluatedDrive(run, drive, pace, stamp, files)


def _drive_laps(car: TrainedCar, circuit: Track, laps: int) -> tuple[Drive, str]:
    """Let a car drive laps; return the drive, and the digits under which its AWS files stand."""
    from racecraft.worlds.deepracer.analysis.judged_drive import drive_laps
    from racecraft.worlds.deepracer.training.aws.evaluation import write_aws_evaluation

    drive = drive_laps(car, circuit, laps)
    return drive, write_aws_evaluation(car.run.path, drive.ticks, len(drive.report), drive.track.length)


def _show(
    drive: Drive, film: FilmOptions, style: FilmStyle | None, picture: Path, progress: Progress
) -> dict[str, Path]:
    """Write the pictures and films that are asked for; return the files by kind."""
    from racecraft.worlds.deepracer.analysis.judged_drive import film_as_aws, show_drive

    if film.video is not None or film.save_mp4:
        progress(f"Filming {len(drive.ticks)} ticks …")
    outside = style if film.from_outside else None
    with progress.counting("pictures") as count:
        files = show_drive(drive, video=film.video, picture=picture, style=outside, count=count)
        if film.save_mp4 and style is not None:
            files |= film_as_aws(drive, style, drive.car.checkpoint.iteration, count)
    return files


def _imported(run: Path, progress: Progress) -> Path:
    """Return a run folder as it is, and a new one for a model of AWS's."""
    from racecraft.worlds.deepracer.players.aws_model import import_model
    from racecraft.worlds.deepracer.players.open_run import is_aws_model

    if not is_aws_model(run):
        return run
    done = import_model(run)
    for note in done.notes:
        progress(f"- {note}")
    progress(f"{run} was imported as {done.run.path}")
    return done.run.path


def requested_tracks(track: Sequence[str], tracks: str | None, of_one: Mapping[str, Any]) -> list[str]:
    """Return the names of --track or --tracks, each once.

    Args:
        track: As typed.
        tracks: As typed, a comma list.
        of_one: What else was given and is of one track only, by option.

    Raises:
        SettingError: Both were given, none is named, or an option says nothing of several tracks.
    """
    if track and tracks is not None:
        raise SettingError("--track and --tracks were given; expected all names after one of them.")
    for name in of_one:
        raise SettingError(
            "{option} shows one track, and several are judged; expected one --track, or no {option}.", option=name
        )
    parts = [tracks] if tracks is not None else list(track)
    names = list(dict.fromkeys(name.strip() for part in parts for name in part.split(",") if name.strip()))
    if not names:
        raise SettingError("--tracks {tracks!r} names none; expected names, trained, held-out or all.", tracks=tracks)
    return names


def _drive_tracks(car: TrainedCar, names: list[str], request: EvaluateRequest) -> EvaluatedTracks:
    """Judge a car on tracks by name, from several starts on each.

    Raises:
        TrackError: A track cannot be used; the nearest name is told.
        SettingError: Held-out tracks are asked for, and the run has none.
    """
    from racecraft.worlds.deepracer.evaluation.by_track import judge_named, told_of

    starts = request.laps or STARTS
    results = judge_named(car, names, starts)
    return EvaluatedTracks(told_of(car, results, starts), car, starts, results)
