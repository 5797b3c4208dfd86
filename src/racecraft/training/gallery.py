"""What a training leaves for people to look at: a film of the best policy's lap, its path, the learning curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecraft.analysis.figures import draw_curves, draw_path
from racecraft.analysis.video import write_video
from racecraft.contract.world import Array
from racecraft.evaluation.drive import DriveKeeper
from racecraft.evaluation.laps import LapReport, judge_laps
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained_car import TrainedCar, load_trained_car
from racecraft.tracks.catalogue import load_track
from racecraft.tracks.track import Track

VIDEO, PATH_PICTURE, CURVES = "lap.mp4", "path.png", "curves.png"


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
    """Film the best policy's lap from the start line, draw its path and the run's curves; return the files by kind."""
    say("Filming the best policy's lap …")
    car = load_trained_car(run.path, "best")
    drive = drive_laps(car, load_track(car.trained_on), laps=1)
    files = {"video": run.path / VIDEO, "picture": run.path / PATH_PICTURE, "curves": run.path / CURVES}
    show_drive(drive, video=files["video"], picture=files["picture"])
    draw_curves(files["curves"], run.read_metrics())
    return files


def show_drive(drive: Drive, *, video: Path | None = None, picture: Path | None = None) -> None:
    """Write the film and the path of a drive, whichever is asked for."""
    title = f"{drive.track.title or drive.track.name}, checkpoint {drive.car.checkpoint.iteration}"
    if picture is not None:
        draw_path(picture, drive.track, drive.ticks)
    if video is not None:
        write_video(video, drive.ticks, drive.track, mount=drive.car.mount, title=title)
