"""What a training leaves for people to look at: a film of the best policy's lap, its path, the learning curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from racecraft.analysis.figures import draw_curves
from racecraft.analysis.report import write_report
from racecraft.analysis.video import film_title, small_film
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.whole import make_folder
from racecraft.reporting.account import advice_of, own_plots_of
from racecraft.worlds.deepracer.analysis.drive import PAUSE, as_drive
from racecraft.worlds.deepracer.analysis.drive import Drive as CarDrive
from racecraft.worlds.deepracer.analysis.explaining import explain_failures
from racecraft.worlds.deepracer.analysis.films.film import FilmStyle, PictureCount, write_film
from racecraft.worlds.deepracer.analysis.films.shells import DEEPRACER
from racecraft.worlds.deepracer.analysis.films.views import AWS_FOLDERS
from racecraft.worlds.deepracer.analysis.lap_film import write_video
from racecraft.worlds.deepracer.analysis.path_picture import draw_path
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.judged_race import JudgedRace, RaceRecord, judge_race
from racecraft.worlds.deepracer.evaluation.laps import LapReport, judge_laps
from racecraft.worlds.deepracer.players.trained_car import KIND, TrainedCar, load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track

VIDEO, PATH_PICTURE, CURVES, REPORT = "lap.mp4", "path.png", "curves.png", "report.html"
WHY: dict[str, int] = {"starts": 12, "places": 2, "failures": 4, "seconds": 10}
"""How much is driven for the report's word on why it fails; `racecraft why` drives more."""


@dataclass(frozen=True)
class Drive:
    """A judged drive of one car, and what is needed to show it."""

    car: TrainedCar
    track: Track
    report: LapReport | RaceRecord
    ticks: Array
    """TICK_REPORT (T,)."""
    objects: tuple[Array, Array] | None = None
    """What stood or drove on the road, (T, K, 6) and their kinds (T, K)."""

    @property
    def shown(self) -> CarDrive:
        """What the car did, as films take it; of a judged race with its trials, resets and penalties."""
        drive = replace(as_drive(self.ticks), boxes=None if self.objects is None else self.objects[0][-1])
        if isinstance(self.report, LapReport):
            return drive
        race = self.report
        return replace(
            drive,
            status=np.where(np.isin(race.status, ("lap_complete", PAUSE)), race.status, drive.status),
            lap=race.trial,
            trial=race.trial,
            resets=race.resets,
            penalty_seconds=race.penalty_seconds,
        )


def drive_laps(car: TrainedCar, track: Track, laps: int) -> Drive:
    """Let a trained car drive so many laps, greedily, and keep every tick."""
    keeper = DriveKeeper()
    world = car.world(track, num_cars=1, start_shares=[0.0], laps=laps)
    report = judge_laps(car.policy, world, laps, [keeper])
    return Drive(car, world.track, report, keeper.drive, keeper.objects)


def drive_race(car: TrainedCar, track: Track, rules: JudgedRace, reverse: bool | None) -> tuple[RaceRecord, Drive]:
    """Let a trained car drive a judged race, greedily; return the race, and the drive to be shown.

    Args:
        car: Who drives.
        track: Where.
        rules: How it is judged.
        reverse: In the opposite direction to the track's own; None: as it was trained.
    """
    config = rules.race_config(car.settings.race, reverse)
    world = car.world(track, num_cars=1, start_shares=[0.0], laps=rules.laps_in_one, race=config)
    record = judge_race(car.policy, world, rules)
    return record, Drive(car, world.track, record, record.ticks, record.objects)


def paint_run(run: RunFolder, say: Callable[[str], None]) -> dict[str, Path]:
    """Film the best policy's lap, draw its path and the run's curves, write the report; return the files by kind."""
    say("Filming the best policy's lap …")
    car = load_trained_car(run.path, "best")
    drive = drive_laps(car, car.trained_on, laps=1)
    files = {
        "video": run.path / VIDEO,
        "picture": run.path / PATH_PICTURE,
        "curves": run.path / CURVES,
        "report": run.path / REPORT,
    }
    show_drive(drive, video=files["video"], picture=files["picture"])
    draw_curves(files["curves"], run.read_metrics())
    why = explain_failures(car, car.trained_on, str(run.path), **WHY)
    write_report(run, files["report"], drive.shown, small_film(files["video"]), advice_of(run), why=why)
    return files


