"""The checksum, many bytes at once, beside one that takes a byte and a bit at a time."""

import numpy as np
import pytest

from racecraft.formats import mapped_file
from racecraft.worlds.deepracer.files.tensorflow import crc32c


def bit_by_bit(data):
    state = 0xFFFFFFFF
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (crc32c.POLYNOMIAL if state & 1 else 0)
    return state ^ 0xFFFFFFFF


@pytest.mark.parametrize("piece", [70_000, 65_536, 2**24])
@pytest.mark.parametrize("size", [0, 1, 4096 * 15, 4096 * 16 + 3, 150_001])
def test_lanes_and_pieces_change_nothing(monkeypatch, piece, size):
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", piece)
    data = np.random.default_rng(size).bytes(size)
    assert crc32c.crc32c(data) == bit_by_bit(data)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (bytes(32), 0x8A9136AA),
        (b"\xff" * 32, 0x62A8AB43),
        (bytes(range(32)), 0x46DD794E),
        (bytes(range(31, -1, -1)), 0x113FDB5C),
    ],
)
def test_the_checksum_is_that_of_the_standards_examples(data, expected):
    """RFC 3720, appendix B.4, its bytes from the highest to the lowest."""
    assert crc32c.crc32c(data) == expected
    assert crc32c.crc32c(np.frombuffer(data, "<i4").reshape(2, 4)) == expected
    assert crc32c.masked_crc32c(data) == ((expected >> 15) + (expected % 2**15 << 17) + 0xA282EAD8) % 2**32
