"""A film of a drive that plays everywhere: the car's view, a map, and the figures a spectator wants. See `write_video`.

H.264 in MP4, yuv420p, the index at the front so that a browser starts at once; real time, 15 pictures a second. The
view is rendered again from the poses, so any drive in an episode file can be filmed, long after it was driven.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.dashboard import Dashboard, lay_banner
from racecraft.contract.errors import MissingExtraError, UserInputError
from racecraft.contract.world import Array
from racecraft.formats.whole import whole_file
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
ENCODERS = {
    "libx264": {"preset": "superfast", "crf": "21"},
    "libopenh264": {"b": "4000000"},
    "h264_videotoolbox": {"b": "4000000"},
    "h264_mf": {"b": "4000000"},
}
"""H.264 encoders in order of preference, with their options: one is in every build of PyAV."""
SMALL_ENCODERS = {
    "libx264": {"preset": "superfast", "crf": "30"},
    "libopenh264": {"b": "300000"},
    "h264_videotoolbox": {"b": "300000"},
    "h264_mf": {"b": "300000"},
}
"""The same for a film that travels inside a page."""
SMALL_WIDTH, SMALL_HEIGHT = 640, 360
"""Pixels of such a film."""


class VideoError(UserInputError):
    """A film cannot be made."""


def write_video(
    path: str | Path,
    drive: Drive | Array | pl.DataFrame,
    track: Track,
    mount: CameraMount = MOUNT_V3,
    title: str = "",
    light: str = "2026",
    objects: tuple[Array, Array] | None = None,
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

    Returns:
        The path. The film has T pictures, and HELD_PICTURES more of the last one where the drive ended there.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
        DriveError: The rows are no drive.
        VideoError: The path does not end in .mp4, or no encoder for H.264 is installed.
        MissingExtraError: PyAV is not installed.
    """
    path = film_path(path)
    encode_film(path, film(as_drive(drive), track, mount, title, light, objects), PICTURES_PER_SECOND, title)
    return path


def film_title(path: str | Path) -> str:
    """Return the headline that a film was made with; "" where there is no film, or none that says."""
    import av

    try:
        with av.open(str(path)) as container:
            return str(container.metadata.get("title", ""))
    except (OSError, av.error.FFmpegError):
        return ""


def small_film(path: str | Path) -> bytes:
    """Return a film again in SMALL_WIDTH x SMALL_HEIGHT, as bytes of an MP4: a tenth of it, for a page.

    Raises:
        VideoError: There is no film, or no encoder for H.264 is installed.
        MissingExtraError: PyAV is not installed.
    """
    encoder = _encoder()
    import av

    with tempfile.TemporaryDirectory() as folder:
        small = Path(folder) / "small.mp4"
        try:
            with av.open(str(path)) as container:
                frames = container.decode(video=0)
                pictures = (one.to_ndarray(format="rgb24", width=SMALL_WIDTH, height=SMALL_HEIGHT) for one in frames)
                _encode(small, encoder, SMALL_ENCODERS[encoder], pictures, Fraction(PICTURES_PER_SECOND))
        except (OSError, av.error.FFmpegError) as error:
            raise VideoError(
                f"{path}: is no film that can be read ({error}); expected an MP4. Film it anew."
            ) from error
        return small.read_bytes()


def read_film(path: str | Path) -> Iterator[Array]:
    """Yield the pictures of a film of anybody's, (H, W, 3) uint8.

    Raises:
        VideoError: There is no film that can be read.
        MissingExtraError: PyAV is not installed.
    """
    _encoder()
    import av

    try:
        with av.open(str(path)) as container:
            for one in container.decode(video=0):
                yield one.to_ndarray(format="rgb24")
    except (OSError, IndexError, av.error.FFmpegError) as error:
        raise VideoError(f"{path}: is no film that can be read ({error}); expected an MP4.") from error


def film_path(path: str | Path) -> Path:
    """Return the path of a film that is yet to be made.

    Raises:
        VideoError: It does not end in .mp4.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise VideoError(f"{path}: a film is written as MP4; expected a name that ends in .mp4. Rename it.")
    return path


def film(
    drive: Drive,
    track: Track,
    mount: CameraMount = MOUNT_V3,
    title: str = "",
    light: str = "2026",
    objects: tuple[Array, Array] | None = None,
) -> Iterator[Array]:
    """Yield the pictures of a film one by one, (HEIGHT, WIDTH, 3) uint8: the same array, painted anew."""
    camera = Camera(build_scene(track, light, for_people=True), VIEW_WIDTH, VIEW_HEIGHT, mount)
    dashboard = Dashboard(track, drive, title, PANEL_WIDTH, HEIGHT, objects[0] if objects else None)
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


def _encoder() -> str:
    """Return the name of the first H.264 encoder that is here."""
    try:
        import av
    except ImportError as error:
        raise MissingExtraError(
            "Films are written with PyAV, which is not installed. `pip install av` does."
        ) from error
    for name in ENCODERS:
        if name in av.codecs_available:
            return name
    raise VideoError(
        f"This PyAV ({av.__version__}) has no H.264 encoder; expected one of {', '.join(ENCODERS)}. "
        "`pip install --force-reinstall --only-binary=:all: av` brings one."
    )


def encode_film(path: Path, pictures: Iterator[Array], rate: float, title: str = "") -> None:
    """Write pictures as an MP4 that arrives whole.

    Args:
        path: File to write.
        pictures: (H, W, 3) uint8, all of one size, sides even.
        rate: Pictures a second.
        title: Kept in the file, for `film_title`.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
        VideoError: No encoder for H.264 is installed.
        MissingExtraError: PyAV is not installed.
    """
    encoder = _encoder()
    with whole_file(path) as part:
        _encode(part, encoder, ENCODERS[encoder], pictures, Fraction(rate).limit_denominator(1000), title)


def _encode(
    part: Path,
    encoder: str,
    options: Mapping[str, str],
    pictures: Iterator[Array],
    rate: Fraction,
    title: str = "",
) -> None:
    """Write the pictures as an MP4 whose index stands before its pictures."""
    import av

    try:
        with av.open(str(part), "w", format="mp4", options={"movflags": "+faststart"}) as container:
            if title:
                container.metadata["title"] = title
            stream: Any = container.add_stream(encoder, rate=rate, options=dict(options))
            stream.pix_fmt = "yuv420p"
            stream.codec_context.gop_size = round(4 * rate)
            with ThreadPoolExecutor(1) as helper:  # encodes one picture while the next is rendered
                under_way: Future[None] | None = None
                for picture in pictures:
                    if under_way is None:
                        stream.height, stream.width = picture.shape[:2]
                    else:
                        under_way.result()
                    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                    under_way = helper.submit(lambda one: container.mux(stream.encode(one)), frame)
                if under_way is not None:
                    under_way.result()
            container.mux(stream.encode())
    except av.error.FFmpegError as error:
        raise OSError(error.errno, error.strerror or str(error)) from error
