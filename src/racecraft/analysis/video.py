"""Films that play everywhere, of any pictures. Begin with `encode_film`.

H.264 in MP4, yuv420p, the index at the front so that a browser starts at once.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any

from racecraft.contract.errors import MissingExtraError, UserInputError
from racecraft.contract.world import Array
from racecraft.formats.atomic import atomic_file

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
                rate = container.streams.video[0].average_rate or Fraction(25)
                frames = container.decode(video=0)
                pictures = (one.to_ndarray(format="rgb24", width=SMALL_WIDTH, height=SMALL_HEIGHT) for one in frames)
                _encode(small, encoder, SMALL_ENCODERS[encoder], pictures, rate)
        except (OSError, av.error.FFmpegError) as error:
            raise VideoError(
                "{path}: is no film that can be read ({error}); expected an MP4. Film it anew.", path=path, error=error
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
        raise VideoError(
            "{path}: is no film that can be read ({error}); expected an MP4.", path=path, error=error
        ) from error


def film_path(path: str | Path) -> Path:
    """Return the path of a film that is yet to be made.

    Raises:
        VideoError: It does not end in .mp4.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise VideoError("{path}: a film is written as MP4; expected a name that ends in .mp4. Rename it.", path=path)
    return path


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
        "This PyAV ({version}) has no H.264 encoder; expected one of {encoders}. "
        "`pip install --force-reinstall --only-binary=:all: av` brings one.",
        version=av.__version__,
        encoders=", ".join(ENCODERS),
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
    with atomic_file(path) as part:
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