def report_run(path: Path, page: Path, plots: Sequence[Path] = ()) -> Path:
    """Write the page that tells a run; a car's best policy drives one lap for it.

    The film in the folder comes along where it is of that policy.

    Args:
        path: The run folder.
        page: The page to write.
        plots: Files, or folders of them, with the racer's own plots; of a car.

    Raises:
        RunFolderError: No run folder.
        OwnPlotError: A file holds no plot of the racer's own.
    """
    run = RunFolder.open(path)
    if run.read_job().get("kind") != KIND:
        return write_report(run, page, advice=advice_of(run))
    own = own_plots_of(run, plots)
    car = load_trained_car(path, "best")
    drive = drive_laps(car, car.trained_on, laps=1).shown
    why = explain_failures(car, car.trained_on, str(path), **WHY)
    return write_report(run, page, drive, _film_of(run, car), advice_of(run), own, why)


def _film_of(run: RunFolder, car: TrainedCar) -> bytes | None:
    """Return the film in the run folder, small, if it is of this very checkpoint; an older policy's tells nothing."""
    path = run.path / VIDEO
    return small_film(path) if path.is_file() and film_title(path) == _headline(car) else None


def _headline(car: TrainedCar) -> str:
    return f"checkpoint {car.checkpoint.iteration}"


def show_drive(
    drive: Drive,
    *,
    video: Path | None = None,
    picture: Path | None = None,
    style: FilmStyle | None = None,
    count: PictureCount | None = None,
) -> dict[str, Path]:
    """Write the film and the path of a drive, whichever is asked for; return the files by kind.

    Args:
        drive: What was driven.
        video: Where the film goes.
        picture: Where the path goes.
        style: The camera it is filmed with; None: the car's own view beside a panel of figures.
        count: Hears how many pictures are painted, and of how many; not where `style` is None.
    """
    files = {}
    if picture is not None:
        draw_path(picture, drive.track, drive.shown)
        files["picture"] = picture
    if video is not None and style is None:
        write_video(
            video,
            drive.shown,
            drive.track,
            mount=drive.car.mount,
            title=_headline(drive.car),
            light=drive.car.light,
            objects=drive.objects,
        )
        files["video"] = video
    elif video is not None and style is not None:
        files["video"], files["strip"] = film_drive(drive, video, style, count)
    return files


def film_drive(drive: Drive, video: Path, style: FilmStyle, count: PictureCount | None = None) -> tuple[Path, Path]:
    """Film a drive with one of the cameras of `films/views.py`; return the film and its strip."""
    car = drive.car
    return write_film(
        video, drive.shown, drive.track, style, car.mount, car.light, title=_headline(car), objects=drive.objects,
        count=count,
    )  # fmt: skip


def film_as_aws(drive: Drive, style: FilmStyle, number: int, count: PictureCount | None = None) -> dict[str, Path]:
    """Film a drive with the original's three cameras into mp4/ of its run folder; return the files by view."""
    films = {}
    for view, folder in AWS_FOLDERS.items():
        place = drive.car.run.path / "mp4" / folder / f"{number}-video.mp4"
        make_folder(place.parent)
        films[view], _ = film_drive(drive, place, replace(style, view=view), count)
    return films


def style_of(car: TrainedCar, view: str, size: str, fps: int) -> FilmStyle:
    """Return how a car is filmed: shell, colour and name as its run.env had them.

    The view "dashboard" has a size and a pace of its own; here it stands for no view in particular.

    Raises:
        SettingError: An unknown view, size, shell or colour.
        VideoError: Pictures a second outside the range.
    """
    env = car.run.read_job().get("env", {})
    name = env.get("DR_RACER_NAME") or env.get("DR_CAR_NAME") or car.run.path.resolve().name
    shell, colour = env.get("DR_CAR_BODY_SHELL_TYPE", DEEPRACER), env.get("DR_CAR_COLOR", "Red")
    return FilmStyle("pip" if view == "dashboard" else view, size, fps, shell, colour, name)
