"""What a training leaves for people to look at: a film of the best policy's lap, its path, the learning curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from racecraft.analysis.figures import draw_curves, draw_path
from racecraft.analysis.report import write_report
from racecraft.analysis.video import film_title, small_film, write_video
from racecraft.contract.world import Array
from racecraft.evaluation.deepracer.drive import DriveKeeper
from racecraft.evaluation.deepracer.laps import LapReport, judge_laps
from racecraft.formats.run_folder import RunFolder
from racecraft.players.deepracer.trained_car import KIND, TrainedCar, load_trained_car
from racecraft.reporting.account import advice_of, own_plots_of
from racecraft.tracks.track import Track

VIDEO, PATH_PICTURE, CURVES, REPORT = "lap.mp4", "path.png", "curves.png", "report.html"


@dataclass(frozen=True)
class Drive:
    """A judged drive of one car, and what is needed to show it."""

    car: TrainedCar
    track: Track
    report: LapReport
    ticks: Array
    """TICK_REPORT (T,)."""


def drive_laps(car: TrainedCar, track: Track, laps: int) -> Drive:
    """Let a trained car drive so many laps, greedily, and keep every tick."""
    keeper = DriveKeeper()
    world = car.world(track, num_cars=1, start_shares=[0.0], laps=laps)
    report = judge_laps(car.policy, world, laps, [keeper])
    return Drive(car, world.track, report, keeper.drive)


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
    write_report(run, files["report"], drive.ticks, small_film(files["video"]), advice_of(run))
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
        OwnPlotError: A plot of the racer's own does not work.
    """
    run = RunFolder.open(path)
    if run.read_job().get("kind") != KIND:
        return write_report(run, page, advice=advice_of(run))
    own = own_plots_of(run, plots)
    car = load_trained_car(path, "best")
    drive = drive_laps(car, car.trained_on, laps=1).ticks
    return write_report(run, page, drive, _film_of(run, car), advice_of(run), own)


def _film_of(run: RunFolder, car: TrainedCar) -> bytes | None:
    """Return the film in the run folder, small, if it is of this very checkpoint; an older policy's tells nothing."""
    path = run.path / VIDEO
    return small_film(path) if path.is_file() and film_title(path) == _headline(car) else None


def _headline(car: TrainedCar) -> str:
    return f"checkpoint {car.checkpoint.iteration}"


def show_drive(drive: Drive, *, video: Path | None = None, picture: Path | None = None) -> None:
    """Write the film and the path of a drive, whichever is asked for."""
    if picture is not None:
        draw_path(picture, drive.track, drive.ticks)
    if video is not None:
        write_video(
            video, drive.ticks, drive.track, mount=drive.car.mount, title=_headline(drive.car), light=drive.car.light
        )
