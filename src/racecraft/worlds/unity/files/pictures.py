"""Pictures as ML-Agents packs them: PNG files of three channels each, one after the other, and a channel mapping.

Begin at `decode_picture`. The wire and the demonstration files pack alike. Every problem is a ValueError, a clause that
the caller completes with whose picture it was.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence

import numpy as np

from racecraft.contract.world import Array

HWC, CHW = "HWC", "CHW"
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def layout_by_shape(shape: Sequence[int]) -> str:
    """Return the likelier order of a picture's axes where nothing tells it: channels are few.

    >>> layout_by_shape((3, 84, 84)), layout_by_shape((84, 84, 3))
    ('CHW', 'HWC')
    """
    return CHW if len(shape) == 3 and shape[0] < shape[2] else HWC


def decode_picture(data: bytes, shape: tuple[int, ...], mapping: Sequence[int]) -> Array:
    """Return a picture, uint8 (H, W, C).

    Args:
        data: PNG files, one after the other.
        shape: (H, W, C) wanted.
        mapping: Where each decoded channel belongs, -1 nowhere; those that meet are averaged. Empty: as they come, and
            three as one grey where one is wanted.

    Raises:
        ValueError: They cannot be read, or are of another size or number.
    """
    from PIL import Image

    height, width, channels = shape
    planes: list[Array] = []
    for file in _split_pngs(data):
        try:
            with Image.open(io.BytesIO(file), formats=["PNG"]) as picture:
                if picture.size == (width, height):
                    planes.append(np.asarray(picture.convert("RGB")))
                    continue
                found = f"{picture.size[0]} x {picture.size[1]}"
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as cause:
            raise ValueError(f"is a PNG that cannot be read: {cause}.") from cause
        raise ValueError(f"is a PNG of {found} pixels; expected {width} x {height}.")
    if not planes:
        raise ValueError("should be a PNG and is empty.")
    decoded = np.concatenate(planes, axis=2)
    if mapping:
        return _map_channels(decoded, shape, list(mapping))
    if channels == 1:
        return np.asarray(np.round(decoded[:, :, :3].mean(axis=2, keepdims=True)), np.uint8)
    if decoded.shape[2] < channels:
        raise ValueError(f"brings {decoded.shape[2]} channels; expected {channels}.")
    return decoded[:, :, :channels]


def _map_channels(decoded: Array, shape: tuple[int, ...], mapping: list[int]) -> Array:
    channels = shape[2]
    known = len(mapping) == decoded.shape[2] and all(-1 <= target < channels for target in mapping)
    if not known or set(mapping) - {-1} != set(range(channels)):
        raise ValueError(
            f"maps {decoded.shape[2]} decoded channels by {mapping}; "
            f"expected one number each that together cover 0 to {channels - 1}, or -1."
        )
    targets = np.array(mapping)
    picture = np.empty(shape, np.uint8)
    for channel in range(channels):
        sources = np.flatnonzero(targets == channel)
        if len(sources) == 1:
            picture[:, :, channel] = decoded[:, :, sources[0]]
        else:
            picture[:, :, channel] = np.round(decoded[:, :, sources].mean(axis=2))
    return picture


def _split_pngs(data: bytes) -> Iterator[bytes]:
    """Cut concatenated PNG files apart by walking their chunks."""
    at = 0
    while at < len(data):
        start = at
        if data[at : at + 8] != _PNG_SIGNATURE:
            raise ValueError("is no PNG.")
        at += 8
        kind = b""
        while kind != b"IEND":
            kind = data[at + 4 : at + 8]
            length = int.from_bytes(data[at : at + 4], "big")
            at += 12 + length  # length, kind, data, checksum
            if at > len(data):
                raise ValueError("is a PNG that was cut.")
        yield data[start:at]
