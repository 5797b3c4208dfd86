"""Pictures as ML-Agents packs them, written here with Pillow."""

import io

import numpy as np
import pytest

from racecraft.worlds.unity.files.pictures import decode_picture, layout_by_shape

Image = pytest.importorskip("PIL.Image", reason="the extra racecraft[unity] is not installed")


def png(*levels):
    """A PNG of 1 x 2 pixels, all of one colour."""
    file = io.BytesIO()
    Image.fromarray(np.broadcast_to(np.array(levels, np.uint8), (1, 2, 3)).copy()).save(file, format="PNG")
    return file.getvalue()


ONE, TWO = png(10, 20, 60), png(40, 50, 90)


@pytest.mark.parametrize(
    ("shape", "layout"),
    [((3, 84, 84), "CHW"), ((84, 84, 3), "HWC"), ((4, 9, 4), "HWC"), ((9, 2, 9), "HWC"), ((2, 5), "HWC")],
)
def test_the_axis_that_is_shorter_than_the_last_holds_the_channels(shape, layout):
    assert layout_by_shape(shape) == layout


@pytest.mark.parametrize(
    ("data", "channels", "mapping", "pixel"),
    [
        (ONE, 3, (), [10, 20, 60]),
        (ONE, 2, (), [10, 20]),
        (ONE + TWO, 6, (), [10, 20, 60, 40, 50, 90]),
        (ONE + TWO, 1, (), [30]),  # of the first three
        (ONE, 3, (2, 0, 1), [20, 60, 10]),
        (ONE, 1, (-1, 0, -1), [20]),
        (ONE + TWO, 2, (0, 1, -1, 0, -1, -1), [25, 20]),
    ],
)
def test_channels_come_in_their_order_or_where_the_mapping_puts_them(data, channels, mapping, pixel):
    picture = decode_picture(data, (1, 2, channels), mapping)
    assert picture.dtype == np.uint8
    assert picture.tolist() == [[pixel, pixel]]


@pytest.mark.parametrize(
    ("data", "shape", "mapping", "letter"),
    [
        (b"", (1, 2, 3), (), "should be a PNG and is empty"),
        (b"GIF89a", (1, 2, 3), (), "is no PNG"),
        (ONE + b"junk", (1, 2, 3), (), "is no PNG"),
        (ONE[:-1], (1, 2, 3), (), "is a PNG that was cut"),
        (ONE[:30] + bytes([ONE[30] ^ 0xFF]) + ONE[31:], (1, 2, 3), (), "is a PNG that cannot be read"),
        (ONE, (2, 1, 3), (), "is a PNG of 2 x 1 pixels; expected 1 x 2"),
        (ONE, (1, 2, 4), (), "brings 3 channels; expected 4"),
        (ONE, (1, 2, 3), (0, 1, 2, -1), r"maps 3 decoded channels by \[0, 1, 2, -1\]"),
        (ONE, (1, 2, 3), (0, 1, 1), "maps 3 decoded channels.* cover 0 to 2"),
    ],
)
def test_what_cannot_be_shown_is_named(data, shape, mapping, letter):
    with pytest.raises(ValueError, match=letter):
        decode_picture(data, shape, mapping)
