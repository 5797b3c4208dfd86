"""A judged drive of one car, and the films and pictures that show it. Begin with `drive_laps`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.atomic import make_folder
from racecraft.worlds.deepracer.analysis.drive import PAUSE, as_drive
from racecraft.worlds.deepracer.analysis.drive import Drive as CarDrive
from racecraft.worlds.deepracer.analysis.films.film import FilmStyle, PictureCount, write_film
from racecraft.worlds.deepracer.analysis.films.shells import DEEPRACER
from racecraft.worlds.deepracer.analysis.films.views import AWS_FOLDERS
from racecraft.worlds.deepracer.analysis.lap_film import write_video
from racecraft.worlds.deepracer.analysis.path_picture import draw_path
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.laps import LapReport, judge_laps
from racecraft.worlds.deepracer.evaluation.trial_race import RaceRecord, TrialRaceRules, judge_race
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.track import Track


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
    def film_drive(self) -> CarDrive:
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


def drive_race(car: TrainedCar, track: Track, rules: TrialRaceRules, reverse: bool | None) -> tuple[RaceRecord, Drive]:
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


def headline(car: TrainedCar) -> str:
    """Return the title of a film of a car: its checkpoint."""
    return f"checkpoint {car.checkpoint.iteration}"


def show_drive(
    drive: Drive,
    *,
    video: Path | None = None,
    picture: Path | None = None,
    style: FilmStyle | None = None,
    count: PictureCount | None = None,
    ghost: CarDrive | None = None,
) -> dict[str, Path]:
    """Write the film and the path of a drive, whichever is asked for; return the files by kind.

    Args:
        drive: What was driven.
        video: Where the film goes.
        picture: Where the path goes.
        style: The camera it is filmed with; None: the car's own view beside a panel of figures.
        count: Hears how many pictures are painted, and of how many; not where `style` is None.
        ghost: An earlier drive that the map shows beside it, where `style` is None.
    """
    files = {}
    if picture is not None:
        draw_path(picture, drive.track, drive.film_drive)
        files["picture"] = picture
    if video is not None and style is None:
        write_video(
            video,
            drive.film_drive,
            drive.track,
            mount=drive.car.mount,
            title=headline(drive.car),
            light=drive.car.light,
            objects=drive.objects,
            ghost=ghost,
        )
        files["video"] = video
    elif video is not None and style is not None:
        files["video"], files["strip"] = film_drive(drive, video, style, count)
    return files


def film_drive(drive: Drive, video: Path, style: FilmStyle, count: PictureCount | None = None) -> tuple[Path, Path]:
    """Film a drive with one of the cameras of `films/views.py`; return the film and its strip."""
    car = drive.car
    return write_film(
        video, drive.film_drive, drive.track, style, car.mount, car.light, title=headline(car), objects=drive.objects,
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
