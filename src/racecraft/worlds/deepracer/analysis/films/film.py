"""Films of a drive from any of the cameras in `views.py`, each with a strip of stills beside it. See `write_film`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.analysis.video import VideoError, encode_film, film_path
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.films.figures import Overlay
from racecraft.worlds.deepracer.analysis.films.moments import MAX_FPS, MIN_FPS, Moments, moments
from racecraft.worlds.deepracer.analysis.films.shells import DEEPRACER, shell_named
from racecraft.worlds.deepracer.analysis.films.standing import filmed_objects
from racecraft.worlds.deepracer.analysis.films.tower import Standings, Tower
from racecraft.worlds.deepracer.analysis.films.views import VIEWS, FilmContext, FilmedCar
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, CameraMount
from racecraft.worlds.deepracer.tracks.track import Track

SIZES = {"480p": (640, 480), "540p": (960, 540), "720p": (1280, 720), "1080p": (1920, 1080)}
"""Pixels of a film by the names users type; 480p is the original's 4 : 3."""
STILLS, STILLS_A_ROW, STILL_WIDTH = 12, 4, 320
"""Stills of a strip, how many stand side by side, and how wide each is."""


PictureCount = Callable[[int, int], None]
"""Hears how many pictures of a film are painted, and of how many."""


@dataclass(frozen=True)
class FilmStyle:
    """How a film is made."""

    view: str = "pip"
    """One of VIEWS."""
    size: str = "720p"
    """One of SIZES."""
    fps: int = 30
    """Pictures a second, MIN_FPS to MAX_FPS."""
    shell: str = DEEPRACER
    """Body shell, by the original's name."""
    colour: str = "Red"
    """Colour of that shell; Formula-1 shells come painted."""
    name: str = "racecraft"
    """Who drives, as the picture says."""

    def __post_init__(self) -> None:
        """Refuse what no film can be made of.

        Raises:
            SettingError: An unknown view, size, shell or colour.
            VideoError: Pictures a second outside the range.
        """
        if self.view not in VIEWS:
            raise SettingError("there is no view '{view}'. {hint}", view=self.view, hint=nearest(self.view, VIEWS))
        if self.size not in SIZES:
            raise SettingError("there is no film size '{size}'. {hint}", size=self.size, hint=nearest(self.size, SIZES))
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise VideoError(
                "{fps} pictures a second: expected {least_fps} to {most_fps}. Give --fps 30.",
                fps=self.fps,
                least_fps=MIN_FPS,
                most_fps=MAX_FPS,
            )
        shell_named(self.shell, self.colour)


@dataclass(frozen=True, eq=False)
class OtherCar:
    """A car that drives on the same track at the same time."""

    drive: Drive
    shell: str = DEEPRACER
    colour: str = "Blue"


def write_film(
    path: str | Path,
    drive: Drive,
    track: Track,
    style: FilmStyle = FilmStyle(),  # noqa: B008 (frozen)
    mount: CameraMount = MOUNT_V3,
    light: str = "2026",
    others: Sequence[OtherCar] = (),
    title: str = "",
    objects: tuple[Array, Array] | None = None,
    count: PictureCount | None = None,
    standings: Standings | None = None,
) -> tuple[Path, Path]:
    """Film a drive, and lay its stills on a strip.

    Args:
        path: File to write, .mp4; it arrives whole, and so does the strip.
        drive: T ticks of the car that is filmed.
        track: The circuit as it was driven.
        style: View, size, pace, shell, name.
        mount: Where the car's own camera sits.
        light: Year of the simulator whose light falls on the circuit.
        others: Further cars, from the same moment on.
        title: Kept in the file.
        objects: Boxes and bots in every tick, (T, K, 6) and their kinds (T, K), as `objects.Objects` has them.
        count: Hears how many pictures are painted, and of how many, after each.
        standings: Who leads in every tick, told in every view but that from above; None: nobody races.

    Returns:
        The film, and its strip: the same name ending in -strip.png.

    Raises:
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
        OutputFileError: The disk is full, or the place cannot be written.
    """
    path = film_path(path)
    taken = moments(drive, style.fps)
    cars = [FilmedCar(taken, shell_named(style.shell, style.colour))]
    cars += [FilmedCar(moments(one.drive, style.fps), shell_named(one.shell, one.colour)) for one in others]
    strip = Strip(len(taken), SIZES[style.size])
    stage = FilmContext(track, light, mount, cars, filmed_objects(objects, taken))
    pictures = counted(_pictures(drive, taken, stage, style, standings), len(taken), count)
    encode_film(path, strip.watch(pictures), style.fps, title)
    stills = path.with_name(f"{path.stem}-strip.png")
    strip.write(stills)
    return path, stills


def counted(pictures: Iterator[Array], whole: int, count: PictureCount | None) -> Iterator[Array]:
    """Pass pictures on, and tell somebody how many of the whole number have passed."""
    for number, picture in enumerate(pictures, 1):
        yield picture
        if count is not None:
            count(number, whole)


def _pictures(
    drive: Drive, taken: Moments, stage: FilmContext, style: FilmStyle, standings: Standings | None
) -> Iterator[Array]:
    """Yield the pictures one by one: the same array, painted anew."""
    width, height = SIZES[style.size]
    view, overlay = VIEWS[style.view](stage, width, height), Overlay(drive, style.name, width, height)
    is_free = style.view != "top"  # from above the circuit fills the picture, and shows who leads
    tower = Tower(standings, width, height) if standings is not None and is_free else None
    picture = np.empty((height, width, 3), np.uint8)
    for moment, tick in enumerate(taken.ticks.tolist()):
        view.paint(moment, picture)
        overlay.draw_on(tick, picture)
        if tower is not None:
            tower.draw_on(tick, picture)
        yield picture


class Strip:
    """Keeps stills of a film as it passes, evenly spaced, and lays them side by side.

    Args:
        pictures: How many pass.
        size: Their width and height.
    """

    def __init__(self, pictures: int, size: tuple[int, int]) -> None:
        self._kept = set(np.linspace(0, pictures - 1, min(STILLS, pictures)).round().astype(int).tolist())
        self._still = STILL_WIDTH, round(STILL_WIDTH * size[1] / size[0])
        self._stills: list[Array] = []

    def watch(self, pictures: Iterator[Array]) -> Iterator[Array]:
        """Pass pictures on."""
        from PIL import Image

        for number, picture in enumerate(pictures):
            if number in self._kept:
                self._stills.append(np.asarray(Image.fromarray(picture).resize(self._still, Image.Resampling.BOX)))
            yield picture

    def write(self, path: Path) -> None:
        """Write the strip as a PNG.

        Raises:
            OutputFileError: It cannot be written.
        """
        import io

        from PIL import Image

        wide, high = self._still
        rows = -(-len(self._stills) // STILLS_A_ROW)
        sheet = np.full((rows * high, min(STILLS_A_ROW, len(self._stills)) * wide, 3), 17, np.uint8)
        for k, still in enumerate(self._stills):
            row, column = divmod(k, STILLS_A_ROW)
            sheet[row * high : (row + 1) * high, column * wide : (column + 1) * wide] = still
        out = io.BytesIO()
        Image.fromarray(sheet).save(out, "PNG")
        write_atomic(path, out.getvalue())
