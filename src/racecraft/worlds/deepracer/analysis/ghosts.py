"""Laps beside each other from the start line on: in a film, as ghosts to drive against, as lines. See `film_ghosts`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.films.film import FilmStyle, OtherCar, PictureCount, write_film
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.driving.ghosts import Ghost
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.road_frame import headings
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_lap
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.track import Track

GHOSTS = 3
"""Further laps beside the reference, the fastest that are left."""
COLOURS = ("Blue", "Orange", "White", "Grey")


def film_ghosts(path: Path, compared: LapComparison, count: PictureCount | None = None) -> dict[str, Path]:
    """Film a lap with the reference and the fastest other laps beside it; return the film and its strip by kind.

    Args:
        path: File to write, .mp4.
        compared: The lap and its reference.
        count: Hears how many pictures are painted, and of how many.

    Raises:
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
        OutputFileError: The place cannot be written.
    """
    laps = compared.timing.laps
    order = [row for row in np.argsort(laps.lap_seconds, kind="stable").tolist() if row != compared.row]
    beside = [compared.reference, *(of_lap(laps, row, "another lap") for row in order[:GHOSTS])]
    longest = max(one.lap_seconds for one in [compared.lap, *beside])
    ticks = int(np.ceil(longest / TICK_SECONDS)) + 1
    drive = drive_of(compared.lap, laps.track, ticks)
    ghosts = [
        OtherCar(drive_of(one, laps.track, ticks), colour=colour) for one, colour in zip(beside, COLOURS, strict=False)
    ]
    title = f"{laps.track.name}: red the lap, blue {compared.reference.name}"
    style = FilmStyle(view="top", name="this lap")
    film, strip = write_film(path, drive, laps.track, style, others=ghosts, title=title, count=count)
    return {"film": film, "strip": strip}


def drive_of(lap: Reference, track: Track, ticks: int) -> Drive:
    """Return a lap as a drive of so many ticks from the start line; at its end the car stands there."""
    points = points_of(lap.offset_m, track)
    edges = np.concatenate([[0.0], np.cumsum(lap.seconds)])
    middles = 0.5 * (edges[:-1] + edges[1:])
    times = np.minimum(np.arange(ticks) * TICK_SECONDS, edges[-1])
    heading = np.unwrap(np.arctan2(*(np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)).T[::-1]))

    def at(values: Array) -> Array:
        return np.interp(times, middles, values)

    done = np.interp(times, edges, np.linspace(0.0, 100.0, len(edges)))
    speed = np.nan_to_num(lap.speed_mps)
    return Drive(
        x_m=at(points[:, 0]),
        y_m=at(points[:, 1]),
        yaw_rad=at(heading),
        driven_mps=at(speed),
        commanded_mps=at(np.nan_to_num(lap.throttle_mps)),
        steering_rad=at(np.nan_to_num(lap.steering_rad)),
        progress_percent=done,
        lap_seconds=times,
        lap=np.ones(ticks, int),
        status=np.where(done >= 100.0, "lap_complete", "in_progress"),
    )


def run_ghost(run: Path, track: Track, name: str) -> Ghost:
    """Return the fastest lap of a run as a ghost to drive against.

    Args:
        run: The run folder.
        track: That is driven.
        name: What people call the run.

    Raises:
        SettingError: It has no full lap, or was driven elsewhere.
        UserInputError: It cannot be read.
    """
    driven = track_of(RunFolder.open(run).read_job())
    if driven is None or driven.hash() != track.hash() or driven.is_reversed != track.is_reversed:
        raise SettingError("{name}: does not drive {track}; expected a run of that track.", name=name, track=track.name)
    laps = find_laps(read([run]).require_ticks(), track)
    if not len(laps):
        raise SettingError("{name}: has no full lap; expected a run that laps.", name=name)
    return ghost_of(of_lap(laps, int(np.argmin(laps.lap_seconds)), name), track)


def ghost_of(lap: Reference, track: Track) -> Ghost:
    """Return a lap as a ghost to drive against."""
    drive = drive_of(lap, track, int(np.ceil(lap.lap_seconds / TICK_SECONDS)) + 1)
    path = np.column_stack([_base_link(np.column_stack([drive.x_m, drive.y_m]), drive.yaw_rad), drive.yaw_rad])
    return Ghost(lap.name, lap.lap_seconds, path)


def line_of(lap: Reference, track: Track) -> RacingLine:
    """Return the line of base_link in a lap, with its driven speed."""
    front = points_of(lap.offset_m, track)
    edges = np.concatenate([[0.0], np.cumsum(lap.seconds)])
    middles = 0.5 * (edges[:-1] + edges[1:])
    seconds = np.append(middles - middles[0], lap.lap_seconds) if track.closed else middles - middles[0]
    xy = _base_link(front, headings(front, track.closed))
    return RacingLine(track.closed, xy, np.nan_to_num(lap.speed_mps), seconds)


def _base_link(front: Array, yaw_rad: Array) -> Array:
    """Return where base_link is (N, 2), from the point in front of it that logs give."""
    return front - FRONT_POINT_M * np.column_stack([np.cos(yaw_rad), np.sin(yaw_rad)])


def points_of(offset_m: Array, track: Track) -> Array:
    """Return points (N, 2) at offsets from the centre line, left positive, in the middle of equal pieces of it."""
    arc = (np.arange(len(offset_m)) + 0.5) / len(offset_m) * track.length
    ahead, here = ((arc + 0.05) % track.length if track.closed else arc + 0.05), arc
    x, y = (np.interp(here, track.arc, track.centre[:, k]) for k in (0, 1))
    dx, dy = (np.interp(ahead, track.arc, track.centre[:, k]) - base for k, base in ((0, x), (1, y)))
    size = np.maximum(np.hypot(dx, dy), 1e-9)
    return np.column_stack([x - offset_m * dy / size, y + offset_m * dx / size])
