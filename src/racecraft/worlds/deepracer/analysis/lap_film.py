"""A film of a drive: the car's view, a map, and the figures a spectator wants. Begin with `write_video`.

Real time, 15 pictures a second. The view is rendered again from the poses, so any drive in an episode file can be
filmed, long after it was driven.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.analysis.video import encode_film, film_path
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.dashboard import Dashboard, lay_banner
from racecraft.worlds.deepracer.analysis.drive import Drive, as_drive
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, Camera, CameraMount
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

PICTURES_PER_SECOND = round(TICKS_PER_SECOND)
VIEW_WIDTH, VIEW_HEIGHT = 720, 540
"""The camera's 4 : 3, at a size for people."""
PANEL_WIDTH = 240
WIDTH, HEIGHT = VIEW_WIDTH + PANEL_WIDTH, VIEW_HEIGHT
HELD_PICTURES = 2 * PICTURES_PER_SECOND
"""How long the last picture stays when the drive ended, and a banner in mid-film."""
AT_ONCE = 16
"""Views rendered in one call: enough for every core, 19 MB."""


def write_video(
    path: str | Path,
    drive: Drive | Array | pl.DataFrame,
    track: Track,
    mount: CameraMount = MOUNT_V3,
    title: str = "",
    light: str = "2026",
    objects: tuple[Array, Array] | None = None,
    ghost: Drive | None = None,
) -> Path:
    """Film a drive.

    Args:
        path: File to write, .mp4; it arrives whole.
        drive: T ticks of one car: a drive, TICK_REPORT (T,) or rows of an episode file.
        track: The circuit as it was driven (`Track.reversed` where it was driven the other way).
        mount: Where the camera sits on the car.
        title: Headline of the panel; the track's title when empty.
        light: Year of the simulator whose light falls on the circuit.
        objects: Boxes and bots in every tick, (T, K, 6) and their kinds (T, K), as `objects.Objects` has them.
        ghost: An earlier drive that the map shows beside this one, from the same moment on.

    Returns:
        The path. The film has T pictures, and HELD_PICTURES more of the last one where the drive ended there.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
        DriveError: The rows are no drive.
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
        MissingExtraError: PyAV is not installed.
    """
    path = film_path(path)
    encode_film(path, film(as_drive(drive), track, mount, title, light, objects, ghost), PICTURES_PER_SECOND, title)
    return path


def film(
    drive: Drive,
    track: Track,
    mount: CameraMount = MOUNT_V3,
    title: str = "",
    light: str = "2026",
    objects: tuple[Array, Array] | None = None,
    ghost: Drive | None = None,
) -> Iterator[Array]:
    """Yield the pictures of a film one by one, (HEIGHT, WIDTH, 3) uint8: the same array, painted anew."""
    camera = Camera(build_scene(track, light, for_people=True), VIEW_WIDTH, VIEW_HEIGHT, mount)
    dashboard = Dashboard(track, drive, title, PANEL_WIDTH, HEIGHT, objects[0] if objects else None, ghost)
    poses, endings = drive.poses, drive.endings
    views = np.empty((min(AT_ONCE, len(drive)), VIEW_HEIGHT, VIEW_WIDTH, 3), np.uint8)
    picture = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    view, panel = picture[:, :VIEW_WIDTH], picture[:, VIEW_WIDTH:]
    banners = {row: dashboard.banner(row, VIEW_WIDTH) for row in endings.tolist()}
    for tick in range(len(drive)):
        if tick % len(views) == 0:
            batch = slice(tick, tick + len(views))
            boxes = (objects[0][batch], objects[1][batch]) if objects else None
            camera.render_rgb(poses[batch], views[: len(poses[batch])], boxes=boxes)
        view[:] = views[tick % len(views)]
        dashboard.draw(tick, panel)
        ended = endings[(endings <= tick) & (endings > tick - HELD_PICTURES)]
        if len(ended):
            lay_banner(view, banners[int(ended[-1])])
        yield picture
    if len(endings) and endings[-1] == len(drive) - 1:
        for _ in range(HELD_PICTURES):
            yield picture
